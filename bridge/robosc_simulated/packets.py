"""Dynamixel Protocol 2.0 as a device speaks it: instruction packets in, status packets out.

After the ROBOTIS e-Manual, "DYNAMIXEL Protocol 2.0". Written for the simulators alone: the drivers use
dynamixel-sdk's, so that the two sides can disagree.
"""

from dataclasses import dataclass
from enum import IntEnum

BROADCAST_ID = 254
_HEADER = b"\xff\xff\xfd\x00"
_STUFFED = b"\xff\xff\xfd"
# No device of a robot takes a longer packet; what claims to be one is noise.
LONGEST = 2048
# A sender that stops in the middle of a packet has given it up.
_PATIENCE_S = 0.1


class Instruction(IntEnum):
    """Instruction that a host can give."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REG_WRITE = 0x04
    ACTION = 0x05
    FACTORY_RESET = 0x06
    REBOOT = 0x08
    CLEAR = 0x10
    STATUS = 0x55
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83
    BULK_READ = 0x92
    BULK_WRITE = 0x93


class Error(IntEnum):
    """Bits 0 to 6 of a status packet's error byte."""

    NONE = 0
    RESULT_FAIL = 1
    INSTRUCTION = 2
    CRC = 3
    DATA_RANGE = 4
    DATA_LENGTH = 5
    DATA_LIMIT = 6
    ACCESS = 7


ALERT = 0x80


@dataclass(frozen=True)
class Request:
    """An instruction packet.

    Attributes:
        device_id: ID to which it is addressed.
        instruction: Any byte; see `Instruction`.
        parameters: Parameters without stuffing.
        is_intact: True if its CRC was right.
    """

    device_id: int
    instruction: int
    parameters: bytes
    is_intact: bool = True


def _shifted(crc: int) -> int:
    for _ in range(8):
        crc = ((crc << 1) ^ 0x8005 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


_SHIFTED = tuple(_shifted(byte << 8) for byte in range(256))


def crc16(data: bytes) -> int:
    """Polynomial 0x8005, from 0, no reflection, no final XOR."""
    crc = 0
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ _SHIFTED[crc >> 8 ^ byte]
    return crc


def status(device_id: int, error: int, parameters: bytes = b"", *, stuffs_in_place: bool = False) -> bytes:
    """A status packet, stuffed and signed.

    Args:
        device_id: ID of the sender.
        error: Error byte.
        parameters: Parameters without stuffing.
        stuffs_in_place: True to stuff it as Dynamixel2Arduino did before 0.6.2: the byte behind a header within the
            packet is copied over all bytes that follow.
    """
    body = bytes((Instruction.STATUS, error)) + parameters
    begin = body.find(_STUFFED)
    if stuffs_in_place and begin >= 0:
        body = body[: begin + 3] + b"\xfd" * (len(body) - begin - 2)
    else:
        body = body.replace(_STUFFED, _STUFFED + b"\xfd")
    packet = _HEADER + bytes((device_id,)) + (len(body) + 2).to_bytes(2, "little") + body
    return packet + crc16(packet).to_bytes(2, "little")


class RequestParser:
    """Finds instruction packets in what comes, however it is cut; whatever else comes is skipped."""

    def __init__(self) -> None:
        self._held = bytearray()
        self._heard_s = 0.0

    def feed(self, data: bytes, now_s: float) -> list[Request]:
        """Return all packets that are complete now.

        Args:
            data: Bytes that have come.
            now_s: Time at which they came, in seconds.
        """
        if self._held and now_s - self._heard_s > _PATIENCE_S:
            self._held.clear()
        self._heard_s = now_s
        self._held += data
        found = []
        while (request := self._take()) is not None:
            found.append(request)
        return found

    def clear(self) -> None:
        """Forget the beginning of a packet."""
        self._held.clear()

    def _take(self) -> Request | None:
        while True:
            start = self._held.find(_HEADER)
            if start < 0:
                # The last three bytes may begin a header.
                del self._held[: max(len(self._held) - 3, 0)]
                return None
            del self._held[:start]
            if len(self._held) < 7:
                return None
            length = int.from_bytes(self._held[5:7], "little")
            if length < 3 or length > LONGEST:
                del self._held[0]
                continue
            end = 7 + length
            if len(self._held) < end:
                return None
            packet = bytes(self._held[:end])
            is_intact = crc16(packet[:-2]) == int.from_bytes(packet[-2:], "little")
            # Behind a wrong CRC may be a packet that began while another one was cut off: look again from there.
            del self._held[: end if is_intact else 1]
            body = packet[7:-2].replace(_STUFFED + b"\xfd", _STUFFED)
            return Request(packet[4], body[0], body[1:], is_intact)
