"""A worker process: jobs come on standard input, reports and one outcome for each go to standard output.

A process, not a thread: one operation on decision diagrams holds the interpreter for as long as it takes,
so a thread could neither be stopped in time nor leave the server free to answer. Every message is a
pickled value behind its length in 8 bytes; both ends are processes of one server.
"""

import contextlib
import importlib
import os
import pickle
import queue
import signal
import struct
import sys
import threading
from collections.abc import Callable
from typing import BinaryIO

from robosc_server.work import Job, Outcome, Report, run_job

LENGTH = struct.Struct(">Q")
"""The length before each message."""

RunJob = Callable[[Job, Callable[[Report], None]], Outcome]


def pack(message: object) -> bytes:
    """A message with its length before it."""
    content = pickle.dumps(message)
    return LENGTH.pack(len(content)) + content


def unpack(content: bytes) -> object:
    """The message in the bytes that another process of this server packed."""
    return pickle.loads(content)  # noqa: S301  # both ends are ours


def serve(run: RunJob) -> None:
    """Do jobs until the server closes its end, also in the middle of one; then leave the process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, which ends its workers.
    stdin, stdout = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # Whatever a library prints must not stand between the messages.
    jobs: queue.SimpleQueue[Job] = queue.SimpleQueue()
    threading.Thread(target=_read_jobs, args=(stdin, jobs), daemon=True).start()

    def send(message: Report | Outcome) -> None:
        stdout.write(pack(message))
        stdout.flush()

    with contextlib.suppress(BrokenPipeError):
        while True:
            send(run(jobs.get(), send))


def _read_jobs(stream: BinaryIO, jobs: "queue.SimpleQueue[Job]") -> None:
    """Pass on jobs; at the end of the stream the server is gone and nobody waits for an outcome."""
    while True:
        head = stream.read(LENGTH.size)
        if len(head) < LENGTH.size:
            os._exit(0)
        (size,) = LENGTH.unpack(head)
        content = stream.read(size)
        if len(content) < size:
            os._exit(0)
        jobs.put(unpack(content))  # type: ignore[arg-type]  # the server sends nothing else


def main() -> None:
    """Load what every job needs, so that the first one does not wait for it, and serve."""
    for module in ("robosc.model", "robosc.supervisor.make", "robosc.supervisor.codec", "robosc.targets"):
        importlib.import_module(module)
    serve(run_job)


if __name__ == "__main__":
    main()
