"""Semantics 3.2 and 3.4: services, goals, timeouts and cancels."""

import pytest

from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.runner import DeploymentError, Status
from robosc.model.structure import Deployment
from robosc.supervisor import AddedCondition, DecisionDiagram, DecisionNode
from support.execution import Bench, Sent, bench, example_system, supervisor_of, system_of
from support.models import model_of

SERVICE = """
robot Caller {
  interface trigger use Trigger from std_srvs
  datatype object Answer { success: boolean }
  component A {
    service ask with request: none, response: Answer links trigger
    behaviour {
      variable good: boolean
      variable errors: integer(0..9)
      initial marked state ready { on request to ask goto asking }
      state asking {
        on response from ask do good := value.success goto ready
        on error from ask do errors := errors + 1 goto ready
      }
    }
  }
}
"""


def test_a_reply_is_a_response_then_a_reset() -> None:
    b = bench(SERVICE)
    assert b.tick() == [("call", "ask", 1, None)]
    assert b.system.location("ask") == "waiting"
    assert b.tick() == []
    b.executor.on_reply(1, {"success": True})
    assert b.events == ["ask.request", "ask.response", "ask.reset"]
    assert b.variable("A", "good") is True
    assert b.tick() == [("call", "ask", 2, None)]


def test_a_reply_to_no_call_is_unexpected() -> None:
    b = bench(SERVICE)
    b.tick()
    b.executor.on_reply(7, {"success": True})
    assert b.events == ["ask.request"]
    b.executor.on_reply(1, {"success": True})
    b.executor.on_reply(1, {"success": True})
    b.executor.on_call_failed(1, "gone")
    assert b.executor.counters.unexpected == 3
    assert b.status() is Status.RUNNING


def test_a_failed_call_is_an_error() -> None:
    b = bench(SERVICE)
    b.tick()
    b.executor.on_call_failed(1, "no server")
    assert b.events == ["ask.request", "ask.error", "ask.reset"]
    assert b.entries("event")[1]["data"] == "no server"


@pytest.mark.parametrize(("timeout_s", "periods"), [(10.0, 100), (0.25, 3)])
def test_no_reply_in_time_is_an_error_and_a_late_one_is_unexpected(timeout_s: float, periods: int) -> None:
    b = bench(SERVICE, service_timeout_s=timeout_s)
    b.tick()
    b.tick(periods - 2)
    assert b.variable("A", "errors") == 0
    b.tick(3)
    assert b.variable("A", "errors") == 1
    assert b.events[:4] == ["ask.request", "ask.error", "ask.reset", "ask.request"]
    b.executor.on_reply(1, {"success": True})
    assert b.executor.counters.unexpected == 1
    assert b.variable("A", "good") is False


def test_ten_seconds_is_the_default_and_none_means_never() -> None:
    assert bench(SERVICE).executor.settings.service_timeout_s == 10.0
    assert bench(SERVICE).executor.settings.action_timeout_s is None
    b = bench(SERVICE, service_timeout_s=None)
    b.tick(10_000)
    assert b.variable("A", "errors") == 0


def test_a_timeout_counts_before_whatever_comes_at_the_same_moment() -> None:
    b = bench(SERVICE, service_timeout_s=1.0)
    b.tick()
    b.clock.advance(1.0)
    b.executor.on_reply(1, {"success": True})
    assert b.events[:2] == ["ask.request", "ask.error"]
    assert b.executor.counters.unexpected == 1


ACTION = """
robot Driver {
  interface navigate use NavigateToPose from nav2_msgs
  datatype object Goal { x: double }
  datatype object Result { code: integer }
  datatype object Feedback { left: double }
  component Sensor {
    outgoing message safe with type: boolean
    outgoing message near with type: boolean
    outgoing message out with type: none
    behaviour {
      variable is_safe: boolean = true
      variable is_near: boolean = false
      on response from safe do is_safe := value
      on response from near do is_near := value
      initial marked state watching { }
    }
  }
  component Driver {
    action drive with request: Goal, response: Result, feedback: Feedback links navigate
    behaviour {
      variable left: double
      variable code: integer = 99
      on feedback from drive do left := value.left
      initial marked state home { on request to drive goto away  on response from out goto outside }
      marked state away {
        on response from drive do code := value.code goto home
        on error from drive goto failed
        on cancel to drive goto home
      }
      marked state outside { }
      marked state failed { on response from near goto home }
    }
  }
  requirement drive needs Sensor.is_safe and Driver.home
  requirement Sensor.is_near disables drive
  provide drive with { x: 1.5 }
}
""".replace("requirement drive needs Sensor.is_safe and Driver.home", "requirement drive needs Sensor.is_safe")
GOAL: Sent = ("goal", "drive", 1, {"x": 1.5})
CANCEL: Sent = ("cancel", "drive", 1)


