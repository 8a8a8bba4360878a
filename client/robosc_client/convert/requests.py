"""Conversion of tasks to request messages."""

from pathlib import PurePath

from robosc.model.structure import Deployment
from robosc.source import Bundle, SourceFile
from robosc.targets import GenerateOptions, PackageMetadata, StateMessage
from robosc_api.v1 import jobs_pb2, jobs_pb2_grpc, synthesis_pb2_grpc
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client.errors import RequestRefusedError
from robosc_client.jobs import JobState, TaskKind
from robosc_client.tasks import Check, Explain, Explore, Format, Generate, SynthesisOptions, Synthesize, Task, Verify

SynthesisStub = synthesis_pb2_grpc.SynthesisServiceStub
JobStub = jobs_pb2_grpc.JobServiceStub

type Request = (
    pb.CheckRequest
    | pb.SynthesizeRequest
    | pb.GenerateRequest
    | pb.ExploreRequest
    | pb.VerifyRequest
    | pb.ExplainRequest
    | pb.FormatRequest
)

_DEPLOYMENTS = {
    None: pb.DEPLOYMENT_UNSPECIFIED,
    Deployment.CONTROLLER: pb.DEPLOYMENT_CONTROLLER,
    Deployment.LAYER: pb.DEPLOYMENT_LAYER,
}
_LANGUAGES = {".cif": pb.LANGUAGE_CIF, ".gen": pb.LANGUAGE_FAUDES, ".wmod": pb.LANGUAGE_SUPREMICA}
"""Language of automata, by the ending of the main file's name."""

_STATES = {
    JobState.QUEUED: jobs_pb2.JOB_STATE_QUEUED,
    JobState.RUNNING: jobs_pb2.JOB_STATE_RUNNING,
    JobState.SUCCEEDED: jobs_pb2.JOB_STATE_SUCCEEDED,
    JobState.FAILED: jobs_pb2.JOB_STATE_FAILED,
    JobState.CANCELLED: jobs_pb2.JOB_STATE_CANCELLED,
}
_KINDS = {
    None: jobs_pb2.TASK_KIND_UNSPECIFIED,
    TaskKind.CHECK: jobs_pb2.TASK_KIND_CHECK,
    TaskKind.SYNTHESIZE: jobs_pb2.TASK_KIND_SYNTHESIZE,
    TaskKind.GENERATE: jobs_pb2.TASK_KIND_GENERATE,
    TaskKind.EXPLORE: jobs_pb2.TASK_KIND_EXPLORE,
    TaskKind.VERIFY: jobs_pb2.TASK_KIND_VERIFY,
    TaskKind.EXPLAIN: jobs_pb2.TASK_KIND_EXPLAIN,
    TaskKind.FORMAT: jobs_pb2.TASK_KIND_FORMAT,
}


def request_of(task: Task) -> Request:
    """Return the request message of a task.

    Raises:
        RequestRefusedError: A name, text or number cannot be sent.
    """
    try:
        return _request(task)
    except UnicodeEncodeError as error:
        raise RequestRefusedError("a file's name or text cannot be sent: it is not valid Unicode") from error
    except ValueError as error:
        raise RequestRefusedError(f"the request cannot be sent: {error}") from error


def _request(task: Task) -> Request:
    match task:
        case Check():
            return pb.CheckRequest(bundle=_bundle(task.model))
        case Synthesize():
            return pb.SynthesizeRequest(
                bundle=_bundle(task.model), options=_options(task.options), modular=task.is_modular
            )
        case Generate():
            return pb.GenerateRequest(
                bundle=_bundle(task.model),
                options=_options(task.options),
                target=task.target,
                generation=_generate_options(task.generation),
                initial=task.initial or "",
                modular=task.is_modular,
            )
        case Explore():
            return pb.ExploreRequest(
                bundle=_bundle(task.model),
                options=_options(task.options),
                maximum_states=_limit(task.maximum_states, "maximum_states"),
            )
        case Verify():
            return _verify_request(task)
        case Explain():
            return pb.ExplainRequest(
                bundle=_bundle(task.model),
                options=_options(task.options),
                event=task.event,
                state=task.state,
                after=task.after,
                modular=task.is_modular,
            )
        case Format():
            return pb.FormatRequest(file=_file(task.file))


