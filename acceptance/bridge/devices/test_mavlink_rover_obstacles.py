"""A MAVLink rover as a source of obstacles, over a real pseudo-terminal and real UDP."""

import math
import time

import pytest

from robosc_bridge.devices.interface import (
    RangeScanner,
    Scan,
)
from robosc_bridge.devices.registry import make_range_scanner
from robosc_bridge.errors import (
    LineLostError,
)
from robosc_bridge.simulated import Walls
from support.rovers import Bench, rig

pytestmark = pytest.mark.real_time


def _next(scanner: RangeScanner, limit_s: float = 3.0) -> Scan:
    scan = scanner.receive(limit_s)
    assert scan is not None
    return scan


def _check(bench: Bench, scan: Scan, width_deg: float) -> None:
    """Every bin is as near as the nearest in its sector: not nearer than anything there, not farther than the wall."""
    assert len(scan.ranges_m) == 360
    for k, range_m in enumerate(scan.ranges_m):
        around = [math.radians(k + part * width_deg / 20) for part in range(-20, 21)]
        assert min(bench.world.ranges(around)) - 0.02 <= range_m <= max(bench.world.ranges(around)) + 0.02, k


@pytest.mark.parametrize("obstacles", ["ring", "north ring", "sensors"])
def test_obstacles_are_where_they_are(any_bench: Bench, obstacles: str) -> None:
    bench = any_bench
    bench.rover.obstacles = obstacles
    bench.rover._interval_s[30] = 0.1  # Attitude: which way is north.
    bench.rover._due_s[30] = 0.0
    scanner = make_range_scanner("mavlink-rover", path=bench.path)
    scanner.open()
    try:
        begin_s = time.monotonic()
        scan = _next(scanner)
        _check(bench, scan, 45.0 if obstacles == "sensors" else 6.0)
        assert begin_s < scan.time_s <= time.monotonic()
        assert scanner.counters.scans >= 1
        # Alone on the line, it is who is there.
        end_s = time.monotonic() + 3.0
        while (255, 190) not in bench.rover.heartbeats:
            assert time.monotonic() < end_s
            scanner.receive(0.1)
    finally:
        scanner.close()
    with pytest.raises(LineLostError, match="not open"):
        scanner.receive(0.0)


def test_walls_that_are_too_far_are_none() -> None:
    with rig("udpout") as bench:
        bench.world.walls = Walls(())
        scanner = make_range_scanner("mavlink-rover", path=bench.path)
        scanner.open()
        assert all(map(math.isnan, _next(scanner).ranges_m))
        scanner.close()
