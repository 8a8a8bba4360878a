"""Tests of what goes on to ROS, and with which time: on a clock in the test's hands."""

import math
from typing import Any

import pytest

from robosc_api.v1 import bridge_pb2 as pb
from robosc_bridge.ros2.clock_offset import LocalClocks
from robosc_bridge.ros2.diagnostics import Entry, Level
from robosc_bridge.ros2.relay import EarlierBridgeError, Relay

WALL_NS = 1_700_000_000_000_000_000
AHEAD_S = 5000.0
"""The bridge's clock is ahead of this computer's: it was switched on earlier."""


class Bench:
    """A relay with its clocks, and what it passes on."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.wall_ns = WALL_NS
        self.known: list[tuple[str, tuple[float, float] | None]] = []
        self.drives: list[tuple[Any, int, tuple[float, ...]]] = []
        self.batteries: list[int] = []
        self.scans: list[int] = []
        self.reports: list[tuple[dict[str, Entry], int, str]] = []
        self.relay = Relay("robot:1", self, LocalClocks(lambda: self.now_s, lambda: self.wall_ns))

    def connect(self, turtlebot: str = "burger") -> None:
        self.relay.connect(pb.GetDefinitionResponse(robot="Porter", version="1.2", turtlebot=turtlebot))

    def know(self, turtlebot: str, scanner: tuple[float, float] | None) -> None:
        self.known.append((turtlebot, scanner))

    def put_drive(self, drive: Any, stamp_ns: int, pose_covariance: tuple[float, ...]) -> None:
        self.drives.append((drive, stamp_ns, pose_covariance))

    def put_battery(self, drive: Any, stamp_ns: int) -> None:
        self.batteries.append(stamp_ns)

    def put_scan(self, scan: Any, stamp_ns: int) -> None:
        self.scans.append(stamp_ns)

    def put_diagnostics(self, entries: tuple[Entry, ...], stamp_ns: int, robot: str) -> None:
        self.reports.append(({entry.name: entry for entry in entries}, stamp_ns, robot))

    def report(self) -> dict[str, Entry]:
        self.relay.report()
        return self.reports[-1][0]

    def pass_s(self, seconds: float) -> None:
        self.now_s += seconds
        self.wall_ns += round(seconds * 1e9)

    def take(
        self,
        *,
        read_s: float | None = None,
        turned_s: float | None = None,
        delay_s: float = 0.0,
        x_m: float = 0.0,
        age_s: float = 0.0,
    ) -> None:
        """A response comes; times are by this computer's clock, and were measured by the bridge's."""
        response = pb.WatchResponse(
            sent_s=self.now_s + AHEAD_S - delay_s, snapshot=pb.Snapshot(age_s=age_s, state=pb.BRIDGE_STATE_RUNNING)
        )
        if read_s is not None:
            response.snapshot.drive.time_s = read_s + AHEAD_S
            response.snapshot.drive.pose.x_m = x_m
        if turned_s is not None:
            response.scan.time_s = turned_s + AHEAD_S
        self.relay.take(response)

    def stamps_s(self) -> list[float]:
        """Stamps of readings, by this computer's clock; good to a microsecond."""
        return [round(100.0 + (stamp_ns - WALL_NS) / 1e9, 6) for _, stamp_ns, _ in self.drives]


@pytest.fixture
def bench() -> Bench:
    made = Bench()
    made.connect()
    return made


def test_the_stamp_is_the_time_of_the_reading(bench: Bench) -> None:
    bench.take(read_s=99.95)
    bench.pass_s(0.2)
    bench.take(read_s=100.1, turned_s=100.05, delay_s=0.04)
    assert bench.stamps_s() == [99.95, 100.1]
    assert [round((stamp_ns - WALL_NS) / 1e9, 6) for stamp_ns in bench.scans] == [0.05]
    assert bench.known == [("burger", None)]


def test_the_place_of_the_lidar_is_passed_on(bench: Bench) -> None:
    definition = pb.GetDefinitionResponse(robot="Porter", version="1.2", scanner_x_m=0.0, scanner_y_m=-0.06)
    bench.relay.connect(definition)
    assert bench.known[-1] == ("", (0.0, -0.06))


def test_a_slow_beginning_is_corrected_without_going_back(bench: Bench) -> None:
    bench.take(read_s=99.9, delay_s=0.1)
    assert bench.stamps_s() == [100.0]
    bench.pass_s(0.05)
    # By what is known now, this one is earlier than the one before was said to be.
    bench.take(read_s=99.97)
    bench.pass_s(0.05)
    bench.take(read_s=100.05)
    assert bench.stamps_s() == [100.0, 100.05]


def test_each_reading_and_scan_goes_on_once(bench: Bench) -> None:
    for _ in range(3):
        bench.take(read_s=99.9, turned_s=99.8)
        bench.pass_s(0.01)
    assert (len(bench.drives), len(bench.scans)) == (1, 1)


def test_a_reading_that_a_better_offset_dates_later_does_not_go_on_again(bench: Bench) -> None:
    bench.take()
    bench.pass_s(29.9)
    bench.take(read_s=129.8, turned_s=129.8, delay_s=0.2)
    assert bench.stamps_s() == [129.8]
    # The best measurement of the offset is too old to count.
    bench.pass_s(0.2)
    bench.take(read_s=129.8, turned_s=129.8, delay_s=0.2)
    assert (len(bench.drives), len(bench.scans)) == (1, 1)


