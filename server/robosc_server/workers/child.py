"""A worker: a fork of the fork server that waits for one task, does it, answers and ends."""

import faulthandler
import gc
import os
import socket
import traceback
from collections.abc import Callable

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
    too_large,
)
from robosc_server.workers.sandbox import Sandbox, close_other_descriptors

type TaskFunction = Callable[[TaskKind, bytes, TaskLimits, Callable[[Report], None]], Outcome]

_COLLECT_EVERY = 20_000
"""New objects of Python after which those that refer to each other in circles are looked for."""

OUT_OF_MEMORY = "the task exceeded its memory limit"


def run_worker(
    connection: socket.socket, crash_output: int, function: TaskFunction, sandbox: Sandbox, used_bytes: int
) -> None:
    """Wait for a task, do it, send its outcome; confined before anything of a stranger's is read.

    Args:
        connection: Connection to the server; where it ends before a task came, nobody needs this process.
        crash_output: Descriptor to which the interpreter writes where it was when it crashed.
        function: Function that does the task.
        sandbox: Sandbox that confines this process.
        used_bytes: Bytes of address space that this process has.

    Raises:
        SandboxError: It cannot be confined.
    """
    faulthandler.enable(crash_output)
    confinement.prefer_oom_kill()
    # What another process holds open tells nobody of its end, and gives who holds it something to reach.
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
    # A process that does one task and ends has little to collect, and its parts of the diagrams are not Python's.
    gc.set_threshold(_COLLECT_EVERY)
    try:
        outcome = function(kind, request, limits, lambda report: connection.sendall(report_frame(report)))
    except ConnectionError:
        raise  # Nobody waits any more.
    except MemoryError:
        outcome = Failure(Reason.MEMORY_LIMIT, OUT_OF_MEMORY)
    except BaseException:  # The worker's border: whatever it was, the server logs it and lives on.
        confinement.raise_memory_limit()
        outcome = Failure(Reason.INTERNAL_FAULT, "the server has an internal error", traceback.format_exc())
    confinement.raise_memory_limit()
    _send(connection, outcome, limits)


def _send(connection: socket.socket, outcome: Outcome, limits: TaskLimits) -> None:
    if not isinstance(outcome, Failure):
        messages = outcome.messages
        if sum(map(len, messages)) <= limits.result_bytes and len(messages) <= MESSAGES_LIMIT:
            for message in messages:
                # In two, not put together: that would take the memory of a large message once more.
                connection.sendall(HEADER.pack(Tag.MESSAGE.value, len(message)))
                connection.sendall(message)
            connection.sendall(frame(Tag.RESULT, b""))
            return
        outcome = too_large(limits)
    connection.sendall(failure_frame(outcome))


def _receive(connection: socket.socket) -> bytes:
    """The payload of the next frame of the server, which is believed."""
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
    """Have standard input, output and error lead nowhere: libraries that print disturb nobody, and tell nothing."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for descriptor in range(3):
        os.dup2(nowhere, descriptor)
    if nowhere > 2:
        os.close(nowhere)
