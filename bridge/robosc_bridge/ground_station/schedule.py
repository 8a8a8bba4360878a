"""Schedule of messages: when each is due, and how much may be sent."""

import math
from collections.abc import Iterator, Mapping


class Schedule:
    """Messages that come again and again.

    Args:
        defaults: Seconds between two of each, by number; `math.inf`: only if somebody wants it.
    """

    def __init__(self, defaults: Mapping[int, float]) -> None:
        self._defaults = dict(defaults)
        self._intervals_s = dict(defaults)
        self._due_s = dict.fromkeys(defaults, -math.inf)

    def interval_s(self, message: int) -> float:
        """Return the interval at which a message comes, in seconds."""
        return self._intervals_s[message]

    def change(self, message: int, interval_s: float | None) -> bool:
        """Let a message come that often, None: as by default; whether it is one of these."""
        if message not in self._defaults:
            return False
        self._intervals_s[message] = self._defaults[message] if interval_s is None else interval_s
        self._due_s[message] = -math.inf
        return True

    def due(self, now_s: float) -> Iterator[int]:
        """The messages whose time has come, who waits longest first; the next of each is an interval later."""
        waiting = [
            (due_s, message)
            for message, due_s in self._due_s.items()
            if due_s <= now_s and not math.isinf(self._intervals_s[message])
        ]
        for due_s, message in sorted(waiting):
            self._due_s[message] = max(due_s + self._intervals_s[message], now_s)
            yield message


class Bucket:
    """A rate with bursts.

    Args:
        rate_per_s: Over some time.
        most: At once.
    """

    def __init__(self, rate_per_s: float, most: float) -> None:
        self._rate_per_s = rate_per_s
        self._most = most
        self._left = most
        self._last_s: float | None = None

    def pass_time(self, now_s: float) -> None:
        """Let time fill the budget again."""
        if self._last_s is not None:
            self._left = min(self._left + max(now_s - self._last_s, 0.0) * self._rate_per_s, self._most)
        self._last_s = now_s

    @property
    def has_some(self) -> bool:
        """True if at least one is left."""
        return self._left >= 1.0

    def take(self, amount: float = 1.0) -> None:
        """Use it, also beyond what is left: that is made up for before there is some again."""
        self._left = max(self._left - amount, -self._most)
