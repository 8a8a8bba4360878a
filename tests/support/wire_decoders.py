"""Duties of every decoder of the bridge for any bytes, as functions for a fuzzer: they raise where one is broken.

No bytes raise; what is held is bounded, and so is all that is allocated; and at most two frames after any bytes, a
device is understood as from a fresh start.
"""

import math
import tracemalloc
from collections.abc import Callable, Sequence
from random import Random
from typing import Any

from robosc_bridge.protocol import lds01, lds02, lds03, opencr, servo
from robosc_bridge.protocol.dynamixel import MAX_DEVICE, PacketHandler, status_of
from robosc_bridge.protocol.framing import FrameDecoder
from robosc_bridge.protocol.mavlink import Codec, Decoder
from robosc_bridge.protocol.mavlink_messages import vehicle_message
from robosc_bridge.protocol.revolutions import Points, RevolutionBuilder, nearest_by_degree
from support import peer
from support.lidar_frames import lds01_frame, lds02_frame, lds03_frame

MOST_BYTES = 200_000
"""Bytes that a decoder may allocate beside what it is fed and returns, at any moment."""

_FRAMES = 8
_LOST = 2
# The longest false header of a MAVLink packet hides so many of its shortest ones.
_HEARTBEAT = bytes.fromhex("fd 09 00 00 00 01 bf 00 00 00 00 00 00 00 12 08 00 04 03 ae c6")
_HIDDEN = 1 + 280 // len(_HEARTBEAT)


def pieces(data: bytes) -> list[bytes]:
    """The bytes behind the first one, cut as it says."""
    dice, rest, found = Random(data[0] if data else 0), data[1:], []
    while rest:
        length = dice.choice((1, 2, 7, 42, 100, 4096))
        found.append(rest[:length])
        rest = rest[length:]
    return found


def _require(holds: bool, what: str) -> None:
    if not holds:
        raise AssertionError(what)


def _fed(decoder: FrameDecoder[Any], data: bytes, longest: int) -> list[Any]:
    """Return the frames that a decoder finds in data, whole or in pieces; it holds no more than a frame."""
    found = []
    for piece in pieces(data):
        found += decoder.feed(piece)
        _require(len(decoder._waiting) < longest + decoder.look_ahead, "it holds more than a frame")
    counts = decoder.counts
    _require(counts.frames == len(found), "frames are counted wrongly")
    _require(counts.skipped_bytes <= len(data), "it has skipped more bytes than there were")
    return found


def _goes_on(decoder: FrameDecoder[Any], fresh: FrameDecoder[Any], frames: Sequence[bytes]) -> None:
    expected = fresh.feed(b"".join(frames[_LOST:]))
    found = [item for frame in frames for item in decoder.feed(frame)]
    _require(found[-len(expected) :] == expected, "it is not understood two frames later")


def _lidar(
    make: Callable[[], FrameDecoder[Any]],
    longest: int,
    nth: Callable[[int], bytes],
    points: Callable[[Any], Points],
    data: bytes,
) -> None:
    decoder, builder = make(), RevolutionBuilder()
    for frame in _fed(decoder, data, longest):
        revolution = builder.add(points(frame))
        if revolution is not None:
            _require(
                len(nearest_by_degree(revolution.angles_deg, revolution.ranges_m)) == 360, "a turn has not 360 bins"
            )
    whole = make().feed(data[1:])
    _require(len(whole) == decoder.counts.frames, "how the bytes are cut changes what is found")
    _goes_on(decoder, make(), [nth(number) for number in range(_FRAMES)])


def _nth_lds01(number: int) -> bytes:
    return lds01_frame(number, [(1000, 500 + number)] * 6)


def _nth_lds02(number: int) -> bytes:
    start = number * 1123 % 36000
    return lds02_frame(start, (start + 1030) % 36000, [(500 + number, 200)] * 12)


def _nth_lds03(number: int) -> bytes:
    return lds03_frame(number * 22.5, number * 22.5 + 21.6, [(500 + number, 200)] * 25)


