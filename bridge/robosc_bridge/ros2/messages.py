"""Conversion of a bridge's snapshots to messages of ROS 2.

Units and axes are those of REP 103 (ros.org/reps/rep-0103.html). The module needs the message packages,
but no middleware.
"""

import math
from array import array
from collections.abc import Iterable, Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, Imu, JointState, LaserScan

from robosc_bridge.ros2 import uncertainty
from robosc_bridge.ros2.diagnostics import Entry
from robosc_bridge.ros2.frames import Frames, Mounting
from robosc_bridge.terminal.client import DriveState, Scan

WHEEL_JOINTS = ("wheel_left_joint", "wheel_right_joint")
"""Joints of the wheels, called as a TurtleBot3's are."""

NODE = "robosc_bridge"
"""Name of the node, which stands before the entries of its diagnostics, as REP 107 wants it."""


def odometry(drive: DriveState, stamp_ns: int, frames: Frames, pose_covariance: Iterable[float]) -> Any:
    """Return a nav_msgs/Odometry.

    Args:
        drive: Reading as the bridge sends it.
        stamp_ns: Time of the reading.
        frames: Names of frames.
        pose_covariance: Covariance of the pose, row by row.
    """
    message = Odometry(child_frame_id=frames.of(frames.base))
    _set_header(message.header, stamp_ns, frames.of(frames.odom))
    pose, twist = message.pose.pose, message.twist.twist
    pose.position.x, pose.position.y = drive.pose.x_m, drive.pose.y_m
    pose.orientation.z, pose.orientation.w = _turned(drive.pose.heading_rad)
    twist.linear.x, twist.angular.z = drive.velocity.linear_m_s, drive.velocity.angular_rad_s
    message.pose.covariance = list(pose_covariance)
    variances = {
        name: value
        for name, value in (("linear", drive.linear_variance), ("angular", drive.angular_variance))
        if drive.HasField(f"{name}_variance") and math.isfinite(value)
    }
    message.twist.covariance = list(uncertainty.twist(**variances))
    return message


def moved(drive: DriveState, stamp_ns: int, frames: Frames) -> Any:
    """Return the robot in the frame of its odometry, as a geometry_msgs/TransformStamped."""
    message = TransformStamped(child_frame_id=frames.of(frames.base))
    _set_header(message.header, stamp_ns, frames.of(frames.odom))
    place = message.transform
    place.translation.x, place.translation.y = drive.pose.x_m, drive.pose.y_m
    place.rotation.z, place.rotation.w = _turned(drive.pose.heading_rad)
    return message


def mounted(mounting: Mounting, stamp_ns: int) -> Any:
    """Return a frame that does not move in another one, as a geometry_msgs/TransformStamped."""
    message = TransformStamped(child_frame_id=mounting.child)
    _set_header(message.header, stamp_ns, mounting.parent)
    place = message.transform.translation
    place.x, place.y, place.z = mounting.place.x_m, mounting.place.y_m, mounting.place.z_m
    return message


def joint_states(drive: DriveState, stamp_ns: int) -> Any | None:
    """Return a sensor_msgs/JointState of the wheels; None: their angles are not known."""
    if not (drive.HasField("left_wheel_m") and drive.HasField("right_wheel_m") and drive.wheel_radius_m > 0.0):
        return None
    radius_m = drive.wheel_radius_m
    message = JointState(name=list(WHEEL_JOINTS))
    _set_header(message.header, stamp_ns, "")
    message.position = [drive.left_wheel_m / radius_m, drive.right_wheel_m / radius_m]
    message.velocity = [drive.left_wheel_m_s / radius_m, drive.right_wheel_m_s / radius_m]
    return message


def imu(drive: DriveState, stamp_ns: int, frames: Frames) -> Any | None:
    """Return a sensor_msgs/Imu, in which -1 stands for what is not measured; None: nothing is."""
    orientation = _unit([drive.imu.get(f"orientation_{axis}", math.nan) for axis in "xyzw"])
    angular_velocity, linear_acceleration = (
        _vector(drive.imu, "angular_velocity"),
        _vector(drive.imu, "linear_acceleration"),
    )
    if orientation is None and angular_velocity is None and linear_acceleration is None:
        return None
    message = Imu()
    _set_header(message.header, stamp_ns, frames.of(frames.imu))
    message.orientation_covariance = _covariance(orientation, uncertainty.ORIENTATION_RAD2)
    message.angular_velocity_covariance = _covariance(angular_velocity, uncertainty.ANGULAR_VELOCITY_RAD2_S2)
    message.linear_acceleration_covariance = _covariance(linear_acceleration, uncertainty.LINEAR_ACCELERATION_M2_S4)
    if orientation is not None:
        to = message.orientation
        to.x, to.y, to.z, to.w = orientation
    if angular_velocity is not None:
        to = message.angular_velocity
        to.x, to.y, to.z = angular_velocity
    if linear_acceleration is not None:
        to = message.linear_acceleration
        to.x, to.y, to.z = linear_acceleration
    return message


