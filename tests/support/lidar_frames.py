"""Frames of the three LiDARs as their devices send them, and plain decoders of whole strings of bytes.

Both are written from the formats' description, slowly and obviously, and share nothing with the bridge but the names of
what a frame says.
"""

import struct
from collections.abc import Sequence

from robosc_bridge.protocol import lds01, lds02, lds03


def crc8(data: bytes) -> int:
    """Long division by x^8 + x^6 + x^3 + x^2 + 1, bit by bit."""
    crc = 0
    for byte in data:
        for bit in range(7, -1, -1):
            top = crc >> 7 ^ byte >> bit & 1
            crc = crc << 1 & 0xFF ^ (0x4D if top else 0)
    return crc


def xor16(frame: bytes) -> bytes:
    """The checksum of an LDS-03's frame, in the order in which its driver takes the words."""
    check = 0x55AA ^ (frame[4] | frame[5] << 8) ^ (frame[3] << 8 | frame[2]) ^ (frame[6] | frame[7] << 8)
    for k in range(frame[3]):
        b0, b1, b2 = frame[10 + 3 * k : 13 + 3 * k]
        check ^= b0 ^ (b2 << 8 | b1)
    return struct.pack("<H", check)


def lds01_frame(
    index: int, points: Sequence[tuple[int, int]], *, speed: int = 3000, check: tuple[int, int] | None = None
) -> bytes:
    """Six points, each intensity and millimetres; `check` overrides the two last bytes."""
    body = struct.pack("<BBH", 0xFA, 0xA0 + index, speed)
    body += b"".join(struct.pack("<HHH", intensity, distance_mm, 0) for intensity, distance_mm in points)
    total = 0xFF - sum(body) % 256
    return body + bytes(check or (total, total))


def lds02_frame(
    start_cdeg: int, end_cdeg: int, points: Sequence[tuple[int, int]], *, speed: int = 2152, time_ms: int = 0
) -> bytes:
    """Twelve points, each millimetres and confidence."""
    body = struct.pack("<BBHH", 0x54, 0x2C, speed, start_cdeg)
    body += b"".join(struct.pack("<HB", *point) for point in points)
    body += struct.pack("<HH", end_cdeg, time_ms)
    return body + bytes([crc8(body)])


def lds03_frame(
    first_deg: float,
    last_deg: float,
    points: Sequence[tuple[int, int]],
    *,
    ring_start_dhz: int | None = None,
    is_over_exposed: bool = False,
) -> bytes:
    """Points, each millimetres and intensity; `ring_start_dhz`: tenths of a turn a second of a ring start."""
    kind = 0 if ring_start_dhz is None else ring_start_dhz << 1 | 1
    words = (round(first_deg * 64) << 1 | 1, round(last_deg * 64) << 1 | 1)
    head = b"\xaa\x55" + bytes([kind, len(points)]) + struct.pack("<HH", *words)
    samples = b""
    for distance_mm, intensity in points:
        value = distance_mm << 10 | intensity << 2 | is_over_exposed
        samples += value.to_bytes(3, "little")
    return head + xor16(head + b"\0\0" + samples) + samples


def decode_lds01(data: bytes) -> tuple[list[lds01.Frame], int]:
    """All frames of a string of bytes that begins a stream, and how many bytes of its end still wait."""
    found: list[lds01.Frame] = []
    equal = summed = 0
    previous_end = -1
    at = 0
    while at < len(data):
        if data[at] != 0xFA:
            at += 1
            continue
        if at + 2 > len(data):
            break
        index = data[at + 1] - 0xA0
        if index not in range(60):
            at += 1
            continue
        is_behind_another = previous_end == at
        if at + (42 if is_behind_another or summed >= 16 else 44) > len(data):
            break
        frame = data[at : at + 42]
        is_equal = frame[40] == frame[41]
        is_sum = is_equal and (sum(frame[:40]) + frame[40]) % 256 == 255
        if summed >= 16:
            is_good = is_sum
        elif equal >= 16 and not is_equal:
            is_good = False
        elif is_behind_another:
            is_good = index == (found[-1].index + 1) % 60
        else:
            is_good = data[at + 42 : at + 44] == bytes([0xFA, 0xA0 + (index + 1) % 60])
        if not is_good:
            at += 1
            continue
        equal = equal + 1 if is_equal else 0
        summed = summed + 1 if is_sum else 0
        words = struct.unpack("<H18H", frame[2:40])
        found.append(lds01.Frame(index, words[0], words[2::3], words[1::3]))
        at += 42
        previous_end = at
    return found, len(data) - at


def decode_lds02(data: bytes) -> tuple[list[lds02.Frame], int]:
    """Decode like `decode_lds01`."""
    found: list[lds02.Frame] = []
    at = 0
    while at < len(data):
        if data[at] != 0x54:
            at += 1
            continue
        if at + 2 > len(data):
            break
        if data[at + 1] not in (0x2C, 0xEC):
            at += 1
            continue
        if at + 47 > len(data):
            break
        frame = data[at : at + 47]
        speed, start = struct.unpack("<HH", frame[2:6])
        end, time_ms = struct.unpack("<HH", frame[42:46])
        points = [struct.unpack("<HB", frame[6 + 3 * k : 9 + 3 * k]) for k in range(12)]
        span_deg = (end // 100 - start // 100 + 360) % 360
        if (
            crc8(frame[:46]) != frame[46]
            or start > 36000
            or end > 36000
            or speed / 2300 > 3
            or span_deg > speed * 12 / 2300 * 1.5
        ):
            at += 1
            continue
        found.append(lds02.Frame(speed, start, end, time_ms, tuple(p[0] for p in points), tuple(p[1] for p in points)))
        at += 47
    return found, len(data) - at


def decode_lds03(data: bytes) -> tuple[list[lds03.Frame], int]:
    """Decode like `decode_lds01`."""
    found: list[lds03.Frame] = []
    at = 0
    while at < len(data):
        if data[at] != 0xAA:
            at += 1
            continue
        if at + 7 > len(data):
            break
        count = data[at + 3]
        if data[at + 1] != 0x55 or not 1 <= count <= 50 or data[at + 4] % 2 == 0 or data[at + 6] % 2 == 0:
            at += 1
            continue
        if at + 10 + 3 * count > len(data):
            break
        frame = data[at : at + 10 + 3 * count]
        first, last = (word // 2 for word in struct.unpack("<HH", frame[4:8]))
        is_wrapped = first > 270 * 64 and last < 90 * 64
        span = last - first + (360 * 64 if is_wrapped else 0)
        is_possible = max(first, last) <= 360 * 64 and (count == 1 or 0 <= span <= 3 * 64 * (count - 1))
        if xor16(frame) != frame[8:10] or not is_possible:
            at += 1
            continue
        samples = [frame[10 + 3 * k : 13 + 3 * k] for k in range(count)]
        is_ring_start = frame[2] % 2 == 1
        found.append(
            lds03.Frame(
                is_ring_start,
                frame[2] // 2 / 10 if is_ring_start else None,
                first,
                last,
                tuple(b2 * 64 + (b1 >> 2) for _, b1, b2 in samples),
                tuple(255 if b0 & 1 else min((b1 & 3) * 64 + (b0 >> 2), 254) for b0, b1, _ in samples),
            )
        )
        at += len(frame)
    return found, len(data) - at
