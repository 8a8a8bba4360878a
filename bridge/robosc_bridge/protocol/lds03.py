"""LDS-03 (COIN-D4): frames of a variable number of points between two angles, checked by an XOR of sixteen bits.

Format, checksum and validity are those of ROBOTIS' coin_d4_driver 1.0.1 (src/lidar_sdk/lidar_data_processor.cpp); the
checksum holds for frames captured from a real device. Two things are done otherwise. Points are where they were
measured, while that driver spreads them evenly over the turn. And a turn ends where the angle passes 0: the mark of a
ring start says the same, and a lost one would join two turns.
"""

import math
from dataclasses import dataclass
from functools import reduce
from operator import xor

from robosc_bridge.protocol.framing import FrameDecoder
from robosc_bridge.protocol.turns import WIDEST_STEP_DEG, Points, wrapped_deg

START = bytes.fromhex("aa55f00f")
STOP = bytes.fromhex("aa55f50a")

RANGE_MIN_M = 0.05
RANGE_MAX_M = 12.0

MOST_SAMPLES = 50
"""Twice as many as a frame was ever seen to have: a false header holds the frames behind it up no longer than two."""

_HEADER = b"\xaa\x55"
_SAMPLES = 10
_HALF_TURN_TICKS = 180 * 64
_TURN_TICKS = 2 * _HALF_TURN_TICKS
# What is this near and this weak is no obstacle for the official driver.
_WEAK_RANGE_MM = 150
_WEAK_INTENSITY = 65


@dataclass(frozen=True, slots=True)
class Frame:
    """Some points.

    Attributes:
        is_ring_start: Whether it is the first of a turn.
        frequency_hz: Turns a second; None: only the first frame of a turn tells.
        first_ticks: Angle of the first point, clockwise, in 64ths of a degree.
        last_ticks: Angle of the last point.
        distances_mm: 0: nothing measured.
        intensities: Up to 254; 255: over-exposed.
    """

    is_ring_start: bool
    frequency_hz: float | None
    first_ticks: int
    last_ticks: int
    distances_mm: tuple[int, ...]
    intensities: tuple[int, ...]


class Decoder(FrameDecoder[Frame]):
    """Finds frames of an LDS-03."""

    first_byte = _HEADER[0]
    header_length = 7

    def _length(self, data: bytes, at: int) -> int:
        samples = data[at + 3]
        is_header = data[at + 1] == _HEADER[1] and data[at + 4] & data[at + 6] & 1 and 0 < samples <= MOST_SAMPLES
        return _SAMPLES + 3 * samples if is_header else 0

    def _frame(self, data: bytes, at: int, length: int) -> Frame | None:
        data = data[at : at + length]
        # The sixteen-bit words of the header; of a sample, its first byte, and its second and third as a word.
        low, middle, high = data[_SAMPLES::3], data[_SAMPLES + 1 :: 3], data[_SAMPLES + 2 :: 3]
        if reduce(xor, low, reduce(xor, middle, data[0] ^ data[2] ^ data[4] ^ data[6])) != data[8]:
            return None
        if reduce(xor, high, data[1] ^ data[3] ^ data[5] ^ data[7]) != data[9]:
            return None
        first_ticks = int.from_bytes(data[4:6], "little") >> 1
        last_ticks = int.from_bytes(data[6:8], "little") >> 1
        if not _is_plausible(first_ticks, last_ticks, len(low)):
            return None
        is_ring_start = bool(data[2] & 1)
        return Frame(
            is_ring_start,
            (data[2] >> 1) / 10 if is_ring_start else None,
            first_ticks,
            last_ticks,
            tuple([b2 << 6 | b1 >> 2 for b1, b2 in zip(middle, high, strict=True)]),
            tuple([255 if b0 & 1 else min((b1 & 3) << 6 | b0 >> 2, 254) for b0, b1 in zip(low, middle, strict=True)]),
        )


def _span_ticks(first_ticks: int, last_ticks: int) -> int:
    """How far it is from the first point to the last one; negative: backward, which cannot be."""
    if first_ticks > 3 * _HALF_TURN_TICKS // 2 and last_ticks < _HALF_TURN_TICKS // 2:
        last_ticks += _TURN_TICKS
    return last_ticks - first_ticks


def _is_plausible(first_ticks: int, last_ticks: int, samples: int) -> bool:
    if max(first_ticks, last_ticks) > _TURN_TICKS:
        return False
    return samples == 1 or 0 <= _span_ticks(first_ticks, last_ticks) <= WIDEST_STEP_DEG * 64 * (samples - 1)


def points(frame: Frame) -> Points:
    """Where the points of a frame are."""
    samples = len(frame.distances_mm)
    step_deg = _span_ticks(frame.first_ticks, frame.last_ticks) / 64 / max(samples - 1, 1)
    first_deg = frame.first_ticks / 64
    counted = tuple([(first_deg + k * step_deg) % 360.0 for k in range(samples)])
    return Points(
        counted,
        tuple([wrapped_deg(360.0 - counted_deg) for counted_deg in counted]),
        tuple([_range_m(*sample) for sample in zip(frame.distances_mm, frame.intensities, strict=True)]),
        frame.intensities,
        frame.frequency_hz,
    )


def _range_m(distance_mm: int, intensity: int) -> float:
    range_m = distance_mm / 1000
    if not RANGE_MIN_M <= range_m <= RANGE_MAX_M or (distance_mm <= _WEAK_RANGE_MM and intensity <= _WEAK_INTENSITY):
        return math.nan
    return range_m
