"""LiDARs against simulated ones in a world with walls: what is seen is where it is, whatever the line does."""

import itertools
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any

import pytest

from robosc_bridge.devices.interface import BINS, Scan
from robosc_bridge.devices.lidar import BAUD_TRIAL_S, Lidar, make_lds01, make_lds02, make_lds03
from robosc_bridge.errors import LineLostError
from robosc_simulated import SimulatedTurtleBot3, VirtualHost, Walls, room
from support.pausing_host import PausingHost

MAKERS: dict[str, Callable[..., Lidar[Any]]] = {"lds01": make_lds01, "lds02": make_lds02, "lds03": make_lds03}
# The correction of an LDS-02 moves neighbouring points apart where a wall comes nearer: a bin may lie between.
FULL = {"lds01": BINS, "lds02": BINS - 6, "lds03": BINS}
POSE = (0.3, 0.2, 0.7)
each_lidar = pytest.mark.parametrize("name", MAKERS)


class Scene:
    """A robot in a world, and a driver of its LiDAR, on a virtual host."""

    def __init__(self, name: str, robot: SimulatedTurtleBot3, time: VirtualHost) -> None:
        self.robot = robot
        self.time = time
        self.lidar: Lidar[Any] = MAKERS[name](robot.scanner_path, host=time)
        self.name = name

    def scans(self, seconds: float) -> list[Scan]:
        """Return the scans that are seen while time passes."""
        end_s = self.time.monotonic() + seconds
        found = []
        while (left_s := end_s - self.time.monotonic()) > 0:
            if scan := self.lidar.receive(left_s):
                found.append(scan)
        return found

    def expected(self) -> list[tuple[float, float]]:
        """Return the nearest and the farthest distance that may be seen in each bin."""
        return self._expected_from(self.robot.world.pose)

    @cache  # noqa: B019
    def _expected_from(self, pose: tuple[float, float, float]) -> list[tuple[float, float]]:
        parts = 10
        angles = [math.radians((k - parts / 2) / parts) for k in range(BINS * parts + 1)]
        ranges = self.robot.world.ranges(angles)
        return [
            (min(ranges[k * parts : (k + 1) * parts + 1]), max(ranges[k * parts : (k + 1) * parts + 1]))
            for k in range(BINS)
        ]

    def check(self, scan: Scan) -> int:
        """Check every range that is there; how many there are."""
        known = 0
        for k, (range_m, (nearest_m, farthest_m)) in enumerate(zip(scan.ranges_m, self.expected(), strict=True)):
            if not math.isnan(range_m):
                known += 1
                assert nearest_m - 0.003 <= range_m <= farthest_m + 0.003, f"bin {k}"
        return known


@contextmanager
def scene(
    name: str, walls: Walls | None = None, *, host: VirtualHost | None = None, **arguments: Any
) -> Iterator[Scene]:
    walls = walls or room(3.0, 2.0)
    with (
        host or VirtualHost() as time,
        SimulatedTurtleBot3(lidar=name, walls=walls, pose=POSE, clock=time, **arguments) as robot,
    ):
        made = Scene(name, robot, time)
        try:
            yield made
        finally:
            made.lidar.close()


@each_lidar
def test_every_degree_shows_the_wall_where_it_is(name: str) -> None:
    with scene(name) as seen:
        seen.lidar.open()
        scans = seen.scans(1.0)
        revolutions = {"lds01": 4, "lds02": 4, "lds03": 8}[name]
        assert revolutions <= len(scans) <= revolutions + 2
        for scan in scans:
            assert seen.check(scan) >= FULL[name]
            assert (scan.min_m, scan.max_m) == (seen.robot.scanner.nearest_m, seen.robot.scanner.farthest_m)
            assert scan.revolutions_per_s == pytest.approx(seen.robot.scanner.revolutions_per_s, rel=0.01)
        assert seen.lidar.counters.scans == len(scans)
        assert seen.lidar.counters.bad_frames == 0


@each_lidar
def test_what_is_beyond_the_sensors_reach_is_unknown(name: str) -> None:
    reach_m = {"lds01": 3.5, "lds02": 8.0, "lds03": 12.0}[name]
    with scene(name, room(2 * reach_m + 2, 2.0)) as seen:
        seen.lidar.open()
        for scan in seen.scans(0.5):
            known = seen.check(scan)
            far = sum(nearest_m > reach_m + 0.01 for nearest_m, _ in seen.expected())
            assert far > 5
            assert BINS - far - 12 <= known <= BINS - far


@each_lidar
def test_a_covered_one_reports_scans_without_a_range(name: str) -> None:
    with scene(name) as seen:
        seen.robot.scanner.is_covered = True
        seen.lidar.open()
        scans = seen.scans(0.6)
        assert scans
        assert all(seen.check(scan) == 0 for scan in scans)


@each_lidar
def test_a_slow_motor_reports_it(name: str) -> None:
    with scene(name) as seen:
        seen.robot.scanner.set_speed(0.5)
        seen.lidar.open()
        scans = seen.scans(1.0)
        assert {round(scan.revolutions_per_s / seen.robot.scanner.nominal_hz, 2) for scan in scans} == {0.5}


