"""Feed for watchers of the daemon: the latest snapshot, and the new entries of the event log.

The loop writes, and any number of watchers read, each from a thread of its own; none waits for another. A watcher that
reads too slowly loses entries and learns how many, but it always gets the latest snapshot.
"""

import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from robosc.execution.runtime.event_log import Entry, EventLog
from robosc.execution.runtime.progress import Progress
from robosc_bridge.daemon.states import State
from robosc_bridge.daemon.threads.reports import Device
from robosc_bridge.daemon.timing import TimingFigures
from robosc_bridge.devices.interface import DriveReading, Scan
from robosc_bridge.safety import Caution, Reason

MAXIMUM_WAITING = 1000
"""Entries that are kept for a watcher."""


@dataclass(frozen=True)
class Snapshot:
    """State of the daemon, as the loop saw it at the end of a cycle. No part of it changes afterwards.

    Attributes:
        number: Number that grows with each snapshot.
        time_s: Time of the snapshot, in seconds since 1970-01-01 UTC.
        state: State of the daemon.
        problem: The fault that has stopped the robot; empty: none.
        reasons: Reasons why the safety layer does not let the robot move.
        warnings: Warnings for a person while the safety layer lets the robot move.
        stops: Reasons why the executor issues no request; empty: it may, or no supervisor is executed.
        devices: For each device that belongs to the robot, True if it works.
        components: State and variables of each component with a behaviour, `{name: {"state": s, "variables": {v:
            value}}}`; empty: nothing is executed.
        enabled: Names of the requests that are allowed now, in the model's order.
        reading: Last reading of the drive base; None: there is none yet, or the drive base is lost.
        scan: The LiDAR's last full revolution; None: likewise.
        overruns: Number of decisions that were left out because the previous one took too long.
        communications: Location of each service and action, by name; empty: nothing is executed.
        timing: The bridge's own times, and the counts of its lines.
        progress: State of what the strategy aims at and assumes; None: there is no strategy, or nothing is executed.
        cancelling: Actions whose goal was to be cancelled and has not ended, in the model's order.
        overdue_cancels: Those of them whose goal should have ended by now.
    """

    number: int
    time_s: float
    state: State
    problem: str
    reasons: tuple[Reason, ...]
    warnings: tuple[Caution, ...]
    stops: tuple[str, ...]
    devices: Mapping[Device, bool]
    components: Mapping[str, Mapping[str, Any]]
    enabled: tuple[str, ...]
    reading: DriveReading | None
    scan: Scan | None
    overruns: int
    communications: Mapping[str, str] = field(default_factory=dict)
    timing: TimingFigures = field(default_factory=TimingFigures)
    progress: Progress | None = None
    cancelling: tuple[str, ...] = ()
    overdue_cancels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Update:
    """News that a watcher has not seen yet.

    Attributes:
        snapshot: The latest snapshot; None: there was none yet.
        entries: Entries of the event log since the last update, in their order.
        lost: Number of entries before these that were dropped because the watcher was too slow.
    """

    snapshot: Snapshot | None
    entries: tuple[Entry, ...]
    lost: int


class Subscription:
    """One watcher's view of a feed; made by `Feed.subscribe`."""

    def __init__(self, feed: "Feed", wake: Callable[[], None], limit: int) -> None:
        self._feed = feed
        self._wake = wake
        self._lock = threading.Lock()
        self._entries: deque[Entry] = deque(maxlen=limit)
        self._lost = 0

    def take(self) -> Update:
        """Return the news since the last look; never waits."""
        with self._lock:
            entries, lost = tuple(self._entries), self._lost
            self._entries.clear()
            self._lost = 0
        return Update(self._feed.snapshot, entries, lost)

    def close(self) -> None:
        """End the subscription; may be called again."""
        self._feed.drop(self)

    def put(self, entry: Entry | None) -> None:
        """Keep a new entry, if there is one, and wake the watcher; called by the feed."""
        if entry is not None:
            with self._lock:
                self._lost += len(self._entries) == self._entries.maxlen
                self._entries.append(entry)
        self._wake()


class Feed:
    """The latest snapshot and the entries for each watcher."""

    def __init__(self) -> None:
        self._snapshot: Snapshot | None = None
        # Replaced as a whole, so that the loop can go through it without a lock.
        self._subscriptions: tuple[Subscription, ...] = ()
        self._lock = threading.Lock()

    @property
    def snapshot(self) -> Snapshot | None:
        """Latest snapshot; None: there was none yet."""
        return self._snapshot

    @property
    def is_watched(self) -> bool:
        """True if anybody wants entries."""
        return bool(self._subscriptions)

    def show(self, snapshot: Snapshot) -> None:
        """Show a new snapshot."""
        self._snapshot = snapshot
        for subscription in self._subscriptions:
            subscription.put(None)

    def append(self, entry: Entry) -> None:
        """Send a new entry, whose values do not change any more."""
        for subscription in self._subscriptions:
            subscription.put(entry)

    def subscribe(self, wake: Callable[[], None], limit: int = MAXIMUM_WAITING) -> Subscription:
        """Watch from now on.

        Args:
            wake: Called from the loop's thread when there is something new; neither waits nor raises.
            limit: Entries that may wait for `take`; the oldest are dropped beyond it.
        """
        subscription = Subscription(self, wake, limit)
        with self._lock:
            self._subscriptions = (*self._subscriptions, subscription)
        return subscription

    def drop(self, subscription: Subscription) -> None:
        """End a subscription."""
        with self._lock:
            self._subscriptions = tuple(item for item in self._subscriptions if item is not subscription)


class WatchedLog:
    """Event log whose entries also go to the feed.

    Args:
        log: Log that the entries are written to.
        feed: Feed that shows the entries.
    """

    def __init__(self, log: EventLog, feed: Feed) -> None:
        self._log = log
        self._feed = feed

    @property
    def is_active(self) -> bool:
        """True if anybody wants entries."""
        return self._log.is_active or self._feed.is_watched

    @property
    def dropped(self) -> int:
        """Entries that were lost on their way to where they are written."""
        return self._log.dropped

    def write(self, entry: Entry) -> None:
        """Write it and show it."""
        self._log.write(entry)
        self._feed.append(entry)

    def close(self) -> None:
        """Finish what was written."""
        self._log.close()
