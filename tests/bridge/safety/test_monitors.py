"""Tests of the data that is remembered of reports, at the border of each time and threshold."""

import math
from dataclasses import replace

import pytest

from robosc_bridge.devices.interface import BatteryLevel
from robosc_bridge.safety.monitors import (
    REFUSAL_SHOWN_S,
    BatteryMonitor,
    Freshness,
    RefusalMonitor,
    ScanCoverageMonitor,
    WheelMonitor,
)
from support.safety import LIMITS, reading

# Powers of two: no rounding at the borders.
EXACT = replace(LIMITS, battery_mean_s=2.0, astray_m_s=0.03125, astray_s=0.5)


def test_a_report_is_fresh_up_to_its_time() -> None:
    watch = Freshness(0.5)
    assert watch.is_stale(0.0)
    watch.update(10.0)
    assert not watch.is_stale(10.0)
    assert not watch.is_stale(10.5)
    assert watch.is_stale(math.nextafter(10.5, 11))
    watch.update(11.0)
    assert not watch.is_stale(11.5)


def test_what_never_needs_to_be_heard_is_never_stale() -> None:
    assert not Freshness(None).is_stale(1e9)


def test_a_report_from_the_future_counts_from_when_it_is_looked_at() -> None:
    watch = Freshness(0.5)
    watch.update(1e9)
    assert not watch.is_stale(10.0)
    assert not watch.is_stale(10.5)
    assert watch.is_stale(10.625)


SEEN = {"ahead": {*range(31), *range(330, 360)}, "behind": set(range(150, 211))}


def scan(*degrees: int) -> tuple[float, ...]:
    """Ranges with valid ones at these degrees alone."""
    return tuple(1.0 if degree in degrees else math.nan for degree in range(360))


@pytest.mark.parametrize(("sector", "speed_m_s"), [("ahead", 0.001), ("behind", -0.001)])
def test_each_degree_of_a_sector_counts_and_no_other(sector: str, speed_m_s: float) -> None:
    watch = ScanCoverageMonitor(1.0)
    inside = SEEN[sector]
    watch.update(scan(*inside))
    assert not watch.is_blind(speed_m_s)
    assert watch.is_blind(-speed_m_s)
    assert not watch.is_blind(0.0)
    for degree in inside:
        watch.update(scan(*inside - {degree}))
        assert watch.is_blind(speed_m_s), degree
    one = ScanCoverageMonitor(0.01)
    for degree in range(360):
        one.update(scan(degree))
        assert one.is_blind(speed_m_s) is (degree not in inside)


