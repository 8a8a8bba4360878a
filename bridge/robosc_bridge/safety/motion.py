"""Limitation of velocities by the safety layer: pure functions, built on those of the drive bases."""

from robosc_bridge.devices.interface import Velocity
from robosc_bridge.devices.kinematics import wheel_speeds, within_limits
from robosc_bridge.safety.limits import SafetyLimits


def within(velocity: Velocity, limits: SafetyLimits) -> Velocity:
    """Return the velocity, reduced so that no part and no wheel is beyond its limit.

    Args:
        velocity: Velocity of any size; its parts are numbers.
        limits: Limits of the result.
    """
    return within_limits(velocity, limits, limits.separation_m)


def wheels(velocity: Velocity, limits: SafetyLimits) -> tuple[float, float]:
    """Speeds of the left and the right wheel, in metres per second."""
    return wheel_speeds(velocity, limits.separation_m)


def ramped(present: Velocity, wanted: Velocity, limits: SafetyLimits, step_s: float) -> Velocity:
    """The velocity after one step from the present towards the wanted one.

    Each part changes independently, so that braking never waits for the other part. On the way a wheel may be too fast:
    such velocities are reduced as in `within`.

    Args:
        present: Within the limits.
        wanted: Within the limits.
        limits: Of acceleration and deceleration.
        step_s: Not negative.
    """
    linear_m_s = _stepped(
        present.linear_m_s,
        wanted.linear_m_s,
        limits.linear_acceleration_m_s2 * step_s,
        limits.linear_deceleration_m_s2 * step_s,
    )
    angular_rad_s = _stepped(
        present.angular_rad_s,
        wanted.angular_rad_s,
        limits.angular_acceleration_rad_s2 * step_s,
        limits.angular_deceleration_rad_s2 * step_s,
    )
    return within(Velocity(linear_m_s, angular_rad_s), limits)


def _stepped(present: float, wanted: float, faster: float, slower: float) -> float:
    """One part after a step; a change of direction passes standstill, and has no more than one step to it."""
    if present < 0 or (present == 0 and wanted < 0):
        return -_stepped(-present, -wanted, faster, slower)
    if wanted >= present:
        return min(wanted, present + faster)
    return max(wanted, present - slower, 0.0)
