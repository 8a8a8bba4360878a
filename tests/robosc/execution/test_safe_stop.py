"""Semantics 3.8: wheels stop whatever happens."""

from typing import Any

import pytest

from robosc.execution.runtime.runner import Status
from support.execution import Bench, Broken, Sent, bench, system_of

ROBOT = """
robot Robot {
  interface twist use Twist from geometry_msgs
  interface navigate use NavigateToPose from nav2_msgs
  interface trigger use Trigger from std_srvs
  datatype object Vector { x: double }
  datatype object Twist { linear: Vector }
  datatype object Empty { }
  component Sensor {
    outgoing message scan with identifier: "/scan", type: boolean
    outgoing message shape with identifier: "/scan", type: boolean
    outgoing message battery with identifier: "/battery", type: double
    behaviour {
      variable seen: boolean
      variable volt: double
      on response from scan do seen := value
      on response from battery do volt := value
      initial marked state awake { }
    }
  }
  component Wheels {
    incoming message move with identifier: "/cmd_vel", type: Twist links twist
    incoming message spin with identifier: "/spin", type: Twist links twist
    action go with request: Empty, response: Empty, feedback: Empty links navigate
    service ask with request: none, response: Empty links trigger
    behaviour {
      variable asked: boolean
      on response from ask do asked := true
      initial marked state awake { on request to move  on request to spin  on request to go goto going }
      state going { on error from go goto awake  on response from go goto awake  on cancel to go goto awake }
    }
  }
  provide move with { linear: { x: 0.5 } }
  provide spin with { linear: { x: 0.5 } }
}
"""
MOVE: Sent = ("publish", "move", {"linear": {"x": 0.5}})
ZEROS: list[Sent] = [("default", "/cmd_vel"), ("default", "/spin")]


def moving(**settings: Any) -> Bench:
    b = bench(ROBOT, **{"policy": "priority", "priority": ("move",), **settings})
    assert b.tick() == [MOVE]
    b.middleware.sent.clear()
    return b


def going() -> Bench:
    b = bench(ROBOT, policy="priority", priority=("go",))
    assert b.tick() == [("goal", "go", 1, None)]
    b.middleware.sent.clear()
    return b


def test_a_stop_sends_the_default_everywhere_and_requests_nothing() -> None:
    b = moving()
    b.executor.stop("SIGINT")
    # Also where nothing was sent: whatever acts there must stop.
    assert b.middleware.sent == ZEROS
    assert b.status() is Status.STOPPED
    assert b.executor.reasons == ("SIGINT",)
    assert not b.executor.is_faulty
    assert b.tick(10) == []
    assert b.executor.counters.faults == 0


def test_a_fault_found_by_the_adapter() -> None:
    b = moving()
    b.executor.stop("lost the bus", is_fault=True)
    assert b.middleware.sent == ZEROS
    assert b.executor.is_faulty
    assert b.executor.counters.faults == 1
    assert [entry["what"] for entry in b.entries("fault")] == ["lost the bus"]


def test_sensor_data_and_replies_are_still_handled() -> None:
    b = bench(ROBOT, policy="priority", priority=("ask",))
    assert b.tick() == [("call", "ask", 1, None)]
    b.executor.stop("SIGTERM")
    b.receive("/scan", True)
    b.executor.on_reply(1, {})
    assert b.variable("Sensor", "seen") is True
    assert b.variable("Wheels", "asked") is True
    assert b.events[-1] == "ask.reset"
    assert b.tick(3) == []


@pytest.mark.parametrize("method", ["publish", "prepare", "is_default"])
def test_an_exception_of_the_middleware_stops_the_robot(method: str) -> None:
    b = bench(ROBOT, policy="priority", priority=("move",))
    b.middleware.failing.add(method)
    assert b.tick() == ZEROS
    assert b.executor.is_faulty
    assert "RuntimeError" in b.executor.reasons[0]
    assert b.tick(5) == []


@pytest.mark.parametrize(("request_", "method"), [("go", "send_goal"), ("ask", "call")])
def test_a_call_that_cannot_be_made_stops_the_robot(request_: str, method: str) -> None:
    b = bench(ROBOT, policy="priority", priority=(request_,))
    b.middleware.failing.add(method)
    assert b.tick() == ZEROS
    assert b.executor.is_faulty
    # A call that was never made has no answer to await.
    assert b.status() is Status.STOPPED
    b.middleware.failing.clear()
    b.executor.restart()
    assert b.tick()[0][:2] == ("goal" if request_ == "go" else "call", request_)


