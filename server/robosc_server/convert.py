"""Protobuf messages to the core's values and back: the one module of the server that touches generated names."""

from pathlib import PurePosixPath, PureWindowsPath

from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.model.structure import Deployment
from robosc.source import Bundle, Location, SourceFile
from robosc.synthesis import Statistics
from robosc.targets import GenerateOptions, SupervisedController
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_api.v1 import synthesis_pb2_grpc
from robosc_server.work import (
    UNSUPPORTED_MODEL,
    CheckJob,
    CheckOutcome,
    Figures,
    GenerateJob,
    GenerateOutcome,
    Report,
    SynthesizeJob,
    SynthesizeOutcome,
)

_SERVICE = pb.DESCRIPTOR.services_by_name["SynthesisService"]
SERVICE_NAME = _SERVICE.full_name
METHODS = tuple(method.name for method in _SERVICE.methods)

type CheckRequest = pb.CheckRequest
type CheckResponse = pb.CheckResponse
type SynthesizeRequest = pb.SynthesizeRequest
type GenerateRequest = pb.GenerateRequest
type GenerateResponse = pb.GenerateResponse
SynthesisServiceServicer = synthesis_pb2_grpc.SynthesisServiceServicer
add_service = synthesis_pb2_grpc.add_SynthesisServiceServicer_to_server

_SEVERITIES = {
    Severity.ERROR: pb.SEVERITY_ERROR,
    Severity.WARNING: pb.SEVERITY_WARNING,
    Severity.NOTE: pb.SEVERITY_NOTE,
}
_DEPLOYMENTS = {
    pb.DEPLOYMENT_UNSPECIFIED: Deployment.CONTROLLER,
    pb.DEPLOYMENT_CONTROLLER: Deployment.CONTROLLER,
    pb.DEPLOYMENT_LAYER: Deployment.LAYER,
}
_STATUSES = {
    "supervisor": pb.SYNTHESIS_STATUS_SUPERVISOR,
    "empty": pb.SYNTHESIS_STATUS_EMPTY,
    "model errors": pb.SYNTHESIS_STATUS_MODEL_ERRORS,
    UNSUPPORTED_MODEL: pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL,
}


class RequestError(Exception):
    """A malformed request; one sentence for its sender."""


class BundleTooLargeError(Exception):
    """A bundle beyond the server's limit; one sentence for its sender."""


def check_job(request: pb.CheckRequest, max_bundle_bytes: int) -> CheckJob:
    """The job that a request asks for.

    Raises:
        RequestError: The request is malformed.
        BundleTooLargeError: Its bundle has more than `max_bundle_bytes`.
    """
    return CheckJob(_bundle(request.bundle, max_bundle_bytes))


def synthesize_job(request: pb.SynthesizeRequest | pb.GenerateRequest, max_bundle_bytes: int) -> SynthesizeJob:
    """The job that a request asks for; raises as `check_job`."""
    deployment = _DEPLOYMENTS.get(request.options.deployment)
    if deployment is None:
        raise RequestError(f"there is no deployment of number {request.options.deployment}")
    bundle = _bundle(request.bundle, max_bundle_bytes)
    options = request.options
    return SynthesizeJob(bundle, deployment, options.engine or "auto", options.allow_livelock)


def generate_job(request: pb.GenerateRequest, max_bundle_bytes: int) -> GenerateJob:
    """The job that a request asks for; raises as `check_job`."""
    if not request.target:
        raise RequestError("the request names no target")
    return GenerateJob(synthesize_job(request, max_bundle_bytes), request.target, _generate_options(request.generation))


def _generate_options(options: pb.GenerateOptions) -> GenerateOptions:
    supervised = None
    if options.HasField("supervised"):
        given = options.supervised
        try:
            supervised = SupervisedController(given.package, given.executable or None, given.launch_file or None)
        except ValueError as error:
            raise RequestError(f"the supervised controller: {error}") from error
    return GenerateOptions(options.package or None, options.publish_state, options.log_events, supervised)


def check_response(outcome: CheckOutcome) -> pb.CheckResponse:
    """The response that tells an outcome."""
    return pb.CheckResponse(diagnostics=map(_diagnostic, outcome.diagnostics))


