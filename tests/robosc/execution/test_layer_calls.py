"""Semantics 3.7: service calls and goals of an existing controller."""

import math

import pytest

from robosc.execution.runtime.protocol import MissingData
from robosc.execution.runtime.runner import DeploymentError, Status
from robosc.model.structure import Deployment
from support.execution import Bench, Sent, system_of
from support.layers import LayerBench, layer

SERVICE = """
robot Asked {
  interface trigger use Trigger from std_srvs
  datatype object Answer { success: boolean }
  component A {
    service ask with identifier: "/ask", request: none, response: Answer links trigger
    service tell with identifier: "/tell", request: none, response: Answer links trigger
    outgoing message open with type: boolean
    behaviour {
      variable is_open: boolean = true
      variable good: boolean
      variable errors: integer(0..9)
      on response from open do is_open := value
      on response from ask do good := value.success
      on error from ask do errors := errors + 1
      initial marked state awake { }
    }
  }
  requirement ask needs A.is_open
}
"""
YES = {"success": True}
HELD_BACK: list[Sent] = [("no answer", "ask", "c"), ("blocked", "/ask")]


def test_an_allowed_call_goes_through_and_its_reply_comes_back_unchanged() -> None:
    b = layer(SERVICE)
    assert b.call("ask", "a", "question") == [("call", "ask", 1, "question")]
    assert b.system.location("ask") == "waiting"
    assert b.reply(1, YES) == [("answer", "ask", "a", YES)]
    assert b.events == ["ask.request", "ask.response", "ask.reset"]


def test_the_reply_comes_back_after_the_supervisor_has_seen_it() -> None:
    b = layer(SERVICE)
    seen: list[object] = []
    b.call("ask", "a")
    b.middleware.on_sent = lambda sent: seen.append((b.variable("A", "good"), b.system.location("ask")))
    b.reply(1, YES)
    assert seen == [(True, "idle")]


def test_a_blocked_call_is_answered_at_once_with_a_default_response() -> None:
    b = layer(SERVICE)
    b.receive("open", False)
    assert b.call("ask", "c") == HELD_BACK
    assert b.entries("blocked")[0]["identifier"] == "/ask"
    assert "ask.request" not in b.events


def test_a_second_call_is_blocked_while_the_first_is_under_way() -> None:
    b = layer(SERVICE)
    b.call("ask", "a")
    assert b.call("ask", "c") == HELD_BACK
    # Other services are not concerned, and their ids never meet.
    assert b.call("tell", "a") == [("call", "tell", 2, None)]
    assert b.reply(2, YES) == [("answer", "tell", "a", YES)]
    assert b.reply(1, YES) == [("answer", "ask", "a", YES)]


def test_a_call_with_a_nan_is_blocked() -> None:
    assert layer(SERVICE).call("ask", "c", {"x": math.nan}) == HELD_BACK


def test_a_call_that_fails_is_answered_with_a_default_response() -> None:
    b = layer(SERVICE)
    b.call("ask", "a")
    assert b.fail(1) == [("no answer", "ask", "a")]
    assert b.variable("A", "errors") == 1


def test_a_call_without_reply_in_time_is_answered_with_a_default_response_and_a_late_reply_is_dropped() -> None:
    b = layer(SERVICE)
    b.call("ask", "a")
    assert b.wait(9.75) == []
    assert b.wait(0.25) == [("no answer", "ask", "a")]
    assert b.variable("A", "errors") == 1
    assert b.reply(1, YES) == []
    assert b.executor.counters.unexpected == 1
    assert b.call("ask", "a") == [("call", "ask", 2, None)]


def test_the_time_is_over_before_a_reply_that_comes_at_the_same_moment() -> None:
    b = layer(SERVICE, service_timeout_s=1.0)
    b.call("ask", "a")
    b.clock.advance(1.0)
    assert b.reply(1, YES) == [("no answer", "ask", "a")]


