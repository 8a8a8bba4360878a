"""
Detection of lost servers.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Callable

LOST_S = 1.0
"""
A server that was not seen for so long is lost.

Discovery may lose sight of it for a moment, and a connection may be

made anew.
"""


class Presence:
    """
    Detector of a lost server.

    :param is_ready: Function that returns True if it is seen now.
    """

    def __init__(self, is_ready: Callable[[], bool]) -> None:
        self._is_ready = is_ready
        self._missed_since_s: float | None = None

    def is_lost(self, now_s: float) -> bool:
        """Return True if it has not been seen for `LOST_S`; to be called again and again."""
        if self._is_ready():
            self._missed_since_s = None
            return False
        if self._missed_since_s is None:
            self._missed_since_s = now_s
        return now_s >= self._missed_since_s + LOST_S

    def forget(self) -> None:
        """Forget the time since which the server is missed."""
        self._missed_since_s = None
