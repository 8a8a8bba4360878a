"""Wheels that do not turn as commanded."""

import pytest

from robosc_bridge.devices.wheel_following import FollowingMonitor


def test_a_wheel_that_is_held_is_found_after_the_limit() -> None:
    watch = FollowingMonitor(0.7)
    assert [watch.is_blocked((100, 100), (100, 0), time / 10) for time in range(10)] == [False] * 8 + [True] * 2


def test_a_wheel_that_turns_by_itself_is_found() -> None:
    watch = FollowingMonitor(0.7)
    assert [watch.is_blocked((0, 0), (60, 0), time * 0.3) for time in range(4)] == [False, False, False, True]


def test_after_a_pause_it_begins_anew() -> None:
    watch = FollowingMonitor(0.7)
    watch.is_blocked((100, 100), (0, 0), 0.0)
    assert not watch.is_blocked((100, 100), (0, 0), 1.0)
    assert not watch.is_blocked((100, 100), (0, 0), 1.3)


@pytest.mark.parametrize(
    ("goal", "speeds"),
    [(200, [(0, 0), (50, 50), (120, 120), (30, 30), (180, 180)]), (100, [(0, 100), (0, 100), (100, 0), (100, 0)])],
    ids=["both catch up in time", "neither is away for so long"],
)
def test_a_wheel_that_catches_up_in_time_is_none(goal: int, speeds: list[tuple[int, int]]) -> None:
    watch = FollowingMonitor(0.7)
    assert not any(watch.is_blocked((goal, goal), each, 0.3 * step) for step, each in enumerate(speeds))


def test_what_was_before_can_be_forgotten() -> None:
    watch = FollowingMonitor(0.7)
    for time in (0.0, 0.3, 0.6):
        watch.is_blocked((100, 100), (0, 0), time)
    watch.forget()
    assert not watch.is_blocked((100, 100), (0, 0), 0.9)


def test_slow_goals_and_small_differences_do_not_count() -> None:
    watch = FollowingMonitor(0.7)
    assert not any(watch.is_blocked((20, -20), (0, 0), time * 0.3) for time in range(9))