def test_a_call_of_no_service_is_unexpected() -> None:
    b = layer(SERVICE)
    assert b.call("open", 1) + b.call("nothing", 2) + b.goal("ask", 3) + b.cancel("ask", 4) == []
    assert b.executor.counters.unexpected == 4
    assert b.status() is Status.RUNNING


def test_a_call_that_cannot_be_made_is_answered_and_is_a_fault() -> None:
    b = layer(SERVICE)
    b.middleware.failing.add("call")
    assert b.call("ask", "c") == HELD_BACK
    assert b.executor.is_faulty


def test_a_reply_that_lacks_data_is_not_handed_over() -> None:
    b = layer(SERVICE)
    b.call("ask", "a")
    with pytest.raises(MissingData, match=r"ask.response: value.success is missing"):
        b.reply(1, {})
    assert b.reply(1, YES) == [("answer", "ask", "a", YES)]
    assert b.status() is Status.RUNNING


def test_calls_under_way_at_a_restart_are_answered_with_a_default_response() -> None:
    b = layer(SERVICE)
    b.call("ask", "a")
    assert b.during(b.executor.restart) == [("no answer", "ask", "a")]
    assert b.call("ask", "b") == [("no answer", "ask", "b"), ("blocked", "/ask")]
    assert b.entries("blocked")[-1]["why"] == "calls from before the restart have not been answered"
    assert b.during(b.executor.restart) == []
    assert b.reply(1, YES) == []
    assert b.call("ask", "c") == [("call", "ask", 2, None)]


def test_calls_under_way_at_a_stop_are_still_answered() -> None:
    b = layer(SERVICE)
    b.call("ask", "a")
    b.executor.stop("broken", is_fault=True)
    assert b.call("tell", "b") == [("no answer", "tell", "b"), ("blocked", "/tell")]
    assert b.reply(1, YES) == [("answer", "ask", "a", YES)]
    assert b.variable("A", "good") is True


ACTION = """
robot Driver {
  interface navigate use NavigateToPose from nav2_msgs
  datatype object Goal { x: double }
  datatype object Result { code: integer }
  datatype object Feedback { left: double }
  component Sensor {
    outgoing message safe with type: boolean
    behaviour {
      variable is_safe: boolean = true
      on response from safe do is_safe := value
      initial marked state watching { }
    }
  }
  component Driver {
    action drive with identifier: "/drive", request: Goal, response: Result, feedback: Feedback links navigate
    action wave with identifier: "/wave", request: Goal, response: Result, feedback: Feedback links navigate
    behaviour {
      variable left: double
      variable code: integer = 99
      on feedback from drive do left := value.left
      initial marked state home { on request to drive goto away }
      marked state away {
        on response from drive do code := value.code goto home
        on error from drive goto failed
        on cancel to drive goto home
      }
      marked state failed { }
    }
  }
  requirement drive needs Sensor.is_safe
}
"""
GOAL = {"x": 1.5}
RESULT = {"code": 3}
REJECTED: list[Sent] = [("reject", "drive", "h"), ("blocked", "/drive")]


def driving(is_accepted: bool = True, **settings: object) -> LayerBench:
    b = layer(ACTION, **settings)
    assert b.goal("drive", "g", GOAL) == [("goal", "drive", 1, GOAL), ("accept", "drive", "g")]
    if is_accepted:
        b.executor.on_goal_accepted(1)
    return b


def end(outcome: str, data: object = None) -> list[Sent]:
    return [("end", "drive", "g", outcome, data)]


def test_an_allowed_goal_goes_through_with_its_feedback_and_its_result() -> None:
    b = driving()
    assert b.feedback(1, {"left": 0.5}) == [("feedback", "drive", "g", {"left": 0.5})]
    assert b.variable("Driver", "left") == 0.5
    assert b.end(1, "succeeded", RESULT) == end("succeeded", RESULT)
    assert b.events == ["drive.request", "drive.feedback", "drive.response", "drive.reset"]
    assert b.variable("Driver", "code") == 3


