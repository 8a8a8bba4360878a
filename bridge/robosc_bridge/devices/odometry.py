"""Pose of a body, from the encoders of its wheels.

The equations are those of turtlebot3_node 2.3.6 (`odometry.cpp`): the way of the middle between the wheels, along the
heading halfway through the step.
"""

import math
from dataclasses import dataclass, field, replace

from robosc_bridge.devices.interface import Pose

_MODULUS = 2**32
# A restart moves the count by whole revolutions; half a revolution takes the fastest wheel 0.4 s.
_HALF_TURN = 2048


@dataclass(frozen=True, slots=True)
class Odometry:
    """An odometry after some readings; `advanced` gives the one after the next.

    The encoders wrap around at 2**32, which is handled, and fall back into one revolution when their motor restarts.
    The odometry cannot know whether one has: a jump is a reason to look, and `rebased` what follows from it.

    Attributes:
        tick_m: Way of a wheel in one tick.
        separation_m: Distance between the wheels, in metres.
        pose: Pose of the body.
        ticks: Ticks of the left and the right wheel in the last reading; None: the next one begins anew.
        wheels_m: Way of the left and the right wheel, backward ways subtracted.
    """

    tick_m: float
    separation_m: float
    pose: Pose = field(default_factory=Pose)
    ticks: tuple[int | None, int | None] = (None, None)
    wheels_m: tuple[float, float] = (0.0, 0.0)

    def advanced(self, left: int, right: int) -> "Odometry":
        """The odometry after another reading.

        Args:
            left: Ticks of the left wheel, signed or not.
            right: Of the right wheel.
        """
        left_m, right_m = (step * self.tick_m for step in self._steps(left, right))
        pose = _moved(self.pose, left_m, right_m, self.separation_m)
        wheels_m = self.wheels_m[0] + left_m, self.wheels_m[1] + right_m
        return replace(self, pose=pose, ticks=(left, right), wheels_m=wheels_m)

    def jumps(self, left: int, right: int) -> tuple[bool, bool]:
        """Return, for each wheel, True if it has gone so far that its motor may have restarted instead.

        Its way is counted since the last reading.
        """
        is_left, is_right = (abs(step) > _HALF_TURN for step in self._steps(left, right))
        return is_left, is_right

    def _steps(self, left: int, right: int) -> tuple[int, int]:
        return _step(self.ticks[0], left), _step(self.ticks[1], right)

    def rebased(self, is_left: bool = True, is_right: bool = True) -> "Odometry":
        """The odometry whose next reading is no motion of these wheels."""
        left, right = self.ticks
        return replace(self, ticks=(None if is_left else left, None if is_right else right))


def _step(before: int | None, now: int) -> int:
    """The shorter way from one count to the other, modulo 2**32."""
    if before is None:
        return 0
    return (now - before + _MODULUS // 2) % _MODULUS - _MODULUS // 2


def _moved(pose: Pose, left_m: float, right_m: float, separation_m: float) -> Pose:
    way_m = (left_m + right_m) / 2
    rotation_rad = (right_m - left_m) / separation_m
    middle_rad = pose.heading_rad + rotation_rad / 2
    return Pose(
        pose.x_m + way_m * math.cos(middle_rad),
        pose.y_m + way_m * math.sin(middle_rad),
        _wrapped(pose.heading_rad + rotation_rad),
    )


def _wrapped(angle_rad: float) -> float:
    """Within (-pi, pi]."""
    wrapped = math.remainder(angle_rad, 2 * math.pi)
    return math.pi if wrapped <= -math.pi else wrapped
