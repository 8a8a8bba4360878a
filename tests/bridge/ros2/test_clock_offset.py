"""Tests of the offset between two clocks: against a slow twin, and the bounds that it promises."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.ros2.clock_offset import ClockOffset, LocalClocks

PASSED_S = st.floats(0.0, 5.0)
DELAY_S = st.floats(0.0, 2.0)


@given(st.lists(st.tuples(PASSED_S, DELAY_S), min_size=1, max_size=60), st.floats(-1e6, 1e6))
def test_it_is_the_least_difference_of_the_window(notes: list[tuple[float, float]], ahead_s: float) -> None:
    offset, seen, now_s = ClockOffset(window_s=10.0), [], 100.0
    for passed_s, delay_s in notes:
        now_s += passed_s + delay_s
        sent_s = now_s - delay_s + ahead_s
        offset.add(sent_s, now_s)
        seen.append((now_s, now_s - sent_s))
        twin_s = min(difference_s for at_s, difference_s in seen if at_s >= now_s - 10.0)
        assert offset.local_s(0.0) == twin_s


@given(st.lists(st.tuples(PASSED_S, DELAY_S), min_size=1, max_size=30), st.floats(-1e6, 1e6))
def test_no_time_is_converted_to_one_before_it(notes: list[tuple[float, float]], ahead_s: float) -> None:
    offset, now_s = ClockOffset(), 100.0
    for passed_s, delay_s in notes:
        now_s += passed_s + delay_s
        sent_s = now_s - delay_s
        offset.add(sent_s + ahead_s, now_s)
        # A millionth of a second is what is left of the numbers.
        assert sent_s - 1e-6 <= offset.local_s(sent_s + ahead_s) <= now_s + 1e-6


def test_clocks_that_drift_are_followed() -> None:
    offset = ClockOffset()
    for second in range(1000):
        # One clock loses a ten-thousandth, as crystals do.
        offset.add(second * 0.9999, float(second))
    assert offset.local_s(999 * 0.9999) == pytest.approx(999.0, abs=0.0035)


def test_a_clock_of_ros_that_is_set_is_followed_at_once() -> None:
    wall_ns = 1_000_000_000_000_000_000
    clocks = LocalClocks(lambda: 50.0, lambda: wall_ns)
    assert clocks.stamp_ns(49.5) == 999_999_999_500_000_000
    wall_ns -= 3_600_000_000_000
    assert clocks.stamp_ns(49.5) == 999_996_399_500_000_000
