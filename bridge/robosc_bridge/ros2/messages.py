"""Readings of a bridge as messages of ROS 2, made with the classes that a node has.

Names, frames and units are those of a TurtleBot3 and of REP 103, 105 and 117. What is not known is said as these have
it: NaN, or a covariance whose first element is -1. Covariances of odometry are rough: what wheels do not measure has a
large one, so that a filter does not believe it.
"""

import math
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from robosc_bridge.terminal.client import DriveState, Scan, Snapshot, state_name
from robosc_bridge.terminal.formatting import STALE_S

ODOM, FOOTPRINT, IMU, SCANNER = "odom", "base_footprint", "imu_link", "base_scan"
JOINTS = ("wheel_left_joint", "wheel_right_joint")

_UNKNOWN = 1e6
_PLACE, _HEADING, _SPEED, _TURN = 1e-3, 1e-2, 1e-4, 1e-3
_OK, _WARN, _ERROR, _STALE = b"\x00", b"\x01", b"\x02", b"\x03"


@dataclass(frozen=True)
class Wheels:
    """Wheels of a robot.

    Attributes:
        radius_m: Radius of both.
        separation_m: Distance between them, in metres.
    """

    radius_m: float
    separation_m: float


@dataclass(frozen=True)
class Angles:
    """Angles of the wheels since the odometry began, and the pose that they were worked out from.

    Attributes:
        left_rad: Angle of the left wheel.
        right_rad: Angle of the right one.
        pose: x, y and heading; None: there was none yet.
    """

    left_rad: float = 0.0
    right_rad: float = 0.0
    pose: tuple[float, float, float] | None = None

    def after(self, drive: DriveState, wheels: Wheels) -> "Angles":
        """Return the angles after another reading: the bridge tells the pose, which is made from them."""
        pose = (drive.pose.x_m, drive.pose.y_m, drive.pose.heading_rad)
        if self.pose is None:
            return Angles(self.left_rad, self.right_rad, pose)
        rotation_rad = math.remainder(pose[2] - self.pose[2], 2 * math.pi)
        middle_rad = self.pose[2] + rotation_rad / 2
        chord_m = (pose[0] - self.pose[0]) * math.cos(middle_rad) + (pose[1] - self.pose[1]) * math.sin(middle_rad)
        half_m = rotation_rad * wheels.separation_m / 2
        return Angles(
            self.left_rad + (chord_m - half_m) / wheels.radius_m,
            self.right_rad + (chord_m + half_m) / wheels.radius_m,
            pose,
        )


def _planar(quaternion: Any, heading_rad: float) -> None:
    quaternion.z, quaternion.w = math.sin(heading_rad / 2), math.cos(heading_rad / 2)


def _diagonal(x: float, y: float, yaw: float) -> list[float]:
    found = [0.0] * 36
    for place, value in enumerate((x, y, _UNKNOWN, _UNKNOWN, _UNKNOWN, yaw)):
        found[7 * place] = value
    return found


def odometry(make: Any, stamp: Any, drive: DriveState) -> Any:
    """Return a `nav_msgs/Odometry`."""
    message = make()
    message.header.stamp, message.header.frame_id, message.child_frame_id = stamp, ODOM, FOOTPRINT
    message.pose.pose.position.x, message.pose.pose.position.y = drive.pose.x_m, drive.pose.y_m
    _planar(message.pose.pose.orientation, drive.pose.heading_rad)
    message.pose.covariance = _diagonal(_PLACE, _PLACE, _HEADING)
    message.twist.twist.linear.x = drive.velocity.linear_m_s
    message.twist.twist.angular.z = drive.velocity.angular_rad_s
    # No wheel goes sideways.
    message.twist.covariance = _diagonal(_SPEED, _SPEED, _TURN)
    return message


def transform(make: Any, stamp: Any, drive: DriveState) -> Any:
    """Return a `geometry_msgs/TransformStamped` from `ODOM` to `FOOTPRINT`."""
    message = make()
    message.header.stamp, message.header.frame_id, message.child_frame_id = stamp, ODOM, FOOTPRINT
    message.transform.translation.x, message.transform.translation.y = drive.pose.x_m, drive.pose.y_m
    _planar(message.transform.rotation, drive.pose.heading_rad)
    return message


def joint_states(make: Any, stamp: Any, drive: DriveState, angles: Angles, wheels: Wheels) -> Any:
    """Return a `sensor_msgs/JointState` of the wheels."""
    message = make()
    message.header.stamp = stamp
    message.name = list(JOINTS)
    message.position = [angles.left_rad, angles.right_rad]
    message.velocity = [speed / wheels.radius_m for speed in (drive.left_wheel_m_s, drive.right_wheel_m_s)]
    return message


