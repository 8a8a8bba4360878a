"""LDS-02 (LD08): frames of 47 bytes with twelve points between two angles, checked by a CRC of eight bits.

Format, angles, correction and plausibility are those of ROBOTIS' ld08_driver (include/lipkg.hpp, src/lipkg.cpp,
src/transform.cpp).

Not taken over is that driver's filter of near points (src/slbf.cpp): it drops small groups below 1 m that look weak or
lit by the sun. A thin dark leg of a chair looks weak as well; a robot that stops for a ghost is the lesser harm.
"""

import math
import struct
from dataclasses import dataclass

from robosc_bridge.protocol.framing import FrameDecoder
from robosc_bridge.protocol.revolutions import WIDEST_STEP_DEG, Points, wrapped_deg

POINTS_PER_FRAME = 12
POINTS_PER_S = 2300

# Limits of the sensor's data sheet.
_MAX_SQUARE_MM2 = 8000.0**2
_HEADER = 0x54
_KINDS = (0x2C, 0xEC)
_LENGTH = 47
_CRC_POLYNOMIAL = 0x4D
_TURN_CDEG = 36000
# Kind and header, speed, first angle; distance and confidence of each point; last angle, time.
_FIELDS = struct.Struct("<xxHH" + "HB" * POINTS_PER_FRAME + "HH")


@dataclass(frozen=True, slots=True)
class Frame:
    """Twelve points.

    Attributes:
        speed_deg_s: Of the motor.
        start_cdeg: Angle of the first point, clockwise, in hundredths of a degree.
        end_cdeg: Angle of the last point.
        time_ms: Of the device; begins again at some number.
        distances_mm: 0: nothing measured.
        confidences: Eight bits each; bit 0: sunlight.
    """

    speed_deg_s: int
    start_cdeg: int
    end_cdeg: int
    time_ms: int
    distances_mm: tuple[int, ...]
    confidences: tuple[int, ...]


def _crc_table() -> bytes:
    table = bytearray()
    for crc in range(256):
        for _ in range(8):
            crc = (crc << 1 ^ (_CRC_POLYNOMIAL if crc & 0x80 else 0)) & 0xFF
        table.append(crc)
    return bytes(table)


_CRC_TABLE = _crc_table()


def crc8(data: bytes) -> int:
    """CRC of polynomial 0x4D, from 0, neither reflected nor inverted; of `123456789` it is 0xC3."""
    crc = 0
    table = _CRC_TABLE
    for byte in data:
        crc = table[crc ^ byte]
    return crc


class Decoder(FrameDecoder[Frame]):
    """Finds frames of an LDS-02."""

    first_byte = _HEADER
    header_length = 2

    def _length(self, data: bytes, at: int) -> int:
        return _LENGTH if data[at + 1] in _KINDS else 0

    def _frame(self, data: bytes, at: int, length: int) -> Frame | None:
        fields = _FIELDS.unpack_from(data, at)
        speed_deg_s, start_cdeg, end_cdeg, time_ms = *fields[:2], *fields[-2:]
        if not _is_plausible(speed_deg_s, start_cdeg, end_cdeg):
            return None
        if crc8(data[at : at + length]):  # The CRC of anything with its own CRC behind it is 0.
            return None
        return Frame(speed_deg_s, start_cdeg, end_cdeg, time_ms, fields[2:-2:2], fields[3:-2:2])


def _is_plausible(speed_deg_s: int, start_cdeg: int, end_cdeg: int) -> bool:
    """Return True if there are such angles, and the motor can have turned so far in a frame.

    This is the official driver's rule.
    """
    if max(start_cdeg, end_cdeg) > _TURN_CDEG or speed_deg_s > WIDEST_STEP_DEG * POINTS_PER_S:
        return False
    span_deg = (end_cdeg // 100 - start_cdeg // 100 + 360) % 360
    return span_deg <= 1.5 * speed_deg_s * POINTS_PER_FRAME / POINTS_PER_S


def points(frame: Frame) -> Points:
    """Return the points of a frame, as seen from the axis of the motor instead of the optical centre.

    The official driver publishes every range that is not 0: nothing near is dropped. Beyond what the sensor is made
    for, a range promises free space that nobody measured.
    """
    # The device's own arithmetic: whole hundredths of a degree.
    step_cdeg = (frame.end_cdeg + _TURN_CDEG - frame.start_cdeg) % _TURN_CDEG // (POINTS_PER_FRAME - 1)
    start_cdeg = frame.start_cdeg
    counted = tuple([(start_cdeg + k * step_cdeg) % _TURN_CDEG / 100 for k in range(POINTS_PER_FRAME)])
    angles = []
    ranges = []
    for counted_deg, distance_mm in zip(counted, frame.distances_mm, strict=True):
        angle_deg = 360.0 - counted_deg
        range_m = math.nan
        if distance_mm:
            x_mm = distance_mm + 5.9
            y_mm = 0.11923 * distance_mm - 20.14
            angle_deg += math.degrees(math.atan(y_mm / x_mm))
            if x_mm * x_mm + y_mm * y_mm <= _MAX_SQUARE_MM2:
                range_m = math.hypot(x_mm, y_mm) / 1000
        angles.append(wrapped_deg(angle_deg))
        ranges.append(range_m)
    return Points(counted, tuple(angles), tuple(ranges), frame.confidences, frame.speed_deg_s / 360)
