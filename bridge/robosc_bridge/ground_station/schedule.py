"""Schedule of messages: when each is due, and how much may be sent."""

import math
from collections.abc import Iterator, Mapping


class Schedule:
    """Schedule of periodic messages.

    Args:
        defaults: Default interval of each message, in seconds, by number; `math.inf`: only on request.
    """

    def __init__(self, defaults: Mapping[int, float]) -> None:
        self._defaults = dict(defaults)
        self._intervals_s = dict(defaults)
        self._due_s = dict.fromkeys(defaults, -math.inf)

    def interval_s(self, message: int) -> float:
        """Return the interval of a message, in seconds."""
        return self._intervals_s[message]

    def change(self, message: int, interval_s: float | None) -> bool:
        """Change the interval of a message, None: to the default; return True if the message has a schedule."""
        if message not in self._defaults:
            return False
        self._intervals_s[message] = self._defaults[message] if interval_s is None else interval_s
        self._due_s[message] = -math.inf
        return True

    def due(self, now_s: float) -> Iterator[int]:
        """Return the messages that are due, the one that waits longest first; each is due again an interval later."""
        waiting = [
            (due_s, message)
            for message, due_s in self._due_s.items()
            if due_s <= now_s and not math.isinf(self._intervals_s[message])
        ]
        for due_s, message in sorted(waiting):
            self._due_s[message] = max(due_s + self._intervals_s[message], now_s)
            yield message


class Bucket:
    """Token bucket: a limited rate with bursts.

    Args:
        rate_per_s: Average rate.
        most: Size of a burst.
    """

    def __init__(self, rate_per_s: float, most: float) -> None:
        self._rate_per_s = rate_per_s
        self._most = most
        self._left = most
        self._last_s: float | None = None

    def pass_time(self, now_s: float) -> None:
        """Refill the bucket for the time that has passed."""
        if self._last_s is not None:
            self._left = min(self._left + max(now_s - self._last_s, 0.0) * self._rate_per_s, self._most)
        self._last_s = now_s

    @property
    def has_some(self) -> bool:
        """True if at least one token is left."""
        return self._left >= 1.0

    def take(self, amount: float = 1.0) -> None:
        """Take tokens, even more than are left: the bucket must then refill beyond zero first."""
        self._left = max(self._left - amount, -self._most)
