"""Pose of a body, from the encoders of its wheels and, if there is one, from a gyroscope.

The equations are those of turtlebot3_node 2.3.6 (`odometry.cpp`): the way of the middle between the wheels, along the
heading halfway through the step. The covariance is propagated after R. Siegwart, I. Nourbakhsh, D. Scaramuzza,
"Introduction to Autonomous Mobile Robots", 2nd ed., MIT Press 2011, section 5.2.4: the variance of a wheel's way grows
with the way.

Wheels that slip report a rotation that the body has not made, which a gyroscope does not; a gyroscope drifts while the
robot stands, which wheels do not. So the heading is a complementary filter of both: in each step, the rotation is the
mean of the two, each with the inverse of its variance as its weight (W. T. Higgins, "A comparison of complementary and
Kalman filtering", IEEE Transactions on Aerospace and Electronic Systems 11 (3), 1975: with independent white errors of
both this is the Kalman filter). In motion the gyroscope has most of the weight; at a standstill the wheels have all of
it.
"""

import math
from dataclasses import dataclass, field, replace

from robosc_bridge.devices.interface import Pose

_MODULUS = 2**32
# A restart moves the count by whole revolutions; half a revolution takes the fastest wheel 0.4 s.
_HALF_TURN = 2048
# Variance of a wheel's way for each metre of it: 1.5 cm after one metre, of slip and of a radius that is not exact.
_WHEEL_VARIANCE_M = 2e-4

Matrix = tuple[float, ...]
"""A symmetric matrix of x, y and heading, row by row."""

_CERTAIN: Matrix = (0.0,) * 9


@dataclass(frozen=True, slots=True)
class Rotation:
    """Rotation of the body in a step, measured by another sensor than its wheels.

    Attributes:
        angle_rad: Angle, counter-clockwise.
        variance_rad2: Variance of it.
    """

    angle_rad: float
    variance_rad2: float


@dataclass(frozen=True, slots=True)
class Odometry:
    """Odometry after some readings; `advanced` returns the one after the next.

    The encoders wrap around at 2**32, which is handled. After a restart of its motor, an encoder begins again within
    one revolution. The odometry cannot know whether a motor has restarted: after a jump, the driver must check, and
    use `rebased` if it has.

    Attributes:
        tick_m: Way of a wheel in one tick.
        separation_m: Distance between the wheels, in metres.
        pose: Pose of the body.
        covariance: Covariance of the pose.
        ticks: Ticks of the left and the right wheel in the last reading; None: the next one begins anew.
        wheels_m: Way of the left and the right wheel, backward ways subtracted.
    """

    tick_m: float
    separation_m: float
    pose: Pose = field(default_factory=Pose)
    ticks: tuple[int | None, int | None] = (None, None)
    wheels_m: tuple[float, float] = (0.0, 0.0)
    covariance: Matrix = _CERTAIN

    def advanced(self, left: int, right: int, measured: Rotation | None = None) -> "Odometry":
        """Return the odometry after another reading.

        Args:
            left: Ticks of the left wheel, signed or not.
            right: Of the right wheel.
            measured: Rotation since the last reading as a gyroscope measures it; None: there is none.
        """
        left_m, right_m = (step * self.tick_m for step in self._steps(left, right))
        left_m2, right_m2 = _WHEEL_VARIANCE_M * abs(left_m), _WHEEL_VARIANCE_M * abs(right_m)
        separation_m = self.separation_m
        way_m, rotation_rad = (left_m + right_m) / 2, (right_m - left_m) / separation_m
        way_m2, rotation_rad2 = (left_m2 + right_m2) / 4, (left_m2 + right_m2) / separation_m**2
        both = (right_m2 - left_m2) / (2 * separation_m)
        if measured is not None:
            weight = 0.0
            if rotation_rad2 > 0.0:
                weight = rotation_rad2 / (rotation_rad2 + measured.variance_rad2)
            rotation_rad += weight * (measured.angle_rad - rotation_rad)
            rotation_rad2 *= 1.0 - weight
            both *= 1.0 - weight
        pose = self.pose
        middle_rad = pose.heading_rad + rotation_rad / 2
        cosine, sine = math.cos(middle_rad), math.sin(middle_rad)
        moved = Pose(pose.x_m + way_m * cosine, pose.y_m + way_m * sine, _wrapped(pose.heading_rad + rotation_rad))
        covariance = _propagated(self.covariance, way_m, cosine, sine, (way_m2, rotation_rad2, both))
        wheels_m = self.wheels_m[0] + left_m, self.wheels_m[1] + right_m
        return replace(self, pose=moved, ticks=(left, right), wheels_m=wheels_m, covariance=covariance)

    def jumps(self, left: int, right: int) -> tuple[bool, bool]:
        """Return, for each wheel, True if it has gone so far that its motor may have restarted instead.

        The way of a wheel is counted since the last reading.
        """
        is_left, is_right = (abs(step) > _HALF_TURN for step in self._steps(left, right))
        return is_left, is_right

    def _steps(self, left: int, right: int) -> tuple[int, int]:
        return _step(self.ticks[0], left), _step(self.ticks[1], right)

    def rebased(self, is_left: bool = True, is_right: bool = True) -> "Odometry":
        """Return an odometry for which the next reading does not count as motion of these wheels."""
        left, right = self.ticks
        return replace(self, ticks=(None if is_left else left, None if is_right else right))