def driving(**settings: object) -> Bench:
    b = bench(ACTION, **settings)
    assert b.tick() == [GOAL]
    return b


def test_a_goal_that_succeeds() -> None:
    b = driving()
    b.executor.on_goal_accepted(1)
    b.executor.on_feedback(1, {"left": 0.75})
    assert b.variable("Driver", "left") == 0.75
    b.executor.on_goal_ended(1, "succeeded", {"code": 3})
    assert b.events == ["drive.request", "drive.feedback", "drive.response", "drive.reset"]
    assert b.variable("Driver", "code") == 3
    assert b.tick() == [("goal", "drive", 2, {"x": 1.5})]


@pytest.mark.parametrize("outcome", ["rejected", "aborted", "cancelled", "lost"])
def test_every_other_end_is_an_error(outcome: str) -> None:
    b = driving()
    b.executor.on_goal_ended(1, outcome)
    assert b.events == ["drive.request", "drive.error", "drive.reset"]
    assert b.state("Driver") == "failed"


def test_replies_that_match_no_goal_are_unexpected() -> None:
    b = driving()
    b.executor.on_goal_accepted(9)
    b.executor.on_feedback(9, {"left": 1.0})
    b.executor.on_goal_ended(9, "succeeded", {"code": 1})
    b.executor.on_cancel_refused(9, ended=False)
    assert b.executor.counters.unexpected == 4
    assert b.events == ["drive.request"]
    assert b.status() is Status.RUNNING


def test_an_end_that_does_not_exist_is_a_fault() -> None:
    b = driving()
    b.executor.on_goal_ended(1, "vanished")
    assert b.executor.is_faulty


def test_a_goal_has_no_timeout_by_default() -> None:
    b = driving()
    b.executor.on_goal_accepted(1)
    assert b.tick(100_000) == []


def test_a_goal_that_takes_too_long_is_an_error_and_is_cancelled() -> None:
    b = driving(action_timeout_s=1.0)
    b.executor.on_goal_accepted(1)
    assert b.tick(11) == [CANCEL]
    assert b.events == ["drive.request", "drive.error", "drive.reset"]
    b.executor.on_goal_ended(1, "cancelled")
    assert b.events[-1] == "drive.reset"
    assert b.executor.counters.unexpected == 0


def test_a_timed_out_goal_that_was_not_accepted_is_cancelled_on_acceptance() -> None:
    b = driving(action_timeout_s=1.0)
    assert b.tick(11) == []
    b.executor.on_goal_accepted(1)
    assert b.middleware.sent[-1] == CANCEL


def test_a_result_after_the_timeout_is_unexpected() -> None:
    b = driving(action_timeout_s=1.0)
    b.executor.on_goal_accepted(1)
    b.tick(11)
    b.executor.on_goal_ended(1, "succeeded", {"code": 4})
    assert b.executor.counters.unexpected == 1
    assert b.variable("Driver", "code") == 99


def test_a_requirement_that_turns_cancels_the_goal() -> None:
    b = driving()
    b.executor.on_goal_accepted(1)
    assert b.receive("safe", False) == [CANCEL]
    # Asking ends nothing: the goal is executing until its server has ended it.
    assert b.events == ["drive.request", "safe.response"]
    assert b.executor.cancelling == ("drive",)
    (entry,) = b.entries("cancelling")
    assert (entry["action"], entry["why"]) == ("drive", "requirement 1 no longer holds")
    assert b.system.location("drive") == "executing"
    assert b.tick(3) == []
    b.executor.on_goal_ended(1, "cancelled")
    assert b.events[2:] == ["drive.cancel"]
    assert b.entries("event")[-1]["controllable"] is True
    assert b.state("Driver") == "home"
    assert b.system.location("drive") == "idle"
    assert not b.executor.cancelling
    assert b.executor.counters.unexpected == 0


