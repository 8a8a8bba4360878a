"""Packets of Dynamixel protocol 2.0: dynamixel-sdk's packet handler with its errors corrected.

The SDK knows the packets, their checksum and how to find one among other bytes. Three of its functions cannot be used
as they are (dynamixel-sdk 4.1.0, `protocol2_packet_handler.py`):

- `txPacket` drops what `addStuffing` returns, so that a payload with the header's bytes goes out unstuffed; here
  `addStuffing` changes the packet itself.
- `removeStuffing` takes a byte of the payload FF FF FD FF FD FD for a stuffed one; here what was *un*stuffed decides.
- its reads take the checksum of an answer without data for data; here an answer is a `StatusPacket` whose data may be
  empty.

Source: ROBOTIS e-Manual, "DYNAMIXEL Protocol 2.0".
"""

from collections.abc import Sequence
from dataclasses import dataclass

from dynamixel_sdk import INST_STATUS, Protocol2PacketHandler

MAX_DEVICE = 252
"""The highest id that a device can have."""

PING_DATA = 3
"""Bytes that an answer to a ping carries: model number and version of the firmware."""

_BODY = 7  # Index of the instruction, where stuffing begins.
_ALERT = 0x80
_HEADER = (0xFF, 0xFF, 0xFD)
_STUFFED = 0xFD

_REFUSALS = {
    1: "it failed",
    2: "unknown instruction",
    3: "the request came damaged",
    4: "value out of range",
    5: "too few bytes",
    6: "value beyond a limit",
    7: "no access to this address",
}
DAMAGED_REQUEST = 3
"""Error number of a device whose request came damaged: ask again."""


@dataclass(frozen=True, slots=True)
class StatusPacket:
    """A device's answer.

    Attributes:
        device: Its id.
        number: Number of the error with which it refused the request; 0: it did not.
        is_alert: True if its hardware error status is not zero.
        data: Data that was asked for; empty for a write and where the request was refused.
    """

    device: int
    number: int
    is_alert: bool
    data: bytes

    @property
    def refusal(self) -> str:
        """The error number in words."""
        return _REFUSALS.get(self.number, f"error {self.number}")


def status_of(packet: Sequence[int]) -> StatusPacket | None:
    """Return the status in a well-formed packet without stuffing, or None where it is no status packet.

    Args:
        packet: Packet from its header to its checksum, as `PacketHandler.rxPacket` gives it.
    """
    if len(packet) < _BODY + 4 or packet[_BODY] != INST_STATUS or packet[4] > MAX_DEVICE:
        return None
    error = packet[_BODY + 1]
    return StatusPacket(packet[4], error & ~_ALERT, bool(error & _ALERT), bytes(packet[_BODY + 2 : -2]))


def stuffed(body: Sequence[int]) -> list[int]:
    """A body, from its instruction to its last parameter, in which no header can be found."""
    found: list[int] = []
    for index, byte in enumerate(body):
        found.append(byte)
        if byte == _HEADER[2] and index >= 2 and tuple(body[index - 2 : index]) == _HEADER[:2]:
            found.append(_STUFFED)
    return found


def unstuffed(body: Sequence[int]) -> list[int]:
    """The body that `stuffed` was made from."""
    found: list[int] = []
    is_after_header = False
    for byte in body:
        if not (is_after_header and byte == _STUFFED):
            found.append(byte)
            is_after_header = tuple(found[-3:]) == _HEADER
        else:
            is_after_header = False
    return found


class PacketHandler(Protocol2PacketHandler):  # type: ignore[misc]
    """The SDK's packet handler, stuffing and unstuffing as the protocol has it."""

    def addStuffing(self, packet: list[int]) -> list[int]:  # noqa: N802 - the SDK's name
        """Stuff a packet that is to be sent, in place."""
        return self._with_body(packet, stuffed(self._body(packet)))

    def removeStuffing(self, packet: list[int]) -> list[int]:  # noqa: N802 - the SDK's name
        """Unstuff a packet that has come, in place."""
        return self._with_body(packet, unstuffed(self._body(packet)))

    @staticmethod
    def _body(packet: list[int]) -> list[int]:
        length = packet[5] | packet[6] << 8
        return packet[_BODY : _BODY + length - 2]

    @staticmethod
    def _with_body(packet: list[int], body: list[int]) -> list[int]:
        checksum = packet[-2:]
        packet[5], packet[6] = (len(body) + 2) & 0xFF, len(body) + 2 >> 8
        packet[_BODY:] = [*body, *checksum]
        return packet
