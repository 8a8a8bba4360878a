"""Benchmark of the bytes of each LiDAR that the bridge decodes in a second, beside the maximum of its line.

The aim is a hundred times the line; time is that of the processor. *Frames*: bytes to frames. *Scans*: bytes to 360
ranges. *Noise*: random bytes. *Headers*: only bytes that look like the beginning of a frame, the worst that a line
can bring.
"""

import time
from collections.abc import Callable, Iterator
from random import Random
from typing import Any

from figures import text_table
from robosc_bridge.devices.lidar import LDS01, LDS02, LDS03, Model
from robosc_bridge.protocol.revolutions import RevolutionBuilder, nearest_by_degree
from support.lidar_frames import lds01_frame, lds02_frame, lds03_frame

RUNS = 7
TURNS = 60
NOISE_BYTES = 200_000
AIM = 100
READS = (64, 4096)
"""Bytes that come with one read: as they trickle in, and after a pause."""

HEADER = ["stream, bytes a read", "MB/s", "line, MB/s", "times the line", f"aim ({AIM} times)"]


def _lds01(dice: Random) -> Iterator[bytes]:
    for index in range(60):
        yield lds01_frame(index, [(dice.randrange(2000), dice.randrange(120, 3500)) for _ in range(6)])


def _lds02(dice: Random) -> Iterator[bytes]:
    for start in range(0, 36000, 1125):
        points = [(dice.randrange(160, 8000), dice.randrange(256)) for _ in range(12)]
        yield lds02_frame(start, (start + 1030) % 36000, points)


def _lds03(dice: Random) -> Iterator[bytes]:
    yield lds03_frame(0, 0, [(1000, 200)], ring_start_dhz=100)
    for part in range(16):
        points = [(dice.randrange(50, 12000), dice.randrange(256)) for _ in range(25)]
        yield lds03_frame(part * 22.5 + 0.5, min(part * 22.5 + 22, 359.9), points)


DEVICES: list[tuple[Model[Any], Callable[[Random], Iterator[bytes]], bytes]] = [
    (LDS01, _lds01, b"\xfa\xa0"),
    (LDS02, _lds02, b"\x54\x2c"),
    (LDS03, _lds03, b"\xaa\x55\x00\x32\x01\x00\x01\x00"),
]


def _frames(model: Model[Any], reads: list[bytes]) -> int:
    decoder = model.make_decoder()
    return sum(len(decoder.feed(data)) for data in reads)


def _scans(model: Model[Any], reads: list[bytes]) -> int:
    decoder = model.make_decoder()
    revolutions = RevolutionBuilder()
    found = 0
    for data in reads:
        for frame in decoder.feed(data):
            revolution = revolutions.add(model.points(frame))
            if revolution:
                found += len(nearest_by_degree(revolution.angles_deg, revolution.ranges_m)) == 360
    return found


def _row(
    name: str, model: Model[Any], data: bytes, size: int, work: Callable[[Model[Any], list[bytes]], int], found: int
) -> list[str]:
    reads = [data[at : at + size] for at in range(0, len(data), size)]
    best_s = float("inf")
    for _ in range(RUNS):
        begin = time.process_time()
        count = work(model, reads)
        best_s = min(best_s, time.process_time() - begin)
        if count < found:
            raise RuntimeError(f"{name}: {count} instead of {found} were found")
    speed = len(data) / best_s / 1e6
    line = model.bauds[0] / 10 / 1e6
    verdict = "met" if speed >= AIM * line else "missed"
    return [f"{name}, {size}", f"{speed:.2f}", f"{line:.4f}", f"{speed / line:.0f}", verdict]


def table() -> str:
    """The table."""
    rows = []
    for model, revolution, header in DEVICES:
        dice = Random(1)
        frames = [frame for _ in range(TURNS) for frame in revolution(dice)]
        stream = b"".join(frames)
        noise = dice.randbytes(NOISE_BYTES)
        headers = header * (NOISE_BYTES // len(header))
        for size in READS:
            rows += [
                _row(f"{model.name}: frames", model, stream, size, _frames, len(frames)),
                _row(f"{model.name}: scans", model, stream, size, _scans, TURNS - 1),
                _row(f"{model.name}: noise", model, noise, size, _frames, 0),
                _row(f"{model.name}: headers", model, headers, size, _frames, 0),
            ]
    return text_table(f"LiDAR decoders, best of {RUNS} runs", HEADER, rows)
