"""Where a body is, from the encoders of its wheels.

The equations are those of turtlebot3_node 2.3.6 (`odometry.cpp`): the way of the middle between the wheels, along the
heading halfway through the step.
"""

import math
from dataclasses import dataclass, field, replace

from robosc_bridge.devices.interface import Pose

_MODULUS = 2**32
# A wheel may be pushed faster than its motor turns it.
_FASTER = 1.25
# A restart moves the count by whole turns; half a turn takes the fastest wheel 0.4 s.
_HALF_TURN = 2048


@dataclass(frozen=True, slots=True)
class Odometry:
    """An odometry after some readings; `advanced` gives the one after the next.

    Attributes:
        tick_m: Way of a wheel in one tick.
        separation_m: Between the wheels.
        fastest_m_s: Of a wheel.
        pose: Where the body is.
        ticks: Of the left and the right wheel in the last reading; None: the next one begins anew.
        time_s: Of the last reading.
        rebases: How often a wheel began anew, since it cannot have moved as far as its encoder says.
    """

    tick_m: float
    separation_m: float
    fastest_m_s: float
    pose: Pose = field(default_factory=Pose)
    ticks: tuple[int | None, int | None] = (None, None)
    time_s: float = 0.0
    rebases: int = 0

    def advanced(self, left: int, right: int, time_s: float) -> "Odometry":
        """The odometry after another reading.

        The encoders wrap around at 2**32, and fall back into one turn when their motor restarts. Such a jump is no
        motion: that wheel then counts from its new place on.

        Args:
            left: Ticks of the left wheel, signed or not.
            right: Of the right wheel.
            time_s: When they were read.
        """
        most = max(_HALF_TURN, int((time_s - self.time_s) * self.fastest_m_s * _FASTER / self.tick_m))
        steps = [_step(before, now) for before, now in zip(self.ticks, (left, right), strict=True)]
        jumps = sum(abs(step) > most for step in steps)
        ways_m = [0.0 if abs(step) > most else step * self.tick_m for step in steps]
        return replace(
            self,
            pose=_moved(self.pose, ways_m[0], ways_m[1], self.separation_m),
            ticks=(left, right),
            time_s=time_s,
            rebases=self.rebases + jumps,
        )

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
    turn_rad = (right_m - left_m) / separation_m
    middle_rad = pose.heading_rad + turn_rad / 2
    return Pose(
        pose.x_m + way_m * math.cos(middle_rad),
        pose.y_m + way_m * math.sin(middle_rad),
        _wrapped(pose.heading_rad + turn_rad),
    )


def _wrapped(angle_rad: float) -> float:
    """Within (-pi, pi]."""
    wrapped = math.remainder(angle_rad, 2 * math.pi)
    return math.pi if wrapped <= -math.pi else wrapped