@pytest.mark.parametrize(("age_s", "is_published"), [(0.49, True), (0.51, False)])
def test_what_is_stale_does_not_go_on(age_s: float, is_published: bool, bench: Bench) -> None:
    bench.take()
    bench.pass_s(5.0)
    bench.take(read_s=bench.now_s - age_s, turned_s=bench.now_s - age_s)
    assert (len(bench.drives), len(bench.scans)) == ((1, 1) if is_published else (0, 0))


def test_what_waited_on_its_way_is_stale(bench: Bench) -> None:
    bench.take()
    bench.pass_s(2.0)
    # A process that was stopped finds what was sent meanwhile.
    bench.take(read_s=98.99, delay_s=1.0)
    assert bench.drives == []


def test_a_clock_that_is_set_back_stops_nothing(bench: Bench) -> None:
    bench.take(read_s=99.95)
    bench.wall_ns -= 3_600_000_000_000
    bench.pass_s(0.05)
    bench.take(read_s=100.0)
    assert bench.stamps_s() == [99.95, -3500.0]


def test_the_battery_is_reported_once_a_second(bench: Bench) -> None:
    for _ in range(50):
        bench.take(read_s=bench.now_s - 0.01)
        bench.pass_s(0.05)
    assert len(bench.drives) == 50
    assert len(bench.batteries) == 3


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
def test_a_pose_that_is_none_does_not_go_on(wrong: float, bench: Bench) -> None:
    bench.take(read_s=99.9, x_m=wrong)
    bench.pass_s(0.1)
    bench.take(read_s=100.0, x_m=1.0)
    assert bench.stamps_s() == [100.0]
    assert all(map(math.isfinite, bench.drives[0][2]))


def test_the_covariance_grows_with_the_way_also_while_nothing_is_published(bench: Bench) -> None:
    bench.take(read_s=99.9)
    bench.pass_s(5.0)
    bench.take(read_s=100.0, x_m=1.0)
    assert len(bench.drives) == 1
    bench.pass_s(0.1)
    bench.take(read_s=105.05, x_m=1.0)
    assert bench.drives[0][2][0] == pytest.approx(1e-6)
    assert bench.drives[1][2][0] == pytest.approx(1e-6 + 1e-4)


def test_a_covariance_that_the_bridge_reports_goes_before_an_assumed_one(bench: Bench) -> None:
    drive = pb.DriveState(time_s=99.9 + AHEAD_S, pose_covariance=[0.5, 0, 0, 0, 0.25, 0, 0, 0, 0.125])
    bench.relay.take(pb.WatchResponse(sent_s=bench.now_s + AHEAD_S, snapshot=pb.Snapshot(drive=drive)))
    covariance = bench.drives[0][2]
    assert (covariance[0], covariance[7], covariance[35]) == (0.5 + 1e-6, 0.25 + 1e-6, 0.125 + 1e-6)


def test_a_bridge_that_does_not_send_its_times_is_refused(bench: Bench) -> None:
    with pytest.raises(EarlierBridgeError, match=r"robot:1 is of an earlier version \(1.2\)"):
        bench.relay.take(pb.WatchResponse(snapshot=pb.Snapshot()))


class TestReports:
    def test_before_anything_has_answered(self) -> None:
        found = Bench().report()
        assert found["bridge"].level is Level.ERROR
        assert found["safety"].level is Level.STALE

    def test_a_bridge_that_comes_goes_and_comes_back(self, bench: Bench) -> None:
        assert bench.report()["bridge"].level is Level.WARN
        bench.take()
        assert bench.report()["bridge"].level is Level.OK
        assert bench.reports[-1][1:] == (WALL_NS, "Porter")
        bench.relay.lose("no bridge answers at robot:1")
        found = bench.report()
        assert (found["bridge"].level, found["bridge"].message) == (Level.ERROR, "no bridge answers at robot:1")
        assert found["supervisor"].level is Level.STALE
        bench.connect()
        bench.take()
        assert bench.report()["bridge"].level is Level.OK

    def test_silence_is_an_error_after_a_while(self, bench: Bench) -> None:
        bench.take()
        bench.pass_s(1.9)
        assert {entry.level for entry in bench.report().values()} == {Level.OK}
        bench.pass_s(0.7)
        found = bench.report()
        assert (found["bridge"].level, found["safety"].level) == (Level.ERROR, Level.STALE)
        assert found["bridge"].message == "Nothing has come from the bridge for 2.6 s."
        bench.take()
        assert bench.report()["bridge"].level is Level.OK

    def test_a_loop_that_hangs_is_reported_though_the_endpoint_answers(self, bench: Bench) -> None:
        bench.take(age_s=1.9)
        assert bench.report()["bridge"].level is Level.OK
        bench.pass_s(0.2)
        assert "loop hangs, for 2.1 s" in bench.report()["bridge"].message

    def test_clocks_of_another_bridge_are_found_anew(self, bench: Bench) -> None:
        bench.take(read_s=99.99)
        bench.pass_s(1.0)
        bench.connect()
        # Its computer was started anew: times begin at zero, and the first reading may have the time of an old one.
        for second in range(3):
            sent_s = 5.0 + second
            drive = pb.DriveState(time_s=sent_s - 0.01)
            bench.relay.take(pb.WatchResponse(sent_s=sent_s, snapshot=pb.Snapshot(drive=drive)))
            bench.pass_s(1.0)
        assert bench.stamps_s() == [99.99, 100.99, 101.99, 102.99]
