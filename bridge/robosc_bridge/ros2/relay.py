"""Relay of a bridge's snapshots: it passes on new and fresh readings, with their times by the ROS clock."""

import math
import threading
from dataclasses import replace
from typing import Protocol

from robosc_bridge.ros2.clock_offset import ClockOffset, LocalClocks
from robosc_bridge.ros2.diagnostics import Entry, Link, entries
from robosc_bridge.ros2.uncertainty import PlanarPose, PoseUncertainty, reported_pose
from robosc_bridge.terminal.client import Definition, DriveState, Scan, Snapshot, WatchResponse

STALE_S = 0.5
"""A reading or scan that is older says nothing about now, and is not published."""

SILENCE_S = 2.5
"""A bridge sends something at least once a second: one that sends nothing for this long hangs, or is cut off."""

BATTERY_S = 1.0
"""Time between two messages about the battery."""

_CLOCK_SET_NS = 1_000_000_000


class EarlierBridgeError(Exception):
    """The bridge is of an earlier version, which does not send the times of its readings; one sentence for a person."""


class Outlet(Protocol):
    """Receiver of the messages; stamps are in nanoseconds since 1970-01-01 UTC."""

    def know(self, turtlebot: str, scanner: tuple[float, float] | None) -> None:
        """Take the TurtleBot3 that a bridge drives; empty: another robot."""

    def put_drive(self, drive: DriveState, stamp_ns: int, pose_covariance: tuple[float, ...]) -> None:
        """Take another reading of the drive base."""

    def put_battery(self, drive: DriveState, stamp_ns: int) -> None:
        """Take another reading of the battery."""

    def put_scan(self, scan: Scan, stamp_ns: int) -> None:
        """Take another revolution of the LiDAR."""

    def put_diagnostics(self, reported: tuple[Entry, ...], stamp_ns: int, robot: str) -> None:
        """Take the present state."""


class Relay:
    """Relay of a bridge's readings; its methods may be called from any thread.

    Args:
        address: Address of the bridge, for diagnostics.
        outlet: Outlet that messages go to.
        clocks: Clocks of this computer.
    """

    def __init__(self, address: str, outlet: Outlet, clocks: LocalClocks | None = None) -> None:
        self._outlet = outlet
        self._clocks = clocks or LocalClocks()
        self._lock = threading.Lock()
        self._link = Link(address, problem="The bridge has not answered yet.")
        self._offset = ClockOffset()
        self._heard_s = 0.0
        self._snapshot: Snapshot | None = None
        self._uncertainty = PoseUncertainty()
        self._read_s, self._turned_s, self._battery_s = -math.inf, -math.inf, -math.inf
        self._stamps_ns: dict[str, int] = {}

    def connect(self, definition: Definition) -> None:
        """Note that a bridge answers, which may be another one than before, or a restarted one."""
        with self._lock:
            has_place = definition.HasField("scanner_x_m") and definition.HasField("scanner_y_m")
            scanner = (definition.scanner_x_m, definition.scanner_y_m) if has_place else None
            self._outlet.know(definition.turtlebot, scanner)
            self._link = replace(self._link, robot=definition.robot, version=definition.version, problem="")
            self._offset = ClockOffset()
            self._heard_s = self._clocks.monotonic()
            self._snapshot = None
            self._read_s = self._turned_s = self._battery_s = -math.inf

    def lose(self, why: str) -> None:
        """Note that the bridge does not answer.

        Args:
            why: Reason, one sentence.
        """
        with self._lock:
            self._link = replace(self._link, problem=why)

    def take(self, response: WatchResponse) -> None:
        """Pass on the news in a response of a bridge.

        Raises:
            EarlierBridgeError: The bridge does not send the times of its readings.
        """
        with self._lock:
            if response.sent_s <= 0.0:
                raise EarlierBridgeError(
                    f"the bridge at {self._link.address} is of an earlier version ({self._link.version}), which does "
                    "not send the times of its readings: update it"
                )
            self._heard_s = self._clocks.monotonic()
            self._offset.add(response.sent_s, self._heard_s)
            if response.HasField("snapshot"):
                self._snapshot = response.snapshot
                if response.snapshot.HasField("drive"):
                    self._take_drive(response.snapshot.drive)
            if response.HasField("scan"):
                self._take_scan(response.scan)

    def _take_drive(self, drive: DriveState) -> None:
        if drive.time_s == self._read_s:
            return
        self._read_s = drive.time_s
        pose, velocity = drive.pose, drive.velocity
        measured = (pose.x_m, pose.y_m, pose.heading_rad, velocity.linear_m_s, velocity.angular_rad_s)
        if not all(map(math.isfinite, measured)):
            return
        # The robot has moved, whether or not that is published.
        self._uncertainty.move(PlanarPose(pose.x_m, pose.y_m, pose.heading_rad))
        stamp_ns = self._fresh("drive", drive.time_s)
        if stamp_ns is None:
            return
        covariance = reported_pose(drive.pose_covariance) or self._uncertainty.covariance()
        self._outlet.put_drive(drive, stamp_ns, covariance)
        if drive.time_s - self._battery_s >= BATTERY_S:
            self._battery_s = drive.time_s
            self._outlet.put_battery(drive, stamp_ns)

    def _take_scan(self, scan: Scan) -> None:
        if scan.time_s == self._turned_s:
            return
        self._turned_s = scan.time_s
        stamp_ns = self._fresh("scan", scan.time_s)
        if stamp_ns is not None:
            self._outlet.put_scan(scan, stamp_ns)

    def _fresh(self, what: str, time_s: float) -> int | None:
        """Return the stamp of something that is worth publishing; None: it is stale, or one of the same time was."""
        local_s = self._offset.local_s(time_s)
        if self._clocks.monotonic() - local_s > STALE_S:
            return None
        stamp_ns = self._clocks.stamp_ns(local_s)
        # The offset gets better, so that a time may turn out to be earlier than one that was reported before.
        # If it is much earlier, somebody has set the clock.
        if 0 <= self._stamps_ns.get(what, -_CLOCK_SET_NS) - stamp_ns < _CLOCK_SET_NS:
            return None
        self._stamps_ns[what] = stamp_ns
        return stamp_ns

    def report(self) -> None:
        """Publish the present state of the bridge."""
        with self._lock:
            silence_s = self._clocks.monotonic() - self._heard_s
            link, age_s = self._link, 0.0
            if not link.problem and silence_s > SILENCE_S:
                link = replace(link, problem=f"Nothing has come from the bridge for {silence_s:.1f} s.")
            if self._snapshot is not None:
                age_s = self._snapshot.age_s + silence_s
            reported = entries(link, self._snapshot, age_s)
            self._outlet.put_diagnostics(reported, self._clocks.wall_ns(), link.robot)
