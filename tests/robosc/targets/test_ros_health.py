"""Tests of the diagnostics, around a real executor on a clock of its own."""

from typing import Any

import pytest

from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.executor import Executor
from robosc.execution.runtime.settings import Settings
from robosc.targets.ros.runtime.health import STILL_S, ClockWatch, HealthMonitor, Level
from support.generated import example_supervisor
from support.goal_porter import porter_supervisor


class Silent:
    """A middleware that does nothing."""

    def __getattr__(self, name: str) -> Any:
        return lambda *arguments: None


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


def monitored(clock: ManualClock, **settings: Any) -> tuple[Executor, HealthMonitor]:
    middleware: Any = Silent()
    system = InterpretedSystem(example_supervisor("line_follower/line_follower"))
    executor = Executor(system, middleware, Settings(**settings), clock)
    return executor, HealthMonitor(executor)


def test_from_the_start_to_a_fault(clock: ManualClock) -> None:
    executor, monitor = monitored(clock)
    assert monitor.report()[:2] == (Level.WARN, "not started")
    monitor.missing_servers = ("/a", "/b")
    assert monitor.report()[:2] == (Level.WARN, "waiting for servers: /a, /b")
    executor.start()
    health = monitor.report()
    assert health[:2] == (Level.OK, "running")
    assert health.values == {
        "status": "running",
        "reason": "",
        "unknown": "0",
        "unexpected": "0",
        "faults": "0",
        "dropped": "0",
        "limited": "0",
        "cancelling": "",
        "last decision (us)": "",
    }
    monitor.decided(0.0000123)
    assert monitor.report().values["last decision (us)"] == "12.3"
    executor.stop("the sky falls", is_fault=True)
    health = monitor.report()
    assert health[:2] == (Level.ERROR, "stopped: the sky falls")
    assert (health.values["status"], health.values["faults"]) == ("stopped", "1")
    assert health.values["reason"] == "the sky falls"


def test_what_goes_wrong_is_a_warning_once(clock: ManualClock) -> None:
    executor, monitor = monitored(clock)
    executor.start()
    executor.receive("/nobody/knows", None)
    executor.on_reply(5, None)
    warning = (Level.WARN, "since the last report: 2 unexpected")
    assert monitor.report()[:2] == warning
    # A report out of turn takes nothing away from the next one.
    assert monitor.report()[:2] == warning
    monitor.next_interval()
    assert monitor.report()[:2] == (Level.OK, "running")
    assert monitor.report().values["unexpected"] == "2"


def test_troubles_with_others_are_warnings_as_long_as_they_last(clock: ManualClock) -> None:
    executor, monitor = monitored(clock, max_age_s={"/scan": 1.0})
    monitor.troubles = ("2 servers of /a", "no clock")
    assert monitor.report()[:2] == (Level.WARN, "not started; 2 servers of /a; no clock")
    executor.start()
    waiting = "waiting for the first message of every sensor with a maximum age"
    assert monitor.report()[:2] == (Level.WARN, f"{waiting}; 2 servers of /a; no clock")
    executor.receive("/scan", {"ranges": [2.0] * 360})
    for _ in range(2):
        assert monitor.report()[:2] == (Level.WARN, "2 servers of /a; no clock")
        monitor.next_interval()
    executor.receive("/nobody/knows", None)
    assert monitor.report().message == "2 servers of /a; no clock; since the last report: 1 unexpected"
    monitor.next_interval()
    monitor.troubles = ()
    assert monitor.report()[:2] == (Level.OK, "running")
    monitor.troubles = ("no clock",)
    executor.stop("the sky falls", is_fault=True)
    assert monitor.report()[:2] == (Level.ERROR, "stopped: the sky falls")


def test_a_sensor_that_was_not_seen_or_is_stale(clock: ManualClock) -> None:
    executor, monitor = monitored(clock, max_age_s={"/scan": 1.0})
    executor.start()
    assert monitor.report()[:2] == (
        Level.WARN,
        "waiting for the first message of every sensor with a maximum age",
    )
    clock.advance(1.5)
    executor.watch()
    assert monitor.report()[:2] == (Level.ERROR, "stopped: scan on /scan is stale")
    executor.receive("/scan", {"ranges": [2.0] * 360})
    assert monitor.report()[:2] == (Level.OK, "running")