@pytest.mark.parametrize("method", ["enabled", "enabled_silent", "read", "step", "provide", "conjuncts", "state"])
def test_an_exception_of_the_system_stops_the_robot(method: str) -> None:
    system = Broken(system_of(ROBOT), method)
    b = Bench(system)
    b.tick(2)
    b.middleware.sent.clear()
    system.is_broken = True
    b.receive("/scan", True)
    b.tick()
    assert b.executor.is_faulty
    assert b.middleware.sent[-2:] == ZEROS
    assert b.status() is Status.STOPPED


def test_a_default_message_that_fails_keeps_no_other_from_going_out() -> None:
    b = moving()
    b.middleware.failing.add(("publish_default", "/cmd_vel"))
    b.executor.stop("SIGINT")
    assert b.middleware.sent == [("default", "/spin")]
    assert b.executor.is_faulty
    # It is tried again each period until it went out.
    assert b.tick(2) == []
    b.middleware.failing.clear()
    assert b.tick(2) == [("default", "/cmd_vel")]


def test_a_robot_that_cannot_be_brought_to_rest_is_not_restarted() -> None:
    b = moving()
    b.middleware.failing.add("publish_default")
    b.executor.stop("SIGINT")
    b.executor.restart()
    assert b.status() is Status.STOPPED
    b.middleware.failing.clear()
    b.executor.restart()
    assert b.status() is Status.RUNNING


def test_a_log_that_raises_does_not_stop_the_robot() -> None:
    b = moving()

    def broken(entry: object) -> None:
        raise OSError("disk")

    b.log.write = broken  # type: ignore[method-assign]
    assert b.tick() == [MOVE]
    assert b.status() is Status.RUNNING
    assert b.executor.counters.dropped == 1


def test_running_goals_are_cancelled_and_awaited_for_half_a_second() -> None:
    b = going()
    b.executor.on_goal_accepted(1)
    b.executor.stop("SIGINT")
    assert b.middleware.sent == [*ZEROS, ("cancel", "go", 1)]
    assert b.events == ["go.request"]
    assert b.status() is Status.STOPPING
    b.clock.advance(0.49)
    assert b.status() is Status.STOPPING
    b.clock.advance(0.02)
    assert b.status() is Status.STOPPED


def test_the_goal_then_ends_as_an_error() -> None:
    b = going()
    b.executor.on_goal_accepted(1)
    b.executor.stop("SIGINT")
    b.executor.on_goal_ended(1, "cancelled")
    assert b.status() is Status.STOPPED
    assert b.events == ["go.request", "go.error", "go.reset"]
    (entry,) = b.entries("cancelling")
    assert (entry["action"], entry["why"]) == ("go", "stop")


def test_a_cancel_of_a_requirement_that_turned_before_the_stop_is_still_an_event() -> None:
    b = bench(
        ROBOT.replace("provide spin", "requirement go needs !Sensor.seen provide spin"),
        policy="priority",
        priority=("go",),
    )
    b.tick()
    b.executor.on_goal_accepted(1)
    b.receive("/scan", True)
    b.executor.stop("SIGINT")
    b.executor.on_goal_ended(1, "cancelled")
    assert b.events[-1] == "go.cancel"


def test_a_requirement_that_turns_after_the_stop_makes_no_cancel_of_the_models() -> None:
    b = bench(
        ROBOT.replace("provide spin", "requirement go needs !Sensor.seen provide spin"),
        policy="priority",
        priority=("go",),
    )
    b.tick()
    b.executor.on_goal_accepted(1)
    b.executor.stop("SIGINT")
    b.receive("/scan", True)
    b.executor.on_goal_ended(1, "cancelled")
    assert b.events[-2:] == ["go.error", "go.reset"]


def test_nothing_is_requested_after_a_restart_before_the_goals_of_the_last_run_have_ended() -> None:
    b = going()
    b.executor.on_goal_accepted(1)
    b.executor.stop("SIGINT")
    b.executor.restart()
    b.middleware.sent.clear()
    # The initial state knows nothing of the goal, which may keep the robot moving.
    assert b.system.enabled("move.request") and b.system.enabled("go.request")
    assert b.tick(20) == []
    assert (b.status(), b.executor.old_goals) == (Status.WAITING, ("go",))
    b.executor.on_goal_ended(1, "cancelled")
    assert (b.status(), b.executor.old_goals) == (Status.RUNNING, ())
    assert b.events[1:] == []
    assert b.tick() == [("goal", "go", 2, None)]


