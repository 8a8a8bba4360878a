"""Keys pressed in the terminal of the bridge, one by one and without echo."""

import contextlib
import logging
import os
import select
import sys
import termios
import threading
import tty
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

_log = logging.getLogger(__name__)

_NAMES = {" ": "space"}
_LIMIT_S = 2.0


class Keyboard:
    """Reader of keys, in a thread of its own while its context lasts; does nothing without a terminal.

    Args:
        on_key: Function that takes each key, a single character or `space`; must not wait.
        number: File descriptor of the terminal.
    """

    def __init__(self, on_key: Callable[[str], None], number: int | None = None) -> None:
        self._on_key = on_key
        self._number = sys.stdin.fileno() if number is None else number
        self._before: Any = None
        self._thread: threading.Thread | None = None

    @property
    def is_there(self) -> bool:
        """True if there is a terminal."""
        return os.isatty(self._number)

    def __enter__(self) -> Self:
        if self.is_there:
            self._before = termios.tcgetattr(self._number)
            tty.setcbreak(self._number)
            self._woken, self._waker = os.pipe()
            self._thread = threading.Thread(target=self._read, name="keyboard", daemon=True)
            self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._thread is None or self._before is None:
            return
        os.write(self._waker, b"\0")
        self._thread.join(_LIMIT_S)
        os.close(self._woken)
        os.close(self._waker)
        with contextlib.suppress(termios.error):  # The terminal is gone.
            termios.tcsetattr(self._number, termios.TCSADRAIN, self._before)

    def _read(self) -> None:
        poll = select.poll()
        poll.register(self._number, select.POLLIN)
        poll.register(self._woken, select.POLLIN)
        while True:
            ready = dict(poll.poll())
            if self._woken in ready:
                return
            try:
                data = os.read(self._number, 64)
            except OSError:
                data = b""
            if not data:
                _log.warning("the terminal is gone: keys have no effect any more")
                return
            for key in data.decode("utf-8", "replace"):
                self._on_key(_NAMES.get(key, key))
