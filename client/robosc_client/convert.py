"""The core's values to protobuf messages and back: the one module of the client that touches generated names.

What a server answers is not trusted: numbers, enums and paths are checked here.
"""

from collections.abc import Iterable

from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.explanation import EmptyExplanation, from_text
from robosc.model.structure import Deployment
from robosc.source import Bundle, Location, SourceFile
from robosc.targets import GeneratedFiles, GenerateOptions
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_api.v1 import synthesis_pb2_grpc
from robosc_client.errors import RequestRefusedError, ServiceError
from robosc_client.results import Generation, Progress, Statistics, Summary, Synthesis, SynthesisStatus

Stub = synthesis_pb2_grpc.SynthesisServiceStub

_SEVERITIES = {
    pb.SEVERITY_ERROR: Severity.ERROR,
    pb.SEVERITY_WARNING: Severity.WARNING,
    pb.SEVERITY_NOTE: Severity.NOTE,
}
_DEPLOYMENTS = {
    Deployment.CONTROLLER: pb.DEPLOYMENT_CONTROLLER,
    Deployment.LAYER: pb.DEPLOYMENT_LAYER,
}
_STATUSES = {
    pb.SYNTHESIS_STATUS_SUPERVISOR: SynthesisStatus.SUPERVISOR,
    pb.SYNTHESIS_STATUS_EMPTY: SynthesisStatus.EMPTY,
    pb.SYNTHESIS_STATUS_MODEL_ERRORS: SynthesisStatus.MODEL_ERRORS,
    pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL: SynthesisStatus.UNSUPPORTED_MODEL,
}


def check_request(bundle: Bundle) -> pb.CheckRequest:
    """Ask what is wrong with a bundle.

    Raises:
        RequestRefusedError: A file's name or text cannot be sent.
    """
    return pb.CheckRequest(bundle=_bundle(bundle))


def synthesize_request(
    bundle: Bundle, deployment: Deployment, engine: str, *, allow_livelock: bool = False
) -> pb.SynthesizeRequest:
    """Ask for a supervisor; raises as `check_request`."""
    return pb.SynthesizeRequest(bundle=_bundle(bundle), options=_options(deployment, engine, allow_livelock))


def generate_request(
    bundle: Bundle,
    deployment: Deployment,
    engine: str,
    target: str,
    generation: GenerateOptions,
    *,
    allow_livelock: bool = False,
) -> pb.GenerateRequest:
    """Ask for generated files; raises as `check_request`."""
    options = _options(deployment, engine, allow_livelock)
    return pb.GenerateRequest(
        bundle=_bundle(bundle), options=options, target=target, generation=_generate_options(generation)
    )


def _generate_options(options: GenerateOptions) -> pb.GenerateOptions:
    supervised = None
    if options.supervised is not None:
        supervised = pb.SupervisedController(
            package=options.supervised.package,
            executable=options.supervised.executable or "",
            launch_file=options.supervised.launch_file or "",
        )
    return pb.GenerateOptions(
        package=options.package or "",
        publish_state=options.publish_state,
        log_events=options.log_events,
        supervised=supervised,
    )


def diagnostics(messages: Iterable[pb.Diagnostic]) -> tuple[Diagnostic, ...]:
    """Findings as the core's values.

    Raises:
        ServiceError: A severity is unknown.
    """
    return tuple(map(_diagnostic, messages))


def check_diagnostics(response: pb.CheckResponse) -> tuple[Diagnostic, ...]:
    """The findings in a response; raises as `diagnostics`."""
    return diagnostics(response.diagnostics)


def progress_or_synthesis(response: pb.SynthesizeResponse) -> Progress | Synthesis:
    """One message of a synthesis.

    Raises:
        ServiceError: The message says nothing that a client of this version knows.
    """
    if response.WhichOneof("event") == "progress":
        return Progress(response.progress.stage, response.progress.message)
    result = response.result
    status = _status(result.status)
    if (status is SynthesisStatus.SUPERVISOR) != bool(result.supervisor):
        raise ServiceError("the server's answer is malformed: its status and its supervisor do not fit")
    return Synthesis(
        status=status,
        diagnostics=diagnostics(result.diagnostics),
        reason=result.reason,
        supervisor=result.supervisor,
        summary=_summary(result.summary) if result.HasField("summary") else None,
        statistics=_statistics(result.statistics) if result.HasField("statistics") else None,
        explanation=_explanation(result.explanation),
    )


def generation(response: pb.GenerateResponse) -> Generation:
    """What was generated.

    Raises:
        ServiceError: The status is unknown, or a path leads out of the folder that the caller chooses.
    """
    status = _status(response.status)
    files = None
    if status is SynthesisStatus.SUPERVISOR:
        texts = {file.path: file.content for file in response.files}
        programs = frozenset(file.path for file in response.files if file.executable)
        try:
            files = GeneratedFiles(texts, programs)
        except ValueError as error:
            raise ServiceError(f"the server's answer is malformed: {error}") from error
    explanation = _explanation(response.explanation)
    return Generation(status, diagnostics(response.diagnostics), response.reason, files, explanation)


def _explanation(text: str) -> EmptyExplanation | None:
    """What is to blame, or None where nothing is told."""
    try:
        return from_text(text) if text else None
    except ValueError as error:
        raise ServiceError(f"the server's answer is malformed: {error}") from error


def _bundle(bundle: Bundle) -> pb.Bundle:
    try:
        return pb.Bundle(
            main=_file(bundle.main),
            libraries=map(_file, bundle.libraries),
            searched=list(bundle.searched),
            interfaces=map(_file, bundle.interfaces),
        )
    except UnicodeEncodeError as error:
        raise RequestRefusedError("a file's name or text cannot be sent: it is not valid Unicode") from error


def _file(file: SourceFile) -> pb.SourceFile:
    return pb.SourceFile(name=file.name, text=file.text)


def _options(deployment: Deployment, engine: str, allow_livelock: bool) -> pb.SynthesisOptions:
    return pb.SynthesisOptions(deployment=_DEPLOYMENTS[deployment], engine=engine, allow_livelock=allow_livelock)


def _status(number: pb.SynthesisStatus) -> SynthesisStatus:
    if number not in _STATUSES:
        raise ServiceError(f"the server's answer is malformed: unknown status {number}")
    return _STATUSES[number]


def _location(message: pb.Location) -> Location:
    return Location(message.file, message.line, message.column, message.length)


def _diagnostic(message: pb.Diagnostic) -> Diagnostic:
    if message.severity not in _SEVERITIES:
        raise ServiceError(f"the server's answer is malformed: unknown severity {message.severity}")
    return Diagnostic(
        severity=_SEVERITIES[message.severity],
        code=message.code,
        message=message.message,
        location=_location(message.location) if message.HasField("location") else None,
        mend=message.mend,
        related=tuple(RelatedPlace(place.message, _location(place.location)) for place in message.related),
    )


def _summary(message: pb.Summary) -> Summary:
    return Summary(
        controllable_events=message.controllable_events,
        uncontrollable_events=message.uncontrollable_events,
        states=_count(message.states),
        transitions=_count(message.transitions) if message.transitions else None,
        added=tuple((item.event, item.condition) for item in message.added),
        text=message.text,
    )


def _statistics(message: pb.Statistics) -> Statistics:
    return Statistics(message.engine, message.state_bits, message.iterations, message.peak_nodes)


def _count(text: str) -> int:
    try:
        return int(text)
    except ValueError as error:
        raise ServiceError("the server's answer is malformed: a count is no decimal number") from error