def imu(make: Any, stamp: Any, measured: Mapping[str, float]) -> Any | None:
    """Return a `sensor_msgs/Imu`; None: nothing of it is measured."""
    parts = (
        ("orientation", "wxyz", 0),
        ("angular_velocity", "xyz", 0),
        ("linear_acceleration", "xyz", 0),
    )
    message = make()
    message.header.stamp, message.header.frame_id = stamp, IMU
    has_any = False
    for quantity, axes, first in parts:
        names = [f"{quantity}_{axis}" for axis in axes]
        covariance = [0.0] * 9
        # Of a quantity, each axis counts that is measured; the others are told by a large covariance.
        if any(name in measured for name in names) and (quantity != "orientation" or set(names) <= set(measured)):
            has_any = True
            for axis, name in zip(axes, names, strict=True):
                setattr(getattr(message, quantity), axis, measured.get(name, 0.0))
            known = [f"{quantity}_{axis}" in measured for axis in "xyz"]
            covariance[0], covariance[4], covariance[8] = (_HEADING if one else _UNKNOWN for one in known)
        else:
            covariance[first] = -1.0
        setattr(message, f"{quantity}_covariance", covariance)
    return message if has_any else None


def battery_state(make: Any, stamp: Any, drive: DriveState) -> Any | None:
    """Return a `sensor_msgs/BatteryState`; None: nothing is known of the battery."""
    if not drive.HasField("battery_v"):
        return None
    message = make()
    message.header.stamp = stamp
    message.voltage = drive.battery_v
    message.percentage = drive.battery_share if drive.HasField("battery_share") else math.nan
    for name in ("temperature", "current", "charge", "capacity", "design_capacity"):
        setattr(message, name, math.nan)
    message.present = True
    return message


def laser_scan(make: Any, stamp: Any, scan: Scan) -> Any:
    """Return a `sensor_msgs/LaserScan`, one degree after the other, counter-clockwise from the front."""
    message = make()
    message.header.stamp, message.header.frame_id = stamp, SCANNER
    count = len(scan.ranges_m)
    message.angle_increment = 2 * math.pi / count
    message.angle_max = 2 * math.pi * (count - 1) / count
    turn_s = 1 / scan.turns_per_s if scan.turns_per_s > 0 else 0.0
    message.scan_time, message.time_increment = turn_s, turn_s / count
    message.range_min, message.range_max = scan.min_m, scan.max_m or math.inf
    message.ranges = array("f", scan.ranges_m)
    return message


def diagnostics(make: Any, make_status: Any, make_value: Any, stamp: Any, snapshot: Snapshot | None, lost: str) -> Any:
    """Return a `diagnostic_msgs/DiagnosticArray`.

    Args:
        make: The class.
        make_status: Class of a `DiagnosticStatus`.
        make_value: Class of a `KeyValue`.
        stamp: Time of the message.
        snapshot: The latest; None: there is none.
        lost: Reason why the bridge is not reached; empty: it is.
    """

    def status(name: str, level: bytes, text: str, values: Mapping[str, Any] | None = None) -> Any:
        found = make_status()
        found.name, found.level, found.message, found.hardware_id = (
            f"robosc_bridge: {name}",
            level,
            text,
            "robosc_bridge",
        )
        found.values = [make_value(key=key, value=str(value)) for key, value in (values or {}).items()]
        return found

    message = make()
    message.header.stamp = stamp
    if lost or snapshot is None:
        message.status = [status("bridge", _ERROR, lost or "the bridge's loop has not turned yet")]
        return message
    message.status = [status("bridge", *_level(snapshot), _times(snapshot))]
    counts = {line.device: dict(line.counts) for line in snapshot.lines}
    for device in snapshot.devices:
        level, text = (_OK, "works") if device.works else (_ERROR, "is not there")
        message.status.append(status(device.name, level, text, counts.get(device.name)))
    if snapshot.HasField("drive"):
        drive = snapshot.drive
        faults = ", ".join(drive.faults)
        values = {"torque": "on" if drive.is_torque_on else "off"}
        message.status.append(status("motors", _ERROR if faults else _OK, faults or "no fault", values))
    return message


def _level(snapshot: Snapshot) -> tuple[bytes, str]:
    texts = [*(item.text for item in snapshot.reasons), *(item.text for item in snapshot.warnings), *snapshot.stops]
    text = ": ".join([state_name(snapshot), *([snapshot.problem] if snapshot.problem else []), *texts[:3]])
    if snapshot.age_s > STALE_S:
        return _STALE, f"the bridge's loop hangs; {text}"
    if snapshot.problem:
        return _ERROR, text
    return (_WARN if texts else _OK), text


def _times(snapshot: Snapshot) -> dict[str, str]:
    return {
        f"{one.name} {name}": f"{1e3 * getattr(one, f'{name}_s'):.1f} ms"
        for one in snapshot.latencies
        if one.count
        for name in ("p50", "p99", "max")
    }


def stamps(now_ns: int, ages_s: Sequence[float]) -> list[tuple[int, int]]:
    """Return seconds and nanoseconds of things of some ages."""
    return [divmod(max(now_ns - round(age_s * 1e9), 0), 1_000_000_000) for age_s in ages_s]
