"""The control tables of the wheel servos, as data, and the rules by which a host may change them.

After the ROBOTIS e-Manual, pages XL430-W250 and XM430-W210. Left out: indirect addresses (168 and up), which read and
write as addresses that do not exist.
"""

from collections.abc import Callable
from dataclasses import dataclass

from robosc_simulated.packets import Error

TABLE_SIZE = 147
EEPROM_SIZE = 64


@dataclass(frozen=True)
class Item:
    """A register.

    Attributes:
        name: Name as in the e-Manual, lower case.
        address: Address of its first byte.
        size: Size in bytes.
        default: Value when it left the factory (EEPROM) or after a start (RAM).
        lowest: Smallest value that a host may write; None: it may write none.
        highest: Largest one.
        is_signed: True if it is a two's complement number.
        limit: The item whose value limits its magnitude.
        is_goal: True if a tripped bus watchdog locks it.
    """

    name: str
    address: int
    size: int
    default: int = 0
    lowest: int | None = None
    highest: int = 0
    is_signed: bool = False
    limit: str | None = None
    is_goal: bool = False

    @property
    def is_eeprom(self) -> bool:
        """True if it outlives a restart, and is locked while torque is on."""
        return self.address < EEPROM_SIZE


def _items(
    *,
    number: int,
    firmware: int,
    temperature_limit: int,
    voltages: tuple[int, int],
    velocity_limit: int,
    current_limit: int | None,
    velocity_i_gain: int,
    position_d_gain: int,
) -> tuple[Item, ...]:
    low, high = voltages
    rows = [
        Item("model number", 0, 2, number),
        Item("model information", 2, 4),
        Item("firmware version", 6, 1, firmware),
        Item("id", 7, 1, 1, 0, 252),
        Item("baud rate", 8, 1, 1, 0, 7),
        Item("return delay time", 9, 1, 250, 0, 254),
        Item("drive mode", 10, 1, 0, 0, 13),
        Item("operating mode", 11, 1, 3, 0, 16),
        Item("secondary id", 12, 1, 255, 0, 255),
        Item("protocol type", 13, 1, 2, 2, 2),
        Item("homing offset", 20, 4, 0, -1_044_479, 1_044_479, is_signed=True),
        Item("moving threshold", 24, 4, 10, 0, 1023),
        Item("temperature limit", 31, 1, temperature_limit, 0, 100),
        Item("max voltage limit", 32, 2, high, low, high),
        Item("min voltage limit", 34, 2, low, low, high),
        Item("pwm limit", 36, 2, 885, 0, 885),
        Item("velocity limit", 44, 4, velocity_limit, 0, 1023),
        Item("max position limit", 48, 4, 4095, 0, 4095),
        Item("min position limit", 52, 4, 0, 0, 4095),
        Item("startup configuration", 60, 1, 0, 0, 3),
        Item("shutdown", 63, 1, 0x34, 0, 0x3D),
        Item("torque enable", 64, 1, 0, 0, 1),
        Item("led", 65, 1, 0, 0, 1),
        Item("status return level", 68, 1, 2, 0, 2),
        Item("registered instruction", 69, 1),
        Item("hardware error status", 70, 1),
        Item("velocity i gain", 76, 2, velocity_i_gain, 0, 16_383),
        Item("velocity p gain", 78, 2, 100, 0, 16_383),
        Item("position d gain", 80, 2, position_d_gain, 0, 16_383),
        Item("position i gain", 82, 2, 0, 0, 16_383),
        Item("position p gain", 84, 2, 800, 0, 16_383),
        Item("feedforward 2nd gain", 88, 2, 0, 0, 16_383),
        Item("feedforward 1st gain", 90, 2, 0, 0, 16_383),
        Item("bus watchdog", 98, 1, 0, 0, 127),
        Item("goal pwm", 100, 2, 885, -32_768, 32_767, is_signed=True, limit="pwm limit", is_goal=True),
        Item("goal velocity", 104, 4, 0, -(2**31), 2**31 - 1, is_signed=True, limit="velocity limit", is_goal=True),
        Item("profile acceleration", 108, 4, 0, 0, 32_767, is_goal=True),
        Item("profile velocity", 112, 4, 0, 0, 32_767, is_goal=True),
        Item("goal position", 116, 4, 0, -(2**31), 2**31 - 1, is_signed=True, is_goal=True),
        Item("realtime tick", 120, 2),
        Item("moving", 122, 1),
        Item("moving status", 123, 1),
        Item("present pwm", 124, 2, is_signed=True),
        Item("present load", 126, 2, is_signed=True),
        Item("present velocity", 128, 4, is_signed=True),
        Item("present position", 132, 4, is_signed=True),
        Item("velocity trajectory", 136, 4, is_signed=True),
        Item("position trajectory", 140, 4, is_signed=True),
        Item("present input voltage", 144, 2),
        Item("present temperature", 146, 1),
    ]
    if current_limit is not None:
        rows += [
            Item("current limit", 38, 2, current_limit, 0, current_limit),
            Item(
                "goal current", 102, 2, current_limit, -32_768, 32_767, is_signed=True, limit="current limit",
                is_goal=True,
            ),
        ]  # fmt: skip
    return tuple(sorted(rows, key=lambda item: item.address))


