"""Operations: one function for each method of the clients, which returns the description of its call.

Both clients derive their methods, with names, arguments and documentation, from these functions.
"""

import inspect
import os
import secrets
from collections.abc import Callable, Sequence
from typing import Any, get_args

import robosc
from robosc.certification.progress import OnProgress, ignored
from robosc.pipeline.files import FileName, given_path, read_bounded
from robosc.pipeline.findings import Findings
from robosc.pipeline.loading import ModelLike, loaded, property_file
from robosc.source import SourceFile
from robosc.supervisor import Supervisor
from robosc.supervisor.codec import MAXIMUM_BYTES, encode
from robosc.targets import GenerateOptions, TargetInfo
from robosc_api.v1 import jobs_pb2
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client.calls import JobPages, JobWatch, Operation, job_reader
from robosc_client.convert import jobs, response_fields
from robosc_client.convert.requests import request_of, submit_request
from robosc_client.convert.response_readers import (
    ExplanationReader,
    ExplorationReader,
    GenerationReader,
    JobResultReader,
    ResponseReader,
    SynthesisReader,
    UnaryReader,
    VerificationReader,
    check_reader,
    format_reader,
)
from robosc_client.jobs import Job, JobState, ServiceLoad, Submission, TaskKind
from robosc_client.results import (
    Explained,
    Exploration,
    Formatted,
    Generation,
    ServerInfo,
    Synthesis,
    TaskResult,
    Verification,
)
from robosc_client.tasks import (
    DEFAULT_GENERATION,
    DEFAULT_OPTIONS,
    Check,
    Explain,
    Explore,
    Format,
    Generate,
    SynthesisOptions,
    Synthesize,
    Task,
    Verify,
)

type SupervisorLike = Supervisor | bytes | FileName
"""A supervisor, the bytes of its file or the file's name."""

# Tasks that are done at once


def check(model: ModelLike, *, deadline_s: float | None = None) -> Operation[Findings]:
    """Return every finding about a model, library or automata, sorted by place."""
    texts = loaded(model)
    return Operation("Check", request_of(Check(texts)), lambda: check_reader(texts), deadline_s=deadline_s)


def synthesize(
    model: ModelLike,
    options: SynthesisOptions = DEFAULT_OPTIONS,
    *,
    is_modular: bool = False,
    deadline_s: float | None = None,
    on_progress: OnProgress = ignored,
) -> Operation[Synthesis]:
    """Synthesize and certify a supervisor; with `is_modular` in modules."""
    task = Synthesize(loaded(model), options, is_modular)
    return _streaming_task("Synthesize", task, SynthesisReader, deadline_s, on_progress)


def generate(
    model: ModelLike,
    target: str,
    generation: GenerateOptions = DEFAULT_GENERATION,
    options: SynthesisOptions = DEFAULT_OPTIONS,
    *,
    initial: str | None = None,
    is_modular: bool = False,
    deadline_s: float | None = None,
    on_progress: OnProgress = ignored,
) -> Operation[Generation]:
    """Synthesize a supervisor and generate the files of a target around it.

    Args:
        model: The model and its libraries, or the path of a model.
        target: Name of the target, or `all`.
        generation: Choices about the files.
        options: Options for making the supervisor.
        initial: Description of the state in which automata begin that may begin in several, such as `tank.level = 1`.
        is_modular: True for a synthesis in modules.
        deadline_s: See the class.
        on_progress: See the class.
    """
    task = Generate(loaded(model), target, generation, options, initial, is_modular)
    return _streaming_task("Generate", task, lambda: GenerationReader(target), deadline_s, on_progress)


def explore(
    model: ModelLike,
    options: SynthesisOptions = DEFAULT_OPTIONS,
    *,
    maximum_states: int | None = None,
    deadline_s: float | None = None,
    on_progress: OnProgress = ignored,
) -> Operation[Exploration]:
    """Explore the robot, or automata, under their supervisor, up to a maximum number of states."""
    task = Explore(loaded(model), options, maximum_states)
    return _streaming_task("Explore", task, ExplorationReader, deadline_s, on_progress)