def test_a_cancelled_goal_that_does_not_end_is_an_error_until_it_does(clock: ManualClock) -> None:
    middleware: Any = Silent()
    system = InterpretedSystem(example_supervisor("navigation/navigation"))
    executor = Executor(system, middleware, Settings(cancel_timeout_s=2.0), clock)
    monitor = HealthMonitor(executor)
    executor.start()
    executor.tick()
    executor.on_reply(1, {"success": True})
    executor.receive("/person/distance", 3.0)
    executor.tick()
    executor.receive("/person/distance", 0.5)
    assert monitor.report()[:2] == (Level.OK, "running, cancelling navigate")
    assert monitor.report().values["cancelling"] == "navigate"
    clock.advance(2.0)
    executor.watch()
    overdue = "the goal of navigate has not ended although its cancel was asked for"
    assert monitor.report()[:2] == (Level.ERROR, overdue)
    executor.stop("SIGTERM")
    assert monitor.report()[:2] == (Level.ERROR, f"stopped: SIGTERM; {overdue}")
    executor.restart()
    assert monitor.report()[:2] == (Level.ERROR, overdue)
    executor.on_goal_ended(1, "cancelled")
    assert monitor.report()[:2] == (Level.OK, "running")


def test_goals_from_before_a_restart_are_waited_for(clock: ManualClock) -> None:
    middleware: Any = Silent()
    system = InterpretedSystem(example_supervisor("navigation/navigation"))
    executor = Executor(system, middleware, None, clock)
    monitor = HealthMonitor(executor)
    executor.start()
    executor.tick()
    executor.on_reply(1, {"success": True})
    executor.receive("/person/distance", 3.0)
    executor.tick()
    executor.stop("SIGTERM")
    executor.restart()
    assert monitor.report()[:2] == (Level.WARN, "waiting for the end of goals from before the restart: navigate")


def test_calls_from_before_a_restart_are_waited_for(clock: ManualClock) -> None:
    middleware: Any = Silent()
    system = InterpretedSystem(example_supervisor("navigation/navigation"))
    executor = Executor(system, middleware, None, clock)
    monitor = HealthMonitor(executor)
    executor.start()
    executor.tick()
    executor.restart()
    assert monitor.report()[:2] == (Level.WARN, "waiting for the end of calls from before the restart: calibrate")
    executor.on_reply(1, {"success": True})
    assert monitor.report().values["status"] == "running"


def test_an_assumption_that_is_owed_for_too_long_is_a_warning_until_it_is_met(clock: ManualClock) -> None:
    middleware: Any = Silent()
    settings = Settings(assumption_timeout_s=2.0)
    executor = Executor(InterpretedSystem(porter_supervisor()), middleware, settings, clock)
    monitor = HealthMonitor(executor)
    assert monitor.report().values["goal 1"] == "not known, reached 0 times: Caller.waiting leads to Base.inside"
    executor.start()
    executor.receive("/call", None)
    executor.tick()
    assert monitor.report()[:2] == (Level.OK, "running")
    clock.advance(42.0)
    executor.watch()
    health = monitor.report()
    owed = "assumption 1 has been owed for 42 s: Door.opening leads to Door.ajar"
    assert health[:2] == (Level.WARN, owed)
    assert health.values["assumption 1"] == "not for 42 s, reached 0 times: Door.opening leads to Door.ajar"
    assert (health.values["approached"], health.values["chosen"]) == ("goal 1", "open")
    executor.receive("/call", None)
    executor.on_reply(7, None)
    assert monitor.report().message == f"{owed}; since the last report: 1 unexpected"
    monitor.next_interval()
    executor.receive("/door/opened", None)
    assert monitor.report()[:2] == (Level.OK, "running")


def test_time_that_does_not_come_or_stands_still_is_worth_a_warning() -> None:
    ros_ns = [0]
    watch = ClockWatch(lambda: ros_ns[0])
    assert watch.trouble(100.0) == watch.trouble(1000.0) == "use_sim_time is true, and no time has come on /clock"
    ros_ns[0] = 5
    assert watch.trouble(1000.0) == ""
    assert watch.trouble(1000.0 + 0.9 * STILL_S) == ""
    assert watch.trouble(1000.0 + STILL_S) == "use_sim_time is true, and the time of /clock stands still"
    # Time that goes back moves.
    ros_ns[0] = 4
    assert watch.trouble(1000.0 + STILL_S) == ""
    assert watch.trouble(1000.0 + 1.9 * STILL_S) == ""