def _vector(measured: Mapping[str, float], name: str) -> list[float] | None:
    found = [measured.get(f"{name}_{axis}", math.nan) for axis in "xyz"]
    return found if all(map(math.isfinite, found)) else None


def _unit(quaternion: list[float]) -> list[float] | None:
    length = math.hypot(*quaternion)
    # A sensor that has not begun to measure reports zeros.
    return [part / length for part in quaternion] if math.isfinite(length) and length > 0.5 else None


def _covariance(measured: list[float] | None, variance: float) -> list[float]:
    return list(uncertainty.UNKNOWN if measured is None else uncertainty.diagonal(variance))


def battery_state(drive: DriveState, stamp_ns: int) -> Any | None:
    """Return a sensor_msgs/BatteryState, in which NaN stands for what is not measured; None: no voltage is known."""
    if not drive.HasField("battery_v"):
        return None
    message = BatteryState(voltage=drive.battery_v, present=True)
    _set_header(message.header, stamp_ns, "")
    message.percentage = drive.battery_share if drive.HasField("battery_share") else math.nan
    for name in ("temperature", "current", "charge", "capacity", "design_capacity"):
        setattr(message, name, math.nan)
    message.power_supply_status = BatteryState.POWER_SUPPLY_STATUS_UNKNOWN
    message.power_supply_health = BatteryState.POWER_SUPPLY_HEALTH_UNKNOWN
    message.power_supply_technology = BatteryState.POWER_SUPPLY_TECHNOLOGY_UNKNOWN
    return message


def laser_scan(scan: Scan, stamp_ns: int, frames: Frames) -> Any:
    """Return a sensor_msgs/LaserScan, whose ranges are by REP 117 (ros.org/reps/rep-0117.html).

    The ranges have no times of their own: each is the nearest of several measurements in one degree, and devices begin
    a revolution in different directions. So the stamp is the middle of the revolution.

    Args:
        scan: Revolution as the bridge sends it.
        stamp_ns: Time when its last byte had come.
        frames: Names of frames.
    """
    count = len(scan.ranges_m)
    turn_s = 1.0 / scan.turns_per_s if math.isfinite(scan.turns_per_s) and scan.turns_per_s > 0.0 else 0.0
    most_m = scan.max_m if scan.max_m > 0.0 else math.inf
    message = LaserScan()
    _set_header(message.header, stamp_ns - round(turn_s / 2 * 1e9), frames.of(frames.scan))
    message.angle_increment = math.tau / count if count else 0.0
    message.angle_max = math.tau - message.angle_increment
    message.scan_time = turn_s
    message.range_min, message.range_max = scan.min_m, most_m
    message.ranges = array("f", [_range_m(range_m, scan.min_m, most_m) for range_m in scan.ranges_m])
    return message


def _range_m(range_m: float, min_m: float, max_m: float) -> float:
    """A range by REP 117; what is not a number is not measured, and neither far nor near."""
    if range_m > max_m:
        return math.inf
    return -math.inf if range_m < min_m else range_m


def diagnostics(entries: Iterable[Entry], stamp_ns: int, robot: str) -> Any:
    """Return a diagnostic_msgs/DiagnosticArray."""
    message = DiagnosticArray()
    _set_header(message.header, stamp_ns, "")
    message.status = [
        DiagnosticStatus(
            level=bytes((entry.level,)),
            name=f"{NODE}: {entry.name}",
            message=entry.message,
            hardware_id=robot,
            values=[KeyValue(key=key, value=value) for key, value in entry.values.items()],
        )
        for entry in entries
    ]
    return message


def _turned(angle_rad: float) -> tuple[float, float]:
    """The part along the axis, and w, of a quaternion."""
    return math.sin(angle_rad / 2), math.cos(angle_rad / 2)


def _set_header(header: Any, stamp_ns: int, frame: str) -> None:
    header.frame_id = frame
    header.stamp.sec, header.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
