"""Packets of Dynamixel protocol 2.0 in a stream between two others, requests as well as answers.

The SDK's packet handler, which waits for one answer, is for those who send requests; here none are sent.
"""

from dataclasses import dataclass
from typing import ClassVar

from dynamixel_sdk import INST_STATUS

from robosc_bridge.protocol.dynamixel import PacketHandler, status_of, unstuffed
from robosc_bridge.protocol.framing import FrameDecoder

_HEADER = b"\xff\xff\xfd\x00"
_BODY = 7
_CHECKSUM = 2
_LONGEST = 2048
_HANDLER = PacketHandler()


@dataclass(frozen=True, slots=True)
class Packet:
    """A packet.

    Attributes:
        device: Id of the device that it is for, or from.
        instruction: Instruction; `INST_STATUS` for an answer.
        parameters: Bytes that follow, without stuffing; of an answer, its error comes first.
    """

    device: int
    instruction: int
    parameters: bytes

    @property
    def is_answer(self) -> bool:
        """True if a device has sent it."""
        return bool(self.instruction == INST_STATUS)


class PacketDecoder(FrameDecoder[Packet]):
    """Decoder that finds packets."""

    first_byte: ClassVar[int] = _HEADER[0]
    header_length: ClassVar[int] = _BODY

    def _length(self, data: bytes, at: int) -> int:
        length = int.from_bytes(data[at + 5 : at + 7], "little")
        is_header = data[at : at + len(_HEADER)] == _HEADER and 1 + _CHECKSUM <= length <= _LONGEST
        return _BODY + length if is_header else 0

    def _frame(self, data: bytes, at: int, length: int) -> Packet | None:
        end = at + length - _CHECKSUM
        checksum = int.from_bytes(data[end : end + _CHECKSUM], "little")
        expected: int = _HANDLER.updateCRC(0, list(data[at:end]), length - _CHECKSUM)
        if expected != checksum:
            return None
        body = unstuffed(data[at + _BODY : end])
        found = Packet(data[at + 4], body[0], bytes(body[1:]))
        if found.is_answer and status_of([*data[at : at + _BODY], *body, 0, 0]) is None:
            return None
        return found
