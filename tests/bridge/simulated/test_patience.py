"""A world that waits for its host."""

import fcntl
import os
import sys
import termios

import pytest

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import SimulatedTurtleBot3
from robosc_simulated.timebase import Timebase
from support.waiting import wait_until

# Bytes that the line discipline holds.
_HELD = 4095


def test_time_passes_until_the_patience_is_over_and_goes_on_when_the_host_is_heard() -> None:
    clock = ManualClock(now_s=100.0)
    time = Timebase(clock, factor=10.0, patience_s=0.5)
    clock.advance(0.02)
    assert time.world_s() == pytest.approx(0.2)
    clock.advance(1.0)
    assert time.world_s() == pytest.approx(0.5)
    clock.advance(5.0)
    assert time.world_s() == pytest.approx(0.5)
    # Time that it has waited is not made up for.
    time.host_sent()
    clock.advance(0.03)
    assert time.world_s() == pytest.approx(0.8)
    time.host_sent()
    clock.advance(0.04)
    assert time.world_s() == pytest.approx(1.2)


def test_without_patience_time_passes_whoever_is_heard() -> None:
    clock = ManualClock()
    time = Timebase(clock, factor=3.0)
    clock.advance(10.0)
    time.host_sent()
    assert time.world_s() == pytest.approx(30.0)


def test_a_fast_world_that_does_not_hear_its_host_says_so() -> None:
    clock = ManualClock()
    time = Timebase(clock, factor=10.0)
    # One that has not begun is not silent.
    clock.advance(5.0)
    time.host_sent()
    for pause_s, reported_s in [(0.09, None), (0.15, 1.5), (0.2, None), (0.31, 3.1), (0.31, None), (2.0, None)]:
        clock.advance(pause_s)
        assert time.new_silence_s() is None
        time.host_sent()
        assert time.new_silence_s() == (None if reported_s is None else pytest.approx(reported_s))


@pytest.mark.parametrize(("factor", "patience_s"), [(1.0, None), (10.0, 0.5)])
def test_a_world_that_waits_or_does_not_hurry_says_nothing(factor: float, patience_s: float | None) -> None:
    clock = ManualClock()
    time = Timebase(clock, factor, patience_s)
    for _ in range(3):
        time.host_sent()
        clock.advance(0.9)
    time.host_sent()
    assert time.new_silence_s() is None


@pytest.mark.parametrize("patience_s", [0.0, -1.0, float("nan"), float("inf")])
def test_a_patience_that_cannot_be_is_refused(patience_s: float) -> None:
    with pytest.raises(ValueError, match="the patience with the host"):
        Timebase(patience_s=patience_s)


def test_any_byte_of_the_host_lets_a_robots_world_go_on() -> None:
    with SimulatedTurtleBot3("burger", "opencr", "lds01", clock=ManualClock(), factor=2.0, patience_s=0.5) as robot:
        robot.advance(3.0)
        assert robot.time.world_s() == pytest.approx(0.5)
        for line in (robot.base_line, robot.scanner_line):
            before_s = robot.time.world_s()
            port = os.open(line.path, os.O_RDWR | os.O_NOCTTY)
            try:
                os.write(port, b"b")
                # The kernel carries it when it has time, and time passes meanwhile.
                wait_until(lambda line=line: line.received == 1)  # type: ignore[misc]
                robot.advance(3.0)
            finally:
                os.close(port)
            assert robot.time.world_s() == pytest.approx(before_s + 0.5, abs=0.011)


def test_the_world_waits_for_a_host_that_does_not_read_what_its_lidar_sends() -> None:
    with SimulatedTurtleBot3("burger", "opencr", "lds01", clock=ManualClock(), patience_s=0.5) as robot:
        base, scanner = (os.open(path, os.O_RDWR | os.O_NOCTTY) for path in (robot.base_path, robot.scanner_path))
        taken = 0

        def unread() -> int:
            return int.from_bytes(fcntl.ioctl(scanner, termios.FIONREAD, bytes(4)), sys.byteorder)

        def advance(seconds: float) -> None:
            """Let time pass; the kernel, which carries bytes from end to end when it has time, keeps up."""
            robot.advance(seconds)
            wait_until(lambda: unread() == min(robot.scanner_line.sent - taken, _HELD))

        def read(most: int) -> None:
            nonlocal taken
            taken += len(os.read(scanner, most))

        def live(seconds: float) -> float:
            begin_s = robot.time.world_s()
            for _ in range(round(seconds / 0.05)):
                heard = robot.base_line.received
                os.write(base, b"b")
                wait_until(lambda heard=heard: robot.base_line.received > heard)  # type: ignore[misc]
                advance(0.05)
            return robot.time.world_s() - begin_s

        try:
            # It has not read anything yet: it may have no use for a LiDAR.
            assert live(2.0) == pytest.approx(2.0)
            # More than once: what the kernel holds behind a full line hides that something was read.
            for _ in range(8):
                read(100)
                advance(0.005)
            assert live(2.0) < 0.6
            while taken < robot.scanner_line.sent:
                read(4096)
            assert live(0.3) == pytest.approx(0.3, abs=0.06)
        finally:
            os.close(base)
            os.close(scanner)
