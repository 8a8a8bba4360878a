"""The control table of Dynamixel X servos: addresses and encoding.

Source: ROBOTIS e-Manual, pages XL430-W250 and XM430-W210.
"""

import struct
from dataclasses import dataclass

DRIVE_MODE = 10
OPERATING_MODE = 11
TEMPERATURE_LIMIT = 31
VELOCITY_LIMIT = 44
STARTUP = 60
SHUTDOWN = 63
TORQUE = 64
LED = 65
HARDWARE_ERRORS = 70
BUS_WATCHDOG = 98
GOAL_VELOCITY = 104
PROFILE_ACCELERATION = 108
TEMPERATURE = 146

MEASUREMENT_ADDRESS = 126
MEASUREMENT_LENGTH = 21

REVERSE = 0x01
"""Bit of the drive mode."""

STARTUP_TORQUE, STARTUP_RESTORE = 0x01, 0x02
"""Bits of the startup configuration: torque on, and the RAM as it was, when it starts."""

VELOCITY_MODE = 1

VOLTAGE, OVERHEATING, ENCODER, SHOCK, OVERLOAD = 0x01, 0x04, 0x08, 0x10, 0x20
"""Bits of the hardware errors and of what a servo shuts down for."""

WATCHDOG_S = 0.020
"""One unit of the bus watchdog."""
WATCHDOG_MOST = 127
WATCHDOG_TRIPPED = 0xFF
WATCHDOG_FIRMWARE = 38
"""The first firmware that has one."""

PROFILE_MOST = 32767

_MEASUREMENT = struct.Struct("<hii8xHB")


@dataclass(frozen=True, slots=True)
class Measurement:
    """The registers from 126 to 146.

    Attributes:
        load: Of an XL430 in 0.1 %; of an XM430 its current in 2.69 mA.
        velocity_raw: In 0.229 revolutions per minute.
        ticks: 4096 to a revolution, signed.
        voltage_v: At its input.
        temperature_c: Of the motor.
    """

    load: int
    velocity_raw: int
    ticks: int
    voltage_v: float
    temperature_c: int


def decode_measurement(data: bytes) -> Measurement:
    """Return the measurement in `MEASUREMENT_LENGTH` bytes from `MEASUREMENT_ADDRESS` on."""
    load, velocity_raw, ticks, voltage, temperature_c = _MEASUREMENT.unpack(data)
    return Measurement(load, velocity_raw, ticks, voltage / 10, temperature_c)


def encode_velocity(raw: int) -> bytes:
    """Return the bytes that are written at `GOAL_VELOCITY`."""
    return raw.to_bytes(4, "little", signed=True)
