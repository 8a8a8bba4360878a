"""Wheels that do not turn as they are told."""

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


def test_a_wheel_that_catches_up_in_time_is_none() -> None:
    watch = FollowingMonitor(0.7)
    assert not any(
        watch.is_blocked((200, 200), (speed, speed), time)
        for time, speed in ((0.0, 0), (0.3, 50), (0.6, 120), (0.9, 30), (1.2, 180))
    )


def test_it_is_each_wheel_that_must_be_away_for_so_long() -> None:
    watch = FollowingMonitor(0.7)
    assert not any(
        watch.is_blocked((100, 100), speeds, time)
        for time, speeds in ((0.0, (0, 100)), (0.3, (0, 100)), (0.6, (100, 0)), (0.9, (100, 0)))
    )


def test_what_was_before_can_be_forgotten() -> None:
    watch = FollowingMonitor(0.7)
    for time in (0.0, 0.3, 0.6):
        watch.is_blocked((100, 100), (0, 0), time)
    watch.forget()
    assert not watch.is_blocked((100, 100), (0, 0), 0.9)


def test_slow_goals_and_small_differences_do_not_count() -> None:
    watch = FollowingMonitor(0.7)
    assert not any(watch.is_blocked((20, -20), (0, 0), time * 0.3) for time in range(9))
