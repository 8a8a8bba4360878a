"""Frames of the three LiDARs: the worked ones byte for byte, and streams against a decoder of whole strings."""

import math
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.protocol import lds01, lds02, lds03
from robosc_bridge.protocol.framing import FrameDecoder
from support import lidar_frames
from support.lidar_frames import lds01_frame, lds02_frame, lds03_frame

LDS01_FRAME = bytes.fromhex(
    "fa a0 b8 0b e8 03 f4 01 00 00 e8 03 f5 01 00 00 e8 03 f6 01 00 00 00 00 00 00 00 00 84 03 d0 07 00 00"
    "52 03 ab 0d 00 00 94 94"
)
LDS02_FRAME = bytes.fromhex(
    "54 2c 68 08 ab 7e e0 00 e4 dc 00 e2 00 00 00 e8 03 c8 e9 03 c8 ea 03 c8 eb 03 c8 ec 03 c8 ed 03 c8 ee 03 c8"
    "ef 03 c8 b0 00 ea be 82 3a 1a 51"
)
LDS03_RING_START = bytes.fromhex("aa 55 c9 01 01 00 01 00 e0 5b 20 a3 0f")
LDS03_FRAME = bytes.fromhex("aa 55 00 05 01 05 cd 06 6c ef 20 a3 0f 1c cb 0f 00 00 00 f0 80 bb fd d3 07")
LDS03_CAPTURED = bytes.fromhex(
    "aa 55 00 19 cb 6f 77 76 87 55 50 03 00 2c 2b 0a 38 57 0a 74 8f 0a 88 9b 0a 14 b3 0a 60 c6 0a ac c1 0a 68 b1 0a"
    "68 9d 0a 78 8d 0a 88 81 0a 98 79 0a 98 75 0a 84 6d 0a 90 65 0a a4 4d 0a a8 41 0a ac 3d 0a d4 35 0a e8 29 0a"
    "14 22 0a b8 a5 0a a8 ce 0a f4 e6 0a"
)
# The bytes of an LDS-03 before its first frame: noise, its name, and an answer.
LDS03_GREETING = bytes.fromhex(
    "a5 5a fa fa a5 5a 14 00 e3 02 01 43 4f 49 4e 2d 44 34" + "00" * 12 + "01 a5 5a 00 00 80 01 81"
)


@dataclass(frozen=True)
class Kind:
    name: str
    make: Callable[[], FrameDecoder[Any]]
    twin: Callable[[bytes], tuple[list[Any], int]]
    longest: int
    header: bytes
    # Frame number n of a device that never stops.
    nth: Callable[[int, Random], bytes]


def _nth_lds01(n: int, dice: Random) -> bytes:
    return lds01_frame(n % 60, [(dice.randrange(65536), dice.randrange(65536)) for _ in range(6)])


def _nth_lds02(n: int, dice: Random) -> bytes:
    start = n * 1123 % 36000
    points = [(dice.randrange(65536), dice.randrange(256)) for _ in range(12)]
    return lds02_frame(start, (start + 1030) % 36000, points, time_ms=dice.randrange(65536))


def _nth_lds03(n: int, dice: Random) -> bytes:
    first = n * 22.5 % 360
    ring_start_dhz = dice.randrange(128) if first == 0 else None
    points = [(dice.randrange(16384), dice.randrange(256)) for _ in range(25)]
    return lds03_frame(first, (first + 21.6) % 360, points, ring_start_dhz=ring_start_dhz)


KINDS = [
    Kind("lds01", lds01.Decoder, lidar_frames.decode_lds01, 44, b"\xfa\xa0", _nth_lds01),
    Kind("lds02", lds02.Decoder, lidar_frames.decode_lds02, 47, b"\x54\x2c", _nth_lds02),
    Kind("lds03", lds03.Decoder, lidar_frames.decode_lds03, 160, b"\xaa\x55\x00\x32\x01\x00\x01", _nth_lds03),
]
each_kind = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)


# Worked frames


def test_lds01_worked_frame() -> None:
    decoder = lds01.Decoder()
    successor = b"\xfa\xa1"
    [frame] = decoder.feed(LDS01_FRAME + successor)
    assert frame == lds01.Frame(0, 3000, (500, 501, 502, 0, 2000, 3499), (1000, 1000, 1000, 0, 900, 850))
    points = lds01.points(frame)
    assert points.angles_deg == (359, 358, 357, 356, 355, 354)
    assert [*points.ranges_m[:3], *points.ranges_m[4:]] == [0.5, 0.501, 0.502, 2.0, 3.499]
    assert math.isnan(points.ranges_m[3])
    assert points.revolutions_per_s == 5.0