def test_a_blocked_goal_is_rejected() -> None:
    b = layer(ACTION)
    b.receive("safe", False)
    assert b.goal("drive", "h", GOAL) == REJECTED
    assert b.goal("drive", "h", {"x": math.inf}) == REJECTED
    assert [entry["why"] for entry in b.entries("blocked")] == ["not allowed now", "a NaN or an infinity"]


def test_a_second_goal_is_blocked_while_the_first_is_under_way() -> None:
    b = driving()
    assert b.goal("drive", "h", GOAL) == REJECTED
    assert b.goal("wave", "g", GOAL) == [("goal", "wave", 2, GOAL), ("accept", "wave", "g")]
    assert b.end(2, "succeeded", RESULT) == [("end", "wave", "g", "succeeded", RESULT)]
    assert b.end(1, "succeeded", RESULT) == end("succeeded", RESULT)


@pytest.mark.parametrize("outcome", ["rejected", "aborted", "cancelled", "lost"])
def test_a_goal_that_ends_in_error_ends_as_aborted_for_the_caller(outcome: str) -> None:
    b = driving(is_accepted=outcome != "rejected")
    assert b.end(1, outcome) == end("aborted")
    assert b.middleware.reasons == [f"its server: {outcome}"]
    assert b.events == ["drive.request", "drive.error", "drive.reset"]
    assert b.state("Driver") == "failed"


def test_a_goal_that_takes_too_long_is_cancelled_and_aborted_at_once() -> None:
    b = driving(action_timeout_s=2.0)
    assert b.wait(1.75) == []
    assert sorted(b.wait(0.25)) == [("cancel", "drive", 1), *end("aborted")]
    assert b.middleware.reasons == ["it took too long, or the layer began anew"]
    # The caller learns no more of its server's answers.
    assert b.feedback(1, {"left": 0.5}) == []
    assert b.end(1, "succeeded", RESULT) == []


def test_time_is_over_before_a_result_that_comes_at_the_same_moment() -> None:
    b = driving(action_timeout_s=2.0)
    b.clock.advance(2.0)
    assert b.end(1, "succeeded", RESULT) == [("cancel", "drive", 1), *end("aborted")]


def test_a_goal_that_turns_against_its_requirements_is_cancelled_and_aborted() -> None:
    b = driving()
    sent = b.receive("safe", False)
    assert sent == [("cancel", "drive", 1), ("pass", "safe", False)]
    assert b.events[-1] == "safe.response"
    assert b.executor.cancelling == ("drive",)
    # Its server has not ended it yet: neither the model nor the caller may believe that.
    assert b.goal("drive", "h", GOAL) == REJECTED
    assert b.entries("blocked")[0]["why"] == "its last goal may still be under way"
    assert b.feedback(1, {"left": 0.5}) == [("feedback", "drive", "g", {"left": 0.5})]
    assert b.end(1, "cancelled") == end("aborted")
    assert b.middleware.reasons[-1] == "the supervisor cancelled it: a requirement no longer holds"
    assert b.events[-1] == "drive.cancel"
    assert b.entries("event")[-1]["controllable"] is True
    b.receive("safe", True)
    assert b.goal("drive", "h", GOAL) == [("goal", "drive", 2, GOAL), ("accept", "drive", "h")]


def test_a_goal_that_a_stop_cancels_says_so() -> None:
    b = driving()
    b.executor.stop("SIGINT")
    assert b.end(1, "cancelled") == end("aborted")
    assert b.middleware.reasons == ["it was cancelled, because the robot was stopped"]


def test_an_action_without_requirements_is_never_cancelled_by_the_supervisor() -> None:
    b = layer(ACTION)
    b.goal("wave", "w", GOAL)
    assert b.receive("safe", False) == [("pass", "safe", False)]


