"""Settings of a wheel servo, and the check that it can be driven with them."""

import contextlib
from dataclasses import dataclass

from robosc_bridge.devices.dynamixel_bus import DynamixelBus, RefusedError
from robosc_bridge.devices.robots import SERVOS
from robosc_bridge.errors import WrongDeviceError
from robosc_bridge.protocol import servo

_STARTUP = servo.STARTUP_TORQUE | servo.STARTUP_RESTORE
_SHUTDOWN = servo.OVERHEATING | servo.SHOCK | servo.OVERLOAD


@dataclass(frozen=True, slots=True)
class ServoSettings:
    """Settings that a servo reported.

    Attributes:
        model_number: A key of `SERVOS`.
        sign: Sign of the robot's forward direction in the servo's own direction.
        operating_mode: `VELOCITY_MODE` or another, which must be changed.
        velocity_limit_raw: Limit of its goal velocity.
        temperature_limit_c: Temperature at which it shuts down, in degrees Celsius.
    """

    model_number: int
    sign: int
    operating_mode: int
    velocity_limit_raw: int
    temperature_limit_c: int


def read_settings(bus: DynamixelBus, device: int, name: str, is_mirrored: bool, limit_s: float) -> ServoSettings:
    """Return the settings of a servo.

    Args:
        bus: Bus that it is on.
        device: Its id.
        name: Name of the servo in messages.
        is_mirrored: True if it is mounted so that its own positive direction is backward.
        limit_s: Longest time for each half of it.

    Raises:
        LineError: The line is gone.
        DeviceSilentError: It does not answer.
        WrongDeviceError: The servo or its settings cannot be driven; the message says what to change.
    """
    bus.begin(limit_s)
    model_number, firmware = bus.ping(device)
    # An earlier answer may have been one to another session.
    bus.settle(device)
    if model_number not in SERVOS:
        known = ", ".join(f"{model} ({number})" for number, model in sorted(SERVOS.items()))
        raise WrongDeviceError(f"{name} is of model {model_number}; what can be driven is {known}")
    if firmware < servo.WATCHDOG_FIRMWARE:
        raise WrongDeviceError(
            f"{name} has firmware {firmware}, without a bus watchdog; update it to {servo.WATCHDOG_FIRMWARE} or later"
        )

    def number(address: int, length: int) -> int:
        return int.from_bytes(bus.read(device, address, length).data, "little")

    drive_mode = number(servo.DRIVE_MODE, 1)
    if drive_mode & ~servo.REVERSE:
        raise WrongDeviceError(
            f"{name} has drive mode {drive_mode}: a time-based profile, or torque that a goal switches on; "
            f"set address {servo.DRIVE_MODE} to {drive_mode & servo.REVERSE}"
        )
    startup = 0
    # Older firmware may not have it.
    with contextlib.suppress(RefusedError):
        startup = number(servo.STARTUP, 1)
    if startup & _STARTUP:
        raise WrongDeviceError(
            f"{name} would switch torque on by itself, or restore an old goal, whenever it starts "
            f"(startup configuration {startup}); set address {servo.STARTUP} to {startup & ~_STARTUP}"
        )
    bus.begin(limit_s)
    shutdown = number(servo.SHUTDOWN, 1)
    if shutdown & _SHUTDOWN != _SHUTDOWN:
        raise WrongDeviceError(
            f"{name} would not protect itself when overloaded or hot (shutdown {shutdown}); "
            f"set address {servo.SHUTDOWN} to {_SHUTDOWN}"
        )
    is_reversed = bool(drive_mode & servo.REVERSE)
    return ServoSettings(
        model_number,
        1 if is_reversed == is_mirrored else -1,
        number(servo.OPERATING_MODE, 1),
        number(servo.VELOCITY_LIMIT, 4),
        number(servo.TEMPERATURE_LIMIT, 1),
    )
