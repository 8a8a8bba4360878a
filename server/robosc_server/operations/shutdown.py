"""Signal handling with a guaranteed exit: at once after a second interrupt, and in any case after a time limit.

A forced exit loses nothing: accepted jobs are on disk, and workers end with the server.
"""

import asyncio
import faulthandler
import logging
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

_log = logging.getLogger(__name__)

END_S = 20.0
"""Time for the shutdown after open calls have ended, in seconds; mostly for a database that does not respond."""

_LOGGED_BEFORE_S = 0.5
_BY_SIGNAL = 128


class ShutdownSignals:
    """Handler of the signals that end the server, for use in the main thread.

    Args:
        drain_s: Time for calls under way to end, in seconds.
        end_s: Additional time that the end may take, in seconds.
    """

    def __init__(self, drain_s: float, end_s: float = END_S) -> None:
        self._limit_s = drain_s + end_s
        self._is_requested = asyncio.Event()
        self._interrupts = 0
        # The process exits without standard error, too, but its traceback is lost.
        self._stderr = sys.__stderr__ or os.open(os.devnull, os.O_WRONLY)

    def listen(self) -> None:
        """Install the signal handlers on the running event loop."""
        loop = asyncio.get_running_loop()
        for number in (signal.SIGTERM, signal.SIGINT):
            loop.add_signal_handler(number, self._on_signal, number)

    async def requested(self) -> None:
        """Wait for a signal; from then on, the process exits at its time limit at the latest."""
        await self._is_requested.wait()

    def finished(self) -> None:
        """Cancel the forced exit, since the server has ended."""
        faulthandler.cancel_dump_traceback_later()

    def _on_signal(self, number: int) -> None:
        if not self._is_requested.is_set():
            self._is_requested.set()
            loop = asyncio.get_running_loop()
            loop.call_later(max(0.0, self._limit_s - _LOGGED_BEFORE_S), _log_pending_tasks)
            # A watchdog thread that does not need the interpreter: it exits even if everything else hangs.
            faulthandler.dump_traceback_later(self._limit_s, exit=True, file=self._stderr)
        self._interrupts += number == signal.SIGINT
        if self._interrupts > 1:
            # A user at a terminal does not want to wait.
            _log.warning("exiting immediately after a second interrupt")
            os._exit(_BY_SIGNAL + number)


def _log_pending_tasks() -> None:
    """Log the places in the code at which unfinished asyncio tasks wait."""
    for task in asyncio.all_tasks():
        _log.error(
            "the shutdown takes too long: %s waits at %s", task.get_name(), " < ".join(_code_locations(task.get_coro()))
        )


def _code_locations(waiting: Any) -> Iterator[str]:
    """Yield the place in the code of a coroutine, and of each that it waits for, the outermost first."""
    while waiting is not None:
        frame = getattr(waiting, "cr_frame", None) or getattr(waiting, "gi_frame", None)
        if frame is not None:
            yield f"{Path(frame.f_code.co_filename).name}:{frame.f_lineno}"
        waiting = getattr(waiting, "cr_await", None) or getattr(waiting, "gi_yieldfrom", None)
