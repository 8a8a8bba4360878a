"""Content of requests: texts and options, as the core's values.

Requests have been accepted: their names are right.
"""

from collections.abc import Iterable

from robosc.model.structure import Deployment
from robosc.pipeline.loading import LoadedAutomata
from robosc.pipeline.options import SynthesisOptions
from robosc.source import Bundle, SourceFile
from robosc.synthesis import EngineOptions
from robosc.targets import GenerateOptions, PackageMetadata, StateMessage, SupervisedController
from robosc.verification import DEFAULT_STATES
from robosc_api.v1 import synthesis_pb2 as pb


class OptionError(Exception):
    """Invalid options; one sentence for the caller."""


_DEPLOYMENTS = {pb.DEPLOYMENT_CONTROLLER: Deployment.CONTROLLER, pb.DEPLOYMENT_LAYER: Deployment.LAYER}


def bundle(message: pb.Bundle) -> Bundle:
    """Return the texts, libraries and interfaces by name; their order in a request has no meaning."""
    kind = Bundle if message.language in (pb.LANGUAGE_UNSPECIFIED, pb.LANGUAGE_ROBOSC) else LoadedAutomata
    return kind(
        main=source_file(message.main),
        libraries=_sorted_files(message.libraries),
        searched=tuple(message.searched),
        interfaces=_sorted_files(message.interfaces),
        distribution=message.distribution,
    )


def source_file(message: pb.SourceFile) -> SourceFile:
    """Return one text."""
    return SourceFile(message.name, message.text)


def _sorted_files(messages: Iterable[pb.SourceFile]) -> tuple[SourceFile, ...]:
    return tuple(sorted(map(source_file, messages), key=lambda file: file.name))


def deployment(options: pb.SynthesisOptions) -> Deployment | None:
    """Return the deployment that a supervisor will have, or must have; None: it is not given."""
    return _DEPLOYMENTS.get(options.deployment)


def engine_name(options: pb.SynthesisOptions) -> str:
    """Return the name of the requested engine."""
    return options.engine or "auto"


def engine(options: pb.SynthesisOptions, maximum_nodes: int) -> EngineOptions:
    """Return the options for making decision diagrams, with no more nodes than `maximum_nodes`."""
    nodes = min(options.maximum_nodes or maximum_nodes, maximum_nodes)
    return EngineOptions(engine_name(options), options.allow_reordering, nodes)


def synthesis_options(options: pb.SynthesisOptions, maximum_nodes: int) -> SynthesisOptions:
    """Return the options for a synthesis by the Python API, with no more nodes than `maximum_nodes`."""
    nodes = min(options.maximum_nodes or maximum_nodes, maximum_nodes)
    return SynthesisOptions(
        deployment=deployment(options) or Deployment.CONTROLLER,
        engine=engine_name(options),
        allow_reordering=options.allow_reordering,
        maximum_nodes=nodes,
    )


def verified_states(options: pb.SynthesisOptions) -> int:
    """Return the number of states up to which a new supervisor is verified state by state."""
    return options.verified_states if options.HasField("verified_states") else DEFAULT_STATES


def generation(options: pb.GenerateOptions) -> GenerateOptions:
    """Return the options that are chosen for generated files.

    Raises:
        OptionError: A name of the supervised controller, what the package is to say of itself or the form of the
            state is not valid.
    """
    supervised = None
    if options.HasField("supervised"):
        named = options.supervised
        try:
            supervised = SupervisedController(named.package, named.executable or None, named.launch_file or None)
        except ValueError as error:
            raise OptionError(f"the supervised controller: {error}") from error
    try:
        state_message = StateMessage(options.state_message or StateMessage.JSON)
    except ValueError as error:
        raise OptionError(f"the form of the state must be one of {', '.join(StateMessage)}") from error
    return GenerateOptions(
        options.package or None,
        options.publish_state,
        options.log_events,
        supervised,
        _metadata(options.metadata),
        state_message,
    )


def _metadata(metadata: pb.PackageMetadata) -> PackageMetadata:
    names = ("maintainer", "email", "license", "version", "copyright")
    given = {name: getattr(metadata, name) for name in names}
    try:
        return PackageMetadata(**{name: text for name, text in given.items() if text})
    except ValueError as error:
        raise OptionError(str(error)) from error
