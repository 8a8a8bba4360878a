"""MAVLink packets: encoded to bytes for a vehicle, decoded from it to values.

pymavlink's generated codec packs, unpacks, checks and signs; it is made for that, and knows every message. Its search
for packets is not used: behind a header in noise it takes whole packets along, and without `MAVLINK20=1` in the
environment `mavutil` speaks MAVLink 1. What is sent is MAVLink 2; of MAVLink 1, whose packets cannot be signed, only
messages that were asked for are heard. Sources: mavlink.io (serialization, signing) and pymavlink 2.4.50.
"""

from collections.abc import Callable
from typing import Any, ClassVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from robosc_bridge.protocol.framing import FrameDecoder
from robosc_bridge.protocol.mavlink_signing import KEY_LENGTH

MAGIC = 0xFD
_HEADER = 10
_CHECKSUM = 2
_SIGNATURE = 13
_SIGNED = 1  # The only flag of what a receiver must understand.
_RADIO_STATUS = 109  # Radios put it into the stream themselves, and have no key.

_OLD_MAGIC = 0xFE
_OLD_HEADER = 6


class Codec:
    """Packs what is sent by one component, and unpacks what it hears; keeps sequence number and signing time.

    Used from several threads only under a lock.

    Args:
        system: Of the sender.
        component: Of the sender.
        key: Of signing: `KEY_LENGTH` bytes; None: packets are not signed, and signatures are not asked for.
        link: Of the signed stream.
        timestamp: Of the first signed packet, in units of 10 us since 2015 in UTC; each takes at least one.
        unsigned: Numbers of the messages that are let through without a valid signature; who takes them asks
            `is_signed`.
    """

    def __init__(
        self,
        system: int,
        component: int,
        key: bytes | None = None,
        link: int = 0,
        timestamp: int = 0,
        unsigned: frozenset[int] = frozenset(),
    ) -> None:
        self._codec: Any = dialect.MAVLink(None, srcSystem=system, srcComponent=component)
        if key is not None:
            if len(key) != KEY_LENGTH:
                raise ValueError(f"a key of MAVLink signing has {KEY_LENGTH} bytes, not {len(key)}")
            signing = self._codec.signing
            signing.secret_key = key
            signing.link_id = link
            signing.timestamp = timestamp
            signing.sign_outgoing = True
            signing.allow_unsigned_callback = lambda codec, number: number == _RADIO_STATUS or number in unsigned

    @property
    def timestamp(self) -> int:
        """Timestamp of the next signed packet; received packets may move it forward."""
        return int(self._codec.signing.timestamp)

    def not_before(self, timestamp: int) -> None:
        """Let time pass: the library moves the timestamp by packets alone."""
        self._codec.signing.timestamp = max(self._codec.signing.timestamp, timestamp)

    def encode(self, make: Callable[[Any], Any]) -> bytes:
        """The next packet.

        Args:
            make: Makes the message, with the library's codec.
        """
        packet = bytes(make(self._codec).pack(self._codec))
        self._codec.seq = (self._codec.seq + 1) % 256
        return packet

    def decode(self, packet: bytes) -> Any | None:
        """The library's message; None: checksum, contents or signature are wrong."""
        signing = self._codec.signing
        heard = dict(signing.stream_timestamps)
        try:
            found = self._codec.decode(bytearray(packet))
        except dialect.MAVError:
            found = None
        if found is None or not is_signed(found):
            # It notes the time of a packet before it checks who signed it: one forged or damaged packet from the far
            # future would shut out all that come.
            signing.stream_timestamps = heard
        return found


def is_signed(found: Any) -> bool:
    """Return True if a message of the library came with a valid signature.

    False where signatures are not asked for.
    """
    return bool(found.get_signed())


def is_old(found: Any) -> bool:
    """Return True if a message of the library came as MAVLink 1."""
    return bytes(found.get_msgbuf()[:1]) == bytes((_OLD_MAGIC,))


class Decoder[Content](FrameDecoder[Content]):
    """Decoder of MAVLink 2 packets; those of messages that the dialect does not know are skipped.

    Args:
        codec: Codec that checks and unpacks them.
        read: Function that returns the content of a message of the library; a `ValueError` means that it cannot be.
        old: Numbers of the messages, without extensions, that are also heard as MAVLink 1; its others are skipped.
    """

    first_byte: ClassVar[int] = MAGIC
    header_length: ClassVar[int] = _HEADER

    def __init__(self, codec: Codec, read: Callable[[Any], Content], old: frozenset[int] = frozenset()) -> None:
        super().__init__()
        # These messages lose no bytes at their end: every other length is that of noise.
        self._old_lengths = {number: int(dialect.mavlink_map[number].unpacker.size) for number in old}
        self._codec = codec
        self._read = read

    def take_datagram(self, data: bytes) -> list[Content]:
        """The packets of one datagram, which begins with one and has no noise; a search of every byte is not needed.

        After a packet whose length cannot be determined, the rest is dropped: a hostile datagram costs little time.
        """
        found: list[Content] = []
        at = 0
        while at + _HEADER <= len(data):
            if data[at] == _OLD_MAGIC:
                length = _OLD_HEADER + data[at + 1] + _CHECKSUM
            elif data[at] == MAGIC:
                length = _HEADER + data[at + 1] + _CHECKSUM + (_SIGNATURE if data[at + 2] & _SIGNED else 0)
            else:
                break
            if at + length > len(data):
                break
            frame = self._frame(data, at, length) if self._length(data, at) else None
            if frame is None:
                self.counts.bad_frames += 1
                self.counts.skipped_bytes += length
            else:
                self.counts.frames += 1
                found.append(frame)
            at += length
        self.counts.skipped_bytes += len(data) - at
        return found

    def _begin(self, data: bytes, at: int) -> int:
        new = super()._begin(data, at)
        if not self._old_lengths:
            return new
        old = data.find(_OLD_MAGIC, at) if new < 0 else data.find(_OLD_MAGIC, at, new)
        return new if old < 0 else old

    def _length(self, data: bytes, at: int) -> int:
        if data[at] == _OLD_MAGIC:
            is_heard = self._old_lengths.get(data[at + 5]) == data[at + 1]
            return _OLD_HEADER + data[at + 1] + _CHECKSUM if is_heard else 0
        flags = data[at + 2]
        # The checksum needs its message's extra byte.
        if flags & ~_SIGNED or int.from_bytes(data[at + 7 : at + 10], "little") not in dialect.mavlink_map:
            return 0
        return _HEADER + data[at + 1] + _CHECKSUM + (_SIGNATURE if flags & _SIGNED else 0)

    def _frame(self, data: bytes, at: int, length: int) -> Content | None:
        found = self._codec.decode(data[at : at + length])
        if found is None:
            return None
        try:
            return self._read(found)
        except ValueError:
            return None
