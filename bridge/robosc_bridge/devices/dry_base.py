"""A drive base that does everything except driving: torque stays off, and the velocities are reported instead.

Its readings contain the motion that the wheels would have made, so that a supervisor goes on as if the robot had moved;
the rest of a reading, such as the battery and the buttons, comes from the robot.
"""

import logging
import math
from collections.abc import Callable
from dataclasses import replace

from robosc_bridge.devices.interface import STANDSTILL, DriveBase, DriveLimits, DriveReading, Pose, Velocity

_log = logging.getLogger(__name__)


class DryBase:
    """A `DriveBase` whose wheels never turn.

    Args:
        base: The real drive base.
        separation_m: Distance between its wheels, in metres.
        clock: Clock that returns the time, in seconds.
    """

    def __init__(self, base: DriveBase, separation_m: float, clock: Callable[[], float]) -> None:
        self._base = base
        self._separation_m = separation_m
        self._clock = clock
        self._is_torque_wanted = False
        self._velocity = STANDSTILL
        self._reported: Velocity | None = None
        self._pose = Pose()
        self._moved_s = clock()

    @property
    def limits(self) -> DriveLimits:
        """Limits of the real one."""
        return self._base.limits

    @property
    def counters(self) -> object:
        """Counters of the real one's line; None: it has none."""
        return getattr(self._base, "counters", None)

    @property
    def leftover(self) -> str:
        """Text that says what the real one may still do after `close`."""
        return getattr(self._base, "leftover", "")

    def open(self) -> None:
        """Open the real one; it is left with torque off."""
        self._is_torque_wanted = False
        self._velocity, self._reported = STANDSTILL, None
        self._base.open()
        self._moved_s = self._clock()

    def set_torque(self, is_on: bool) -> None:
        """Record whether torque is wanted; nothing is sent to the motors."""
        self._is_torque_wanted = is_on
        self._velocity = STANDSTILL
        _log.info("dry run: the motors would %s", "hold" if is_on else "let go")

    def exchange(self, velocity: Velocity) -> DriveReading:
        """Read the drive base, and log the velocity instead of sending it."""
        reading = self._base.exchange(STANDSTILL)
        self._move(reading.time_s)
        self._velocity = velocity if self._is_torque_wanted else STANDSTILL
        shown = Velocity(round(self._velocity.linear_m_s, 2), round(self._velocity.angular_rad_s, 2))
        if shown != self._reported:
            self._reported = shown
            _log.info("dry run: it would drive at %.2f m/s, %.2f rad/s", shown.linear_m_s, shown.angular_rad_s)
        half_m_s = self._velocity.angular_rad_s * self._separation_m / 2
        return replace(
            reading,
            pose=self._pose,
            velocity=self._velocity,
            wheels_m_s=(self._velocity.linear_m_s - half_m_s, self._velocity.linear_m_s + half_m_s),
            is_torque_on=self._is_torque_wanted,
        )

    def _move(self, now_s: float) -> None:
        passed_s, self._moved_s = max(now_s - self._moved_s, 0.0), now_s
        way_m, rotation_rad = self._velocity.linear_m_s * passed_s, self._velocity.angular_rad_s * passed_s
        middle_rad = self._pose.heading_rad + rotation_rad / 2
        heading_rad = math.remainder(self._pose.heading_rad + rotation_rad, 2 * math.pi)
        self._pose = Pose(
            self._pose.x_m + way_m * math.cos(middle_rad),
            self._pose.y_m + way_m * math.sin(middle_rad),
            math.pi if heading_rad <= -math.pi else heading_rad,
        )

    def reset(self) -> None:
        """Do nothing: a reset of the real one switches torque on to see whether it holds."""
        self._is_torque_wanted = False

    def close(self) -> None:
        """Give the real one back."""
        self._base.close()
