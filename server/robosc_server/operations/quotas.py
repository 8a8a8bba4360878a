"""Quotas of tokens, as token buckets that refill steadily.

Token buckets: J. Turner, New directions in communications, IEEE Communications Magazine 24(10), 1986, pp. 8-15. Each
server counts by itself, in memory: after a restart the buckets are full.
"""

from collections.abc import Callable

from robosc_api.security import Quota, TokenFile
from robosc_server.clock import monotonic
from robosc_server.tasks.task import Reason, RefusedError

_MINUTE_S = 60.0
_HOUR_S = 3600.0


class Bucket:
    """Bucket of limited size that refills steadily; it may be overdrawn.

    Args:
        size: Amount that it holds; it is full at first.
        filled_in_s: Time in which an empty bucket becomes full, in seconds.
        now_s: Current time of a monotonic clock, in seconds.
    """

    def __init__(self, size: int, filled_in_s: float, now_s: float) -> None:
        self.size = size
        self._rate = size / filled_in_s
        self._level = float(size)
        self._at_s = now_s

    def take(self, amount: float, now_s: float) -> None:
        """Take an amount, even if the bucket holds less."""
        self._level = self._level_at(now_s) - amount
        self._at_s = max(self._at_s, now_s)

    def seconds_until(self, amount: float, now_s: float) -> float:
        """Return the seconds until the bucket holds an amount; 0: it does."""
        return max(0.0, (amount - self._level_at(now_s)) / self._rate)

    def _level_at(self, now_s: float) -> float:
        return min(float(self.size), self._level + max(0.0, now_s - self._at_s) * self._rate)


class _Account:
    """The buckets of one token, for the quota that it has now."""

    def __init__(self, quota: Quota, now_s: float) -> None:
        self.quota = quota
        self.tasks = None if quota.per_minute is None else Bucket(quota.per_minute, _MINUTE_S, now_s)
        seconds = quota.cpu_seconds_per_hour
        self.seconds = None if seconds is None else Bucket(seconds, _HOUR_S, now_s)


class Quotas:
    """Remaining quota of each token; not for several threads.

    Args:
        tokens: File with the quotas; None: there are no tokens, and no quotas.
        clock: Seconds of a monotonic clock.
    """

    def __init__(self, tokens: TokenFile | None, clock: Callable[[], float] = monotonic) -> None:
        self._tokens = tokens
        self._clock = clock
        self._accounts: dict[str, _Account] = {}

    def admit(self, caller: str) -> None:
        """Count a requested task for the quota of a caller.

        Args:
            caller: Name of the token.

        Raises:
            RefusedError: The quota is used up; nothing is counted.
        """
        if self._tokens is None:
            return
        account = self._account(caller)
        if account is None:
            return
        now_s = self._clock()
        _check_seconds(account, now_s)
        if account.tasks is not None:
            if (wait_s := account.tasks.seconds_until(1.0, now_s)) > 0:
                raise _exceeded(f"the token has used up its quota of {account.tasks.size} tasks per minute", wait_s)
            account.tasks.take(1.0, now_s)

    def check(self, caller: str) -> None:
        """Do nothing if an admitted task may start, since other tasks of the token may have used up its CPU time.

        Raises:
            RefusedError: The quota of CPU time is used up.
        """
        account = self._account(caller)
        if account is not None:
            _check_seconds(account, self._clock())

    def charge(self, caller: str, cpu_s: float) -> None:
        """Count the CPU time of a task.

        Args:
            caller: Name of the token of the caller.
            cpu_s: CPU time of its process, in seconds.
        """
        account = self._account(caller)
        if account is not None and account.seconds is not None:
            account.seconds.take(cpu_s, self._clock())

    def waiting(self, caller: str) -> int | None:
        """Return the maximum number of waiting tasks of a token; None: the general limit."""
        quota = self._quota(caller)
        return None if quota is None else quota.waiting

    def _quota(self, caller: str) -> Quota | None:
        entry = None if self._tokens is None else self._tokens.named(caller)
        return None if entry is None else entry.quota

    def _account(self, caller: str) -> _Account | None:
        quota = self._quota(caller)
        if quota is None or (quota.per_minute is None and quota.cpu_seconds_per_hour is None):
            self._accounts.pop(caller, None)
            return None
        account = self._accounts.get(caller)
        if account is None or account.quota != quota:
            # The number of accounts is bounded by the lines of the file, and by revoked tokens.
            account = self._accounts[caller] = _Account(quota, self._clock())
        return account


def _check_seconds(account: _Account, now_s: float) -> None:
    """Do nothing if CPU time is left; the time of a task is known only after its end.

    Raises:
        RefusedError: Nothing is.
    """
    if account.seconds is not None and (wait_s := account.seconds.seconds_until(0.0, now_s)) > 0:
        size = account.seconds.size
        raise _exceeded(f"the token has used up its quota of {size} CPU seconds per hour", wait_s)


def _exceeded(message: str, wait_s: float) -> RefusedError:
    return RefusedError(Reason.QUOTA_EXCEEDED, message, wait_s)