@pytest.mark.parametrize("outcome", ["rejected", "aborted", "lost"])
def test_a_goal_that_ends_otherwise_while_it_is_being_cancelled_is_an_error(outcome: str) -> None:
    b = driving()
    b.receive("safe", False)
    b.executor.on_goal_ended(1, outcome)
    assert b.events[2:] == ["drive.error", "drive.reset"]
    assert b.entries("event")[2]["data"] == outcome


def test_a_goal_that_succeeds_in_spite_of_the_cancel_is_a_response() -> None:
    b = driving()
    b.executor.on_goal_accepted(1)
    b.receive("safe", False)
    b.executor.on_feedback(1, {"left": 2.0})
    assert b.variable("Driver", "left") == 2.0
    b.executor.on_goal_ended(1, "succeeded", {"code": 1})
    assert b.events[2:] == ["drive.feedback", "drive.response", "drive.reset"]
    assert b.variable("Driver", "code") == 1
    assert b.executor.counters.unexpected == 0


def test_a_cancelled_goal_whose_requirements_hold_again_is_an_error() -> None:
    b = driving()
    b.executor.on_goal_accepted(1)
    b.receive("safe", False)
    b.receive("safe", True)
    assert b.executor.cancelling == ("drive",)
    b.executor.on_goal_ended(1, "cancelled")
    assert b.events[-2:] == ["drive.error", "drive.reset"]
    assert b.state("Driver") == "failed"


def test_a_goal_is_asked_once_to_cancel() -> None:
    b = driving()
    b.executor.on_goal_accepted(1)
    assert b.receive("safe", False) == [CANCEL]
    assert b.receive("safe", True) + b.receive("safe", False) + b.receive("near", True) + b.tick(3) == []
    assert len(b.entries("cancelling")) == 1


def test_all_requirements_that_turned_are_named() -> None:
    b = bench(ACTION.replace("requirement Sensor.is_near disables drive", "requirement drive needs Sensor.is_safe"))
    b.tick()
    b.receive("safe", False)
    assert b.entries("cancelling")[0]["why"] == "requirements 1, 2 no longer hold"


def overdue_periods(cancel_timeout_s: float) -> list[float]:
    """Return the seconds since the cancel at which it is reported that the goal did not end."""
    b = driving(cancel_timeout_s=cancel_timeout_s)
    b.executor.on_goal_accepted(1)
    b.receive("safe", False)
    b.tick(100)
    assert b.executor.overdue_cancels == (("drive",) if b.entries("cancel_overdue") else ())
    # It goes on blocking what it blocks, and nothing is wrong with the controller itself.
    assert b.status() is Status.RUNNING
    assert b.system.location("drive") == "executing"
    b.executor.on_goal_ended(1, "cancelled")
    assert b.executor.overdue_cancels == ()
    assert b.events[-1] == "drive.cancel"
    return [entry["asked_s"] for entry in b.entries("cancel_overdue")]


def test_a_goal_that_does_not_end_in_time_is_reported_once() -> None:
    assert overdue_periods(0.35) == [pytest.approx(0.4)]
    assert overdue_periods(5.05) == [pytest.approx(5.1)]
    assert overdue_periods(0.0) == []
    assert bench(ACTION).executor.settings.cancel_timeout_s == 5.0


def test_the_time_for_a_cancel_begins_when_it_is_decided_and_not_on_acceptance() -> None:
    b = driving(cancel_timeout_s=1.0)
    b.receive("safe", False)
    b.tick(6)
    b.executor.on_goal_accepted(1)
    assert b.middleware.sent[-1] == CANCEL
    b.tick(5)
    assert b.executor.overdue_cancels == ("drive",)


