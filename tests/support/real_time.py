"""Tests that live by the computer's clock, on a computer that has other work as well."""

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

LATE_S = 0.05
"""Lateness that no thread may have where answers are awaited for a fifth of a second at most, in seconds."""

_STEP_S = 0.005


class MachineLateError(Exception):
    """A test has failed while the machine gave its process no time: nothing follows from that."""


class Lateness:
    """Worst lateness of a thread of this process: a busy machine's share in what a test measures.

    Attributes:
        worst_s: Worst lateness so far, in seconds.
    """

    def __init__(self) -> None:
        self.worst_s = 0.0
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="lateness", daemon=True)

    def _run(self) -> None:
        while True:
            begin_s = time.monotonic()
            if self._is_over.wait(_STEP_S):
                return
            self.worst_s = max(self.worst_s, time.monotonic() - begin_s - _STEP_S)

    def __enter__(self) -> "Lateness":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._is_over.set()
        self._thread.join()


@contextmanager
def preferred() -> Iterator[None]:
    """This thread, and the threads and programs that it starts, go before other programs where that is permitted.

    A bridge and its devices live by the computer's clock: where neither gets any time for a fifth of a second, the
    bridge rightly takes its motors for silent.
    """
    before = os.getpriority(os.PRIO_PROCESS, 0)
    try:
        os.setpriority(os.PRIO_PROCESS, 0, -15)
    except PermissionError:
        yield
        return
    try:
        yield
    finally:
        os.setpriority(os.PRIO_PROCESS, 0, before)
