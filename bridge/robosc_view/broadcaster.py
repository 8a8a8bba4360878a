"""Broadcast from one source to all viewers: the latest state, and every event once, for slow readers too.

All of it lives in the event loop of the server. A source runs as long as a page is open; a lost one is reported, and
tried again after a growing pause.
"""

import asyncio
import contextlib
import logging
from collections import deque
from collections.abc import Mapping

from robosc_view.definition import Robot
from robosc_view.messages import MessageBuilder, PreparedRobot, events_text, position_text, scan_text, source_lost_text
from robosc_view.reports import EventBatch, LaserScan, Status
from robosc_view.sources import Source, SourceLostError, SourceWrongError

_log = logging.getLogger(__name__)

MAXIMUM_EVENTS = 2000
"""Entries that wait for one who looks."""

MAXIMUM_BYTES = 2 * 1024 * 1024
"""Maximum size of the entries that wait for a viewer, in bytes."""

MAXIMUM_ANSWERS = 50
"""Answers that wait for one page; the oldest are forgotten."""

UPDATE_S, SIGN_OF_LIFE_S = 0.05, 1.0
"""Least and longest time between two updates."""

FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 10.0
"""Before a source is tried again."""

_GOOD_S = 5.0
"""A source that lasted so long is tried again at once as if it were the first time."""


class Viewer:
    """Messages that one viewer has not been sent yet."""

    def __init__(self) -> None:
        self._news = asyncio.Event()
        self._definition: str | None = None
        self._gone: str | None = None
        self._update: str | None = None
        self._scan: str | None = None
        self._position: str | None = None
        self._run: str | None = None
        self._answers: deque[str] = deque(maxlen=MAXIMUM_ANSWERS)
        self._events: deque[str] = deque()
        self._bytes = 0
        self._lost = 0

    def define(self, text: str) -> None:
        """Take the definition of another robot, and drop what waits about the one before."""
        self._lost += len(self._events)
        self._events.clear()
        self._bytes = 0
        self._gone = self._update = self._scan = self._position = self._run = None
        self._definition = text
        self._news.set()

    def source_lost(self, text: str) -> None:
        """Note that the source is lost, until there is a robot again."""
        self._gone = text
        self._news.set()

    def jump(self) -> None:
        """Drop what waits, since the replay has jumped to another position."""
        self._events.clear()
        self._bytes = self._lost = 0
        self._update = self._scan = None

    def show(self, text: str) -> None:
        """Take the latest update."""
        self._update = text
        self._news.set()

    def show_scan(self, text: str) -> None:
        """Take the latest scan."""
        self._scan = text
        self._news.set()

    def show_position(self, text: str) -> None:
        """Take the latest position."""
        self._position = text
        self._news.set()

    def show_run(self, text: str) -> None:
        """Take the latest message about a run that is stepped by hand."""
        self._run = text
        self._news.set()

    def answer(self, text: str) -> None:
        """Send an answer only to this page."""
        self._answers.append(text)
        self._news.set()

    def append_events(self, entries: list[str], lost: int) -> None:
        """Take entries; the oldest are dropped and counted if too many wait."""
        self._lost += lost
        for entry in entries:
            self._events.append(entry)
            self._bytes += len(entry)
        while len(self._events) > MAXIMUM_EVENTS or self._bytes > MAXIMUM_BYTES:
            self._bytes -= len(self._events.popleft())
            self._lost += 1
        self._news.set()

    async def take(self) -> list[str]:
        """Wait for messages, and return all of them in the order in which they must be sent."""
        await self._news.wait()
        self._news.clear()
        found: list[str] = []
        if self._definition is not None:
            found.append(self._definition)
        if self._gone is not None:
            found.append(self._gone)
        found.extend(self._answers)
        if self._position is not None:
            found.append(self._position)
        if self._events or self._lost:
            found.append(events_text(list(self._events), self._lost))
        found += [text for text in (self._update, self._scan, self._run) if text is not None]
        self._definition = self._gone = self._update = self._scan = self._position = self._run = None
        self._answers.clear()
        self._events.clear()
        self._bytes = self._lost = 0
        return found


class RobotCache:
    """Cache of the last prepared robot, so that pages that are opened again need not wait for it.

    Args:
        robot: Robot that is known already; None: none is.
    """

    def __init__(self, robot: Robot | None = None) -> None:
        self._kept = None if robot is None else PreparedRobot(robot)
        self._lock = asyncio.Lock()

    async def prepared(self, robot: Robot) -> PreparedRobot:
        """Return the prepared robot."""
        async with self._lock:
            if self._kept is None or self._kept.robot != robot:
                # The graphs of a large robot take their time, in another thread.
                self._kept = await asyncio.to_thread(PreparedRobot, robot)
            return self._kept


