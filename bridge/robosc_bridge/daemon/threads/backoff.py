"""Waiting time before a failed attempt is repeated: twice as long each time, up to a limit."""


class Backoff:
    """Waiting times that double with each failure.

    Args:
        first_s: Waiting time after the first failure, in seconds.
        limit_s: Longest waiting time, in seconds.
    """

    def __init__(self, first_s: float = 0.25, limit_s: float = 4.0) -> None:
        self._first_s = first_s
        self._limit_s = limit_s
        self._failures = 0

    @property
    def is_fresh(self) -> bool:
        """True if nothing has failed since the last success."""
        return self._failures == 0

    def failed(self) -> float:
        """Note a failure, and return the time to wait now."""
        wait_s = min(self._first_s * 2.0 ** min(self._failures, 32), self._limit_s)
        self._failures += 1
        return wait_s

    def succeeded(self) -> None:
        """Note a success: the next pause is short again."""
        self._failures = 0