def test_a_goal_that_took_too_long_keeps_nothing_else_from_being_requested() -> None:
    b = bench(ROBOT, policy="priority", priority=("go",), action_timeout_s=1.0)
    b.tick()
    b.executor.on_goal_accepted(1)
    b.clock.advance(1.0)
    assert b.tick() == [("cancel", "go", 1), MOVE]


def test_a_goal_that_does_not_end_after_a_stop_is_reported() -> None:
    b = going()
    b.executor.on_goal_accepted(1)
    b.executor.stop("SIGINT")
    b.tick(60)
    assert [entry["action"] for entry in b.entries("cancel_overdue")] == ["go"]
    assert b.executor.overdue_cancels == ("go",)


def test_a_goal_that_is_not_accepted_yet_is_cancelled_on_acceptance() -> None:
    b = going()
    b.executor.stop("SIGINT")
    assert b.middleware.sent == ZEROS
    b.executor.on_goal_accepted(1)
    assert b.middleware.sent[-1] == ("cancel", "go", 1)


def test_a_cancel_that_fails_keeps_nothing_else_from_stopping() -> None:
    b = going()
    b.executor.on_goal_accepted(1)
    b.middleware.failing.add("cancel_goal")
    b.executor.stop("SIGINT")
    assert b.middleware.sent == ZEROS
    assert b.executor.is_faulty


@pytest.mark.parametrize("again", ["tick", "watch"])
def test_a_cancel_that_failed_is_tried_again(again: str) -> None:
    b = going()
    b.executor.on_goal_accepted(1)
    b.middleware.failing.add("cancel_goal")
    b.executor.stop("SIGINT")
    b.middleware.failing.clear()
    b.middleware.sent.clear()
    for _ in range(3):
        getattr(b.executor, again)()
    assert b.middleware.sent == [("cancel", "go", 1)]


@pytest.mark.parametrize("again", ["tick", "watch"])
def test_a_cancel_that_failed_is_tried_again_after_a_restart(again: str) -> None:
    b = going()
    b.executor.on_goal_accepted(1)
    b.middleware.failing.add("cancel_goal")
    b.executor.stop("SIGINT")
    b.executor.restart()
    assert b.status() is Status.WAITING
    b.middleware.failing.clear()
    b.middleware.sent.clear()
    for _ in range(3):
        getattr(b.executor, again)()
    assert b.middleware.sent == [("cancel", "go", 1)]


def test_a_stale_sensor_is_noticed_between_two_distant_decisions() -> None:
    b = bench(ROBOT, policy="priority", priority=("move",), period_s=60.0, max_age_s={"/scan": 0.25})
    b.receive("/scan", True)
    b.executor.tick()
    assert b.middleware.sent == [MOVE]
    b.middleware.sent.clear()
    b.clock.advance(0.2)
    b.executor.watch()
    assert b.middleware.sent == []
    b.clock.advance(0.1)
    b.executor.watch()
    assert b.middleware.sent == ZEROS * 2
    assert b.status() is Status.STOPPED


def test_watching_before_the_start_or_with_a_broken_clock_harms_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    b = Bench(system_of(ROBOT), start=False)
    b.executor.watch()
    assert b.status() is Status.NEW
    b.executor.start()
    monkeypatch.setattr(b.executor, "_end_what_is_over", None)
    monkeypatch.setattr(b.executor, "_deadline_s", 0.0)
    b.executor.watch()
    assert b.executor.is_faulty


def test_after_a_fault_it_stays_stopped_until_a_restart_in_the_initial_state() -> None:
    b = moving()
    b.receive("/scan", True)
    b.executor.stop("broken", is_fault=True)
    b.receive("/scan", True)
    assert b.tick(50) == []
    b.middleware.sent.clear()
    b.executor.restart()
    assert b.middleware.sent == []
    assert b.variable("Sensor", "seen") is False
    assert b.status() is Status.RUNNING
    assert b.executor.reasons == ()
    assert b.tick() == [MOVE]


def test_a_restart_without_a_stop_brings_the_robot_to_rest_first() -> None:
    b = moving()
    b.executor.restart()
    assert b.middleware.sent == ZEROS
    assert b.tick() == [MOVE]