class Broadcaster:
    """Sink of a source, which passes everything on to the viewers.

    Args:
        source: Source that reports.
        robot_cache: Cache in which robots are prepared, and kept.
    """

    def __init__(self, source: Source, robot_cache: "RobotCache") -> None:
        self.source = source
        self._robot_cache = robot_cache
        self._viewers: set[Viewer] = set()
        self._tasks: list[asyncio.Task[None]] = []
        self._prepared: PreparedRobot | None = None
        self._builder: MessageBuilder | None = None
        self._status: Status | None = None
        self._updated_s = 0.0
        self._number = 0
        self._update: str | None = None
        self._position: str | None = None
        self._gone: str | None = None
        self._is_dirty = asyncio.Event()

    @property
    def is_watched(self) -> bool:
        """True if there are viewers."""
        return bool(self._viewers)

    def join(self) -> Viewer:
        """Add a viewer."""
        viewer = Viewer()
        if self._builder is not None and self._prepared is not None:
            viewer.define(self._prepared.text)
            for text, put in ((self._position, viewer.show_position), (self._update, viewer.show)):
                if text is not None:
                    put(text)
        elif self._gone is not None:
            viewer.source_lost(self._gone)
        self._viewers.add(viewer)
        if not self._tasks:
            self._tasks = [asyncio.create_task(self._keep()), asyncio.create_task(self._refresh())]
        return viewer

    async def leave(self, viewer: Viewer) -> None:
        """Remove a viewer; without viewers the source is stopped."""
        self._viewers.discard(viewer)
        if not self._viewers:
            await self.close()

    async def close(self) -> None:
        """End the source's work; `join` begins it anew."""
        tasks, self._tasks = self._tasks, []
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        # New pages may have joined meanwhile.
        if not self._tasks:
            self._builder = self._status = self._update = self._position = self._gone = None

    # The source

    async def _keep(self) -> None:
        loop = asyncio.get_running_loop()
        pause_s = FIRST_PAUSE_S
        while True:
            begin_s = loop.time()
            try:
                await self.source.run(self)
                why = "it has ended"
            except (SourceLostError, SourceWrongError) as error:
                why = str(error)
                if isinstance(error, SourceWrongError):
                    pause_s = LONGEST_PAUSE_S
            except Exception as error:
                _log.exception("a source of the live view has failed")
                why = f"it has failed: {type(error).__name__}"
            if loop.time() - begin_s > _GOOD_S:
                pause_s = FIRST_PAUSE_S
            self._lose(why)
            await asyncio.sleep(pause_s)
            pause_s = min(2 * pause_s, LONGEST_PAUSE_S)

    def _lose(self, why: str) -> None:
        self._builder = self._status = self._update = self._position = None
        text = source_lost_text(why)
        if text != self._gone:
            _log.warning("the live view has lost its source: %s", why)
        self._gone = text
        for viewer in self._viewers:
            viewer.source_lost(text)

    async def define(self, robot: Robot) -> None:
        """Define the robot."""
        self._prepared = await self._robot_cache.prepared(robot)
        self._builder = MessageBuilder(self._prepared)
        self._status = self._update = self._position = self._gone = None
        for viewer in self._viewers:
            viewer.define(self._prepared.text)

    def begin(self, components: Mapping[str, object]) -> None:
        """Receive the known state in which what happens next begins."""
        if self._builder is not None:
            self._builder.begin(components)

    def show(self, status: Status) -> None:
        """Receive what the robot is doing."""
        self._status = status
        self._updated_s = asyncio.get_running_loop().time()
        self._is_dirty.set()

    def append_events(self, batch: EventBatch, first: int | None = None) -> None:
        """Receive entries of the event log."""
        if self._builder is None:
            return
        entries = self._builder.entries(batch, first)
        for viewer in self._viewers:
            viewer.append_events(entries, batch.lost)

    def show_scan(self, scan: LaserScan) -> None:
        """Receive a revolution of the LiDAR."""
        text = scan_text(scan)
        for viewer in self._viewers:
            viewer.show_scan(text)

    def replay_jumped(self) -> None:
        """Receive a jump of the replay; everything about the new position follows."""
        for viewer in self._viewers:
            viewer.jump()

    def show_position(self, time_s: float, speed: float, *, is_playing: bool) -> None:
        """Receive the position of the replay."""
        self._position = position_text(time_s, speed, is_playing=is_playing)
        for viewer in self._viewers:
            viewer.show_position(self._position)

    def show_run(self, text: str) -> None:
        """Receive the message `run`."""
        for viewer in self._viewers:
            viewer.show_run(text)

    def answer(self, text: str) -> None:
        """Receive a message that answers a page."""
        for viewer in self._viewers:
            viewer.answer(text)

    async def _refresh(self) -> None:
        """Send updates: soon after there is something new, not too often, and at least now and then."""
        while True:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(SIGN_OF_LIFE_S):
                    await self._is_dirty.wait()
            self._is_dirty.clear()
            try:
                self._send_update()
            except Exception:
                _log.exception("an update of the live view could not be sent")
            await asyncio.sleep(UPDATE_S)

    def _send_update(self) -> None:
        if self._builder is None or self._status is None:
            if self._gone is not None:
                for viewer in self._viewers:
                    viewer.source_lost(self._gone)
            return
        self._number += 1
        age_s = self._status.age_s + asyncio.get_running_loop().time() - self._updated_s
        self._update = self._builder.update(self._status, self._number, age_s)
        for viewer in self._viewers:
            viewer.show(self._update)