def test_a_goal_that_is_cancelled_when_its_time_is_over_is_reported_if_it_does_not_end() -> None:
    b = driving(action_timeout_s=1.0, cancel_timeout_s=2.0)
    b.executor.on_goal_accepted(1)
    b.tick(11)
    assert [entry["why"] for entry in b.entries("cancelling")] == ["timeout"]
    assert b.executor.cancelling == ("drive",)
    b.tick(21)
    assert b.executor.overdue_cancels == ("drive",)
    # It is not requested again before it has ended.
    b.receive("near", False)
    assert b.system.enabled("drive.request")
    assert b.tick(5) == []


def test_a_goal_that_is_being_cancelled_never_takes_too_long() -> None:
    b = driving(action_timeout_s=1.0, cancel_timeout_s=2.0)
    b.executor.on_goal_accepted(1)
    assert b.receive("safe", False) == [CANCEL]
    assert b.tick(30) == []
    # It may still move the robot: only the time for its cancel is over.
    assert b.events[2:] == []
    assert b.system.location("drive") == "executing"
    assert [entry["why"] for entry in b.entries("cancelling")] == ["requirement 1 no longer holds"]
    assert b.executor.overdue_cancels == ("drive",)
    b.executor.on_goal_ended(1, "cancelled")
    assert b.events[2:] == ["drive.cancel"]


def test_a_goal_that_the_stop_cancels_never_takes_too_long() -> None:
    b = driving(action_timeout_s=1.0)
    b.executor.on_goal_accepted(1)
    b.executor.stop("SIGINT")
    b.tick(30)
    assert b.events == ["drive.request"]
    b.executor.on_goal_ended(1, "cancelled")
    assert b.events[1:] == ["drive.error", "drive.reset"]


def test_a_goal_whose_cancel_is_due_as_its_time_is_over_has_taken_too_long() -> None:
    b = driving(action_timeout_s=1.0)
    b.executor.on_goal_accepted(1)
    b.clock.advance(1.0)
    assert b.receive("safe", False) == [CANCEL]
    assert b.events[1:] == ["drive.error", "drive.reset", "safe.response"]
    assert [entry["why"] for entry in b.entries("cancelling")] == ["timeout"]


def test_each_requirement_cancels_by_itself_also_one_that_disables() -> None:
    b = driving()
    b.executor.on_goal_accepted(1)
    assert b.receive("near", True) == [CANCEL]


def test_a_cancel_before_acceptance_is_sent_on_acceptance() -> None:
    b = driving()
    assert b.receive("safe", False) == []
    assert b.executor.cancelling == ("drive",)
    b.executor.on_goal_accepted(1)
    assert b.middleware.sent[-1] == CANCEL
    b.executor.on_goal_accepted(1)
    assert b.middleware.sent.count(CANCEL) == 1


def test_what_the_request_itself_makes_false_never_cancels() -> None:
    text = ACTION.replace("needs Sensor.is_safe", "needs Sensor.is_safe and Driver.home")
    b = bench(text)
    assert b.tick() == [GOAL]
    b.executor.on_goal_accepted(1)
    assert b.tick(3) == []
    assert b.receive("safe", True) == []
    # This requirement was false since the request: its other half turning changes nothing.
    assert b.receive("safe", False) == []
    # The other requirement held.
    assert b.receive("near", True) == [CANCEL]


def test_an_action_without_requirements_is_never_cancelled_by_the_executor() -> None:
    text = ACTION.replace("requirement drive needs Sensor.is_safe", "").replace(
        "requirement Sensor.is_near disables drive", ""
    )
    b = bench(text)
    b.tick()
    b.executor.on_goal_accepted(1)
    assert b.system.enabled("drive.cancel")
    assert b.receive("safe", False) + b.receive("near", True) == []


def test_no_request_while_the_old_goal_may_still_run() -> None:
    b = driving(action_timeout_s=1.0)
    b.executor.on_goal_accepted(1)
    b.tick(11)
    b.receive("near", False)
    assert b.system.enabled("drive.request")
    assert b.tick(5) == []
    b.executor.on_goal_ended(1, "cancelled")
    assert b.tick() == [("goal", "drive", 2, {"x": 1.5})]


def test_the_old_goal_is_over_when_its_server_is_lost() -> None:
    b = driving(action_timeout_s=1.0)
    b.tick(11)
    b.receive("near", False)
    assert b.tick() == []
    b.executor.on_goal_ended(1, "lost")
    assert b.tick() == [("goal", "drive", 2, {"x": 1.5})]
    assert b.events.count("drive.error") == 1


