"""Watchers: each gets the latest snapshot and the events that it has not seen, however slowly it reads.

One subscription of the feed serves all of them, so that the cost for the loop does not grow with their number.
"""

import asyncio
import contextlib
from collections import deque

from google.protobuf.struct_pb2 import Struct

from robosc_bridge.daemon.feed import Feed, Subscription
from robosc_bridge.remote import convert
from robosc_bridge.remote.loop_call import LoopCall

MAXIMUM_EVENTS = 1000
"""Events that wait for a watcher."""

MAXIMUM_BYTES = 1024 * 1024
"""Maximum size of the events that wait for a watcher, in bytes."""


class Watcher:
    """Watcher of the bridge, with the events that it has not seen.

    Args:
        with_events: True if it wants events.
    """

    def __init__(self, *, with_events: bool) -> None:
        self._with_events = with_events
        self._events: deque[tuple[Struct, int]] = deque()
        self._bytes = 0
        self._lost = 0
        self._news = asyncio.Event()

    def put(self, event: Struct, size: int) -> None:
        """Add an event."""
        if not self._with_events:
            return
        self._events.append((event, size))
        self._bytes += size
        while len(self._events) > MAXIMUM_EVENTS or self._bytes > MAXIMUM_BYTES:
            _, lost = self._events.popleft()
            self._bytes -= lost
            self._lost += 1

    def lose(self, count: int) -> None:
        """Record that events were lost before they reached this watcher."""
        self._lost += count if self._with_events else 0

    def wake(self) -> None:
        """Wake the reader: news has come."""
        self._news.set()

    def take(self) -> tuple[list[Struct], int]:
        """Return the events since the last call, and the number of events before them that were lost."""
        events, lost = [event for event, _ in self._events], self._lost
        self._events.clear()
        self._bytes = self._lost = 0
        self._news.clear()
        return events, lost

    async def wait(self, limit_s: float) -> None:
        """Wait until there is news, or until the time is over."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(limit_s):
                await self._news.wait()


class Watchers:
    """All watchers; lives in the endpoint's event loop.

    Args:
        feed: Feed that the daemon shows.
    """

    def __init__(self, feed: Feed) -> None:
        self._feed = feed
        # The control loop's thread announces new entries.
        self._news = LoopCall(self._hand_out)
        self._watchers: set[Watcher] = set()
        self._subscription: Subscription | None = None

    def join(self, *, with_events: bool) -> Watcher:
        """Add a watcher."""
        watcher = Watcher(with_events=with_events)
        self._watchers.add(watcher)
        if self._subscription is None:
            self._subscription = self._feed.subscribe(self._news.ask)
        return watcher

    def leave(self, watcher: Watcher) -> None:
        """Remove a watcher."""
        self._watchers.discard(watcher)
        if not self._watchers and self._subscription is not None:
            self._subscription.close()
            self._subscription = None

    def wake(self) -> None:
        """Wake all watchers."""
        for watcher in self._watchers:
            watcher.wake()

    def _hand_out(self) -> None:
        if self._subscription is None:
            return
        update = self._subscription.take()
        for watcher in self._watchers:
            watcher.lose(update.lost)
        for entry in update.entries:
            event = convert.event_of(entry)
            size = event.ByteSize()
            for watcher in self._watchers:
                watcher.put(event, size)
        self.wake()
