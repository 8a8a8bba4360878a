"""Pose of a vehicle since it was first seen, from the estimate that its autopilot reports.

The estimate of an autopilot starts where its estimator began, and it may jump: when it is reset, when the vehicle
restarts, or when another message begins to report it. A jump does not count as motion.
"""

import math
from dataclasses import dataclass, field, replace

from robosc_bridge.devices.interface import DriveLimits, Pose, Velocity
from robosc_bridge.devices.mavlink_state import Timestamped, VehicleState
from robosc_bridge.devices.plausibility import Verdict, body_judge
from robosc_bridge.protocol.mavlink_messages import MotionEstimate

_NO_LONGER_S = 0.5
# No vehicle counts its resets so: going from one source to the other is a jump.
_NO_ODOMETRY = -1


def estimate(state: VehicleState) -> Timestamped[MotionEstimate] | None:
    """The newest estimate, and when the older of its parts came; None: there is none yet.

    Place and attitude are used instead if ODOMETRY does not come, or no longer comes.
    """
    pair = _of_place_and_attitude(state)
    if state.motion is None or (pair is not None and pair.time_s - state.motion.time_s > _NO_LONGER_S):
        return pair
    return state.motion


def _of_place_and_attitude(state: VehicleState) -> Timestamped[MotionEstimate] | None:
    if state.position is None or state.attitude is None:
        return None
    place, attitude = state.position.content, state.attitude.content
    cosine, sine = math.cos(attitude.heading_rad), math.sin(attitude.heading_rad)
    motion = MotionEstimate(
        place.x_m,
        place.y_m,
        attitude.heading_rad,
        place.x_m_s * cosine + place.y_m_s * sine,
        attitude.yaw_rate_rad_s,
        _NO_ODOMETRY,
        place.boot_s,
        attitude.boot_s,
    )
    return Timestamped(min(state.position.time_s, state.attitude.time_s), motion)


@dataclass(frozen=True, slots=True)
class VehicleOdometry:
    """Odometry after some estimates; `advanced` returns the one after the next.

    Attributes:
        pose: Pose of the body.
        velocity: Velocity of the body.
        last: The last estimate; None: the next one is no motion.
        rebases: Number of jumps of the estimate.
    """

    pose: Pose = field(default_factory=Pose)
    velocity: Velocity = field(default_factory=Velocity)
    last: MotionEstimate | None = None
    rebases: int = 0

    def advanced(self, motion: MotionEstimate) -> "VehicleOdometry":
        """Return the odometry after another estimate."""
        velocity = Velocity(motion.linear_m_s, motion.angular_rad_s)
        last = self.last
        if last is None or last.resets != motion.resets:
            jumps = self.rebases + (last is not None)
            return replace(self, velocity=velocity, last=motion, rebases=jumps)
        # The step, as seen along the vehicle's heading then, is the same in both frames.
        rotation_rad = self.pose.heading_rad - last.heading_rad
        x_m, y_m = motion.x_m - last.x_m, motion.y_m - last.y_m
        heading_rad = math.remainder(motion.heading_rad + rotation_rad, 2 * math.pi)
        pose = Pose(
            self.pose.x_m + x_m * math.cos(rotation_rad) - y_m * math.sin(rotation_rad),
            self.pose.y_m + x_m * math.sin(rotation_rad) + y_m * math.cos(rotation_rad),
            math.pi if heading_rad <= -math.pi else heading_rad,
        )
        return replace(self, pose=pose, velocity=velocity, last=motion)

    def rebased(self) -> "VehicleOdometry":
        """Return an odometry for which the next estimate does not count as motion."""
        return replace(self, last=None)


class VehicleTracker:
    """Follows a vehicle by its estimates, of which those that cannot be do not count.

    Args:
        name: Name of the vehicle, for warnings.
        limits: Limits of what it is commanded.

    Attributes:
        odometry: Odometry so far.
        judge: Judge of the estimates.
        accepted: Last estimate that counts; None: there is none yet.
    """

    def __init__(self, name: str, limits: DriveLimits) -> None:
        self.odometry = VehicleOdometry()
        self.judge = body_judge(name, limits)
        self.accepted: Timestamped[MotionEstimate] | None = None
        self._seen: tuple[object, ...] = ()

    def begin_anew(self) -> None:
        """Let the next estimate be no motion, as after the vehicle was opened."""
        self.odometry = self.odometry.rebased()
        self.judge.forget()
        self.accepted, self._seen = None, ()

    def take(self, report: Timestamped[MotionEstimate] | None) -> bool:
        """Take the newest estimate, also again; return True if it is new and counts."""
        if report is None:
            return False
        motion = report.content
        seen = report.time_s, motion, motion.place_s, motion.heading_s
        if seen == self._seen:
            return False
        self._seen = seen
        last = self.odometry.last
        if last is not None and last.resets != motion.resets:
            # The vehicle itself says that it has begun anew.
            self.judge.forget()
        verdict = self.judge.judge(motion, report.time_s)
        if verdict is Verdict.REFUSED:
            return False
        if verdict is Verdict.ANEW:
            self.odometry = self.odometry.rebased()
        self.odometry = self.odometry.advanced(motion)
        self.accepted = report
        return True