@pytest.mark.parametrize(
    ("outcome", "event"), [("cancelled", "cancel"), ("succeeded", "response"), ("aborted", "error")]
)
def test_a_callers_cancel_is_forwarded_and_its_goal_ends_as_the_server_ends_it(outcome: str, event: str) -> None:
    b = driving()
    assert b.cancel("drive", "g") == [("cancel", "drive", 1)]
    assert b.state("Driver") == "away"
    assert [entry["why"] for entry in b.entries("cancelling")] == ["the caller"]
    assert b.cancel("drive", "g") == []
    assert b.feedback(1, {"left": 0.1}) == [("feedback", "drive", "g", {"left": 0.1})]
    assert b.variable("Driver", "left") == 0.1
    assert b.end(1, outcome, RESULT) == end(outcome, RESULT)
    (entry,) = b.entries("event")[2:3]
    assert (entry["event"], entry["controllable"]) == (f"drive.{event}", False)
    assert b.variable("Driver", "code") == (3 if outcome == "succeeded" else 99)


def test_a_goal_that_succeeds_although_it_turned_against_its_requirements_has_succeeded_for_its_caller() -> None:
    b = driving()
    b.receive("safe", False)
    assert b.end(1, "succeeded", RESULT) == end("succeeded", RESULT)
    assert b.events[-2:] == ["drive.response", "drive.reset"]
    assert b.variable("Driver", "code") == 3


def test_a_caller_may_cancel_a_goal_that_is_being_cancelled() -> None:
    b = driving()
    b.receive("safe", False)
    assert b.cancel("drive", "g") == []
    assert b.end(1, "cancelled") == end("cancelled")
    assert b.events[-1] == "drive.cancel"
    assert b.entries("event")[-1]["controllable"] is True


@pytest.mark.parametrize("outcome", ["rejected", "lost"])
def test_a_cancelled_goal_that_its_server_never_ran_or_lost_is_aborted(outcome: str) -> None:
    b = driving()
    b.cancel("drive", "g")
    assert b.end(1, outcome) == end("aborted")


def test_a_callers_cancel_is_forwarded_even_where_the_requirements_hold_or_nothing_is_required() -> None:
    b = layer(ACTION)
    b.goal("wave", "w", GOAL)
    b.executor.on_goal_accepted(1)
    assert b.cancel("wave", "w") == [("cancel", "wave", 1)]


def test_a_callers_cancel_before_the_acceptance_is_sent_on_acceptance() -> None:
    b = driving(is_accepted=False)
    assert b.cancel("drive", "g") == []
    assert b.during(b.executor.on_goal_accepted, 1) == [("cancel", "drive", 1)]


def test_a_callers_cancel_of_a_goal_that_has_ended_is_unexpected() -> None:
    b = driving()
    b.end(1, "succeeded", RESULT)
    assert b.cancel("drive", "g") + b.cancel("drive", "other") + b.cancel("wave", "g") == []
    assert b.executor.counters.unexpected == 3


def test_a_cancelled_goal_no_longer_turns_against_its_requirements() -> None:
    b = driving()
    b.cancel("drive", "g")
    assert b.receive("safe", False) == [("pass", "safe", False)]
    assert b.end(1, "cancelled") == end("cancelled")
    assert b.executor.counters.unexpected == 0


def test_a_cancelled_goal_never_takes_too_long_and_ends_for_its_caller_as_its_server_ends_it() -> None:
    b = driving(action_timeout_s=2.0)
    b.cancel("drive", "g")
    assert b.wait(3.0) == []
    assert b.events == ["drive.request"]
    assert b.end(1, "cancelled") == end("cancelled")
    assert b.events[1] == "drive.cancel"
    assert b.executor.counters.unexpected == 0


def test_a_refused_cancel_of_a_running_goal_is_a_fault_also_if_the_caller_wanted_it() -> None:
    b = driving()
    b.cancel("drive", "g")
    b.executor.on_cancel_refused(1, True)
    assert not b.executor.is_faulty
    b.executor.on_cancel_refused(1, False)
    assert b.executor.is_faulty