def _step(before: int | None, now: int) -> int:
    """The shorter way from one count to the other, modulo 2**32."""
    if before is None:
        return 0
    return (now - before + _MODULUS // 2) % _MODULUS - _MODULUS // 2


def _propagated(
    covariance: Matrix, way_m: float, cosine: float, sine: float, step: tuple[float, float, float]
) -> Matrix:
    """Return the covariance after a step.

    Args:
        covariance: Covariance before it.
        way_m: Way of the step.
        cosine: Cosine of the heading halfway through it.
        sine: Sine of the same.
        step: Variances of the way and of the rotation, and their covariance.
    """
    xx, xy, xh, _, yy, yh, _, _, hh = covariance
    way_m2, rotation_rad2, both = step
    # By the heading before it: the derivatives of x and y are these.
    to_x, to_y = -way_m * sine, way_m * cosine
    xx, xy, yy = (
        xx + 2 * to_x * xh + to_x * to_x * hh,
        xy + to_y * xh + to_x * yh + to_x * to_y * hh,
        yy + 2 * to_y * yh + to_y * to_y * hh,
    )
    xh, yh = xh + to_x * hh, yh + to_y * hh
    # By the step itself: the way along the heading, and half of the rotation across it.
    across_x, across_y = to_x / 2, to_y / 2
    xx += cosine * cosine * way_m2 + 2 * cosine * across_x * both + across_x * across_x * rotation_rad2
    xy += cosine * sine * way_m2 + (cosine * across_y + sine * across_x) * both + across_x * across_y * rotation_rad2
    yy += sine * sine * way_m2 + 2 * sine * across_y * both + across_y * across_y * rotation_rad2
    xh += cosine * both + across_x * rotation_rad2
    yh += sine * both + across_y * rotation_rad2
    hh += rotation_rad2
    return (xx, xy, xh, xy, yy, yh, xh, yh, hh)


def velocity_variances(left_m_s: float, right_m_s: float, raw_m_s: float, separation_m: float) -> tuple[float, float]:
    """Return the variances of the linear and the angular velocity that two wheels report.

    Args:
        left_m_s: Speed of the left wheel.
        right_m_s: Speed of the right wheel.
        raw_m_s: Unit in which the wheels report their speed; the error of a speed is one unit.
        separation_m: Distance between them.
    """
    # Variances of the wheels' ways after one metre.
    left, right = (raw_m_s**2 + _WHEEL_VARIANCE_M * speed**2 for speed in (left_m_s, right_m_s))
    return (left + right) / 4, (left + right) / separation_m**2


def _wrapped(angle_rad: float) -> float:
    """Within (-pi, pi]."""
    wrapped = math.remainder(angle_rad, 2 * math.pi)
    return math.pi if wrapped <= -math.pi else wrapped