def progress_response(report: Report) -> pb.SynthesizeResponse:
    """The message that tells where the work is."""
    return pb.SynthesizeResponse(progress=pb.Progress(stage=report.stage, message=report.message))


def synthesize_response(outcome: SynthesizeOutcome) -> pb.SynthesizeResponse:
    """The message that tells an outcome."""
    return pb.SynthesizeResponse(
        result=pb.SynthesisResult(
            status=_STATUSES[outcome.status],
            diagnostics=map(_diagnostic, outcome.diagnostics),
            supervisor=outcome.supervisor,
            reason=outcome.reason,
            summary=_summary(outcome.figures) if outcome.figures else None,
            statistics=_statistics(outcome.statistics) if outcome.statistics else None,
            explanation=outcome.explanation,
        )
    )


def generate_response(outcome: GenerateOutcome) -> pb.GenerateResponse:
    """The response that tells an outcome."""
    return pb.GenerateResponse(
        status=_STATUSES[outcome.status],
        diagnostics=map(_diagnostic, outcome.diagnostics),
        reason=outcome.reason,
        files=[
            pb.GeneratedFile(path=path, content=content, executable=is_program)
            for path, content, is_program in outcome.files
        ],
        explanation=outcome.explanation,
    )


def _bundle(message: pb.Bundle, max_bytes: int) -> Bundle:
    """The texts of a request; their names are names only, nothing is ever opened by them."""
    if not message.HasField("main"):
        raise RequestError("the bundle has no main file")
    size = sum(len(text.encode("utf-8")) for text in _texts(message))
    if size > max_bytes:
        raise BundleTooLargeError(f"the bundle has {size} bytes, this server takes at most {max_bytes}")
    names: set[str] = set()
    for file in (message.main, *message.libraries):
        _require_usable(file.name)
        if file.name in names:
            raise RequestError(f"two files of the bundle are called '{file.name}'")
        names.add(file.name)
    libraries = sorted((SourceFile(file.name, file.text) for file in message.libraries), key=lambda file: file.name)
    interfaces = tuple(SourceFile(file.name, file.text) for file in message.interfaces)
    main = SourceFile(message.main.name, message.main.text)
    return Bundle(main, tuple(libraries), tuple(message.searched), interfaces)


def _texts(message: pb.Bundle) -> list[str]:
    files = (message.main, *message.libraries, *message.interfaces)
    return [*(file.name for file in files), *(file.text for file in files), *message.searched]


def _require_usable(name: str) -> None:
    """A file's name is relative and can be printed."""
    if not name:
        raise RequestError("a file of the bundle has no name")
    if not name.isprintable():
        raise RequestError("a file's name in the bundle has a character that cannot be printed, such as NUL")
    if PurePosixPath(name).is_absolute() or PureWindowsPath(name).drive or PureWindowsPath(name).root:
        raise RequestError(f"a file's name in the bundle must be relative, not '{name}'")


def _location(location: Location) -> pb.Location:
    return pb.Location(file=location.file, line=location.line, column=location.column, length=location.length)


def _related(place: RelatedPlace) -> pb.RelatedPlace:
    return pb.RelatedPlace(message=place.message, location=_location(place.location))


def _diagnostic(diagnostic: Diagnostic) -> pb.Diagnostic:
    return pb.Diagnostic(
        severity=_SEVERITIES[diagnostic.severity],
        code=diagnostic.code,
        message=diagnostic.message,
        location=_location(diagnostic.location) if diagnostic.location else None,
        mend=diagnostic.mend,
        related=map(_related, diagnostic.related),
    )


def _statistics(statistics: Statistics) -> pb.Statistics:
    return pb.Statistics(
        engine=statistics.engine,
        state_bits=statistics.state_bits,
        iterations=statistics.iterations,
        peak_nodes=statistics.peak_nodes,
    )


def _summary(figures: Figures) -> pb.Summary:
    return pb.Summary(
        controllable_events=figures.controllable_events,
        uncontrollable_events=figures.uncontrollable_events,
        states=figures.states,
        transitions=figures.transitions,
        added=[pb.AddedCondition(event=event, condition=condition) for event, condition in figures.added],
        text=figures.text,
    )
