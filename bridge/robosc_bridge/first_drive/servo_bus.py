"""Servos on a line: their ids, baud rates and settings. Only pings and read requests are sent."""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, field

from dynamixel_sdk import BROADCAST_ID, INST_PING

from robosc_bridge.devices.dynamixel_bus import DynamixelBus, RefusedError
from robosc_bridge.devices.robots import SERVOS
from robosc_bridge.devices.servo_settings import read_settings
from robosc_bridge.errors import DeviceError, WrongDeviceError
from robosc_bridge.host import Host, Port
from robosc_bridge.protocol import servo
from robosc_bridge.protocol.dynamixel import PING_DATA, PacketHandler
from robosc_bridge.protocol.dynamixel_frames import PacketDecoder

BAUDS = (1_000_000, 57_600, 115_200, 2_000_000, 3_000_000, 4_000_000, 9_600)
"""Speeds that a servo may have, the likeliest first: a TurtleBot3's, and that of the factory."""

BAUD_NUMBERS = {9_600: 0, 57_600: 1, 115_200: 2, 1_000_000: 3, 2_000_000: 4, 3_000_000: 5, 4_000_000: 6}
"""Values of the register of the speed."""

ID, BAUD = 7, 8
VOLTAGE = 144
LIMIT_S = 0.3

# A servo waits for those of lower ids, 3 ms each at most (the SDK's window for a broadcast ping).
_WINDOW_S = 0.003 * 253
_QUIET_S = 0.1


@dataclass(frozen=True)
class FoundServo:
    """A servo.

    Attributes:
        device: Its id.
        baud: Baud rate at which it answers.
        model_number: Number of its model.
        firmware: Version of its firmware.
        registers: Settings and measurements by name, as far as the servo lets them be read.
        problems: Problems that keep the bridge from driving the servo, now or later, each with its remedy.
    """

    device: int
    baud: int
    model_number: int
    firmware: int
    registers: dict[str, int | float] = field(default_factory=dict)
    problems: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the model."""
        return SERVOS.get(self.model_number, f"model {self.model_number}")


def broadcast_ping(line: Port, host: Host) -> list[tuple[int, int, int]]:
    """Return id, model and firmware of every servo that answers at the line's speed.

    Raises:
        LineError: The line is gone.
    """
    handler, decoder = PacketHandler(), PacketDecoder()
    packet = [0xFF, 0xFF, 0xFD, 0, BROADCAST_ID, 3, 0, INST_PING]
    checksum = handler.updateCRC(0, packet, len(packet))
    line.discard_input()
    line.write(bytes((*packet, checksum & 0xFF, checksum >> 8)))
    found: dict[int, tuple[int, int, int]] = {}
    end_s = host.monotonic() + _WINDOW_S
    while (left_s := end_s - host.monotonic()) > 0:
        data = line.read(min(left_s, _QUIET_S) if found else left_s)
        for answer in decoder.feed(data):
            # Adapters may return what was sent; an answer begins with its error.
            if answer.is_answer and len(answer.parameters) == 1 + PING_DATA:
                model = int.from_bytes(answer.parameters[1:3], "little")
                found[answer.device] = (answer.device, model, answer.parameters[3])
        if not data and found:
            break
    return sorted(found.values())


def find_servos(
    line: Port, host: Host, bauds: Sequence[int] = BAUDS, *, is_first_enough: bool = True
) -> list[FoundServo]:
    """Return the servos on a line.

    Args:
        line: Open line; its speed is another afterwards.
        host: Host whose time is used.
        bauds: Speeds at which they are looked for.
        is_first_enough: True to end at the first speed at which one answers.

    Raises:
        LineError: The line is gone.
    """
    found: list[FoundServo] = []
    for baud in bauds:
        line.set_baud(baud)
        answers = broadcast_ping(line, host)
        bus = DynamixelBus(line, lambda device: f"servo {device}", host=host)
        found += [read_servo(bus, device, baud, model, firmware) for device, model, firmware in answers]
        if found and is_first_enough:
            break
    return found


def read_servo(bus: DynamixelBus, device: int, baud: int, model_number: int, firmware: int) -> FoundServo:
    """Return the settings and values that a servo reports, and what is wrong with them.

    Raises:
        LineError: The line is gone.
    """

    def number(address: int, length: int) -> int:
        bus.begin(LIMIT_S)
        return int.from_bytes(bus.read(device, address, length).data, "little")

    registers: dict[str, int | float] = {}
    for name, address, length in (
        ("drive_mode", servo.DRIVE_MODE, 1),
        ("operating_mode", servo.OPERATING_MODE, 1),
        ("velocity_limit", servo.VELOCITY_LIMIT, 4),
        ("temperature_limit_c", servo.TEMPERATURE_LIMIT, 1),
        ("startup", servo.STARTUP, 1),
        ("shutdown", servo.SHUTDOWN, 1),
        ("torque", servo.TORQUE, 1),
        ("hardware_errors", servo.HARDWARE_ERRORS, 1),
        ("bus_watchdog", servo.BUS_WATCHDOG, 1),
        ("temperature_c", servo.TEMPERATURE, 1),
        ("voltage_v", VOLTAGE, 2),
    ):
        with contextlib.suppress(RefusedError, DeviceError):
            registers[name] = number(address, length)
    if "voltage_v" in registers:
        registers["voltage_v"] /= 10
    problems = list(_problems(registers, baud))
    try:
        # Problems that the driver itself would report.
        read_settings(bus, device, f"servo {device}", device % 2 == 0, LIMIT_S)
    except WrongDeviceError as error:
        problems.append(str(error))
    except DeviceError as error:
        problems.append(f"it does not let its settings be read: {error}")
    return FoundServo(device, baud, model_number, firmware, registers, tuple(problems))


_ERRORS = {
    servo.VOLTAGE: "input voltage",
    servo.OVERHEATING: "overheating",
    servo.ENCODER: "encoder",
    servo.SHOCK: "electrical shock",
    servo.OVERLOAD: "overload",
}


def _problems(registers: dict[str, int | float], baud: int) -> Sequence[str]:
    found = []
    errors = int(registers.get("hardware_errors", 0))
    if errors:
        names = [name for bit, name in _ERRORS.items() if errors & bit]
        found.append(
            f"it has a hardware error ({', '.join(names)}); remove its cause, then `reset`, or switch it off and on"
        )
    if baud != BAUDS[0]:
        found.append(
            f"it speaks at {baud} baud, not {BAUDS[0]}: `setup-servo --new-baud {BAUDS[0]}`, or bauds: [{baud}]"
        )
    if registers.get("torque"):
        found.append("its torque is on: another program has left it so; it holds, and may move")
    return found