@each_lidar
@pytest.mark.parametrize(
    "fault",
    [
        {"drop_share": 0.08},
        {"corrupt_share": 0.08},
        {"lose_bytes_share": 0.001},
        {"garbage": b"\xfa\xa0\x54\x2c\xaa\x55"},
    ],
    ids=lambda fault: next(iter(fault)),
)
def test_on_a_bad_line_what_is_seen_is_still_where_it_is(name: str, fault: dict[str, Any]) -> None:
    with scene(name) as seen:
        seen.lidar.open()
        assert seen.scans(0.6)
        before = seen.lidar.counters.skipped_bytes, seen.lidar.counters.bad_frames
        vars(seen.robot.scanner_faults).update(fault)
        scans = seen.scans(1.5)
        assert len(scans) >= 4
        known = [seen.check(scan) for scan in scans]
        assert max(known) > 270
        if "drop_share" in fault:
            assert min(known) < 355
        else:
            assert seen.lidar.counters.skipped_bytes > before[0]
        if "corrupt_share" in fault:
            assert seen.lidar.counters.bad_frames > before[1]
        seen.robot.scanner_faults.clear()
        *_, last = seen.scans(0.8)
        assert seen.check(last) >= FULL[name]


@each_lidar
def test_bytes_that_come_one_by_one_are_the_same_scan(name: str) -> None:
    with scene(name) as seen:
        seen.lidar.open()
        seen.robot.scanner_faults.split_s = 0.0
        scans = seen.scans(0.6)
        assert scans
        assert all(seen.check(scan) >= FULL[name] for scan in scans)


@each_lidar
def test_a_stalled_one_reports_nothing_and_goes_on_without_a_mixture(name: str) -> None:
    with scene(name) as seen:
        seen.lidar.open()
        assert seen.scans(0.5)
        seen.robot.scanner.is_stalled = True
        seen.scans(0.0)  # Bytes under way still arrive.
        assert seen.scans(1.0) == []
        # Meanwhile the robot was turned: ranges of before would be beside the walls.
        seen.robot.world.heading_rad += 1.0
        seen.robot.scanner.is_stalled = False
        scans = seen.scans(0.8)
        assert scans
        assert all(seen.check(scan) >= FULL[name] for scan in scans)


@each_lidar
@pytest.mark.parametrize("pause_s", [1.0, 20.0])
def test_nothing_of_before_a_pause_of_the_process_counts_as_new(name: str, pause_s: float) -> None:
    host = PausingHost()
    with scene(name, host=host) as seen:
        seen.lidar.open()
        scans: list[Scan] = []

        def listen() -> None:
            with suppress(LineLostError):  # At the end.
                while True:
                    if scan := seen.lidar.receive(0.2):
                        scans.append(scan)

        host.thread(listen, "listener").start()
        host.sleep(1.0)
        assert scans
        host.paused = "listener"
        host.sleep(pause_s - 0.5)
        # Ranges of before would be beside the walls.
        seen.robot.world.heading_rad += 1.0
        host.sleep(0.5)
        host.paused = ""
        resumed_s = host.monotonic()
        host.sleep(0.8)
        found = [scan for scan in scans if scan.time_s >= resumed_s]
        assert found
        assert all(seen.check(scan) >= FULL[name] for scan in found)


@each_lidar
def test_an_unplugged_one_is_opened_again(name: str) -> None:
    with scene(name) as seen:
        seen.lidar.open()
        assert seen.scans(0.5)
        seen.robot.scanner_line.disconnect()
        with pytest.raises(LineLostError):
            seen.scans(0.1)
        seen.lidar.close()
        seen.robot.scanner_line.reconnect()
        seen.lidar.open()
        scans = seen.scans(0.6)
        assert scans
        assert all(seen.check(scan) >= FULL[name] for scan in scans)


@pytest.mark.parametrize("name", ["lds01", "lds03"])
def test_closing_stops_the_motor_and_opening_starts_it(name: str) -> None:
    with scene(name) as seen:
        for _ in range(2):
            seen.lidar.open()
            seen.time.sleep(0.01)
            assert seen.robot.scanner.is_spinning
            seen.lidar.close()
            seen.time.sleep(0.01)
            assert not seen.robot.scanner.is_spinning


def test_an_lds03_is_restarted_after_a_second() -> None:
    with scene("lds03") as seen:
        seen.lidar.open()
        assert seen.scans(0.5)
        begin_s = seen.time.monotonic()
        seen.lidar.restart()
        seen.scans(0.99)
        assert not seen.robot.scanner.is_spinning
        (first, *_) = seen.scans(0.5)
        assert seen.robot.scanner.is_spinning
        # The first turn is whole after one or two of its length.
        assert 1.1 <= first.time_s - begin_s <= 1.2


def test_an_lds03_of_the_other_speed_is_found_after_a_second() -> None:
    with scene("lds03") as seen:
        seen.robot.scanner.baud = 115_200
        seen.lidar.open()
        assert seen.scans(BAUD_TRIAL_S - 0.01) == []
        assert not seen.robot.scanner.is_spinning
        scans = seen.scans(0.5)
        assert scans
        assert seen.robot.scanner.is_spinning
        assert all(seen.check(scan) >= BINS for scan in scans)
        assert seen.lidar.baud == 115_200


@each_lidar
def test_scans_come_as_the_motor_turns(name: str) -> None:
    """Once a turn, and each has the time at which its last frame was heard."""
    with scene(name) as seen:
        seen.lidar.open()
        times_s = [scan.time_s for scan in seen.scans(3.0)]
        revolution_s = 1 / seen.robot.scanner.nominal_hz
        steps_s = [after_s - before_s for before_s, after_s in itertools.pairwise(times_s)]
        assert len(times_s) == pytest.approx(3.0 / revolution_s, abs=2)
        assert steps_s == pytest.approx([revolution_s] * len(steps_s), abs=0.01)