def test_lds02_worked_frame() -> None:
    [frame] = lds02.Decoder().feed(LDS02_FRAME)
    distances = (224, 220, 0, *range(1000, 1008), 176)
    assert frame == lds02.Frame(2152, 32427, 33470, 6714, distances, (228, 226, 0, *(200,) * 8, 234))
    points = lds02.points(frame)
    assert points.counted_deg == tuple(round(324.27 + 0.94 * k, 2) for k in range(12))
    assert points.revolutions_per_s == pytest.approx(5.978, abs=0.001)


def test_lds02_is_corrected_to_the_axis_of_its_motor() -> None:
    [frame] = lds02.Decoder().feed(lds02_frame(9000, 9000, [(1000, 200)] * 12))
    points = lds02.points(frame)
    assert points.angles_deg[0] == pytest.approx(275.626, abs=0.0005)
    assert points.ranges_m[0] == pytest.approx(1.0108, abs=0.00005)


def test_lds02_without_a_reading_stays_at_its_angle() -> None:
    [frame] = lds02.Decoder().feed(lds02_frame(0, 1100, [(0, 0)] * 12))
    points = lds02.points(frame)
    assert points.angles_deg[:2] == (0.0, 359.0)
    assert all(math.isnan(range_m) for range_m in points.ranges_m)


def test_lds03_worked_frames() -> None:
    ring_start, frame = lds03.Decoder().feed(LDS03_RING_START + LDS03_FRAME)
    assert ring_start == lds03.Frame(True, 10.0, 0, 0, (1000,), (200,))
    assert frame == lds03.Frame(False, None, 640, 870, (1000, 1010, 0, 12000, 500), (200, 199, 0, 60, 255))
    points = lds03.points(frame)
    step_deg = (870 / 64 - 10) / 4
    assert points.counted_deg == tuple(10 + k * step_deg for k in range(5))
    assert points.angles_deg == tuple(360 - 10 - k * step_deg for k in range(5))
    assert [*points.ranges_m[:2], *points.ranges_m[3:]] == [1.0, 1.01, 12.0, 0.5]
    assert math.isnan(points.ranges_m[2])


def test_lds03_frame_over_zero() -> None:
    [frame] = lds03.Decoder().feed(lds03_frame(359, 1, [(1000, 200)] * 5))
    points = lds03.points(frame)
    assert points.counted_deg == (359, 359.5, 0, 0.5, 1)
    assert points.angles_deg == (1, 0.5, 0, 359.5, 359)


def test_lds03_captured_frame() -> None:
    [frame] = lds03.Decoder().feed(LDS03_GREETING + LDS03_CAPTURED)
    samples = list(zip(frame.distances_mm, frame.intensities, strict=True))
    assert samples[:3] == [(0, 212), (650, 203), (661, 206)]
    assert samples[-1] == (697, 189)
    assert (frame.first_ticks / 64, frame.last_ticks / 64) == pytest.approx((223.578, 236.922), abs=0.001)


def test_commands() -> None:
    assert (lds01.START, lds01.STOP) == (b"b", b"e")
    assert lds03.START.hex(" ") == "aa 55 f0 0f"
    assert lds03.STOP.hex(" ") == "aa 55 f5 0a"


def test_crc8_check_value() -> None:
    assert lds02.crc8(b"123456789") == 0xC3


def test_the_tests_own_encoders_make_the_worked_frames() -> None:
    intensities = (1000, 1000, 1000, 0, 900, 850)
    points = list(zip(intensities, (500, 501, 502, 0, 2000, 3499), strict=True))
    assert lds01_frame(0, points) == LDS01_FRAME
    points = [(224, 228), (220, 226), (0, 0), *((1000 + k, 200) for k in range(8)), (176, 234)]
    assert lds02_frame(32427, 33470, points, time_ms=6714) == LDS02_FRAME
    assert lds03_frame(0, 0, [(1000, 200)], ring_start_dhz=100) == LDS03_RING_START
    assert lidar_frames.xor16(LDS03_FRAME) == LDS03_FRAME[8:10]
    assert lidar_frames.xor16(LDS03_CAPTURED) == LDS03_CAPTURED[8:10]


