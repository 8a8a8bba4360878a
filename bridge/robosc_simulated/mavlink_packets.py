"""MAVLink 2 packets as a vehicle makes and understands them: the few messages that a simulated rover needs.

Sources: mavlink.io (serialization, message signing) and the definitions `common.xml` and `minimal.xml`. The fields of a
payload are ordered by size, extensions follow, and zeros at its end are cut.
"""

import hashlib
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

_MAGIC = 0xFD
_HEADER = struct.Struct("<BBBBBBB")
_HEADER_LENGTH = 10
_SIGNED = 1
_SIGNATURE_LENGTH = 13
_HASH_LENGTH = 6


@dataclass(frozen=True)
class Layout:
    """Layout of a message in its payload.

    Attributes:
        name: Name of the message.
        number: Number of the message.
        extra: Value that its checksum also covers.
        format: Format of the payload.
        fields: Fields in their order there: `name`, or `name*count` for an array.
    """

    name: str
    number: int
    extra: int
    format: str
    fields: str

    def pack(self, values: Mapping[str, Any]) -> bytes:
        """The payload, its zeros cut; fields that are not given are 0."""
        flat: list[Any] = []
        for field in self.fields.split():
            name, _, count = field.partition("*")
            if count:
                flat += values.get(name, (0,) * int(count))
            else:
                flat.append(values.get(name, b"" if name == "text" else 0))
        payload = struct.pack(self.format, *flat)
        return payload.rstrip(b"\0") or b"\0"

    def unpack(self, payload: bytes) -> dict[str, Any]:
        """The fields; what was cut is zero, and what is too long is of a later version."""
        size = struct.calcsize(self.format)
        flat = list(struct.unpack(self.format, payload[:size].ljust(size, b"\0")))
        values: dict[str, Any] = {}
        for field in self.fields.split():
            name, _, count = field.partition("*")
            values[name] = tuple(flat[: int(count)]) if count else flat[0]
            del flat[: int(count or 1)]
        return values


LAYOUTS = (
    Layout("HEARTBEAT", 0, 50, "<IBBBBB", "custom_mode type autopilot base_mode system_status version"),
    Layout(
        "SYS_STATUS", 1, 124, "<IIIHHhHHHHHHb3I",
        "present enabled health load voltage current drop_rate errors count1 count2 count3 count4 remaining "
        "more_present more_enabled more_health",
    ),
    Layout("ATTITUDE", 30, 39, "<I6f", "time_ms roll pitch yaw rollspeed pitchspeed yawspeed"),
    Layout("LOCAL_POSITION_NED", 32, 185, "<I6f", "time_ms x y z vx vy vz"),
    Layout("COMMAND_LONG", 76, 152, "<7fHBBB", "parameters*7 command target_system target_component confirmation"),
    Layout("COMMAND_ACK", 77, 143, "<HBBiBB", "command result progress detail target_system target_component"),
    Layout(
        "SET_POSITION_TARGET_LOCAL_NED", 84, 143, "<I11fHBBB",
        "time_ms x y z vx vy vz ax ay az yaw yaw_rate type_mask target_system target_component frame",
    ),
    Layout(
        "DISTANCE_SENSOR", 132, 85, "<IHHHBBBB6fB",
        "time_ms min max current type id orientation covariance width height q*4 quality",
    ),
    Layout(
        "BATTERY_STATUS", 147, 154, "<iih10HhBBBbiB4HBI",
        "consumed energy temperature voltages*10 current id function type remaining time_remaining charge_state "
        "more_voltages*4 mode faults",
    ),
    Layout("STATUSTEXT", 253, 83, "<B50sHB", "severity text id chunk"),
    Layout(
        "OBSTACLE_DISTANCE", 330, 23, "<Q72HHHBBffB",
        "time_us distances*72 min max type increment increment_f offset frame",
    ),
    Layout(
        "ODOMETRY", 331, 91, "<Q3f4f3f3f21f21fBBBBb",
        "time_us x y z q*4 vx vy vz rollspeed pitchspeed yawspeed pose_covariance*21 velocity_covariance*21 frame "
        "child_frame resets estimator quality",
    ),
)  # fmt: skip
BY_NAME = {layout.name: layout for layout in LAYOUTS}
BY_NUMBER = {layout.number: layout for layout in LAYOUTS}