def verify(
    model: Verify | ModelLike,
    properties: str | Sequence[str] = (),
    *,
    property_files: Sequence[FileName | SourceFile] = (),
    supervisor: SupervisorLike | None = None,
    options: SynthesisOptions | None = None,
    maximum_states: int | None = None,
    is_strict: bool = False,
    controller: bool = False,
    as_is: bool = False,
    deadline_s: float | None = None,
    on_progress: OnProgress = ignored,
) -> Operation[Verification]:
    """Check a supervisor against its model, or verify properties of the robot under its supervisor.

    Args:
        model: The model and its libraries, or the path of a model; or a task with all other arguments.
        properties: A property in the property language, or several.
        property_files: Files with a property on each line.
        supervisor: The supervisor to check, or the path or the bytes of its file; None: it is made from the model.
        options: Options for making the supervisor, and the deployment that a given one must have; None: its own.
        maximum_states: States up to which a given supervisor is searched one by one; None: 1,000,000.
        is_strict: True if a given supervisor passes only if permissiveness was checked, too.
        controller: True if automata are also checked for bounded and finite response, confluence and nonblocking under
            control.
        as_is: True if nothing is synthesized: automata are verified as they stand.
        deadline_s: See the class.
        on_progress: See the class.
    """
    task = model
    if not isinstance(task, Verify):
        chosen = options or DEFAULT_OPTIONS
        task = Verify(
            model=loaded(task),
            supervisor=b"" if supervisor is None else _content_of(supervisor),
            deployment=None if options is None else options.deployment,
            properties=(properties,) if isinstance(properties, str) else tuple(properties),
            property_files=tuple(map(property_file, property_files)),
            engine=chosen.engine,
            allow_reordering=chosen.allow_reordering,
            maximum_nodes=chosen.maximum_nodes,
            maximum_states=maximum_states,
            is_strict=is_strict,
            controller=controller,
            as_is=as_is,
        )
    elif (
        any((properties, property_files, options, is_strict, controller, as_is))
        or supervisor is not None
        or maximum_states is not None
    ):
        raise TypeError("a task contains all options: give either a task, or a model with options")
    return _streaming_task("Verify", task, VerificationReader, deadline_s, on_progress)


def _content_of(supervisor: SupervisorLike) -> bytes:
    """Return the content of a supervisor's file; the server judges whether it is one.

    Raises:
        FileAccessError: The file cannot be read.
    """
    if isinstance(supervisor, bytes):
        return supervisor
    if isinstance(supervisor, str | os.PathLike):
        return read_bounded(given_path(supervisor), MAXIMUM_BYTES)
    return encode(supervisor)


def explain(
    model: ModelLike,
    options: SynthesisOptions = DEFAULT_OPTIONS,
    *,
    event: str | None = None,
    state: str | None = None,
    after: str | None = None,
    is_modular: bool = False,
    deadline_s: float | None = None,
    on_progress: OnProgress = ignored,
) -> Operation[Explained]:
    """Explain what synthesis does to a model: what restricts its events, or what is to blame for no supervisor.

    Raises NotThereError if something that is asked about is not there.

    Args:
        model: The model and its libraries, or the path of a model.
        options: Options for making the supervisor.
        event: The event to explain; None: all of them, and warnings.
        state: Description of a state in which to explain what can happen, such as `Door.closed, Lift.n = 2`.
        after: Run after which to explain what can happen, such as `open, jam.response`.
        is_modular: True if the events of a robot are explained module by module.
        deadline_s: See the class.
        on_progress: See the class.
    """
    bundle = loaded(model)
    task = Explain(model=bundle, options=options, event=event, state=state, after=after, is_modular=is_modular)
    return _streaming_task("Explain", task, lambda: ExplanationReader(bundle), deadline_s, on_progress)


def format_(file: SourceFile, *, deadline_s: float | None = None) -> Operation[Formatted]:
    """Put a text into its canonical layout."""
    request = request_of(Format(file))
    return Operation("Format", request, lambda: format_reader(file.text), deadline_s=deadline_s)


def _streaming_task[Result](
    method: str,
    task: Task,
    reader: Callable[[], ResponseReader[Result]],
    deadline_s: float | None,
    on_progress: OnProgress,
) -> Operation[Result]:
    return Operation(method, request_of(task), reader, is_stream=True, deadline_s=deadline_s, on_progress=on_progress)


# About the server


def list_targets(*, deadline_s: float | None = None) -> Operation[tuple[TargetInfo, ...]]:
    """Return the targets that can be generated, sorted by name."""
    request = pb.ListTargetsRequest()
    return Operation("ListTargets", request, lambda: UnaryReader(response_fields.targets_of), deadline_s=deadline_s)


def get_version(*, deadline_s: float | None = None) -> Operation[ServerInfo]:
    """Return information about the server, and its limits."""
    request = pb.GetVersionRequest()
    return Operation("GetVersion", request, lambda: UnaryReader(response_fields.server_info_of), deadline_s=deadline_s)


# Jobs