# Valid frames


@pytest.mark.parametrize(
    ("distance_mm", "is_valid"),
    [(0, False), (1, True), (119, True), (120, True), (3500, True), (3501, False), (65535, False)],
)
def test_lds01_range_and_what_is_too_near_for_it(distance_mm: int, is_valid: bool) -> None:
    points = lds01.points(lds01.Frame(3, 3000, (distance_mm,) * 6, (0,) * 6))
    assert [math.isfinite(range_m) for range_m in points.ranges_m] == [is_valid] * 6


@pytest.mark.parametrize(
    ("distance_mm", "is_valid"), [(0, False), (1, True), (160, True), (7930, True), (8000, False), (65535, False)]
)
def test_lds02_range_however_weak(distance_mm: int, is_valid: bool) -> None:
    points = lds02.points(lds02.Frame(2152, 0, 1100, 0, (distance_mm,) * 12, (1,) * 12))
    assert [math.isfinite(range_m) for range_m in points.ranges_m] == [is_valid] * 12


@pytest.mark.parametrize(
    ("distance_mm", "intensity", "is_valid"),
    [
        (0, 200, False),
        (1, 66, True),
        (49, 200, True),
        (49, 65, False),
        (50, 66, True),
        (50, 65, False),
        (150, 65, False),
        (150, 66, True),
        (151, 0, True),
        (12000, 0, True),
        (12001, 255, False),
    ],
)
def test_lds03_range_and_weak_near_points(distance_mm: int, intensity: int, is_valid: bool) -> None:
    points = lds03.points(lds03.Frame(False, None, 0, 0, (distance_mm,), (intensity,)))
    assert [math.isfinite(range_m) for range_m in points.ranges_m] == [is_valid]


@pytest.mark.parametrize(
    ("speed", "revolutions_per_s"),
    [(3000, 5.0), (300, 5.0), (200, 200 / 60), (400, 400 / 60), (199, 199 / 600), (401, 401 / 600), (0, 0.0)],
)
def test_lds01_speed_in_either_unit(speed: int, revolutions_per_s: float) -> None:
    assert lds01.revolutions_per_s(speed) == revolutions_per_s


@pytest.mark.parametrize(
    ("start_cdeg", "end_cdeg", "speed", "is_good"),
    [
        (0, 1030, 2152, True),
        (35900, 930, 2152, True),  # Over 0 degrees.
        (0, 1600, 2152, True),
        (0, 1700, 2152, False),  # Further than the motor turns.
        (0, 1030, 0, False),
        (1000, 900, 2152, False),  # Backward.
        (36001, 36001, 2152, False),
        (0, 36100, 2152, False),
        (0, 0, 6900, True),
        (0, 0, 6901, False),
    ],
)
def test_lds02_frames_that_cannot_be(start_cdeg: int, end_cdeg: int, speed: int, is_good: bool) -> None:
    decoder = lds02.Decoder()
    found = decoder.feed(lds02_frame(start_cdeg, end_cdeg, [(1000, 200)] * 12, speed=speed))
    assert (len(found), decoder.counts.frames, decoder.counts.bad_frames) == (is_good, is_good, not is_good)


def test_lds02_other_kind_of_header() -> None:
    body = b"\x54\xec" + LDS02_FRAME[2:46]
    assert len(lds02.Decoder().feed(body + bytes([lidar_frames.crc8(body)]))) == 1


@pytest.mark.parametrize(
    ("first_deg", "last_deg", "samples", "is_good"),
    [
        (0, 21.6, 25, True),
        (350, 11.6, 25, True),
        (11.6, 350, 25, False),
        (20, 10, 25, False),
        (10, 10, 1, True),
        (10, 20, 1, True),
        (0, 3, 2, True),
        (0, 3.1, 2, False),
        (361, 361, 1, False),
        (0, 10, 50, True),
        (0, 10, 51, False),
    ],
)
def test_lds03_frames_that_cannot_be(first_deg: float, last_deg: float, samples: int, is_good: bool) -> None:
    decoder = lds03.Decoder()
    assert len(decoder.feed(lds03_frame(first_deg, last_deg, [(1000, 200)] * samples))) == is_good


