"""An event loop in a thread of its own, for tests that are written one step after the other; and what they wait for."""

import asyncio
import contextlib
import os
import threading
from collections.abc import Coroutine
from concurrent.futures import Future
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from support.waiting import PATIENCE_S


class BackgroundLoop:
    """Runs coroutines while the test does something else; a context.

    Args:
        loop: Such as a `HeldLoop`; None: a new one.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop | None = None) -> None:
        self._loop = loop or asyncio.new_event_loop()

    def __enter__(self) -> Self:
        self._thread = threading.Thread(target=self._loop.run_forever)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(PATIENCE_S)
        self._loop.close()

    def start[T](self, work: Coroutine[Any, Any, T]) -> Future[T]:
        """Begin a piece of work; cancelling what is returned cancels it."""
        return asyncio.run_coroutine_threadsafe(work, self._loop)

    def run[T](self, work: Coroutine[Any, Any, T]) -> T:
        """Run a piece of work, and return its result."""
        return self.start(work).result(PATIENCE_S)


def is_running(pid: int) -> bool:
    """Return True if there is a process of that number."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def has_ended(pid: int) -> bool:
    """Return True if a process has ended.

    Nobody need have asked for its status, since processes whose parent is gone wait for that.
    """
    try:
        return _fields(pid)[0] == "Z"
    except (FileNotFoundError, ProcessLookupError):
        return True


def is_stopped(pid: int) -> bool:
    """Return True if a process is stopped, as after Ctrl-Z."""
    return _fields(pid)[0] == "T"


def parent_of(pid: int) -> int:
    """The process that a process was started by."""
    return int(_fields(pid)[1])


def children_of(pid: int) -> list[int]:
    """The processes that a process has started, whichever of its threads did; none where it is gone."""
    found: list[int] = []
    for children in Path(f"/proc/{pid}/task").glob("*/children"):
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            found += map(int, children.read_text().split())
    return found


def cpu_ticks(pid: int) -> int:
    """Time of a processor that a process has taken, in hundredths of a second on most machines."""
    fields = _fields(pid)
    return int(fields[11]) + int(fields[12])


def _fields(pid: int) -> list[str]:
    """Return the kernel's data on a process, after its name."""
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
