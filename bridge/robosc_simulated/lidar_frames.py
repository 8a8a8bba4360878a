"""The frames of the three LiDARs as they are sent.

LDS-01 after ROBOTIS-GIT/hls_lfcd_lds_driver, LDS-02 after ROBOTIS-GIT/ld08_driver, LDS-03 after
ROBOTIS-GIT/coin_d4_driver. The checksum of LDS-01 is not documented; two equal bytes 0xFF - sum are sent.
"""

from collections.abc import Sequence

# Distance in mm, 0: nothing measured; and intensity.
Point = tuple[int, int]


def lds01_frame(index: int, speed: int, points: Sequence[Point]) -> bytes:
    """Six degrees of LDS-01.

    Args:
        index: 0 to 59.
        speed: In 0.1 rpm.
        points: Six.
    """
    frame = bytes((0xFA, 0xA0 + index)) + _word(speed)
    frame += b"".join(_word(intensity) + _word(distance_mm) + b"\0\0" for distance_mm, intensity in points)
    checksum = 0xFF - sum(frame) % 256
    return frame + bytes((checksum, checksum))


def lds02_frame(speed: int, start: int, end: int, stamp_ms: int, points: Sequence[Point]) -> bytes:
    """Twelve points of LDS-02.

    Args:
        speed: In degrees per second.
        start: Angle of the first point, in 0.01 degrees.
        end: Angle of the last one.
        stamp_ms: Time, wrapping at 65536.
        points: Twelve.
    """
    frame = bytes((0x54, 0x20 | len(points))) + _word(speed) + _word(start)
    frame += b"".join(_word(distance_mm) + bytes((confidence,)) for distance_mm, confidence in points)
    frame += _word(end) + _word(stamp_ms)
    return frame + bytes((crc8(frame),))


def lds03_frame(kind: int, first: int, last: int, points: Sequence[Point]) -> bytes:
    """A frame of LDS-03.

    Args:
        kind: Byte CT: at the beginning of a revolution the speed and bit 0, else 0.
        first: Angle of the first point, in degrees / 64.
        last: Angle of the last one.
        points: At most 25; an intensity of 255 sets the mark of an overexposed sample, too.
    """
    samples = b"".join(_lds03_sample(*point) for point in points)
    words = (first << 1 | 1, last << 1 | 1)
    checksum = 0x55AA ^ words[0] ^ (len(points) << 8 | kind) ^ words[1]
    for low, middle, high in zip(samples[::3], samples[1::3], samples[2::3], strict=True):
        checksum ^= low ^ (high << 8 | middle)
    head = bytes((0xAA, 0x55, kind, len(points)))
    return head + _word(words[0]) + _word(words[1]) + _word(checksum) + samples


def _lds03_sample(distance_mm: int, intensity: int) -> bytes:
    low = (intensity & 0x3F) << 2 | (intensity == 255)
    return bytes((low, (distance_mm & 0x3F) << 2 | intensity >> 6, distance_mm >> 6))


def lds03_identity() -> bytes:
    """Return the bytes with which LDS-03 identifies itself when it is started."""
    name = b"COIN-D4".ljust(19, b"\0") + b"\x01"
    length = _word(len(name))
    total = sum(b"\xa5\x5a") + sum(length) + 0x01 + sum(name)
    return b"\xfa\xfa\xa5\x5a" + length + _word(total) + b"\x01" + name


def _shifted(crc: int) -> int:
    for _ in range(8):
        crc = (crc << 1 ^ 0x4D if crc & 0x80 else crc << 1) & 0xFF
    return crc


_SHIFTED = tuple(_shifted(byte) for byte in range(256))


def crc8(data: bytes) -> int:
    """Polynomial 0x4D, from 0, no reflection, no final XOR."""
    crc = 0
    for byte in data:
        crc = _SHIFTED[crc ^ byte]
    return crc


def _word(value: int) -> bytes:
    return value.to_bytes(2, "little")