def test_a_refused_cancel_of_an_ended_goal_means_nothing() -> None:
    b = driving()
    b.executor.on_goal_accepted(1)
    b.receive("safe", False)
    b.executor.on_cancel_refused(1, ended=True)
    assert b.status() is Status.RUNNING
    assert b.executor.counters.unexpected == 0


def test_a_refused_cancel_of_a_running_goal_is_a_fault() -> None:
    b = driving()
    b.executor.on_goal_accepted(1)
    b.receive("safe", False)
    b.executor.on_cancel_refused(1, ended=False)
    assert b.executor.is_faulty
    assert "refused" in b.executor.reasons[0]


def test_feedback_and_results_of_a_goal_that_took_too_long_are_unexpected() -> None:
    b = driving(action_timeout_s=1.0)
    b.executor.on_goal_accepted(1)
    b.tick(11)
    b.executor.on_feedback(1, {"left": 2.0})
    b.executor.on_goal_ended(1, "succeeded", {"code": 1})
    assert b.executor.counters.unexpected == 2
    assert b.variable("Driver", "left") == 0.0


def test_cancels_are_asked_for_before_resets_and_resets_come_before_taus() -> None:
    b = bench(
        """
        robot Order {
          interface navigate use NavigateToPose from nav2_msgs
          interface trigger use Trigger from std_srvs
          datatype object Empty { }
          component Early {
            outgoing message noise with type: none
            behaviour {
              initial marked state low { on response from ask goto high }
              marked state high { transition goto higher }
              marked state higher { }
            }
          }
          component Asker { service ask with request: none, response: Empty links trigger }
          component Driver { action drive with request: Empty, response: Empty, feedback: Empty links navigate }
          requirement drive needs Early.low
        }
        """,
        policy="priority",
        priority=("drive", "ask"),
    )
    assert [sent[1] for sent in b.tick(2)] == ["drive", "ask"]
    b.executor.on_reply(1, {})
    entries = [entry.get("event", entry["kind"]) for entry in b.log.entries]
    assert entries[2:] == ["ask.response", "cancelling", "ask.reset", "Early.tau_1"]
    b.executor.on_goal_ended(1, "cancelled")
    assert b.events[-1] == "drive.cancel"


def test_the_navigation_example() -> None:
    b = Bench(example_system("navigation/navigation"))
    assert b.tick(2) == [("call", "calibrate", 1, None)]
    b.executor.on_reply(1, {"success": True})
    assert b.state("Localisation") == "known"
    assert b.tick() == []
    b.receive("/person/distance", 3.0)
    assert b.tick() == [("goal", "navigate", 1, {"pose": {"pose": {"position": {"x": 2.0, "y": 0.5}}}})]
    b.executor.on_goal_accepted(1)
    b.executor.on_feedback(1, {"distance_remaining": 1.0, "number_of_recoveries": 2})
    assert b.variable("Navigator", "recoveries") == "making_progress"
    b.executor.on_feedback(1, {"distance_remaining": 1.0, "number_of_recoveries": 3})
    assert b.middleware.sent[-1] == ("cancel", "navigate", 1)
    b.executor.on_goal_ended(1, "cancelled")
    # Its own request sets the recoveries back, but nothing else does: it may not start again.
    assert b.tick(3) == []


def test_three_failures_then_the_button() -> None:
    b = Bench(example_system("navigation/navigation"))
    b.tick()
    b.executor.on_reply(1, {"success": True})
    b.receive("/person/distance", 3.0)
    for goal in (1, 2, 3):
        assert b.tick()[0][:3] == ("goal", "navigate", goal)
        b.executor.on_goal_ended(goal, "aborted")
    assert b.state("Navigator") == "given_up"
    assert b.tick(3) == []
    b.receive("/button")
    assert b.tick()[0][:3] == ("goal", "navigate", 4)


def test_a_supervisor_for_a_layer_is_refused_if_the_model_has_actions() -> None:
    with pytest.raises(DeploymentError, match="layer"):
        Bench(system_of(ACTION, Deployment.LAYER))
    Bench(system_of(SERVICE, Deployment.LAYER))


