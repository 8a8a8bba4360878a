"""LDS-01 (HLS-LFCD2): frames of 42 bytes with six points, one degree apart; sixty frames are a revolution.

Format, direction and units are those of ROBOTIS' hls_lfcd_lds_driver 2.1.1 (src/hlds_laser_publisher.cpp).

That driver ignores the two check bytes, and no other source is sure of their formula: most likely both are 0xFF minus
the sum of the other forty. So a rule is asked of a frame only once this device has kept it often enough that it cannot
be chance. Until then, a frame counts if it follows another one without a gap and in order, or if the header of its
successor follows it.
"""

import math
import struct
from dataclasses import dataclass

from robosc_bridge.protocol.framing import FrameDecoder
from robosc_bridge.protocol.revolutions import Points

START = b"b"
STOP = b"e"

FRAMES_PER_TURN = 60
POINTS_PER_FRAME = 6

PROOF_FRAMES = 16
"""A rule that this many frames in a row have kept is one: by chance, two equal bytes come so once in 2**128 times."""

# Limit of the sensor's data sheet, and of ranges in its official driver.
_MAX_MM = 3500
_HEADER = 0xFA
_FIRST_INDEX = 0xA0
_LENGTH = 42
_CHECK = 40
# Speed; then intensity, distance and a reserved word of each point.
_WORDS = struct.Struct("<H" + "HHxx" * POINTS_PER_FRAME)


@dataclass(frozen=True, slots=True)
class Frame:
    """Six points.

    Attributes:
        index: 0 to 59: which sixth of a minute, as it were, clockwise.
        speed: As sent; see `revolutions_per_s`.
        distances_mm: 0: nothing measured.
        intensities: Sixteen bits each.
    """

    index: int
    speed: int
    distances_mm: tuple[int, ...]
    intensities: tuple[int, ...]


class Decoder(FrameDecoder[Frame]):
    """Finds frames of an LDS-01."""

    first_byte = _HEADER
    header_length = 2

    def __init__(self) -> None:
        super().__init__()
        self._next_index = 0
        self._equal_frames = 0
        self._summed_frames = 0
        self._align(False)

    def forget(self) -> None:
        """Begin anew, also with what is known of the check bytes: it may be another device."""
        self._equal_frames = self._summed_frames = 0
        super().forget()

    def _align(self, is_aligned: bool) -> None:
        super()._align(is_aligned)
        is_enough = is_aligned or self._summed_frames >= PROOF_FRAMES
        self.look_ahead = 0 if is_enough else 2

    def _length(self, data: bytes, at: int) -> int:
        return _LENGTH if 0 <= data[at + 1] - _FIRST_INDEX < FRAMES_PER_TURN else 0

    def _frame(self, data: bytes, at: int, length: int) -> Frame | None:
        index = data[at + 1] - _FIRST_INDEX
        is_sum_known = self._summed_frames >= PROOF_FRAMES
        if not is_sum_known and not self._has_neighbour(data, at, index):
            return None
        check, again = data[at + _CHECK], data[at + _CHECK + 1]
        is_equal = check == again
        is_sum = is_equal and check == 0xFF - sum(data[at : at + _CHECK]) % 256
        if (is_sum_known and not is_sum) or (self._equal_frames >= PROOF_FRAMES and not is_equal):
            return None
        self._equal_frames = self._equal_frames + 1 if is_equal else 0
        self._summed_frames = self._summed_frames + 1 if is_sum else 0
        self._next_index = (index + 1) % FRAMES_PER_TURN
        words = _WORDS.unpack_from(data, at + 2)
        return Frame(index, words[0], words[2::2], words[1::2])

    def _has_neighbour(self, data: bytes, at: int, index: int) -> bool:
        if self._is_aligned:
            return index == self._next_index
        successor = _FIRST_INDEX + (index + 1) % FRAMES_PER_TURN
        return data[at + _LENGTH] == _HEADER and data[at + _LENGTH + 1] == successor


def revolutions_per_s(speed: int) -> float:
    """Speed of the motor, at 300 revolutions a minute when all is well.

    The official driver takes the number for tenths of a revolution a minute, another one for whole ones: what looks
    like a sound device in one of both units is taken so.
    """
    return speed / 60 if 200 <= speed <= 400 else speed / 600


def points(frame: Frame) -> Points:
    """Return the points of a frame; index 0 of the device is 359 degrees, its last one is straight ahead."""
    return Points(
        _COUNTED_DEG[frame.index],
        _ANGLES_DEG[frame.index],
        # Nearer than the sensor is made for, it is inexact, and something is there all the same.
        tuple([mm / 1000 if 0 < mm <= _MAX_MM else math.nan for mm in frame.distances_mm]),
        frame.intensities,
        revolutions_per_s(frame.speed),
        frame.index == FRAMES_PER_TURN - 1,
    )


_COUNTED_DEG = [
    tuple(float(POINTS_PER_FRAME * index + point) for point in range(POINTS_PER_FRAME))
    for index in range(FRAMES_PER_TURN)
]
_ANGLES_DEG = [tuple(359.0 - counted_deg for counted_deg in frame) for frame in _COUNTED_DEG]