@pytest.mark.parametrize("nothing", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_not_seen(nothing: float) -> None:
    watch = ScanCoverageMonitor(0.5)
    watch.update((nothing,) * 360)
    assert watch.is_blind(0.1) and watch.is_blind(-0.1)


@pytest.mark.parametrize("missing", [0, 30, 31, 61])
def test_a_sector_is_blind_below_its_share(missing: int) -> None:
    # 61 ranges: half of them are 30.5.
    watch = ScanCoverageMonitor(0.5)
    watch.update(scan(*sorted(SEEN["ahead"])[missing:]))
    assert watch.is_blind(0.1) is (missing >= 31)


def test_before_the_first_scan_nothing_is_missing() -> None:
    watch = ScanCoverageMonitor(1.0)
    assert not watch.is_blind(1.0) and not watch.is_blind(-1.0)


def test_exactly_the_share_is_enough() -> None:
    watch = ScanCoverageMonitor(0.25)
    # 61 ranges: 15.25.
    watch.update(scan(*range(16)))
    assert not watch.is_blind(0.1)
    watch.update(scan(*range(15)))
    assert watch.is_blind(0.1)


@pytest.mark.parametrize("time_s", [math.nan, math.inf, -math.inf])
def test_no_time_is_not_heard(time_s: float) -> None:
    watch = Freshness(0.5)
    watch.update(time_s)
    assert watch.is_stale(10.0)
    watch.update(10.0)
    watch.update(time_s)
    assert not watch.is_stale(10.5)
    assert watch.is_stale(10.75)


def battery(*heard: tuple[float | None, float]) -> tuple[bool, bool]:
    watch = BatteryMonitor(EXACT)
    for voltage_v, time_s in heard:
        watch.update(voltage_v, time_s)
    return watch.is_near_empty, watch.is_empty


@pytest.mark.parametrize(
    ("voltage_v", "is_near_empty", "is_empty"),
    [
        (12.0, False, False),
        (math.nextafter(11.5, 12), False, False),
        (11.5, True, False),
        (math.nextafter(11.1, 12), True, False),
        (11.1, True, True),
        (0.0, True, True),
        (-1.0, True, True),
    ],
)
def test_the_battery_counts_at_its_voltages_and_below(voltage_v: float, is_near_empty: bool, is_empty: bool) -> None:
    assert battery((voltage_v, 10.0), (voltage_v, 12.0)) == (is_near_empty, is_empty)


def test_a_mean_takes_its_time() -> None:
    assert battery() == (False, False)
    assert battery((1.0, 10.0)) == (False, False)
    assert battery((1.0, 10.0), (1.0, math.nextafter(12.0, 0))) == (False, False)
    assert battery((1.0, 10.0), (1.0, 12.0)) == (True, True)


@pytest.mark.parametrize(
    ("level", "is_near_empty", "is_empty"),
    [(BatteryLevel.SOUND, False, False), (BatteryLevel.LOW, True, False), (BatteryLevel.EMPTY, True, True)],
)
def test_what_a_drive_base_says_of_its_battery_counts_at_once(
    level: BatteryLevel, is_near_empty: bool, is_empty: bool
) -> None:
    watch = BatteryMonitor(replace(EXACT, battery_warn_v=None, battery_stop_v=None))
    watch.update(None, 10.0, level)
    assert (watch.is_near_empty, watch.is_empty) == (is_near_empty, is_empty)
    watch.update(1.0, 11.0)  # says nothing
    watch.update(1.0, 13.0)
    assert (watch.is_near_empty, watch.is_empty) == (is_near_empty, is_empty)
    watch.update(None, 14.0, BatteryLevel.SOUND)
    assert (watch.is_near_empty, watch.is_empty) == (False, False)


def test_a_dip_is_no_empty_battery() -> None:
    heard = [(12.0, 10 + 0.25 * step) for step in range(9)]
    heard[3] = (9.0, 10.75)
    assert battery(*heard) == (False, False)  # (8 * 12 + 9) / 9 = 11.67
    heard[4] = (8.0, 11.0)
    assert battery(*heard) == (True, False)  # 11.22
    heard[5] = (9.0, 11.25)
    assert battery(*heard) == (True, True)  # 10.89


def test_each_mean_is_of_its_own_time() -> None:
    low = [(11.0, 10.0), (11.0, 12.0)]
    assert battery(*low, (12.0, 12.5)) == (True, True)
    assert battery(*low, (12.0, 12.5), (12.0, 14.25)) == (True, True)
    assert battery(*low, (12.0, 12.5), (12.0, 14.5)) == (False, False)
    assert battery((12.0, 10.0), (12.0, 12.0), (11.0, 12.5), (11.0, 14.5)) == (True, True)


def test_when_the_clock_goes_back_the_mean_begins_anew() -> None:
    assert battery((12.0, 10.0), (12.0, 10.5), (11.0, 5.0), (11.0, 6.0), (11.0, 7.0)) == (True, True)
    assert battery((12.0, 10.0), (11.0, 5.0), (11.0, 6.75)) == (False, False)
    # The same time again is no step back.
    assert battery((10.0, 10.0), (12.0, 10.0), (12.0, 12.0)) == (True, False)


@pytest.mark.parametrize(
    ("voltage_v", "time_s"),
    [(None, 11.0), (math.nan, 11.0), (math.inf, 11.0), (-math.inf, 11.0), (0.0, math.nan), (0.0, math.inf)],
)
def test_what_is_no_voltage_reports_nothing(voltage_v: float | None, time_s: float) -> None:
    assert battery((12.0, 10.0), (voltage_v, time_s), (12.0, 12.0)) == (False, False)
    assert battery((voltage_v, time_s), (voltage_v, time_s), (11.0, 10.0), (11.0, 12.0)) == (True, True)


GOOD, BAD = ((0.0, 0.0), (0.0, 0.0)), ((0.0, 0.0), (0.1, 0.0))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("goal", "speed", "follows"),
    [
        (0.0, 0.03125, True),
        (0.0, math.nextafter(0.03125, 1), False),
        (0.0, -0.03125, True),
        (0.0, math.nextafter(-0.03125, -1), False),
        (0.0625, 0.03125, True),
        (0.0625, 0.03124, False),
        (0.125, 0.0625, True),  # half of it
        (0.125, 0.06249, False),
        (0.125, 0.1875, True),
        (0.125, math.nextafter(0.1875, 1), False),
        (0.015625, 0.0, True),  # too slow to judge
        (0.125, -0.125, False),
        (0.0, math.nan, False),
        (0.125, math.nan, False),
        (0.125, math.inf, False),
    ],
)
def test_how_far_off_a_wheel_may_be(sign: int, goal: float, speed: float, follows: bool) -> None:
    for goals, speeds in (((sign * goal, 0.0), (sign * speed, 0.0)), ((0.0, sign * goal), (0.0, sign * speed))):
        assert astray((goals, speeds, 10.0), (goals, speeds, 11.0)) == [False, not follows]


Read = tuple[tuple[float, float], tuple[float, float], float]


def astray(*read: Read, acceleration_m_s2: float | None = None) -> list[bool]:
    """Tell after each reading (goals, speeds, time) whether a wheel is astray."""
    watch, found = WheelMonitor(EXACT), list[bool]()
    for goals, speeds, time_s in read:
        watch.update(goals, reading(time_s, wheels_m_s=speeds, acceleration_m_s2=acceleration_m_s2))
        found.append(watch.is_astray)
    return found