@dataclass(frozen=True)
class Packet:
    """Message and its sender.

    Attributes:
        system: System of the sender.
        component: Component of the sender.
        name: Name of the message.
        values: Values of its fields.
        is_signed: True if it has a signature.
    """

    system: int
    component: int
    name: str
    values: dict[str, Any]
    is_signed: bool = False


def checksum(data: bytes) -> int:
    """CRC-16/MCRF4XX (X.25 without its last inversion)."""
    value = 0xFFFF
    for byte in data:
        byte ^= value & 0xFF
        byte ^= byte << 4 & 0xFF
        value = value >> 8 ^ byte << 8 ^ byte << 3 ^ byte >> 4
    return value


class Encoder:
    """Makes the packets of one component.

    Args:
        system: Of the sender.
        component: Of the sender.
        key: Of signing, 32 bytes; None: they are not signed.

    Attributes:
        timestamp: Of the next signature.
    """

    def __init__(self, system: int, component: int, key: bytes | None = None) -> None:
        self.timestamp = 0
        self._system = system
        self._component = component
        self._key = key
        self._sequence = 0

    def encode(self, name: str, **values: Any) -> bytes:
        """The next packet."""
        layout = BY_NAME[name]
        payload = layout.pack(values)
        flags = 0 if self._key is None else _SIGNED
        head = _HEADER.pack(_MAGIC, len(payload), flags, 0, self._sequence, self._system, self._component)
        self._sequence = (self._sequence + 1) % 256
        packet = head + layout.number.to_bytes(3, "little") + payload
        packet += checksum(packet[1:] + bytes((layout.extra,))).to_bytes(2, "little")
        if self._key is None:
            return packet
        packet += b"\0" + self.timestamp.to_bytes(6, "little")
        self.timestamp += 1
        return packet + hashlib.sha256(self._key + packet).digest()[:_HASH_LENGTH]


class Parser:
    """Finds packets among bytes that come in pieces.

    Args:
        key: Of signing: what is not signed with it, or not later than what came before, does not count; None: all do.

    Attributes:
        rejected: Packets that did not count for their signature.
    """

    def __init__(self, key: bytes | None = None) -> None:
        self.rejected = 0
        self._key = key
        self._newest: dict[tuple[int, int, int], int] = {}
        self._rest = b""

    def feed(self, data: bytes) -> list[Packet]:
        """The packets that these bytes complete."""
        self._rest += data
        found: list[Packet] = []
        while True:
            begin = self._rest.find(_MAGIC)
            self._rest = self._rest[begin:] if begin >= 0 else b""
            if len(self._rest) < _HEADER_LENGTH:
                return found
            is_signed = self._rest[2] == _SIGNED
            length = _HEADER_LENGTH + self._rest[1] + 2 + is_signed * _SIGNATURE_LENGTH
            number = int.from_bytes(self._rest[7:10], "little")
            if number not in BY_NUMBER or self._rest[2] > _SIGNED:
                self._rest = self._rest[1:]
                continue
            if len(self._rest) < length:
                return found
            packet = self._packet(self._rest[:length], BY_NUMBER[number], is_signed)
            self._rest = self._rest[1 if packet is None else length :]
            if packet is not None and self._counts(packet, is_signed):
                found.append(_read(packet, BY_NUMBER[number], is_signed))

    def _packet(self, data: bytes, layout: Layout, is_signed: bool) -> bytes | None:
        end = len(data) - is_signed * _SIGNATURE_LENGTH
        expected = int.from_bytes(data[end - 2 : end], "little")
        return data if expected == checksum(data[1 : end - 2] + bytes((layout.extra,))) else None

    def _counts(self, data: bytes, is_signed: bool) -> bool:
        if self._key is None:
            return True
        stream = (data[-_SIGNATURE_LENGTH], data[5], data[6])
        timestamp = int.from_bytes(data[-_SIGNATURE_LENGTH + 1 : -_HASH_LENGTH], "little")
        is_genuine = hashlib.sha256(self._key + data[:-_HASH_LENGTH]).digest()[:_HASH_LENGTH] == data[-_HASH_LENGTH:]
        if not is_signed or not is_genuine or timestamp <= self._newest.get(stream, -1):
            self.rejected += 1
            return False
        self._newest[stream] = timestamp
        return True


def _read(data: bytes, layout: Layout, is_signed: bool) -> Packet:
    payload = data[_HEADER_LENGTH : _HEADER_LENGTH + data[1]]
    return Packet(data[5], data[6], layout.name, layout.unpack(payload), is_signed)