@pytest.mark.parametrize("byte", [4, 6])
def test_lds03_angles_have_a_mark(byte: int) -> None:
    frame = bytearray(LDS03_FRAME)
    frame[byte] ^= 1
    frame[8:10] = lidar_frames.xor16(bytes(frame))
    assert not lds03.Decoder().feed(bytes(frame))


# Streams


def _stream(kind: Kind, seed: int, frames: int) -> list[bytes]:
    dice = Random(seed)
    return [kind.nth(n, dice) for n in range(frames)]


def _hurt(kind: Kind, frames: list[bytes], dice: Random, faults: int) -> bytes:
    """The stream with bytes lost, added and changed, and headers of frames that are none."""
    data = bytearray(b"".join(frames))
    for _ in range(faults):
        at = dice.randrange(len(data))
        match dice.randrange(5):
            case 0:
                data[at] = dice.randrange(256)
            case 1:
                del data[at : at + dice.randrange(1, 60)]
            case 2:
                data[at:at] = dice.randbytes(dice.randrange(1, 60))
            case 3:
                data[at:at] = kind.header
            case _:
                data[at : at + len(kind.header)] = kind.header
    return bytes(data)


def _cut(data: bytes, dice: Random) -> list[bytes]:
    pieces = []
    while data:
        length = dice.choice((1, 1, 2, 7, 41, 42, 43, 100, 4096))
        pieces.append(data[:length])
        data = data[length:]
    return pieces


@each_kind
@given(seed=st.integers(0, 2**32), faults=st.integers(0, 12))
def test_pieces_are_decoded_as_the_twin_decodes_the_whole(kind: Kind, seed: int, faults: int) -> None:
    dice = Random(seed)
    data = _hurt(kind, _stream(kind, seed, 25), dice, faults)[dice.randrange(100) :]
    expected, waiting = kind.twin(data)
    decoder = kind.make()
    found = [frame for piece in _cut(data, dice) for frame in decoder.feed(piece)]
    assert found == expected
    assert decoder.counts.frames == len(expected)
    skipped = decoder.counts.skipped_bytes
    decoder.forget()
    assert decoder.counts.skipped_bytes == skipped + waiting


@each_kind
@given(data=st.binary(max_size=400), seed=st.integers(0, 2**32))
def test_any_bytes_are_decoded_as_the_twin_decodes_them(kind: Kind, data: bytes, seed: int) -> None:
    data = data.replace(b"\0", kind.header)
    decoder = kind.make()
    assert [frame for piece in _cut(data, Random(seed)) for frame in decoder.feed(piece)] == kind.twin(data)[0]


@each_kind
@given(seed=st.integers(0, 2**32), garbage=st.binary(max_size=300), is_header=st.booleans())
def test_two_frames_after_garbage_it_goes_on(kind: Kind, seed: int, garbage: bytes, is_header: bool) -> None:
    frames = _stream(kind, seed, 8)
    decoder = kind.make()
    begun = frames[0][: Random(seed).randrange(len(frames[0]))]
    decoder.feed(begun + garbage + (kind.header if is_header else b""))
    expected = kind.make().feed(b"".join(frames[2:]))
    found = [frame for data in frames for frame in decoder.feed(data)]
    # At most two frames are lost, and no later than two frames' time after the garbage the stream is up to date.
    assert found[-len(expected) :] == expected


@each_kind
def test_every_byte_is_in_a_frame_or_skipped_or_waits(kind: Kind) -> None:
    dice = Random(1)
    decoder = kind.make()
    fed = 0
    for _ in range(50):
        data = _hurt(kind, _stream(kind, dice.randrange(99), 30), dice, 5)
        fed += len(data)
        for piece in _cut(data, dice):
            decoder.feed(piece)
    decoder.forget()
    length = {"lds01": 42, "lds02": 47, "lds03": 85}[kind.name]
    assert decoder.counts.frames * length + decoder.counts.skipped_bytes == fed
    assert decoder.counts.bad_frames > 50


@each_kind
def test_a_false_header_does_not_swallow_the_frame_behind_it(kind: Kind) -> None:
    frames = _stream(kind, 3, 6)
    decoder = kind.make()
    found = decoder.feed(b"".join(frames[:3]) + kind.header + b"".join(frames[3:]) + frames[5] + bytes(160))
    assert len(found) >= 6
    assert decoder.counts.bad_frames >= 1