def submit_request(task: Task, key: str, label: str, retention_s: float | None) -> jobs_pb2.SubmitJobRequest:
    """Return the request for submitting a job; raises as `request_of`."""
    request = request_of(task)
    try:
        submitted = jobs_pb2.SubmitJobRequest(task=_task(request), idempotency_key=key, label=label)
        if retention_s is not None:
            submitted.retention.FromNanoseconds(round(retention_s * 1e9))
    except (UnicodeEncodeError, ValueError, OverflowError) as error:
        raise RequestRefusedError(f"the job cannot be submitted: {error}") from error
    return submitted


def list_request(
    states: tuple[JobState, ...], kind: TaskKind | None, *, all_owners: bool, page_size: int, page_token: str
) -> jobs_pb2.ListJobsRequest:
    """Return the request for one page of jobs."""
    return jobs_pb2.ListJobsRequest(
        page_size=page_size,
        page_token=page_token,
        states=[_STATES[state] for state in states],
        kind=_KINDS[kind],
        all_owners=all_owners,
    )


def _task(request: Request) -> jobs_pb2.Task:
    match request:
        case pb.CheckRequest():
            return jobs_pb2.Task(check=request)
        case pb.SynthesizeRequest():
            return jobs_pb2.Task(synthesize=request)
        case pb.GenerateRequest():
            return jobs_pb2.Task(generate=request)
        case pb.ExploreRequest():
            return jobs_pb2.Task(explore=request)
        case pb.VerifyRequest():
            return jobs_pb2.Task(verify=request)
        case pb.ExplainRequest():
            return jobs_pb2.Task(explain=request)
        case pb.FormatRequest():
            return jobs_pb2.Task(format=request)


def _verify_request(task: Verify) -> pb.VerifyRequest:
    options = pb.SynthesisOptions(
        deployment=_DEPLOYMENTS[task.deployment],
        engine=_engine(task.engine),
        allow_reordering=task.allow_reordering,
        maximum_nodes=_limit(task.maximum_nodes, "maximum_nodes"),
    )
    return pb.VerifyRequest(
        bundle=_bundle(task.model),
        options=options,
        supervisor=task.supervisor,
        properties=task.properties,
        property_files=map(_listing, task.property_files),
        maximum_states=_limit(task.maximum_states, "maximum_states"),
        strict=task.is_strict,
        controller=task.controller,
        as_is=task.as_is,
    )


def _options(options: SynthesisOptions) -> pb.SynthesisOptions:
    if options.condition_seconds is not None:
        raise ValueError("condition_seconds is for synthesis on this machine: a server limits all of its time")
    return pb.SynthesisOptions(
        deployment=_DEPLOYMENTS[options.deployment],
        engine=_engine(options.engine),
        allow_livelock=options.allow_livelock,
        allow_reordering=options.allow_reordering,
        maximum_nodes=_limit(options.maximum_nodes, "maximum_nodes"),
        verified_states=options.verified_states,
    )


def _limit(most: int | None, name: str) -> int:
    """Return a limit for a request, in which 0 means the limit of the server.

    Raises:
        ValueError: It is less than 1.
    """
    if most is not None and most < 1:
        raise ValueError(f"{name} is {most}, and must be at least 1")
    return most or 0


def _engine(name: str) -> str:
    return "" if name == "auto" else name


def _generate_options(options: GenerateOptions) -> pb.GenerateOptions:
    supervised, metadata = None, options.metadata
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
        state_message="" if options.state_message == StateMessage.JSON else str(options.state_message),
        metadata=None if metadata == PackageMetadata() else _metadata(metadata),
    )


def _metadata(metadata: PackageMetadata) -> pb.PackageMetadata:
    return pb.PackageMetadata(
        maintainer=metadata.maintainer,
        email=metadata.email,
        license=metadata.license,
        version=metadata.version or "",
        copyright=metadata.copyright or "",
    )


def _bundle(bundle: Bundle) -> pb.Bundle:
    return pb.Bundle(
        main=_file(bundle.main),
        libraries=map(_file, bundle.libraries),
        searched=list(bundle.searched),
        interfaces=map(_file, bundle.interfaces),
        language=_LANGUAGES.get(PurePath(bundle.main.name).suffix),
        distribution=bundle.distribution,
    )


def _listing(file: SourceFile) -> pb.SourceFile:
    """Convert a file of properties; a server accepts only relative names."""
    path = PurePath(file.name)
    return pb.SourceFile(name=path.name if path.is_absolute() else file.name, text=file.text)


def _file(file: SourceFile) -> pb.SourceFile:
    return pb.SourceFile(name=file.name, text=file.text)
