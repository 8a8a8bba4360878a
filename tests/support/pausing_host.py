"""A virtual host on which a thread can be paused."""

from collections.abc import Callable
from typing import Any

from robosc_simulated import VirtualHost


class PausingHost(VirtualHost):
    """A host whose threads of one name can be paused, as a process that gets no processor.

    Attributes:
        paused: Name of the threads that are paused; empty: none are.
    """

    def __init__(self) -> None:
        super().__init__()
        self.paused = ""
        self._by_name: dict[str, Any] = {}

    def thread(self, run: Callable[[], None], name: str) -> Any:
        """Return a new thread that can be paused."""
        self._by_name[name] = super().thread(run, name)
        return self._by_name[name]

    def _next(self) -> Any:
        held = [slot for slot in self._waiting if self.paused and slot is self._by_name[self.paused]._turn]
        for slot in held:
            self._waiting.remove(slot)
        try:
            return super()._next()
        finally:
            self._waiting.extendleft(held)