def submit(
    task: Task,
    *,
    label: str = "",
    idempotency_key: str | None = None,
    retention_s: float | None = None,
    deadline_s: float | None = None,
) -> Operation[Submission]:
    """Submit a task as a job; once this returns, the server has stored the job.

    Args:
        task: Task to be done.
        label: Name of the job in lists.
        idempotency_key: Key for which a repeated submission returns the same job; None: a new key.
        retention_s: Time for which the job is kept after its end; None: as long as the server keeps jobs.
        deadline_s: See the class; it is about the submission, not about the task.
    """
    # A key makes the call repeatable.
    key = secrets.token_hex(16) if idempotency_key is None else idempotency_key
    request = submit_request(task, key, label, retention_s)
    return _job_call("SubmitJob", request, jobs.submission_of, deadline_s)


def get_job(job_id: str, *, deadline_s: float | None = None) -> Operation[Job]:
    """Return the current state of a job."""
    return _job_call("GetJob", jobs_pb2.GetJobRequest(id=job_id), job_reader(job_id), deadline_s)


def watch(job_id: str, *, after_revision: int = 0, deadline_s: float | None = None) -> JobWatch:
    """Watch a job: its current state, and each change until its end, across lost connections.

    Args:
        job_id: Its id.
        after_revision: Last seen revision; only later ones are returned.
        deadline_s: See the class.
    """
    return JobWatch(job_id, after_revision, deadline_s)


def wait(job_id: str, *, deadline_s: float | None = None) -> JobWatch:
    """Wait for the end of a job, and return it."""
    return JobWatch(job_id, deadline_s=deadline_s)


def cancel_job(job_id: str, *, deadline_s: float | None = None) -> Operation[Job]:
    """Cancel a job; one that has ended does not change."""
    return _job_call("CancelJob", jobs_pb2.CancelJobRequest(id=job_id), job_reader(job_id), deadline_s)


def list_jobs(
    *,
    states: tuple[JobState, ...] = (),
    kind: TaskKind | None = None,
    all_owners: bool = False,
    page_size: int = 100,
    deadline_s: float | None = None,
) -> JobPages:
    """List jobs page by page, newest first.

    Args:
        states: States of the listed jobs; empty: all states.
        kind: Kind of the listed jobs; None: all kinds.
        all_owners: True to list the jobs of other callers, too; needs a token with the scope `admin`.
        page_size: Number of jobs per call.
        deadline_s: See the class; for each page.
    """
    return JobPages(states, kind, all_owners=all_owners, page_size=page_size, deadline_s=deadline_s)


def get_load(*, all_callers: bool = False, deadline_s: float | None = None) -> Operation[ServiceLoad]:
    """Return the present load of the service, caller by caller.

    Args:
        all_callers: True to return the load of other callers, too; needs a token with the scope `admin`.
        deadline_s: See the class.
    """
    return _job_call("GetLoad", jobs_pb2.GetLoadRequest(all_callers=all_callers), jobs.load_of, deadline_s)


def job_result(job_id: str, *, kind: TaskKind | None = None, deadline_s: float | None = None) -> Operation[TaskResult]:
    """Return the result of a job that has succeeded, as the method for its task would have returned it.

    Args:
        job_id: Its id.
        kind: Kind of its task, as `submit` or `get_job` have reported: a result of another kind is refused; None:
            any.
        deadline_s: See the class.
    """
    request = jobs_pb2.GetJobResultRequest(id=job_id)
    return Operation(
        "GetJobResult",
        request,
        lambda: JobResultReader(kind),
        is_stream=True,
        is_about_jobs=True,
        deadline_s=deadline_s,
    )


def _job_call[Message, Result](
    method: str, request: Any, convert: Callable[[Message], Result], deadline_s: float | None
) -> Operation[Result]:
    return Operation(method, request, lambda: UnaryReader(convert), is_about_jobs=True, deadline_s=deadline_s)


# From functions to methods


class LocalFunction:
    """A function of `robosc` as a method of a client; what it needs is loaded on its first use."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, client: object, kind: type | None = None) -> Callable[..., Any]:
        return getattr(robosc, self._name)  # type: ignore[no-any-return]  # named


def client_method[Method: Callable[..., Any]](
    method: Method, description: Callable[..., Any], of: str, returns: Any = None
) -> Method:
    """Return a client method with the signature and documentation of its operation.

    Args:
        method: The method.
        description: Function of the operation, without `self`.
        of: Name of the client's class.
        returns: Type that the method returns; None: the result type of the operation that the function returns.
    """
    signature = inspect.signature(description)
    own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_ONLY)
    result = get_args(signature.return_annotation)[0] if returns is None else returns
    documented: Any = method
    documented.__name__ = description.__name__.removesuffix("_")
    documented.__qualname__ = f"{of}.{documented.__name__}"
    documented.__doc__ = description.__doc__
    documented.__signature__ = signature.replace(
        parameters=[own, *signature.parameters.values()], return_annotation=result
    )
    return method
