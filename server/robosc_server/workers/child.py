"""Worker process: a fork that waits for one task, runs it, sends the outcome and exits."""

import faulthandler
import gc
import os
import socket
import traceback
from collections.abc import Callable

from robosc_server.tasks.exceeded import memory_exceeded, result_too_large
from robosc_server.tasks.memory import is_lack_of_memory
from robosc_server.tasks.task import Failure, Outcome, Reason, Report, TaskKind, TaskLimits
from robosc_server.workers import confinement
from robosc_server.workers.frames import (
    HEADER,
    MESSAGES_LIMIT,
    Tag,
    failure_frame,
    frame,
    report_frame,
    task_of,
)
from robosc_server.workers.sandbox import Sandbox, close_other_descriptors

type TaskFunction = Callable[[TaskKind, bytes, TaskLimits, Callable[[Report], None]], Outcome]

_COLLECT_EVERY = 20_000
"""Number of new Python objects between two runs of the cyclic garbage collector."""

_SMALL_BYTES = 64 * 1024
"""Size up to which a result is sent in one piece."""

_RESULT_END = frame(Tag.RESULT, b"")


def run_worker(
    connection: socket.socket, crash_output: int, function: TaskFunction, sandbox: Sandbox, used_bytes: int
) -> None:
    """Wait for a task, run it and send its outcome; the process is confined before it reads untrusted data.

    Args:
        connection: Connection to the server; if it ends before a task comes, the process exits.
        crash_output: Descriptor to which the interpreter writes its traceback if it crashes.
        function: Function that does the task.
        sandbox: Sandbox that confines this process.
        used_bytes: Bytes of address space that this process has.

    Raises:
        SandboxError: The process cannot be confined.
    """
    faulthandler.enable(crash_output)
    confinement.prefer_oom_kill()
    # Inherited descriptors would hide the end of other processes, and would be accessible to this one.
    close_other_descriptors({connection.fileno(), crash_output} | sandbox.descriptors)
    sandbox.enter()
    try:
        task, limits = task_of(_receive(connection), _receive(connection))
        confinement.confine(limits, used_bytes + len(task.request))
        _answer(connection, task.kind, task.request, limits, function)
    except (EOFError, ConnectionError):
        return


def _answer(
    connection: socket.socket, kind: TaskKind, request: bytes, limits: TaskLimits, function: TaskFunction
) -> None:
    gc.enable()
    # A process that runs one task has little garbage, and decision diagrams are not Python objects.
    gc.set_threshold(_COLLECT_EVERY)
    try:
        outcome = function(kind, request, limits, lambda report: connection.sendall(report_frame(report)))
    except ConnectionError:
        raise  # The server has closed the connection.
    except BaseException as error:  # The boundary of the worker: the server logs any error and continues.
        is_short = is_lack_of_memory(error)
        # The failure needs memory, too, while what the task has made is still there.
        confinement.raise_memory_limit()
        if is_short:
            outcome = memory_exceeded(limits)
        else:
            outcome = Failure(Reason.INTERNAL_FAULT, "the server has an internal error", traceback.format_exc())
    confinement.raise_memory_limit()
    _send(connection, outcome, limits)


def _send(connection: socket.socket, outcome: Outcome, limits: TaskLimits) -> None:
    if not isinstance(outcome, Failure):
        messages = outcome.messages
        size = sum(map(len, messages))
        if size <= limits.result_bytes and len(messages) <= MESSAGES_LIMIT:
            if size <= _SMALL_BYTES:
                # One piece wakes up the server once.
                connection.sendall(b"".join([*(frame(Tag.MESSAGE, message) for message in messages), _RESULT_END]))
                return
            for message in messages:
                # Two writes, since joining them would copy a large message.
                connection.sendall(HEADER.pack(Tag.MESSAGE.value, len(message)))
                connection.sendall(message)
            connection.sendall(_RESULT_END)
            return
        outcome = result_too_large(limits)
    connection.sendall(failure_frame(outcome))


def _receive(connection: socket.socket) -> bytes:
    """Return the payload of the next frame of the server, which is trusted."""
    _, length = HEADER.unpack(_receive_exactly(connection, HEADER.size))
    return _receive_exactly(connection, length)


def _receive_exactly(connection: socket.socket, length: int) -> bytes:
    content = bytearray(length)
    view = memoryview(content)
    got = 0
    while got < length:
        count = connection.recv_into(view[got:])
        if not count:
            raise EOFError
        got += count
    return bytes(content)


def redirect_to_devnull() -> None:
    """Redirect standard input, output and error to the null device."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for descriptor in range(3):
        os.dup2(nowhere, descriptor)
    if nowhere > 2:
        os.close(nowhere)
