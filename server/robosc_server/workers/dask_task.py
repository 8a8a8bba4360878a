"""Task on a Dask worker: it runs in a separate process, sends progress events, and answers in bytes.

The answer is bytes with a mark, never an object: the server reads the output of a process that has handled an untrusted
model with the checks of `frames`.
"""

import threading
import traceback
from collections import deque
from typing import Any

from distributed import get_worker

from robosc import __version__
from robosc_server.tasks.task import Failure, Outcome, Reason, Report, Result, Task, TaskKind, TaskLimits
from robosc_server.workers import WorkerLostError, WorkersError
from robosc_server.workers.frames import HEADER, AnswerReader, FrameError, Tag, failure_frame, frame
from robosc_server.workers.isolated import StoppedError, prepare, run_isolated

ANSWER = b"A"
NO_WORKER = b"W"
LOST = b"L"

BEGUN = "begun"
REPORTS = "reports"
CPU_TIME = "spent"

_REPORT_EVERY_ASKS = 5  # A tenth of a second.
_KEPT_REPORTS = 16
_UNDER_WAY = ("executing", "long-running")


def ready_version(task_function: str, must_be_confined: bool) -> str:
    """Start idle worker processes in the background; return the version of RoboSC on this worker."""
    threading.Thread(target=_prepare_quietly, args=(task_function, must_be_confined), daemon=True).start()
    return __version__


def _prepare_quietly(task_function: str, must_be_confined: bool) -> None:
    try:
        prepare(task_function, must_be_confined=must_be_confined)
    except WorkersError:
        return  # The next task reports the error.


def run_on_cluster(
    version: str,
    task_function: str,
    must_be_confined: bool,
    topic: str,
    kind: str,
    request: bytes,
    identity: tuple[str, str],
    limits: tuple[float, float, int, int, int],
) -> bytes:
    """Run a task on this worker; stop when the cluster has cancelled it.

    Args:
        version: Version of the server.
        task_function: Function that does tasks, `package.module:name`.
        must_be_confined: True to run no task on a machine without complete confinement.
        topic: Topic of the reports.
        kind: The task's kind.
        request: Its request.
        identity: Its key and the name of its main file.
        limits: The values of its `TaskLimits`.
    """
    worker: Any = get_worker()
    name = worker.get_current_task()
    if version != __version__:
        return NO_WORKER + mismatch(worker.address, __version__, version).encode()
    kept: deque[Report] = deque(maxlen=_KEPT_REPORTS)
    asks = 0

    def is_abandoned() -> bool:
        nonlocal asks
        asks += 1
        if asks % _REPORT_EVERY_ASKS == 0 and kept:
            reports = [kept.popleft() for _ in range(len(kept))]
            sent = [[report.stage, report.message] for report in reports]
            worker.log_event(topic, {"is": REPORTS, "task": name, "reports": sent})
        state = worker.state.tasks.get(name)
        return state is None or state.state not in _UNDER_WAY

    def report_cpu_time(cpu_s: float) -> None:
        worker.log_event(topic, {"is": CPU_TIME, "task": name, "worker": worker.address, "cpu_s": cpu_s})

    worker.log_event(topic, {"is": BEGUN, "task": name, "worker": worker.address})
    task = Task(TaskKind(kind), request, *identity)
    try:
        outcome = run_isolated(
            task,
            TaskLimits(*limits),
            kept.append,
            is_abandoned,
            task_function,
            report_cpu_time,
            must_be_confined=must_be_confined,
        )
        return ANSWER + answer(outcome)
    except WorkersError as error:
        mark = LOST if isinstance(error, WorkerLostError) else NO_WORKER
        return mark + f"the Dask worker at {worker.address}: {error}".encode()
    except StoppedError:
        return NO_WORKER + b"stopped"
    except Exception:  # The boundary of the task: the server logs any error, and does not retry the task.
        return ANSWER + answer(
            Failure(Reason.INTERNAL_FAULT, "the server has an internal error", traceback.format_exc())
        )


def mismatch(address: str, theirs: str, ours: str) -> str:
    """Return the message about a worker with another version."""
    return f"the Dask worker at {address} has RoboSC {theirs}, but this server has {ours}: install the same version"


def answer(outcome: Outcome) -> bytes:
    """Return an outcome as frames of `frames`."""
    if isinstance(outcome, Failure):
        return failure_frame(outcome)
    parts: list[bytes] = []
    for message in outcome.messages:
        parts += [HEADER.pack(Tag.MESSAGE.value, len(message)), message]
    return b"".join((*parts, frame(Tag.RESULT, b"")))


def outcome_of(content: bytes, limits: TaskLimits) -> Outcome:
    """Return the outcome of a serialized answer.

    Raises:
        FrameError: The bytes are no answer.
    """
    reader = AnswerReader(limits)
    view = memoryview(content)
    while len(view) >= HEADER.size:
        announced = reader.read_header(bytes(view[: HEADER.size]))
        if isinstance(announced, Failure):
            return announced
        tag, length = announced
        payload = bytes(view[HEADER.size :][:length])
        view = view[HEADER.size + length :]
        if len(payload) < length:
            break
        message = reader.read(tag, payload)
        if isinstance(message, Result | Failure):
            return message
    raise FrameError("an answer that ends too early")