@each_kind
def test_a_changed_bit_is_a_bad_frame_and_costs_no_other(kind: Kind) -> None:
    frames = _stream(kind, 4, 60)
    decoder = kind.make()
    clean = kind.make().feed(b"".join(frames))
    decoder.feed(b"".join(frames[:30]))
    broken = bytearray(frames[30])
    broken[20] ^= 4
    assert decoder.feed(bytes(broken) + b"".join(frames[31:])) == clean[31:]
    assert decoder.counts.frames == 59
    assert decoder.counts.bad_frames >= 1


@each_kind
@pytest.mark.parametrize("noise", ["random", "headers", "first bytes"])
def test_memory_is_bounded(kind: Kind, noise: str) -> None:
    dice = Random(5)
    decoder = kind.make()

    def piece() -> bytes:
        match noise:
            case "random":
                return dice.randbytes(4096)
            case "headers":
                return kind.header * 500
        return kind.header[:1] * 4096

    decoder.feed(piece())
    tracemalloc.start()
    try:
        for _ in range(20):
            decoder.feed(piece())
        now, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert now < 8_000
    assert most < 100_000


# The check bytes of an LDS-01, whose formula no source is sure of


def _lds01_stream(frames: int, check: Callable[[int], tuple[int, int] | None]) -> list[bytes]:
    dice = Random(6)
    return [
        lds01_frame(n % 60, [(dice.randrange(999), dice.randrange(120, 3500)) for _ in range(6)], check=check(n))
        for n in range(frames)
    ]


def test_lds01_takes_frames_whatever_their_check_bytes_are() -> None:
    dice = Random(7)
    decoder = lds01.Decoder()
    stream = b"".join(_lds01_stream(200, lambda n: (dice.randrange(256), dice.randrange(256))))
    assert len(decoder.feed(stream)) == 200
    assert decoder.counts.bad_frames == 0


@pytest.mark.parametrize(("frames_before", "is_taken"), [(15, True), (16, False)])
def test_lds01_holds_a_device_to_equal_check_bytes_once_it_always_sent_them(frames_before: int, is_taken: bool) -> None:
    dice = Random(8)

    def check(n: int) -> tuple[int, int]:
        byte = dice.randrange(256)
        return byte, byte ^ (n == frames_before)

    decoder = lds01.Decoder()
    assert len(decoder.feed(b"".join(_lds01_stream(frames_before + 1, check)) + b"\xfa")) == frames_before + is_taken


@pytest.mark.parametrize(("frames_before", "is_taken"), [(15, True), (16, False)])
def test_lds01_holds_a_device_to_the_sum_once_it_always_sent_it(frames_before: int, is_taken: bool) -> None:
    frames = _lds01_stream(frames_before + 1, lambda _: None)
    broken = bytearray(frames[-1])
    broken[7] ^= 1
    decoder = lds01.Decoder()
    assert len(decoder.feed(b"".join(frames[:-1]) + bytes(broken))) == frames_before + is_taken


def test_lds01_forgets_what_it_knows_of_a_device() -> None:
    decoder = lds01.Decoder()
    decoder.feed(b"".join(_lds01_stream(20, lambda _: None)))
    decoder.forget()
    assert len(decoder.feed(b"".join(_lds01_stream(20, lambda n: (n, n + 1))))) == 20


def test_lds01_without_a_known_check_waits_for_the_successor_of_a_frame_that_follows_none() -> None:
    frames = _lds01_stream(3, lambda n: (n, n + 1))
    decoder = lds01.Decoder()
    assert len(decoder.feed(frames[0] + frames[1][:2])) == 1
    # One byte too many, which looks like a beginning.
    decoder.forget()
    assert len(decoder.feed(frames[0] + b"\xfa" + frames[1])) == 0
    assert len(decoder.feed(frames[0] + frames[1] + b"\xfa" + frames[2])) == 2
    assert len(decoder.feed(b"\xfa\xa3")) == 1


def test_lds01_without_a_known_check_takes_no_frame_out_of_order() -> None:
    frames = _lds01_stream(10, lambda n: (n, n + 1))
    decoder = lds01.Decoder()
    # The jump from 2 to 5 may be a broken index: frame 5 is not taken, the others are in order again.
    found = decoder.feed(b"".join(frames[:3] + frames[5:]))
    assert [frame.index for frame in found] == [0, 1, 2, 6, 7, 8, 9]
