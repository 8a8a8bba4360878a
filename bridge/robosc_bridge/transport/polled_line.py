"""Reading of a line with waits in `poll`: a wait costs nothing, has a limit, and can be ended by another thread."""

import contextlib
import os
import select
import threading
from abc import ABC, abstractmethod

from robosc_bridge.errors import LineLostError

_WAKES = 4096


class PolledLine(ABC):
    """An open line that one thread reads, and that any thread may wake or close.

    Args:
        path: Name of the line in messages.
        file: Number of its open file.
    """

    def __init__(self, path: str, file: int) -> None:
        self.path = path
        self._file = file
        self._woken, self._waker = os.pipe()
        os.set_blocking(self._waker, False)
        self._poll = select.poll()  # Unlike `select`, it takes any number of a file.
        self._poll.register(file, select.POLLIN)
        self._poll.register(self._woken, select.POLLIN)
        # Another thread may wake the line while it is being closed: its file's number may be another file's then.
        # A signal handler may wake it, too, while its own thread is inside.
        self._guard = threading.RLock()
        self._is_open = True

    @abstractmethod
    def _close_file(self) -> None:
        """Give its file back; never raises."""

    def _is_readable(self, limit_s: float) -> bool:
        """Wait for something to read, for at most so long, or until `wake`; return True if there is something."""
        readable = dict(self._poll.poll(max(limit_s, 0.0) * 1000))
        if self._woken in readable:
            os.read(self._woken, _WAKES)
        return self._file in readable

    def wake(self) -> None:
        """Let a `read` that waits in another thread return; safe at any time."""
        with self._guard:
            if self._is_open:
                # A full pipe: it is awake already.
                with contextlib.suppress(BlockingIOError):
                    os.write(self._waker, b"\0")

    def close(self) -> None:
        """Close the line; never raises, and may be called again."""
        with self._guard:
            if not self._is_open:
                return
            self._is_open = False
            self._close_file()
            os.close(self._woken)
            os.close(self._waker)

    def _check_open(self) -> None:
        # The numbers of a closed line's files may be other files' now.
        if not self._is_open:
            raise LineLostError(self.path, "the line is closed")
