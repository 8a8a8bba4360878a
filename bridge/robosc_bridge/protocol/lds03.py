"""LDS-03 (COIN-D4): frames of a variable number of points between two angles, checked by an XOR of sixteen bits.

Format, checksum and validity are those of ROBOTIS' coin_d4_driver 1.0.1 (src/lidar_sdk/lidar_data_processor.cpp); the
checksum holds for frames captured from a real device. Two things are done otherwise. Points are where they were
measured, while that driver spreads them evenly over the revolution. And a revolution ends where the angle passes 0: the
mark of a ring start says the same, and a lost one would join two revolutions.
"""

import math
import struct
from dataclasses import dataclass

from robosc_bridge.protocol.framing import FrameDecoder
from robosc_bridge.protocol.revolutions import WIDEST_STEP_DEG, Points

START = bytes.fromhex("aa55f00f")
STOP = bytes.fromhex("aa55f50a")

MOST_SAMPLES = 50
"""Twice as many as a frame was ever seen to have: a false header holds the frames behind it up no longer than two."""

# Limit of the sensor's data sheet. Nearer than its least range, it is inexact, and something is there all the same.
_MAX_MM = 12_000
_HEADER = b"\xaa\x55"
_SAMPLES = 10
_HALF_TURN_TICKS = 180 * 64
_TURN_TICKS = 2 * _HALF_TURN_TICKS
# By count of samples: header, kind and count, first and last angle, checksum; then a byte and a word of each sample.
_FIELDS = [struct.Struct("<HHHHH" + "BH" * samples) for samples in range(MOST_SAMPLES + 1)]
# Header of a frame before the samples: start, kind and count, first and last angle, checksum.
_HEAD = struct.Struct("<5H")
# By count of samples: how far to shift, and what to keep, until the samples lie on one another.
_FOLDS: list[list[tuple[int, int]]] = [[], []]
for _samples in range(2, MOST_SAMPLES + 1):
    _half = (_samples + 1) // 2
    _FOLDS.append([(24 * _half, (1 << 24 * _half) - 1), *_FOLDS[_half]])
# By the two lowest bits of a sample's word, and its byte.
_INTENSITIES = [255 if bits & 1 else min(bits >> 2, 254) for bits in range(1 << 10)]
# The official driver takes samples this near and this weak for no obstacle.
_WEAK_MM = 150
_WEAK_INTENSITY = 65


@dataclass(frozen=True, slots=True)
class Frame:
    """Some points.

    Attributes:
        is_ring_start: True if it is the first of a revolution.
        frequency_hz: Revolutions a second; None: only the first frame of a revolution reports it.
        first_ticks: Angle of the first point, clockwise, in 64ths of a degree.
        last_ticks: Angle of the last point.
        distances_mm: Distances in millimetres; 0: nothing measured.
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
        samples = (length - _SAMPLES) // 3
        header, kind, first, last, checksum = _HEAD.unpack_from(data, at)
        # A byte and a word of each sample, three bytes: all at once, since false headers must not take long.
        folded = int.from_bytes(data[at + _SAMPLES : at + length], "little")
        for shift, kept in _FOLDS[samples]:
            folded = folded >> shift ^ folded & kept
        # The checksum itself is among the words, so that all of them together are 0.
        if header ^ kind ^ first ^ last ^ checksum ^ folded & 0xFF ^ folded >> 8:
            return None
        first_ticks, last_ticks = first >> 1, last >> 1
        if not _is_plausible(first_ticks, last_ticks, samples):
            return None
        fields = _FIELDS[samples].unpack_from(data, at)
        low, high = fields[5::2], fields[6::2]
        is_ring_start = bool(kind & 1)
        return Frame(
            is_ring_start,
            (kind >> 1 & 0x7F) / 10 if is_ring_start else None,
            first_ticks,
            last_ticks,
            tuple([word >> 2 for word in high]),
            tuple([_INTENSITIES[(word & 3) << 8 | byte] for byte, word in zip(low, high, strict=True)]),
        )


def _span_ticks(first_ticks: int, last_ticks: int) -> int:
    """Return the angle from the first point to the last one, in ticks; negative: backward, which cannot be."""
    if first_ticks > 3 * _HALF_TURN_TICKS // 2 and last_ticks < _HALF_TURN_TICKS // 2:
        last_ticks += _TURN_TICKS
    return last_ticks - first_ticks


def _is_plausible(first_ticks: int, last_ticks: int, samples: int) -> bool:
    if max(first_ticks, last_ticks) > _TURN_TICKS:
        return False
    return samples == 1 or 0 <= _span_ticks(first_ticks, last_ticks) <= WIDEST_STEP_DEG * 64 * (samples - 1)


def points(frame: Frame) -> Points:
    """Return the points of a frame."""
    samples = len(frame.distances_mm)
    step_deg = _span_ticks(frame.first_ticks, frame.last_ticks) / 64 / max(samples - 1, 1)
    first_deg = frame.first_ticks / 64
    counted = [first_deg + k * step_deg for k in range(samples)]
    if counted[-1] >= 360.0:
        counted = [counted_deg % 360.0 for counted_deg in counted]
    return Points(
        tuple(counted),
        tuple([360.0 - counted_deg if counted_deg else 0.0 for counted_deg in counted]),
        tuple(
            [
                mm / 1000
                if _WEAK_MM < mm <= _MAX_MM or (0 < mm <= _WEAK_MM and intensity > _WEAK_INTENSITY)
                else math.nan
                for mm, intensity in zip(frame.distances_mm, frame.intensities, strict=True)
            ]
        ),
        frame.intensities,
        frame.frequency_hz,
    )