@dataclass(frozen=True)
class Model:
    """A kind of servo.

    Attributes:
        items: Items in order of address.
        operating_modes: Operating modes that it has.
        no_load_rpm: No-load speed at 12 V, in rpm.
        strongest_load: Value that item 126 reports for a motor that cannot rotate.
    """

    items: tuple[Item, ...]
    operating_modes: frozenset[int]
    no_load_rpm: float
    strongest_load: int


MODELS = {
    "XL430-W250": Model(
        _items(
            number=1060, firmware=45, temperature_limit=72, voltages=(60, 140), velocity_limit=265,
            current_limit=None, velocity_i_gain=1000, position_d_gain=4000,
        ),
        frozenset((1, 3, 4, 16)), 61.0, 1000,
    ),
    "XM430-W210": Model(
        _items(
            number=1030, firmware=38, temperature_limit=80, voltages=(95, 160), velocity_limit=330,
            current_limit=1193, velocity_i_gain=1920, position_d_gain=0,
        ),
        frozenset((0, 1, 3, 4, 5, 16)), 77.0, 855,
    ),
}  # fmt: skip

# Bit 0 reverse, bit 2 time-based profile, bit 3 torque on by goal update.
_DRIVE_MODE_BITS = 0b1101


class ControlTable:
    """The memory of a servo.

    Args:
        model: Servo model with these items.
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        self._items = {item.name: item for item in model.items}
        self._owner = {
            address: item for item in model.items for address in range(item.address, item.address + item.size)
        }
        self._bytes = bytearray(TABLE_SIZE)
        self.restore(lambda item: True)

    def __getitem__(self, name: str) -> int:
        item = self._items[name]
        return int.from_bytes(self._bytes[item.address :][: item.size], "little", signed=item.is_signed)

    def __setitem__(self, name: str, value: int) -> None:
        item = self._items[name]
        bits = 8 * item.size
        self._bytes[item.address : item.address + item.size] = (value % 2**bits).to_bytes(item.size, "little")

    def restore(self, chosen: Callable[[Item], bool]) -> None:
        """Set the chosen items to their defaults."""
        for item in self.model.items:
            if chosen(item):
                self[item.name] = item.default

    def read(self, address: int, length: int) -> tuple[int, bytes]:
        """Return what a host reads: the error's number, and the data if it is 0; bytes between items are 0."""
        if length < 1:
            return Error.DATA_LENGTH, b""
        if address + length > TABLE_SIZE:
            return Error.ACCESS, b""
        return Error.NONE, bytes(self._bytes[address : address + length])

    def check(self, address: int, data: bytes) -> tuple[int, list[tuple[Item, int]]]:
        """Check a host's write: return the error's number, and what is written if it is 0; all of it or nothing."""
        found: list[tuple[Item, int]] = []
        if not data:
            return Error.DATA_LENGTH, []
        end = address + len(data)
        while address < end:
            item = self._owner.get(address)
            if item is None or item.lowest is None or item.address != address:
                return Error.ACCESS, []
            if address + item.size > end:
                return Error.DATA_LENGTH, []
            raw = data[len(data) - (end - address) :][: item.size]
            value = int.from_bytes(raw, "little", signed=item.is_signed)
            if error := self._refusal(item, value):
                return error, []
            found.append((item, value))
            address += item.size
        return Error.NONE, found

    def _refusal(self, item: Item, value: int) -> int:
        if item.is_eeprom and self["torque enable"]:
            return Error.ACCESS
        is_tripped = self["bus watchdog"] == 0xFF
        if is_tripped and (item.is_goal or (item.name == "bus watchdog" and value)):
            return Error.DATA_RANGE
        if item.lowest is None or not item.lowest <= value <= item.highest:
            return Error.DATA_RANGE
        if item.name == "drive mode" and value & ~_DRIVE_MODE_BITS:
            return Error.DATA_RANGE
        if item.name == "operating mode" and value not in self.model.operating_modes:
            return Error.DATA_RANGE
        if item.limit is not None and abs(value) > self[item.limit]:
            return Error.DATA_LIMIT
        return Error.NONE
