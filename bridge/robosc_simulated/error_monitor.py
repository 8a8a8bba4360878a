"""Errors while a simulator serves, as they are reported to its user: at once, and by the exit status at the end."""

import contextlib
import sys
import threading
from types import TracebackType
from typing import Self


class ErrorMonitor:
    """Record of what goes wrong; use it as a context manager around all that has threads.

    A thread that ends by an unexpected error would leave its device mute: as the last line of defence, the
    error is reported, with its trace, and the program is to end.

    Attributes:
        has_crashed: True if a thread has ended so.
    """

    def __init__(self) -> None:
        self.has_crashed = False
        self._is_any = False
        self._before = threading.excepthook

    @property
    def status(self) -> int:
        """Status of the program at its end: 1 if anything went wrong."""
        return int(self._is_any)

    def report(self, sentence: str) -> None:
        """Report an error after which the simulator goes on."""
        self._is_any = True
        # Also standard error may be a file on a full disk.
        with contextlib.suppress(OSError):
            print(sentence, file=sys.stderr, flush=True)

    def __enter__(self) -> Self:
        self._before = threading.excepthook
        threading.excepthook = self._crash
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        threading.excepthook = self._before

    def _crash(self, what: threading.ExceptHookArgs) -> None:
        if what.exc_type is SystemExit:
            return
        threading.__excepthook__(what)
        name = "a thread" if what.thread is None else f"the thread {what.thread.name!r}"
        self.report(f"the simulation ends, because {name} has failed: {what.exc_type.__name__}: {what.exc_value}")
        self.has_crashed = True