def test_goals_of_the_old_run_are_nothing_to_the_new_one_but_must_end() -> None:
    b = going()
    b.executor.on_goal_accepted(1)
    b.executor.stop("broken", is_fault=True)
    b.executor.restart()
    assert ("goal", "go", 2, None) not in b.tick(3)
    before = len(b.events)
    b.executor.on_goal_ended(1, "cancelled")
    assert b.events[before:] == []
    assert b.executor.counters.unexpected == 0
    assert b.tick()[-1] == ("goal", "go", 2, None)


def asking(**settings: Any) -> Bench:
    """Restarted while a call was under way."""
    b = bench(ROBOT, policy="priority", priority=("ask",), **settings)
    assert b.tick()[0] == ("call", "ask", 1, None)
    b.executor.restart()
    b.middleware.sent.clear()
    return b


def test_nothing_is_requested_after_a_restart_before_the_calls_of_the_last_run_are_answered() -> None:
    b = asking()
    # The initial state knows nothing of the call, and what it asked for may still go on.
    assert b.system.enabled("move.request") and b.system.enabled("ask.request")
    assert b.tick(3) == []
    assert (b.status(), b.executor.old_calls) == (Status.WAITING, ("ask",))
    before = len(b.events)
    b.executor.on_reply(1, {})
    assert (b.status(), b.executor.old_calls) == (Status.RUNNING, ())
    assert b.events[before:] == []
    assert b.variable("Wheels", "asked") is False
    assert b.executor.counters.unexpected == 1
    assert b.tick()[0] == ("call", "ask", 2, None)
    b.executor.on_reply(1, {})
    assert b.executor.counters.unexpected == 2
    assert b.system.location("ask") == "waiting"


def test_a_call_of_the_last_run_that_fails_keeps_nothing_from_being_requested() -> None:
    b = asking()
    b.executor.on_call_failed(1, "lost")
    assert (b.status(), b.executor.counters.unexpected) == (Status.RUNNING, 0)
    assert b.events[1:] == []
    assert b.tick()[0] == ("call", "ask", 2, None)


def test_a_call_of_the_last_run_is_awaited_no_longer_than_its_time() -> None:
    b = asking(service_timeout_s=1.0)
    b.executor.restart()
    assert b.tick(8) == []
    b.clock.advance(0.25)
    b.executor.watch()
    assert (b.status(), b.events[1:]) == (Status.RUNNING, [])
    assert b.tick()[0] == ("call", "ask", 2, None)
    b = asking(service_timeout_s=None)
    b.tick(1000)
    assert b.status() is Status.WAITING


def test_a_stop_is_not_ended_by_the_answer_to_a_call_of_the_last_run() -> None:
    b = asking()
    b.executor.stop("SIGINT")
    b.executor.on_reply(1, {})
    assert b.status() is Status.STOPPED
    assert b.tick(3) == []


def test_a_restart_forgets_whose_turn_it_was() -> None:
    b = bench(ROBOT)
    first = b.tick()
    b.executor.restart()
    assert b.tick() == first


def test_nothing_is_requested_before_the_first_message_of_a_sensor_with_a_maximum_age() -> None:
    b = bench(ROBOT, policy="priority", priority=("move",), max_age_s={"/scan": 1.0})
    assert b.status() is Status.WAITING
    assert b.executor.missing_sensors == ("/scan",)
    assert b.tick(3) == []
    b.receive("/battery", 12.0)
    assert b.tick() == []
    b.receive("/scan", True)
    assert b.status() is Status.RUNNING
    assert not b.executor.missing_sensors
    assert b.tick() == [MOVE]


def test_a_sensor_that_never_comes_is_stale_after_its_maximum_age() -> None:
    b = bench(ROBOT, max_age_s={"/scan": 1.0})
    b.tick(9)
    assert b.status() is Status.WAITING
    assert b.tick(2) == ZEROS * 2
    assert b.status() is Status.STOPPED
    assert not b.executor.is_faulty


