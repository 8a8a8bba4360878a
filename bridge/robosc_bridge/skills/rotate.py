"""Rotates the robot by an angle, in a closed loop on the heading of its odometry.

The speed is the least of three: the limit; the speed from which the robot can brake in time, v = sqrt(2 a r); and the
remaining angle times the gain, so that a line with a delay of up to 1/(e * gain) seconds leads to no overshoot (the
critical gain of a pure integrator with dead time; K. J. Astrom and T. Hagglund, "PID Controllers: Theory, Design, and
Tuning", 2nd edition, 1995).
"""

import math
from enum import StrEnum

from robosc_bridge.devices.interface import STANDSTILL, Velocity
from robosc_bridge.skills.settings import RotateSettings

MAXIMUM_ANGLE_RAD = 200 * math.pi
"""A hundred revolutions; a larger angle is one in a mistaken unit."""


class RotateState(StrEnum):
    """Progress of a rotation."""

    IDLE = "idle"
    TURNING = "turning"
    DONE = "done"
    FAILED = "failed"


class Rotate:
    """A rotation by an angle of any size, either way; one at a time.

    Attributes:
        state: Progress of the rotation; `DONE` and `FAILED` stay until the next `start`.
        reason: Reason why it failed; empty: it did not fail.
        remaining_rad: Angle left to rotate, counter-clockwise above zero; 0 before the first rotation.

    Args:
        settings: Limits and tolerances.
    """

    def __init__(self, settings: RotateSettings) -> None:
        self.state = RotateState.IDLE
        self.reason = ""
        self.remaining_rad = 0.0
        self._settings = settings
        self._end_s = 0.0
        self._heading_rad: float | None = None
        self._settled_s: float | None = None

    @property
    def is_rotating(self) -> bool:
        """True if a rotation is under way."""
        return self.state is RotateState.TURNING

    def start(self, angle_rad: float, time_s: float) -> bool:
        """Begin a rotation at the next heading that comes.

        Args:
            angle_rad: Angle, counter-clockwise above zero. The rotation fails at once if the angle is not finite or
                beyond `MAXIMUM_ANGLE_RAD`.
            time_s: Current time, in seconds.

        Returns:
            True if the rotation begins; False: another rotation is under way and goes on.
        """
        if self.is_rotating:
            return False
        self.reason = ""
        self.remaining_rad = 0.0
        self._heading_rad = None
        self._settled_s = None
        if not abs(angle_rad) <= MAXIMUM_ANGLE_RAD:
            self._fail(f"an angle of {angle_rad:g} rad is beyond a hundred revolutions")
            return True
        self.remaining_rad = angle_rad
        self._end_s = time_s + 2 * abs(angle_rad) / self._settings.speed_rad_s + self._settings.patience_s
        self.state = RotateState.TURNING
        return True

    def cancel(self, reason: str) -> None:
        """End the rotation under way as failed."""
        if self.is_rotating:
            self._fail(reason)

    def update(self, heading_rad: float | None, time_s: float) -> Velocity:
        """Return the velocity to request now; a standstill unless a rotation is under way.

        Args:
            heading_rad: Heading of the odometry, with any number of revolutions; None: there is no new one. Between two
                headings the robot must rotate by less than half a revolution.
            time_s: Current time, in seconds.
        """
        if not self.is_rotating:
            return STANDSTILL
        is_known = heading_rad is not None and math.isfinite(heading_rad)
        if heading_rad is not None and is_known:
            self._follow(heading_rad)
            if self._has_settled(time_s):
                self.state = RotateState.DONE
                return STANDSTILL
        if time_s >= self._end_s:
            self._fail("the rotation has taken too long" if self._heading_rad is not None else "there is no odometry")
            return STANDSTILL
        # The remaining rotation is unknown without a heading.
        return Velocity(0.0, self._speed_rad_s()) if is_known else STANDSTILL

    def _follow(self, heading_rad: float) -> None:
        if self._heading_rad is not None:
            self.remaining_rad -= math.remainder(heading_rad - self._heading_rad, math.tau)
        self._heading_rad = heading_rad

    def _has_settled(self, time_s: float) -> bool:
        if abs(self.remaining_rad) > self._settings.tolerance_rad:
            self._settled_s = None
            return False
        if self._settled_s is None:
            self._settled_s = time_s
        return time_s - self._settled_s >= self._settings.settle_s

    def _speed_rad_s(self) -> float:
        left_rad, settings = abs(self.remaining_rad), self._settings
        if left_rad <= settings.tolerance_rad:
            return 0.0
        braked = math.sqrt(2 * settings.braking_rad_s2 * left_rad)
        speed = max(min(braked, settings.gain_per_s * left_rad), settings.slowest_rad_s)
        return math.copysign(min(speed, settings.speed_rad_s), self.remaining_rad)

    def _fail(self, reason: str) -> None:
        self.state = RotateState.FAILED
        self.reason = reason
