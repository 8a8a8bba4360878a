"""A MAVLink rover as a source of obstacles, on a virtual host."""

import math

import pytest

from robosc_bridge.devices.interface import RangeScanner, Scan, Velocity
from robosc_bridge.driver_registry import make_range_scanner
from robosc_bridge.errors import LineError, LineLostError
from robosc_simulated import SimulatedLine, Walls
from support import rovers
from support.pausing_host import PausingHost
from support.rovers import FORWARD, Bench


def _next(scanner: RangeScanner, limit_s: float = 3.0) -> Scan:
    scan = scanner.receive(limit_s)
    assert scan is not None
    return scan


def _check(bench: Bench, scan: Scan, width_deg: float, *, is_whole: bool = True) -> None:
    """Every bin is as near as the nearest in its sector: not nearer than anything there, not farther than the wall."""
    assert len(scan.ranges_m) == 360
    for k, range_m in enumerate(scan.ranges_m):
        if not is_whole and math.isnan(range_m):
            continue
        around = [math.radians(k + part * width_deg / 20) for part in range(-20, 21)]
        assert min(bench.world.ranges(around)) - 0.02 <= range_m <= max(bench.world.ranges(around)) + 0.02, k


@pytest.mark.parametrize("obstacles", ["ring", "north ring", "sensors"])
def test_obstacles_are_where_they_are(bench: Bench, obstacles: str) -> None:
    bench.rover.obstacles = obstacles
    bench.rover._interval_s[30] = 0.1  # Attitude: which way is north.
    bench.rover._due_s[30] = 0.0
    scanner = make_range_scanner("mavlink-rover", path=bench.path, host=bench.host)
    scanner.open()
    try:
        scan = _next(scanner)
        _check(bench, scan, 45.0 if obstacles == "sensors" else 6.0)
        assert scan.time_s == bench.host.monotonic()
        assert (scan.min_m, scan.max_m) == (0.05, 8.0)
        assert scanner.counters.scans >= 1
        # Alone on the line, it is who is there.
        before, end_s = len(bench.rover.heartbeats), bench.host.monotonic() + 20.0
        while bench.host.monotonic() < end_s:
            scanner.receive(0.1)
        assert set(bench.rover.heartbeats) == {(254, 191)}
        assert len(bench.rover.heartbeats) - before == pytest.approx(20, abs=1)
    finally:
        scanner.close()
    with pytest.raises(LineLostError, match="not open"):
        scanner.receive(0.0)


@pytest.mark.parametrize("pause_s", [1.0, 20.0])
@pytest.mark.parametrize("obstacles", ["ring", "sensors"])
def test_nothing_of_before_a_pause_of_the_process_counts_as_new(
    obstacles: str, pause_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rovers, "VirtualHost", PausingHost)
    with rovers.rig() as bench:
        assert isinstance(bench.host, PausingHost)
        bench.rover.obstacles = obstacles
        scanner = make_range_scanner("mavlink-rover", path=bench.path, host=bench.host)
        scanner.open()
        try:
            _next(scanner)
            bench.host.paused = f"MAVLink {bench.path}"
            bench.host.sleep(pause_s - 0.5)
            bench.world.place(-1.0, -0.5, 2.0)
            bench.host.sleep(0.5)
            bench.host.paused = ""
            for is_whole in (False, True, True):
                # The first round of sensors began before the pause: of some directions nothing is known.
                _check(bench, _next(scanner), 45.0 if obstacles == "sensors" else 6.0, is_whole=is_whole)
        finally:
            scanner.close()


def test_walls_that_are_too_far_are_none(bench: Bench) -> None:
    bench.world.walls = Walls(())
    scanner = make_range_scanner("mavlink-rover", path=bench.path, host=bench.host)
    scanner.open()
    assert all(map(math.isnan, _next(scanner).ranges_m))
    scanner.close()


def test_drive_base_and_scanner_share_a_line_and_outlive_each_other(bench: Bench) -> None:
    scanner = make_range_scanner("mavlink-rover", path=bench.path, host=bench.host)
    bench.base.open()
    scanner.open()
    seen: list[Scan] = []
    is_over = False

    def look() -> None:
        while not is_over:
            if scan := scanner.receive(0.5):
                seen.append(scan)

    thread = bench.later(0.0, look)
    try:
        bench.base.set_torque(True)
        reading = bench.drive(Velocity(0.1, 0.3), 1.5)
        assert reading.velocity.linear_m_s == pytest.approx(0.1, abs=0.001)
        assert len(seen) >= 10
        assert 1 <= len(bench.rover.heartbeats) <= 4
        # The base no longer lives: its heartbeat ends though the scanner goes on, until the base is closed.
        before = len(bench.rover.heartbeats)
        bench.host.sleep(1.3)
        assert len(bench.rover.heartbeats) == before
        bench.base.close()
        count = len(seen)
        bench.until(lambda: len(seen) > count + 2)
        bench.base.open()
    finally:
        is_over = True
        scanner.wake()
        thread.join()
        scanner.close()
    assert not bench.drive(FORWARD, 0.1).is_torque_on


def test_a_scanner_that_waits_is_woken_by_a_lost_line(bench: Bench) -> None:
    assert isinstance(bench.line, SimulatedLine)
    bench.rover.is_silent = True
    scanner = make_range_scanner("mavlink-rover", path=bench.path, host=bench.host)
    scanner.open()
    timer = bench.later(0.1, scanner.wake)
    begin_s = bench.host.monotonic()
    assert scanner.receive(5.0) is None
    assert bench.host.monotonic() - begin_s == pytest.approx(0.1)
    timer.join()
    timer = bench.later(0.1, bench.line.disconnect)
    with pytest.raises(LineError):
        scanner.receive(5.0)
    timer.join()
    scanner.close()


def test_a_scanner_asks_again_when_asked_to(bench: Bench) -> None:
    scanner = make_range_scanner("mavlink-rover", path=bench.path, host=bench.host)
    scanner.open()
    _next(scanner)
    bench.rover.restart()
    while scanner.receive(0.5):
        pass
    scanner.restart()
    _next(scanner)
    scanner.close()