def test_a_goal_that_cannot_be_sent_is_rejected_and_is_a_fault() -> None:
    b = layer(ACTION)
    b.middleware.failing.add("send_goal")
    assert b.goal("drive", "h", GOAL) == REJECTED
    assert b.executor.is_faulty
    assert b.status() is Status.STOPPED


def test_a_goal_that_cannot_be_accepted_is_rejected_and_cancelled() -> None:
    b = layer(ACTION)
    b.middleware.failing.add("accept_goal")
    assert b.goal("drive", "h", GOAL) == [("goal", "drive", 1, GOAL), *REJECTED]
    assert b.executor.is_faulty
    assert b.during(b.executor.on_goal_accepted, 1) == [("cancel", "drive", 1)]
    assert b.end(1, "cancelled") == []


def test_goals_are_cancelled_at_a_stop_and_end_as_aborted_for_the_caller() -> None:
    b = driving()
    assert b.during(b.executor.stop, "SIGINT") == [("cancel", "drive", 1)]
    assert b.status() is Status.STOPPING
    assert b.goal("wave", "w", GOAL) == [("reject", "wave", "w"), ("blocked", "/wave")]
    assert b.feedback(1, {"left": 0.25}) == [("feedback", "drive", "g", {"left": 0.25})]
    assert b.end(1, "cancelled") == end("aborted")
    assert b.events[-2:] == ["drive.error", "drive.reset"]
    assert b.status() is Status.STOPPED


def test_goals_are_awaited_for_half_a_second() -> None:
    b = driving()
    b.executor.stop("SIGINT")
    b.wait(0.49)
    assert b.status() is Status.STOPPING
    b.wait(0.02)
    assert b.status() is Status.STOPPED


def test_a_caller_may_cancel_while_the_robot_is_stopped() -> None:
    b = driving(is_accepted=False)
    b.executor.stop("SIGINT")
    b.cancel("drive", "g")
    assert b.during(b.executor.on_goal_accepted, 1) == [("cancel", "drive", 1)]
    assert b.end(1, "cancelled") == end("cancelled")
    # The cancel that its caller has asked for is an event of the model.
    assert b.events[-1] == "drive.cancel"


def test_goals_of_the_old_run_are_aborted_at_a_restart_but_must_end() -> None:
    b = driving()
    b.executor.stop("broken", is_fault=True)
    assert b.during(b.executor.restart) == end("aborted")
    assert b.goal("drive", "h", GOAL) == REJECTED
    assert b.goal("wave", "w", GOAL) == [("reject", "wave", "w"), ("blocked", "/wave")]
    assert b.entries("blocked")[-1]["why"] == "goals from before the restart have not ended"
    assert b.end(1, "cancelled") == []
    assert b.goal("drive", "h", GOAL)[0] == ("goal", "drive", 2, GOAL)


def test_a_goal_whose_caller_cancelled_it_ends_as_its_server_ends_it_also_after_a_restart() -> None:
    b = driving()
    b.cancel("drive", "g")
    assert b.during(b.executor.restart) == []
    assert b.end(1, "cancelled") == end("cancelled")


def test_an_end_that_does_not_exist_is_a_fault_and_ends_nothing() -> None:
    b = driving()
    assert b.end(1, "vanished") == [("cancel", "drive", 1)]
    assert b.executor.is_faulty
    assert b.end(1, "cancelled") == end("aborted")


def test_a_supervisor_for_a_controller_is_refused_if_the_model_has_actions() -> None:
    with pytest.raises(DeploymentError, match=r"'controller'.*make one for the deployment 'layer'"):
        LayerBench(system_of(ACTION))
    with pytest.raises(DeploymentError, match=r"'layer'.*make one for the deployment 'controller'"):
        Bench(system_of(ACTION, Deployment.LAYER))
    LayerBench(system_of(SERVICE))