def test_how_long_a_wheel_may_be_off() -> None:
    beyond_s = math.nextafter(10.5, 11)
    assert astray((*BAD, 10.0), (*BAD, 10.5), (*BAD, beyond_s), (*BAD, 10.75)) == [False, False, True, True]
    assert astray((*BAD, 10.0), (*BAD, 10.75), (*GOOD, 11.0), (*BAD, 11.0), (*BAD, 11.5)) == [
        False, True, False, False, False,
    ]  # fmt: skip
    watch = WheelMonitor(EXACT)
    for time_s in (10.0, 10.75):
        watch.update(BAD[0], reading(time_s, wheels_m_s=BAD[1]))
    watch.forget()
    assert not watch.is_astray
    watch.update(BAD[0], reading(11.0, wheels_m_s=BAD[1]))
    assert not watch.is_astray


def test_each_wheel_has_its_own_time() -> None:
    left, right = ((0.125, 0.125), (0.0, 0.125)), ((0.125, 0.125), (0.125, 0.0))
    assert astray((*left, 10.0), (*left, 10.5), (*right, 10.75), (*right, 11.25)) == [False] * 4


def test_when_the_clock_goes_back_the_time_off_begins_anew() -> None:
    assert astray((*BAD, 10.0), (*BAD, 5.0), (*BAD, 5.5), (*BAD, 5.75)) == [False, False, False, True]


def test_a_wheel_is_compared_with_the_goal_as_its_motor_goes_there() -> None:
    goals = (0.5, 0.5)
    followed: list[Read] = [(goals, (0.125 * step / 8, 0.125 * step / 8), 10.0 + step / 8) for step in range(33)]
    assert not any(astray(*followed, acceleration_m_s2=0.125))
    assert any(astray(*followed))
    held: list[Read] = [(goals, (0.0, 0.0), 10.0 + step / 8) for step in range(33)]
    # 0.03125 m/s are reached after 0.25 s, and exceeded after 0.375 s.
    assert astray(*held, acceleration_m_s2=0.125).index(True) == 3 + 5
    # A braking wheel is slower than commanded as well, and one that does not brake is found.
    braked: list[Read] = [((0.0, 0.0), (0.5 - step / 64, 0.5 - step / 64), 10.0 + step / 8) for step in range(33)]
    assert not any(astray(*braked, acceleration_m_s2=0.125))
    assert any(astray(*[(goals, (0.5, 0.5), time_s) for goals, _, time_s in braked], acceleration_m_s2=0.125))


def unbidden(*read: Read) -> list[bool]:
    watch, found = WheelMonitor(replace(EXACT, standstill_m_s=0.015625, unbidden_s=0.25)), list[bool]()
    for goals, speeds, time_s in read:
        watch.update(goals, reading(time_s, wheels_m_s=speeds))
        found.append(watch.is_unbidden)
    return found


ZERO = (0.0, 0.0)


@pytest.mark.parametrize("speeds", [(0.04, 0.0), (0.0, -0.04), (math.nan, 0.0), (1.0, 1.0)])
def test_wheels_that_stood_still_may_not_rotate_by_themselves(speeds: tuple[float, float]) -> None:
    rest: Read = (ZERO, (0.015625, -0.015625), 9.0)
    moves: list[Read] = [(ZERO, speeds, time_s) for time_s in (10.0, 10.25, math.nextafter(10.25, 11), 11.0)]
    assert unbidden(rest, *moves) == [False, False, False, True, True]
    # A wheel that comes to rest between begins anew; so does a clock that goes back.
    assert unbidden(rest, *moves[:2], rest, *moves[:2]) == [False] * 6
    assert unbidden(rest, moves[3], *moves[:3]) == [False, False, False, False, True]


def test_wheels_that_have_not_stood_still_yet_are_none_that_begin_to_rotate() -> None:
    moves: list[Read] = [(ZERO, (0.5, 0.5), 10.0 + step) for step in range(3)]
    assert unbidden(*moves) == [False] * 3
    commanded: Read = ((0.5, 0.5), (0.5, 0.5), 9.5)
    assert unbidden((ZERO, ZERO, 9.0), commanded, *moves) == [False] * 5


def test_slow_ones_do_not_count() -> None:
    slow: list[Read] = [(ZERO, (0.03125, -0.03125), 10.0 + step) for step in range(3)]
    assert unbidden((ZERO, ZERO, 9.0), *slow) == [False] * 4


def test_a_refused_reading_is_shown_until_its_time_has_passed() -> None:
    monitor = RefusalMonitor()
    monitor.update(1, 8.0)
    assert monitor.is_recent(8.0 + REFUSAL_SHOWN_S / 2)
    assert not monitor.is_recent(8.0 + REFUSAL_SHOWN_S)