def on_lds01(data: bytes) -> None:
    """Any bytes from an LDS-01."""
    _lidar(lds01.Decoder, 42, _nth_lds01, lds01.points, data)


def on_lds02(data: bytes) -> None:
    """Any bytes from an LDS-02."""
    _lidar(lds02.Decoder, 47, _nth_lds02, lds02.points, data)


def on_lds03(data: bytes) -> None:
    """Any bytes from an LDS-03."""
    _lidar(lds03.Decoder, 10 + 3 * lds03.MOST_SAMPLES, _nth_lds03, lds03.points, data)


def on_mavlink(data: bytes) -> None:
    """Any bytes from a vehicle."""
    decoder = Decoder(Codec(255, 190), vehicle_message)
    _fed(decoder, data, 280)
    found = decoder.feed(_HEARTBEAT * (_HIDDEN + 2))
    _require(len(found) >= 2, "it is not understood after what a false header may hide")


class _Port:
    """Bytes in memory, as dynamixel-sdk reads a port: at most so many a turn."""

    is_using = False

    def __init__(self, incoming: bytes) -> None:
        self._incoming = incoming

    def readPort(self, length: int) -> bytes:
        taken, self._incoming = self._incoming[:length], self._incoming[length:]
        return taken

    def isPacketTimeout(self) -> bool:
        return not self._incoming


def on_dynamixel(data: bytes) -> None:
    """Any bytes before an answer of a Dynamixel device: after at most two requests it is read as it was sent."""
    answer = peer.status(7, b"\x01\x02\x03\x04")
    for garbage in (data, b"\xff\xff\xfd\x00" + data):
        port, handler = _Port(garbage), PacketHandler()
        while not port.isPacketTimeout():
            packet, result = handler.rxPacket(port, False)
            if result == 0 and (status := status_of(packet)) is not None:
                _require(status.device <= MAX_DEVICE and len(status.data) <= len(garbage), "an impossible answer")
    # Bytes from before are discarded with the request: `DynamixelPort.clearPort`.
    packet, result = PacketHandler().rxPacket(_Port(answer), False)
    found = status_of(packet) if result == 0 else None
    _require(found is not None and (found.device, found.data) == (7, b"\x01\x02\x03\x04"), "an answer is not read")


def on_registers(data: bytes) -> None:
    """Any contents of the registers that OpenCR and servos are asked for."""
    block = opencr.decode_block(data[: opencr.BLOCK_LENGTH].ljust(opencr.BLOCK_LENGTH, b"\0"))
    _require(0.0 <= block.battery_share <= 1.0, "an impossible charge")
    _require(all(math.isfinite(value) for value in block.motion.values()), "a motion that is not a number")
    servo.decode_measurement(data[: servo.MEASUREMENT_LENGTH].ljust(servo.MEASUREMENT_LENGTH, b"\0"))


TARGETS: dict[str, Callable[[bytes], None]] = {
    "lds01": on_lds01,
    "lds02": on_lds02,
    "lds03": on_lds03,
    "mavlink": on_mavlink,
    "dynamixel": on_dynamixel,
    "registers": on_registers,
}
"""Targets by name of the decoder."""

SEEDS: dict[str, tuple[bytes, ...]] = {
    "lds01": (b"\0" + b"".join(map(_nth_lds01, range(20))),),
    "lds02": (b"\0" + b"".join(map(_nth_lds02, range(20))),),
    "lds03": (b"\0" + b"".join(map(_nth_lds03, range(16))),),
    "mavlink": (b"\0" + _HEARTBEAT * 4,),
    "dynamixel": (peer.status(1, bytes(10)), peer.status(2, b"\xff\xff\xfd\xfd")),
    "registers": (bytes(range(200)),),
}
"""Sound bytes to begin with."""


def judge(name: str, data: bytes) -> None:
    """See that a decoder owes nothing for some bytes, and allocates no more than it may."""
    TARGETS[name](data)
    tracemalloc.start()
    try:
        TARGETS[name](data)
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # Twice as they are cut, and every object that is found in them.
    _require(most <= MOST_BYTES + 100 * len(data), f"it allocates {most} bytes for {len(data)}")
