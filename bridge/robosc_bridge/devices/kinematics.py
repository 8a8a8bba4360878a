"""Commands for two wheels that move the body as commanded, within the limits of the wheels.

The limits are applied in this order: the body's velocity is clamped; the speeds of the wheels are computed from it; if
one wheel is too fast, both are slowed by the same factor, which keeps the curvature; then the speeds are rounded to the
resolution of the device.
"""

import math
from typing import Protocol

from robosc_bridge.devices.interface import Velocity

_CM = 100  # OpenCR takes centimetres and hundredths of a radian per second.


class VelocityLimits(Protocol):
    """Limits of a body and its wheels: those of a drive base or of the safety layer."""

    @property
    def linear_m_s(self) -> float:
        """Fastest speed forward and backward."""

    @property
    def angular_rad_s(self) -> float:
        """Fastest rotation."""

    @property
    def wheel_m_s(self) -> float:
        """Fastest wheel."""


def clamped(velocity: Velocity, limits: VelocityLimits) -> Velocity:
    """Return the velocity with each part within its limit; a part that is not a number becomes zero.

    Args:
        velocity: Velocity of the body.
        limits: Limits of the body.
    """
    return Velocity(
        _clamped(velocity.linear_m_s, limits.linear_m_s), _clamped(velocity.angular_rad_s, limits.angular_rad_s)
    )


def _clamped(value: float, limit: float) -> float:
    # Comparing takes integers of any size, too, and nothing compares with what is not a number.
    return max(-limit, min(limit, value)) if -math.inf <= value <= math.inf else 0.0


def wheel_speeds(velocity: Velocity, separation_m: float) -> tuple[float, float]:
    """Speeds of the left and the right wheel, in metres per second."""
    rotation_m_s = velocity.angular_rad_s * separation_m / 2
    return velocity.linear_m_s - rotation_m_s, velocity.linear_m_s + rotation_m_s


def body_velocity(left_m_s: float, right_m_s: float, separation_m: float) -> Velocity:
    """Return the velocity of a body from the speeds of its wheels."""
    return Velocity((left_m_s + right_m_s) / 2, (right_m_s - left_m_s) / separation_m)


def within_limits(velocity: Velocity, limits: VelocityLimits, separation_m: float) -> Velocity:
    """The velocity within all limits, of the same curvature as the clamped one."""
    found = clamped(velocity, limits)
    fastest_m_s = max(abs(speed) for speed in wheel_speeds(found, separation_m))
    if fastest_m_s <= limits.wheel_m_s:
        return found
    factor = limits.wheel_m_s / fastest_m_s
    return Velocity(found.linear_m_s * factor, found.angular_rad_s * factor)


def wheel_goals(velocity: Velocity, limits: VelocityLimits, separation_m: float, raw_m_s: float) -> tuple[int, int]:
    """Return the goal velocities of the left and the right servo.

    Args:
        velocity: Velocity that the body should have.
        limits: Limits of the body.
        separation_m: Distance between the wheels, in metres.
        raw_m_s: Speed of a wheel in one unit of its servo's velocity.

    Returns:
        Goals in units of the servos' velocity, never beyond `limits.wheel_m_s`.
    """
    most = int(limits.wheel_m_s / raw_m_s + 1e-9)
    speeds = wheel_speeds(within_limits(velocity, limits, separation_m), separation_m)
    left, right = (max(-most, min(most, round(speed / raw_m_s))) for speed in speeds)
    return left, right


def opencr_words(velocity: Velocity, limits: VelocityLimits, separation_m: float) -> tuple[int, int]:
    """Return the words that command OpenCR, so that none of the board's own limits takes effect.

    Its firmware clamps both parts separately and then each wheel, which changes the curvature. It may also command a
    servo a goal beyond the servo's velocity limit: the servo ignores such a goal and keeps its last speed.

    Args:
        velocity: Velocity that the body should have.
        limits: Limits of the body.
        separation_m: Distance between the wheels, in metres.

    Returns:
        Hundredths of a metre per second and of a radian per second.
    """
    found = within_limits(velocity, limits, separation_m)
    linear = _word(found.linear_m_s, limits.linear_m_s)
    angular = _word(found.angular_rad_s, limits.angular_rad_s)

    def is_too_fast() -> bool:
        speeds = wheel_speeds(Velocity(linear / _CM, angular / _CM), separation_m)
        return max(map(abs, speeds)) > limits.wheel_m_s

    if is_too_fast():
        # Rounded up beyond the limit: the coarser word is rounded down, then the finer one.
        linear = math.trunc(found.linear_m_s * _CM + math.copysign(1e-9, found.linear_m_s))
    while is_too_fast():
        angular -= int(math.copysign(1, angular))
    return linear, angular


def _word(value: float, limit: float) -> int:
    most = int(limit * _CM + 1e-9)
    return max(-most, min(most, round(value * _CM)))
