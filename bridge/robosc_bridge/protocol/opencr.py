"""The control table of an OpenCR board with TurtleBot3's ROS 2 firmware: addresses and encoding.

Source: ROBOTIS-GIT/OpenCR 1.5.3, `turtlebot3_ros2`. Where turtlebot3_node 2.3.6 takes another type for a register, the
firmware's counts: illumination is two bytes (not a float), infrared four bytes (not a float), battery unsigned.
"""

import math
import struct
from dataclasses import dataclass

DEVICE = 200
MODEL_NUMBER = 0x5000
FIRMWARE = 5

MODEL_INFORMATION = 2
DEVICE_STATUS = 18
HEARTBEAT = 19
CALIBRATE_GYRO = 59
MOTORS_CONNECTED = 148
TORQUE = 149
COMMAND = 150
PROFILE_ACCELERATIONS = 174

NO_PROFILE = bytes(8)
"""Bytes written at `PROFILE_ACCELERATIONS`: both wheels as fast as they can."""

BLOCK_ADDRESS = 10
BLOCK_LENGTH = 172

_BLOCK = struct.Struct(
    "<I"  # 10: milliseconds since the start
    "4xbB6x"  # 18: device status, heartbeat
    "4?"  # 26: buttons, bumpers
    "H2xIf"  # 30: illumination, infrared, sonar
    "II"  # 42: battery
    "10x13f"  # 60: motion
    "8x2i2i2i"  # 120: currents, velocities, positions
    "4x2?"  # 148: motors connected, torque
    "i16xi"  # 150: command
    "8x"  # 174: profile accelerations
)
_COMMAND = struct.Struct("<i16xi")
MOTOR_ITEMS = frozenset({120, 124, 128, 132, 136, 140})
"""Addresses of what the motors report, four bytes each; the board does not answer with parts of an item."""

_TRUTH_VALUES = tuple(address - BLOCK_ADDRESS for address in (26, 27, 28, 29, MOTORS_CONNECTED, TORQUE))
_HEADER, _STUFFED = b"\xff\xff\xfd", 0xFD
# The block ends with what was written to it, which is never eight bytes of this kind.
_LEAST_SPOILT = 8
_MOTION = tuple(
    f"{quantity}_{axis}"
    for quantity, axes in (
        ("angular_velocity", "xyz"),
        ("linear_acceleration", "xyz"),
        ("magnetic_field", "xyz"),
        ("orientation", "wxyz"),
    )
    for axis in axes
)


@dataclass(frozen=True, slots=True)
class Block:
    """The registers from 10 to 181.

    Attributes:
        uptime_ms: Time since the board started, modulo 2**32; it and all that is measured is refreshed every 20 ms.
        device_status: Status, 0: it runs; -1: it found no motors when it started.
        heartbeat: Heartbeat that it was given last.
        buttons: True for each button that is pressed.
        illumination: Raw value.
        infrared: Raw value.
        sonar_m: 0 in the stock firmware.
        battery_v: Voltage of the battery.
        battery_share: Charge, 0 to 1; no longer refreshed below 10.5 V.
        motion: Measurements of the inertial sensor, by name; those that are no numbers are left out.
        velocities_raw: Velocities of the left and the right wheel.
        ticks: Ticks of the left and the right wheel.
        has_motors: True if it found them when it started.
        is_torque_on: True if both motors have torque.
        command: Linear and angular velocity, as they were written.
    """

    uptime_ms: int
    device_status: int
    heartbeat: int
    buttons: dict[str, bool]
    illumination: int
    infrared: int
    sonar_m: float
    battery_v: float
    battery_share: float
    motion: dict[str, float]
    velocities_raw: tuple[int, int]
    ticks: tuple[int, int]
    has_motors: bool
    is_torque_on: bool
    command: tuple[int, int]


def spoilt_from(data: bytes) -> int | None:
    """Return the index from which firmware has spoilt an answer before it signed it; None: it has not.

    Dynamixel2Arduino before 0.6.2 stuffs a packet in place: it copies the byte behind a header within the answer over
    all bytes that follow.

    Args:
        data: Data of an answer, without stuffing.
    """
    tail = len(data) - len(data.rstrip(bytes((_STUFFED,))))
    begin = data.find(_HEADER, max(len(data) - tail - 2, 0))
    spoilt = None if begin < 0 else begin + 2
    return spoilt if spoilt is not None and len(data) - spoilt >= _LEAST_SPOILT else None


def impossibility(data: bytes) -> str:
    """Return why a block cannot have such contents; empty: it can."""
    if spoilt_from(data) is not None:
        return (
            "the board's firmware has overwritten the end of its answer: update it (Dynamixel2Arduino 0.6.2 or later)"
        )
    wrong = next((data[index] for index in _TRUTH_VALUES if data[index] > 1), None)
    return "" if wrong is None else f"a truth value is {wrong}"


def decode_block(data: bytes) -> Block:
    """Return the block in `BLOCK_LENGTH` bytes from `BLOCK_ADDRESS` on."""
    (
        uptime_ms, device_status, heartbeat, button_1, button_2, bumper_1, bumper_2, illumination, infrared, sonar_cm,
        battery_cv, battery_bp, *rest,
    ) = _BLOCK.unpack(data)  # fmt: skip
    motion = rest[: len(_MOTION)]
    _, _, left_raw, right_raw, left, right, has_motors, is_torque_on, linear, angular = rest[len(_MOTION) :]
    return Block(
        uptime_ms=uptime_ms,
        device_status=device_status,
        heartbeat=heartbeat,
        buttons={"button_1": button_1, "button_2": button_2, "bumper_1": bumper_1, "bumper_2": bumper_2},
        illumination=illumination,
        infrared=infrared,
        sonar_m=sonar_cm / 100,
        battery_v=battery_cv / 100,
        battery_share=max(0.0, min(1.0, battery_bp / 10_000)),
        motion={name: value for name, value in zip(_MOTION, motion, strict=True) if math.isfinite(value)},
        velocities_raw=(left_raw, right_raw),
        ticks=(left, right),
        has_motors=has_motors,
        is_torque_on=is_torque_on,
        command=(linear, angular),
    )


def encode_command(linear: int, angular: int) -> bytes:
    """Return the bytes that are written at `COMMAND`.

    Args:
        linear: Linear velocity, in hundredths of a metre per second.
        angular: Yaw rate, in hundredths of a radian per second, counter-clockwise.
    """
    return _COMMAND.pack(linear, angular)