def test_a_stale_sensor_stops_the_robot_and_its_return_ends_that() -> None:
    b = bench(ROBOT, policy="priority", priority=("move",), max_age_s={"/scan": 0.25})
    b.receive("/scan", True)
    assert b.tick(2) == [MOVE, MOVE]
    assert b.tick() == ZEROS * 2
    assert b.status() is Status.STOPPED
    assert len(b.executor.reasons) == 2
    assert "stale" in b.executor.reasons[0]
    assert b.tick(3) == []
    b.receive("/scan", True)
    assert b.status() is Status.RUNNING
    assert not b.executor.missing_sensors
    assert b.tick() == [MOVE]
    assert b.executor.counters.faults == 0


def test_the_return_of_a_sensor_ends_no_other_stop() -> None:
    b = bench(ROBOT, max_age_s={"/scan": 0.25, "/battery": 0.25})
    b.receive("/scan", True)
    b.receive("/battery", 12.0)
    b.tick(4)
    b.receive("/scan", True)
    assert b.executor.reasons == ("battery on /battery is stale",)
    b.executor.stop("broken", is_fault=True)
    b.receive("/battery", 12.0)
    assert b.executor.reasons == ("broken",)
    assert b.tick(2) == []


def test_a_late_message_is_stale_even_if_no_period_passed() -> None:
    b = bench(ROBOT, policy="priority", priority=("move",), max_age_s={"/scan": 0.05}, every="event")
    b.receive("/scan", True)
    b.middleware.sent.clear()
    b.clock.advance(0.06)
    # Another message must not lead to a decision on data that is too old.
    assert b.receive("/battery", 12.0) == ZEROS * 2


def test_a_restart_waits_for_the_sensors_again() -> None:
    b = bench(ROBOT, max_age_s={"/scan": 1.0})
    b.receive("/scan", True)
    assert b.status() is Status.RUNNING
    b.executor.restart()
    assert b.status() is Status.WAITING


def test_a_stop_before_the_start_holds_afterwards() -> None:
    b = Bench(system_of(ROBOT), start=False)
    b.executor.stop("SIGINT")
    assert b.middleware.sent == ZEROS
    b.executor.start()
    assert b.tick(3) == []


def test_a_sensor_is_stale_at_its_maximum_age_and_not_before() -> None:
    b = bench(ROBOT, max_age_s={"/battery": 0.25}, period_s=0.125)
    b.receive("/battery", 12.0)
    b.tick()
    assert b.status() is Status.RUNNING
    b.tick()
    assert b.status() is Status.STOPPED


def test_each_sensor_stops_the_robot_once_and_again_after_its_return() -> None:
    b = bench(ROBOT, max_age_s={"/scan": 0.35, "/battery": 0.75})
    for round_ in (1, 2):
        b.receive("/scan", True)
        b.receive("/battery", 12.0)
        assert b.status() is Status.RUNNING
        b.tick(15)
        assert len(b.entries("stop")) == 3 * round_
        assert len(b.entries("resume")) == 3 * (round_ - 1)


def test_each_sensor_alone_is_watched_again_after_its_return() -> None:
    b = bench(ROBOT, policy="priority", priority=("move",), max_age_s={"/battery": 0.35})
    for _ in range(3):
        b.receive("/battery", 12.0)
        assert b.status() is Status.RUNNING
        b.tick(5)
        assert b.status() is Status.STOPPED


LAST_MOMENT = """
robot Robot {
  interface dock use Dock from irobot_msgs
  interface trigger use Trigger from std_srvs
  component Wheels {
    action park with identifier: "/park", request: none, response: none, feedback: none links dock
    service ask with identifier: "/ask", request: none, response: none links trigger
    incoming message move with identifier: "/cmd_vel", type: double
    behaviour {
      initial marked state fine {
        on request to park
        on request to ask
        on error from ask goto bad
      }
      marked state bad { on request to park }
    }
  }
  requirement move needs Wheels.fine
  provide move with 1.0
}
"""


def test_a_goal_that_ends_at_the_moment_of_a_fault_has_ended() -> None:
    b = bench(LAST_MOMENT, service_timeout_s=2.0, release_identifiers=("/cmd_vel",))
    assert ("goal", "park", 1, None) in b.tick(3)
    b.executor.on_goal_accepted(1)
    b.clock.advance(3.0)
    # The call has timed out, so that the wheels must stop, and that cannot be commanded.
    b.middleware.failing = {"publish_default"}
    b.executor.on_goal_ended(1, "succeeded", None)
    assert b.executor.is_faulty
    b.middleware.failing = set()
    b.tick(10)
    b.executor.restart()
    assert ("goal", "park", 2, None) in b.tick(3)
