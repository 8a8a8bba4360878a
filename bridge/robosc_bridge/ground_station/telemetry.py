"""State of the daemon, as messages that are sent again and again.

Each function returns a maker of a message for the library's codec, or None where there is nothing to report. Axes: the
robot's are x forward, y left, z up and rotations counter-clockwise (REP 103); MAVLink's are forward, right, down and
clockwise, so that y, z and rotations change their sign. Source: mavlink.io (common messages).
"""

import math
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from robosc_bridge.daemon.feed import Snapshot
from robosc_bridge.daemon.threads.reports import Device
from robosc_bridge.devices.interface import DriveReading, Scan
from robosc_bridge.ground_station.status import VehicleStatus
from robosc_bridge.protocol.mavlink_messages import BODY_FRD, GROUND_ROVER, LOCAL_FRD, UNKNOWN
from robosc_bridge.protocol.mavlink_obstacles import RING_STEP_DEG, ring_distances_cm
from robosc_bridge.safety import Caution, Reason

type Make = Callable[[Any], Any]
"""Makes a message with the library's codec."""

_MOTORS: int = dialect.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
_BATTERY: int = dialect.MAV_SYS_STATUS_SENSOR_BATTERY
_PROXIMITY: int = dialect.MAV_SYS_STATUS_SENSOR_PROXIMITY
# The robot has no fence; MAVProxy takes one that is not healthy for broken, whether it is present or not.
_FENCE: int = dialect.MAV_SYS_STATUS_GEOFENCE
_NO_TEMPERATURE = 32767


def heartbeat(status: VehicleStatus) -> Make:
    """Make the heartbeat with the status."""
    return lambda codec: codec.heartbeat_encode(
        GROUND_ROVER, dialect.MAV_AUTOPILOT_GENERIC, status.base_mode, int(status.mode), int(status.system_status)
    )


def _percent(reading: DriveReading | None) -> int:
    share = None if reading is None else reading.battery_share
    return -1 if share is None or not math.isfinite(share) else round(min(max(share, 0.0), 1.0) * 100)


def _millivolts(reading: DriveReading | None) -> int:
    volts = None if reading is None else reading.battery_v
    return UNKNOWN if volts is None or not 0.0 <= volts < UNKNOWN / 1000 else round(volts * 1000)


def sys_status(snapshot: Snapshot, bad_packets: int) -> Make:
    """Make the message about the presence and health of the parts, and the battery.

    Args:
        snapshot: Latest snapshot.
        bad_packets: Number of received packets that were ignored.
    """
    devices, reading = snapshot.devices, snapshot.reading
    present = _MOTORS | (_PROXIMITY if Device.SCANNER in devices else 0)
    health = _MOTORS if devices.get(Device.DRIVE, False) else 0
    health |= _PROXIMITY if devices.get(Device.SCANNER, False) else 0
    if reading is not None and reading.faults:
        health &= ~_MOTORS
    if Reason.SCAN_STALE in snapshot.reasons:
        health &= ~_PROXIMITY
    if _millivolts(reading) != UNKNOWN:
        present |= _BATTERY
        health |= 0 if Reason.BATTERY_LOW in snapshot.reasons else _BATTERY
    overruns = min(snapshot.overruns, UNKNOWN)
    return lambda codec: codec.sys_status_encode(
        present, present, health & present | _FENCE, 0, _millivolts(reading), -1, _percent(reading), 0,
        min(bad_packets, UNKNOWN), overruns, 0, 0, 0,
    )  # fmt: skip


def battery_status(snapshot: Snapshot) -> Make | None:
    """The battery's own message; None: the drive base reports nothing about its battery."""
    reading = snapshot.reading
    millivolts = _millivolts(reading)
    if reading is None or (millivolts == UNKNOWN and _percent(reading) < 0):
        return None
    charge = dialect.MAV_BATTERY_CHARGE_STATE_OK
    if Reason.BATTERY_LOW in snapshot.reasons:
        charge = dialect.MAV_BATTERY_CHARGE_STATE_CRITICAL
    elif Caution.BATTERY in snapshot.warnings:
        charge = dialect.MAV_BATTERY_CHARGE_STATE_LOW
    return lambda codec: codec.battery_status_encode(
        0, dialect.MAV_BATTERY_FUNCTION_ALL, dialect.MAV_BATTERY_TYPE_LIPO, _NO_TEMPERATURE,
        [millivolts] + [UNKNOWN] * 9, -1, -1, -1,
        _percent(reading), 0, charge,
    )  # fmt: skip


def odometry(reading: DriveReading) -> Make:
    """Pose since the odometry began, and velocity of the body."""
    pose, velocity = reading.pose, reading.velocity
    half_rad = -pose.heading_rad / 2.0
    unknown = [math.nan] + [0.0] * 20
    return lambda codec: codec.odometry_encode(
        _microseconds(reading.time_s), LOCAL_FRD, BODY_FRD, pose.x_m, -pose.y_m + 0.0, 0.0,
        [math.cos(half_rad), 0.0, 0.0, math.sin(half_rad)], velocity.linear_m_s, 0.0, 0.0,
        0.0, 0.0, -velocity.angular_rad_s + 0.0, unknown, unknown, 0, dialect.MAV_ESTIMATOR_TYPE_NAIVE, 0,
    )  # fmt: skip


def attitude(reading: DriveReading, boot_ms: int) -> Make:
    """Heading from where the odometry began, and yaw rate."""
    return lambda codec: codec.attitude_encode(
        boot_ms, 0.0, 0.0, -reading.pose.heading_rad + 0.0, 0.0, 0.0, -reading.velocity.angular_rad_s + 0.0
    )


def local_position(reading: DriveReading, boot_ms: int) -> Make:
    """Position and velocity; north is the heading at the begin of the odometry."""
    pose, speed_m_s = reading.pose, reading.velocity.linear_m_s
    ahead, left = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
    return lambda codec: codec.local_position_ned_encode(
        boot_ms, pose.x_m, -pose.y_m + 0.0, 0.0, speed_m_s * ahead, -speed_m_s * left + 0.0, 0.0
    )


def obstacle_distance(scan: Scan, least_m: float, most_m: float) -> Make:
    """The nearest of each five degrees, clockwise from the front.

    Args:
        scan: A full revolution.
        least_m: Shortest distance that the LiDAR measures.
        most_m: Longest distance that the LiDAR measures.
    """
    least_cm, most_cm = math.ceil(least_m * 100 - 1e-6), int(most_m * 100 + 1e-6)
    distances_cm = ring_distances_cm(scan.ranges_m, least_cm, most_cm)
    return lambda codec: codec.obstacle_distance_encode(
        _microseconds(scan.time_s), dialect.MAV_DISTANCE_SENSOR_LASER, list(distances_cm), RING_STEP_DEG, least_cm,
        most_cm, float(RING_STEP_DEG), 0.0, BODY_FRD,
    )  # fmt: skip


def _microseconds(time_s: float) -> int:
    return max(int(time_s * 1e6), 0)
