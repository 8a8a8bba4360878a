"""Calls in the endpoint's event loop that other threads ask for."""

import asyncio
import contextlib
from collections.abc import Callable


class LoopCall:
    """Call of a function in the running event loop: several requests before it begins make one call.

    Args:
        function: The function.
    """

    def __init__(self, function: Callable[[], None]) -> None:
        self._function = function
        self._loop = asyncio.get_running_loop()
        self._is_asked = False

    def ask(self) -> None:
        """Let the function be called soon; from any thread."""
        if not self._is_asked:
            self._is_asked = True
            with contextlib.suppress(RuntimeError):  # The endpoint is closed.
                self._loop.call_soon_threadsafe(self._call)

    def _call(self) -> None:
        # First, so that whatever comes from here on is called again.
        self._is_asked = False
        self._function()
