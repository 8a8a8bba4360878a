"""Reports of a vehicle, as values in the axes of REP 103, and messages to it.

MAVLink counts yaw clockwise, y to the right and z down; here it is counter-clockwise, left and up. Sources:
mavlink.io (common messages) and ArduPilot Rover (`GCS_MAVLink_Rover.cpp`, `mode_guided.cpp`).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

GROUND_ROVER: int = dialect.MAV_TYPE_GROUND_ROVER
ARDUPILOT: int = dialect.MAV_AUTOPILOT_ARDUPILOTMEGA
NO_AUTOPILOT: int = dialect.MAV_AUTOPILOT_INVALID
AUTOPILOT: int = dialect.MAV_COMP_ID_AUTOPILOT1
ONBOARD_COMPUTER: int = dialect.MAV_COMP_ID_ONBOARD_COMPUTER
GROUND_STATIONS = frozenset({dialect.MAV_TYPE_GCS})
ARMED: int = dialect.MAV_MODE_FLAG_SAFETY_ARMED
CUSTOM_MODE: int = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
BODY_NED: int = dialect.MAV_FRAME_BODY_NED
LOCAL_NED: int = dialect.MAV_FRAME_LOCAL_NED
LOCAL_FRD: int = dialect.MAV_FRAME_LOCAL_FRD
BODY_FRD: int = dialect.MAV_FRAME_BODY_FRD
# All but the speeds and the yaw rate is to be ignored; that of accelerations must be said.
VELOCITY_AND_TURN_RATE: int = (
    dialect.POSITION_TARGET_TYPEMASK_X_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_Y_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_Z_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_VZ_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_AX_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_AY_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_AZ_IGNORE
    | dialect.POSITION_TARGET_TYPEMASK_YAW_IGNORE
)
# The dialect has no names for these three.
FORCE = 21196
UNKNOWN = 65535
CHUNK = 50
# Signal qualities of a distance: 0 is unknown, the others are shares.
_INVALID_SIGNAL = 1


class Mode(IntEnum):
    """Mode of ArduPilot Rover."""

    MANUAL = dialect.ROVER_MODE_MANUAL
    ACRO = dialect.ROVER_MODE_ACRO
    STEERING = dialect.ROVER_MODE_STEERING
    HOLD = dialect.ROVER_MODE_HOLD
    LOITER = dialect.ROVER_MODE_LOITER
    FOLLOW = dialect.ROVER_MODE_FOLLOW
    SIMPLE = dialect.ROVER_MODE_SIMPLE
    DOCK = dialect.ROVER_MODE_DOCK
    CIRCLE = dialect.ROVER_MODE_CIRCLE
    AUTO = dialect.ROVER_MODE_AUTO
    RTL = dialect.ROVER_MODE_RTL
    SMART_RTL = dialect.ROVER_MODE_SMART_RTL
    GUIDED = dialect.ROVER_MODE_GUIDED
    INITIALISING = dialect.ROVER_MODE_INITIALIZING


class MavCommand(IntEnum):
    """Command that a vehicle can be given, with its number."""

    SET_MODE = dialect.MAV_CMD_DO_SET_MODE
    FLIGHT_TERMINATION = dialect.MAV_CMD_DO_FLIGHTTERMINATION
    PAUSE_CONTINUE = dialect.MAV_CMD_DO_PAUSE_CONTINUE
    REBOOT_SHUTDOWN = dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
    ARM_DISARM = dialect.MAV_CMD_COMPONENT_ARM_DISARM
    RUN_PREARM_CHECKS = dialect.MAV_CMD_RUN_PREARM_CHECKS
    SET_MESSAGE_INTERVAL = dialect.MAV_CMD_SET_MESSAGE_INTERVAL
    REQUEST_MESSAGE = dialect.MAV_CMD_REQUEST_MESSAGE
    REQUEST_CAPABILITIES = dialect.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES


class Incoming(IntEnum):
    """Messages that a vehicle handles, with their numbers."""

    HEARTBEAT = dialect.MAVLINK_MSG_ID_HEARTBEAT
    PING = dialect.MAVLINK_MSG_ID_PING
    SET_MODE = dialect.MAVLINK_MSG_ID_SET_MODE
    PARAM_REQUEST_READ = dialect.MAVLINK_MSG_ID_PARAM_REQUEST_READ
    PARAM_REQUEST_LIST = dialect.MAVLINK_MSG_ID_PARAM_REQUEST_LIST
    PARAM_SET = dialect.MAVLINK_MSG_ID_PARAM_SET
    MISSION_REQUEST_LIST = dialect.MAVLINK_MSG_ID_MISSION_REQUEST_LIST
    MANUAL_CONTROL = dialect.MAVLINK_MSG_ID_MANUAL_CONTROL
    COMMAND_INT = dialect.MAVLINK_MSG_ID_COMMAND_INT
    COMMAND_LONG = dialect.MAVLINK_MSG_ID_COMMAND_LONG
    SET_POSITION_TARGET = dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED
    FILE_TRANSFER = dialect.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL
    TIMESYNC = dialect.MAVLINK_MSG_ID_TIMESYNC


class Result(IntEnum):
    """Answer to a command."""

    ACCEPTED = dialect.MAV_RESULT_ACCEPTED
    TEMPORARILY_REJECTED = dialect.MAV_RESULT_TEMPORARILY_REJECTED
    DENIED = dialect.MAV_RESULT_DENIED
    UNSUPPORTED = dialect.MAV_RESULT_UNSUPPORTED
    FAILED = dialect.MAV_RESULT_FAILED
    IN_PROGRESS = dialect.MAV_RESULT_IN_PROGRESS


class Telemetry(IntEnum):
    """Messages that a vehicle sends again and again, with their numbers."""

    SYS_STATUS = dialect.MAVLINK_MSG_ID_SYS_STATUS
    ATTITUDE = dialect.MAVLINK_MSG_ID_ATTITUDE
    LOCAL_POSITION = dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED
    DISTANCE_SENSOR = dialect.MAVLINK_MSG_ID_DISTANCE_SENSOR
    BATTERY_STATUS = dialect.MAVLINK_MSG_ID_BATTERY_STATUS
    NAMED_VALUE_FLOAT = dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT
    NAMED_VALUE_INT = dialect.MAVLINK_MSG_ID_NAMED_VALUE_INT
    OBSTACLE_DISTANCE = dialect.MAVLINK_MSG_ID_OBSTACLE_DISTANCE
    ODOMETRY = dialect.MAVLINK_MSG_ID_ODOMETRY


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """Sign of life of a system, and its state."""

    kind: int
    autopilot: int
    is_armed: bool
    mode: int


@dataclass(frozen=True, slots=True)
class Attitude:
    """Heading and yaw rate, counter-clockwise.

    Attributes:
        boot_s: Since the vehicle started.
        heading_rad: From north.
        yaw_rate_rad_s: Its rate.
    """

    boot_s: float
    heading_rad: float
    yaw_rate_rad_s: float


@dataclass(frozen=True, slots=True)
class LocalPosition:
    """Place and velocity in the world: x north, y west, in metres (per second)."""

    boot_s: float
    x_m: float
    y_m: float
    x_m_s: float
    y_m_s: float


@dataclass(frozen=True, slots=True)
class MotionEstimate:
    """Place and velocity as one estimate: x ahead of some first heading, y to its left.

    Attributes:
        x_m: Place.
        y_m: The same.
        heading_rad: Counter-clockwise.
        linear_m_s: Of the body, forward.
        angular_rad_s: Of the body, counter-clockwise.
        resets: Counts how often the estimate has jumped.
        place_s: Time of the place by the vehicle's clock, in seconds.
        heading_s: Time of the heading, likewise.
    """

    x_m: float
    y_m: float
    heading_rad: float
    linear_m_s: float
    angular_rad_s: float
    resets: int = 0
    place_s: float = field(default=0.0, compare=False)
    heading_s: float = field(default=0.0, compare=False)


class ChargeState(IntEnum):
    """Judgement of an autopilot on its battery (MAV_BATTERY_CHARGE_STATE), by its own failsafe parameters."""

    UNDEFINED = 0
    OK = 1
    LOW = 2
    CRITICAL = 3
    EMERGENCY = 4
    FAILED = 5
    UNHEALTHY = 6
    CHARGING = 7


@dataclass(frozen=True, slots=True)
class BatteryState:
    """State of a battery; None: not reported.

    Attributes:
        is_main: True if it is the summary that every vehicle sends, which is about the first battery.
        voltage_v: Voltage of the whole pack.
        share: Charge, 0 to 1.
        state: Judgement of the vehicle on it, one of `ChargeState` if it is known.
        number: Number of the battery.
    """

    is_main: bool
    voltage_v: float | None
    share: float | None
    state: int = ChargeState.UNDEFINED
    number: int = 0


@dataclass(frozen=True, slots=True)
class Text:
    """A text, or a piece of a long one.

    Attributes:
        severity: Severity, 0 emergency to 7 debug.
        data: Data as it came, without the zeros at its end; a piece may end within a character.
        number: Number of the long text; 0: it is a whole one.
        chunk: Number of the piece.
    """

    severity: int
    data: bytes
    number: int = 0
    chunk: int = 0

    @property
    def text(self) -> str:
        """For a person."""
        return self.data.decode("utf-8", errors="replace")

    @property
    def is_last(self) -> bool:
        """True if no piece follows."""
        return self.number == 0 or len(self.data) < CHUNK


@dataclass(frozen=True, slots=True)
class Answer:
    """Answer to a command; targets of 0: to everybody."""

    command: int
    result: int
    target_system: int
    target_component: int


@dataclass(frozen=True, slots=True)
class ObstacleRing:
    """Distances around, clockwise.

    Attributes:
        distances_cm: Distance of each sector: 0: something practically touches; `most_cm` + 1: nothing there; 65535:
            unknown.
        increment_deg: Angle between sectors; negative: counter-clockwise.
        offset_deg: Angle of the middle of the first one, clockwise.
        least_cm: Shortest that is valid.
        most_cm: Longest.
        is_body_fixed: True if counted from the front; else from north.
        kind: Kind of the sensor (MAV_DISTANCE_SENSOR).
    """

    distances_cm: tuple[int, ...]
    increment_deg: float
    offset_deg: float
    least_cm: int
    most_cm: int
    is_body_fixed: bool
    kind: int = 0


@dataclass(frozen=True, slots=True)
class SectorDistance:
    """One distance.

    Attributes:
        orientation: Direction: 0 ahead, and on clockwise in eighths of a revolution, as ArduPilot has it; others are no
            such direction.
        distance_cm: Measured distance; below the shortest one: something is nearer than it can measure.
        least_cm: Shortest that is valid.
        most_cm: Longest.
        width_deg: Width of what it sees; 0: unknown.
        number: Number of the sensor among those of its component.
        is_valid: False if the sensor itself marks its signal as invalid.
    """

    orientation: int
    distance_cm: int
    least_cm: int
    most_cm: int
    width_deg: float
    number: int = 0
    is_valid: bool = True


type Content = (
    Heartbeat
    | Attitude
    | LocalPosition
    | MotionEstimate
    | BatteryState
    | Text
    | Answer
    | ObstacleRing
    | SectorDistance
    | None
)


@dataclass(frozen=True, slots=True)
class Message:
    """Message with its sender; content None: nothing that is used here."""

    system: int
    component: int
    content: Content


def _finite(*values: float) -> tuple[float, ...]:
    if not all(map(math.isfinite, values)):
        raise ValueError("no numbers")
    return values


def _heartbeat(raw: Any) -> Heartbeat:
    return Heartbeat(raw.type, raw.autopilot, bool(raw.base_mode & ARMED), raw.custom_mode)


def _attitude(raw: Any) -> Attitude:
    yaw_rad, rate_rad_s = _finite(raw.yaw, raw.yawspeed)
    return Attitude(raw.time_boot_ms / 1000, -yaw_rad, -rate_rad_s)


def _local_position(raw: Any) -> LocalPosition:
    north_m, east_m, north_m_s, east_m_s = _finite(raw.x, raw.y, raw.vx, raw.vy)
    return LocalPosition(raw.time_boot_ms / 1000, north_m, -east_m, north_m_s, -east_m_s)


def _odometry(raw: Any) -> MotionEstimate | None:
    if raw.frame_id not in (LOCAL_NED, LOCAL_FRD) or raw.child_frame_id != BODY_FRD:
        return None
    w, x, y, z, *_ = _finite(*raw.q, raw.x, raw.y, raw.vx, raw.yawspeed)
    if not 0.9 < w * w + x * x + y * y + z * z < 1.1:
        raise ValueError("no attitude")
    if raw.quality < 0:
        raise ValueError("the odometry has failed")
    yaw_rad = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    time_s = raw.time_usec / 1e6
    return MotionEstimate(raw.x, -raw.y, -yaw_rad, raw.vx, -raw.yawspeed, raw.reset_counter, time_s, time_s)


def _share(percent: int) -> float | None:
    return None if percent < 0 else min(percent, 100) / 100


def _sys_status(raw: Any) -> BatteryState:
    voltage_v = None if raw.voltage_battery in (0, UNKNOWN) else raw.voltage_battery / 1000
    return BatteryState(True, voltage_v, _share(raw.battery_remaining))


def _battery_status(raw: Any) -> BatteryState:
    # A cell beyond ten with 0 is none.
    cells_mv = [cell_mv for cell_mv in (*raw.voltages, *raw.voltages_ext) if cell_mv != UNKNOWN]
    voltage_v = sum(cells_mv) / 1000 if any(cells_mv) else None
    return BatteryState(False, voltage_v, _share(raw.battery_remaining), raw.charge_state, raw.id)


def _text(raw: Any) -> Text:
    # The library's own `text` is ASCII: one character for each byte that is none, of a length of its own.
    return Text(raw.severity, bytes(raw._text_raw).partition(b"\0")[0], raw.id, raw.chunk_seq)


def _answer(raw: Any) -> Answer:
    return Answer(raw.command, raw.result, raw.target_system, raw.target_component)


def _obstacle_ring(raw: Any) -> ObstacleRing:
    fine_deg, offset_deg = _finite(raw.increment_f, raw.angle_offset)
    increment_deg = fine_deg or float(raw.increment)
    if not 0.01 <= abs(increment_deg) <= 180.0 or abs(offset_deg) > 720.0:
        raise ValueError("no such angle")
    is_body_fixed = raw.frame == BODY_FRD
    distances_cm = tuple(raw.distances)
    return ObstacleRing(
        distances_cm, increment_deg, offset_deg, raw.min_distance, raw.max_distance, is_body_fixed, raw.sensor_type
    )


def _distance(raw: Any) -> SectorDistance:
    (width_rad,) = _finite(raw.horizontal_fov)
    width_deg = min(max(math.degrees(width_rad), 0.0), 360.0)
    return SectorDistance(
        raw.orientation,
        raw.current_distance,
        raw.min_distance,
        raw.max_distance,
        width_deg,
        raw.id,
        raw.signal_quality != _INVALID_SIGNAL,
    )


READERS: Mapping[int, Callable[[Any], Content]] = {
    dialect.MAVLINK_MSG_ID_HEARTBEAT: _heartbeat,
    Telemetry.SYS_STATUS: _sys_status,
    Telemetry.ATTITUDE: _attitude,
    Telemetry.LOCAL_POSITION: _local_position,
    dialect.MAVLINK_MSG_ID_COMMAND_ACK: _answer,
    Telemetry.DISTANCE_SENSOR: _distance,
    Telemetry.BATTERY_STATUS: _battery_status,
    dialect.MAVLINK_MSG_ID_STATUSTEXT: _text,
    Telemetry.OBSTACLE_DISTANCE: _obstacle_ring,
    Telemetry.ODOMETRY: _odometry,
}
"""Readers of the contents of a message, by its number; a `ValueError` says that they cannot be."""


def own_heartbeat(codec: Any) -> Any:
    """Return the heartbeat of a companion computer."""
    return codec.heartbeat_encode(dialect.MAV_TYPE_ONBOARD_CONTROLLER, NO_AUTOPILOT, 0, 0, dialect.MAV_STATE_ACTIVE)


def command(
    system: int, component: int, number: MavCommand, confirmation: int, *parameters: float
) -> Callable[[Any], Any]:
    """Make a command.

    Args:
        system: System number of the vehicle.
        component: Its component number.
        number: Number of the command.
        confirmation: Number of times that it was sent before.
        parameters: Its first ones; the others are 0.
    """
    values = (*parameters, *(0.0,) * (7 - len(parameters)))
    return lambda codec: codec.command_long_encode(system, component, number, confirmation, *values)


def arming(is_armed: bool, is_forced: bool = False) -> tuple[float, ...]:
    """Parameters of `MavCommand.ARM_DISARM`."""
    return (float(is_armed), float(FORCE if is_forced else 0))


def entering(mode: Mode) -> tuple[float, ...]:
    """Parameters of `MavCommand.SET_MODE`."""
    return (float(CUSTOM_MODE), float(mode))


def velocity_target(
    system: int, component: int, boot_ms: int, linear_m_s: float, angular_rad_s: float
) -> Callable[[Any], Any]:
    """Make the velocity target that a rover in GUIDED follows until another comes or 3 s have passed.

    Args:
        system: System number of the vehicle.
        component: Its component number.
        boot_ms: Time since the sender started, in milliseconds.
        linear_m_s: Speed forward.
        angular_rad_s: Yaw rate, counter-clockwise.
    """
    # Adding zero makes the negative zero, whose bytes are not all zero, a positive one.
    speeds = (linear_m_s + 0.0, 0.0, 0.0)
    unused = (0.0, 0.0, 0.0)
    return lambda codec: codec.set_position_target_local_ned_encode(
        boot_ms, system, component, BODY_NED, VELOCITY_AND_TURN_RATE,
        *unused, *speeds, *unused, 0.0, -angular_rad_s + 0.0,
    )  # fmt: skip


def vehicle_message(raw: Any) -> Message:
    """Return the content of a vehicle's message of the library.

    Raises:
        ValueError: It says what cannot be.
    """
    number = raw.get_msgId()
    return Message(raw.get_srcSystem(), raw.get_srcComponent(), READERS[number](raw) if number in READERS else None)