def test_the_layer_supervisor_leaves_cancel_to_the_caller() -> None:
    system = system_of(ACTION, Deployment.LAYER)
    system.step("drive.request")
    assert system.enabled("drive.cancel")
    own = system_of(ACTION)
    own.step("drive.request")
    assert not own.enabled("drive.cancel")


def test_a_requirement_that_came_true_since_the_request_cancels_when_it_turns_again() -> None:
    b = bench(
        ACTION.replace("requirement drive needs Sensor.is_safe", "requirement drive needs Driver.home")
        .replace("marked state away {", "marked state away { transition if Sensor.is_near goto home")
        .replace("requirement Sensor.is_near disables drive", "")
    )
    assert b.tick() == [GOAL]
    b.executor.on_goal_accepted(1)
    # Away the requirement does not hold; at home it does, though the goal runs on.
    b.receive("near", True)
    assert b.state("Driver") == "home"
    assert b.middleware.sent == [GOAL]
    assert b.receive("out") == [CANCEL]


@pytest.mark.parametrize(("is_near", "event"), [(False, "drive.error"), (True, "drive.cancel")])
def test_a_cancel_is_asked_for_where_the_supervisor_forbids_its_event(is_near: bool, event: str) -> None:
    diagram = DecisionDiagram((DecisionNode("Sensor", "is_near", (0, 1), (0, 1)),), 2)
    text = ACTION.replace("requirement Sensor.is_near disables drive", "requirement Sensor.is_near disables other")
    text = text.replace("component Driver {", "component Driver { incoming message other with type: none")
    supervisor = supervisor_of(model_of(text), added=(AddedCondition("drive.cancel", diagram),))
    b = Bench(InterpretedSystem(supervisor), policy="priority", priority=("drive",))
    assert b.tick() == [GOAL]
    b.executor.on_goal_accepted(1)
    assert b.receive("safe", False) == [CANCEL]
    assert not b.system.enabled("drive.cancel")
    b.receive("near", is_near)
    b.executor.on_goal_ended(1, "cancelled")
    assert event in b.events


def test_several_cancels_go_out_in_source_order() -> None:
    b = bench(
        """
        robot Two {
          interface navigate use NavigateToPose from nav2_msgs
          datatype object Empty { }
          component Sensor {
            outgoing message alarm with type: none
            behaviour {
              initial marked state calm { on response from alarm goto alarmed }
              marked state alarmed { }
            }
          }
          component A { action first with request: Empty, response: Empty, feedback: Empty links navigate }
          component B { action second with request: Empty, response: Empty, feedback: Empty links navigate }
          requirement { first, second } needs Sensor.calm
        }
        """,
        policy="priority",
        priority=("second", "first"),
    )
    assert [sent[1] for sent in b.tick(2)] == ["second", "first"]
    b.receive("alarm")
    assert [entry["action"] for entry in b.entries("cancelling")] == ["first", "second"]
    assert b.executor.cancelling == ("first", "second")


def test_a_goal_that_anothers_timeout_has_cancelled_does_not_take_too_long() -> None:
    b = bench(
        """
        robot Two {
          interface navigate use NavigateToPose from nav2_msgs
          datatype object Empty { }
          component First {
            action lead with request: Empty, response: Empty, feedback: Empty links navigate
            behaviour {
              initial marked state fine { on error from lead goto broken }
              marked state broken { }
            }
          }
          component Second { action follow with request: Empty, response: Empty, feedback: Empty links navigate }
          requirement follow needs First.fine
        }
        """,
        action_timeout_s=1.0,
        policy="priority",
        priority=("lead", "follow"),
    )
    assert [sent[1] for sent in b.tick(2)] == ["lead", "follow"]
    b.clock.advance(5.0)
    b.executor.watch()
    entries = [entry.get("event", entry["kind"]) for entry in b.log.entries[2:]]
    assert entries == ["lead.error", "cancelling", "lead.reset", "cancelling"]
    assert [entry["why"] for entry in b.entries("cancelling")] == ["requirement 1 no longer holds", "timeout"]
    assert b.executor.counters.unexpected == 0
