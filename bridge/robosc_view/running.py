"""The source for a bridge in the same process: its feed and its operations."""

import asyncio
import contextlib
import math
import time
from collections.abc import Mapping
from typing import Any

from robosc._version import __version__
from robosc_bridge.configuration.channels import channel_name
from robosc_bridge.daemon.feed import Snapshot
from robosc_bridge.daemon.operations import UNDONE_BY, Operations
from robosc_bridge.daemon.states import OperatorCommand
from robosc_bridge.daemon.timing import shown
from robosc_bridge.safety import LATCHING, Caution, Reason
from robosc_view.definition import Robot, robot_of
from robosc_view.reports import Drive, EventBatch, LaserScan, Notice, SourceKind, Status
from robosc_view.sources import RefusedError, ReplayCommand, Sink, not_replayed

COMMAND_LIMIT_S = 20.0
"""Longer than the motors may take to be restarted."""


class RunningBridge:
    """A bridge in this process; its control loop never waits for it.

    Args:
        operations: The daemon.
        scene: Scene for the map.
    """

    def __init__(self, operations: Operations, scene: Mapping[str, Any] | None = None) -> None:
        self._operations = operations
        channels = {name: channel_name(item) for name, item in operations.mapping.channels.items()}
        self.robot: Robot = robot_of(
            operations.supervisor,
            SourceKind.BRIDGE,
            version=__version__,
            channels=channels,
            can_command=True,
            scene=scene,
        )

    async def run(self, sink: Sink) -> None:
        """Pass on the snapshots of the daemon to the sink, until cancelled."""
        await sink.define(self.robot)
        caller = _Caller(asyncio.get_running_loop())
        subscription = self._operations.feed.subscribe(caller.call)
        number, scan_s = -1, math.nan
        try:
            while True:
                update = subscription.take()
                if update.entries or update.lost:
                    sink.append_events(EventBatch(update.entries, update.lost))
                snapshot = update.snapshot
                if snapshot is not None and snapshot.number != number:
                    number = snapshot.number
                    sink.show(status_of(snapshot))
                    if snapshot.scan is not None and snapshot.scan.time_s != scan_s:
                        scan_s = snapshot.scan.time_s
                        sink.show_scan(_scan(snapshot))
                await caller.wait()
        finally:
            subscription.close()

    async def order(self, command: OperatorCommand, by: str) -> None:
        """Give a command to the daemon, and return when it is done; a stop takes effect at once.

        Raises:
            RefusedError: The daemon refuses the command.
        """
        future = self._operations.order(command, by)
        if command is OperatorCommand.STOP:
            return
        answered = asyncio.Event()
        loop = asyncio.get_running_loop()

        def answer(_: object) -> None:
            with contextlib.suppress(RuntimeError):  # The server has ended.
                loop.call_soon_threadsafe(answered.set)

        # Not `wrap_future`: a page that leaves would cancel the future under the loop's hands.
        future.add_done_callback(answer)
        try:
            async with asyncio.timeout(COMMAND_LIMIT_S):
                await answered.wait()
        except (TimeoutError, asyncio.CancelledError) as error:
            undone_by = UNDONE_BY.get(command)
            if undone_by is not None:
                self._operations.order(undone_by, by)
            if isinstance(error, TimeoutError):
                raise RefusedError(f"the bridge's loop has not answered for {COMMAND_LIMIT_S:g} seconds") from error
            raise
        refusal = future.result()
        if refusal:
            raise RefusedError(refusal)

    def control_replay(self, command: ReplayCommand) -> None:
        """Refuse to control a replay: the source is live.

        Raises:
            RefusedError: Always.
        """
        raise not_replayed()


# Apart from `robosc_bridge.remote.loop_call`: calls wait until the page looks again, and not until the loop has a turn.
class _Caller:
    """Lets another thread wake the event loop, once however often it calls."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._news = asyncio.Event()
        self._is_called = False

    def call(self) -> None:
        """From the control loop's thread."""
        if not self._is_called:
            self._is_called = True
            with contextlib.suppress(RuntimeError):  # The server has ended.
                self._loop.call_soon_threadsafe(self._news.set)

    async def wait(self) -> None:
        """Until it was called."""
        await self._news.wait()
        self._news.clear()
        # Before anything is looked at, so that whatever comes from here on calls again.
        self._is_called = False


def status_of(snapshot: Snapshot) -> Status:
    """Return the status in a snapshot of the daemon."""
    reading = snapshot.reading
    return Status(
        time_s=snapshot.time_s,
        state=str(snapshot.state),
        problem=snapshot.problem,
        reasons=[_notice(item) for item in snapshot.reasons],
        warnings=[_notice(item) for item in snapshot.warnings],
        stops=snapshot.stops,
        devices={str(name): works for name, works in snapshot.devices.items()},
        components=snapshot.components,
        communications=snapshot.communications,
        enabled=snapshot.enabled,
        drive=None
        if reading is None
        else Drive(
            (reading.pose.x_m, reading.pose.y_m, reading.pose.heading_rad),
            reading.velocity.linear_m_s,
            reading.velocity.angular_rad_s,
            reading.battery_v,
            reading.is_torque_on,
        ),
        age_s=max(time.time() - snapshot.time_s, 0.0),
        latencies=shown(snapshot.timing.latencies),
        progress=snapshot.progress,
        cancelling=snapshot.cancelling,
    )


def _notice(item: Reason | Caution) -> Notice:
    return Notice(item.name, str(item), item in LATCHING)


def _scan(snapshot: Snapshot) -> LaserScan:
    assert snapshot.scan is not None  # noqa: S101  # Looked at by the caller.
    reading = snapshot.reading
    pose = None if reading is None else (reading.pose.x_m, reading.pose.y_m, reading.pose.heading_rad)
    return LaserScan(snapshot.scan.ranges_m, pose)
