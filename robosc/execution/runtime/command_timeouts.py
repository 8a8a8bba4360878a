"""Time of the last input from the existing controller of a supervision layer."""

from __future__ import annotations

from typing import Dict, List

from robosc.execution.runtime.calls import FOREVER
from robosc.execution.runtime.release import Releases


class CommandTimeouts:
    """
    Detector of release identifiers that still act although the existing controller is silent.

    :param releases: Messages that keep acting.
    :param timeout_s: Seconds after which the controller counts as silent; 0: never.
    """

    __slots__ = ('_arrived_s', '_releases', '_timeout_s')

    def __init__(self, releases: Releases, timeout_s: float) -> None:
        self._releases = releases
        self._timeout_s = timeout_s or FOREVER
        self._arrived_s: Dict[str, float] = {}

    def arrived(self, identifier: str, now_s: float) -> None:
        """Note a message on an identifier, whether it is let through or not."""
        self._arrived_s[identifier] = now_s

    def silent(self, now_s: float) -> List[str]:
        """Return identifiers that act although no message came there within the timeout."""
        return [
            item
            for item in self._releases.acting()
            if now_s >= self._arrived_s[item] + self._timeout_s
        ]

    def deadline_s(self) -> float:
        """Return the clock's reading, in seconds, at which the next identifier is late."""
        return min(
            (self._arrived_s[item] + self._timeout_s for item in self._releases.acting()),
            default=FOREVER,
        )
