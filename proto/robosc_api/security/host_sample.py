"""Sample of events by host, so that a refused caller cannot fill a disk with log lines."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from robosc_api.security.callers import host_of, network_of

PERIOD_S = 10.0
"""Time between two events of one host that are reported, in seconds."""

_HOSTS = 1000
"""Hosts that have entries of their own; further ones share one entry."""

_OTHERS = "other hosts"


@dataclass(slots=True)
class _Entry:
    """Entry of one host.

    Attributes:
        reported_s: Time of its last reported event.
        skipped: Events since then.
    """

    reported_s: float
    skipped: int = 0


class HostSample:
    """Sample with one event for each host and period.

    Args:
        clock: Seconds of a monotonic clock.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._entries: dict[str, _Entry] = {}

    def take(self, peer: str) -> int | None:
        """Return the number of skipped events before this one; None: this one is skipped, too.

        Args:
            peer: The caller in gRPC's words.
        """
        now_s = self._clock()
        host = network_of(host_of(peer))
        if host not in self._entries and len(self._entries) >= _HOSTS:
            # Those that have been silent for long are forgotten; in a flood from everywhere the others share one.
            for old in [name for name, item in self._entries.items() if now_s - item.reported_s >= PERIOD_S]:
                del self._entries[old]
            if len(self._entries) >= _HOSTS:
                host = _OTHERS
        entry = self._entries.get(host)
        if entry is not None and now_s - entry.reported_s < PERIOD_S:
            entry.skipped += 1
            return None
        self._entries[host] = _Entry(now_s)
        return 0 if entry is None else entry.skipped
