"""Services and actions that a layer serves: answers and ends in any order, and callers that are gone."""

from types import SimpleNamespace
from typing import Any

import pytest

from robosc.targets.ros2.runtime.servers import CalledService, ServedAction


class Service:
    """Sends what its callback returns, as rclpy does."""

    def __init__(self) -> None:
        self.sent: list[tuple[Any, Any]] = []
        self.is_broken = False

    def send_response(self, response: Any, header: Any) -> None:
        if self.is_broken:
            raise RuntimeError("gone")
        self.sent.append((response, header))


class Calls:
    """A service with calls; `held` answers at once."""

    def __init__(self) -> None:
        self.service = Service()
        self.given: list[tuple[int, Any]] = []
        self.warnings: list[str] = []
        self.calls = CalledService("/s", lambda: "default", self._hand_over, self.warnings.append)
        self.calls.attach(self.service)

    def _hand_over(self, number: int, request: Any) -> None:
        self.given.append((number, request))
        if request == "held":
            self.calls.answer_default(number, "why")

    def call(self, request: str, header: str) -> None:
        self.service.send_response(self.calls.handle(request, None), header)


def test_a_call_that_is_held_back_is_answered_at_once() -> None:
    world = Calls()
    world.call("held", "h1")
    assert world.service.sent == [("default", "h1")]
    world.calls.take_leave()
    assert len(world.service.sent) == 1


def test_answers_go_to_whom_they_belong_in_any_order() -> None:
    world = Calls()
    for number in (1, 2, 3):
        world.call("go", f"h{number}")
    assert world.service.sent == []
    world.calls.answer(3, "third")
    world.calls.answer(1, "first")
    assert world.service.sent == [("third", "h3"), ("first", "h1")]
    world.calls.take_leave()
    assert world.service.sent[2:] == [("default", "h2")]


def test_a_caller_that_is_gone_is_worth_a_warning() -> None:
    world = Calls()
    world.call("go", "h1")
    world.service.is_broken = True
    world.calls.answer(1, "late")
    assert world.warnings == ["no answer to a call of /s: gone"]


class Handle:
    """A goal's handle, as rclpy has it."""

    def __init__(self, number: int) -> None:
        self.goal_id = SimpleNamespace(uuid=[number] * 16)
        self.log: list[Any] = []

    def execute(self) -> None:
        self.log.append("execute")

    def succeed(self) -> None:
        self.log.append("succeeded")

    def abort(self) -> None:
        self.log.append("aborted")

    def canceled(self) -> None:
        self.log.append("cancelled")

    def publish_feedback(self, data: Any) -> None:
        if data == "broken":
            raise RuntimeError("gone")
        self.log.append(data)


class Goals:
    """An action whose goals are accepted unless they are `held`; one that `fails` ends before it has begun."""

    def __init__(self) -> None:
        self.cancelled: list[int] = []
        self.warnings: list[str] = []
        self.ends: list[tuple[Any, Any]] = []
        self.goals = ServedAction("/a", lambda: "default", self._hand_over, self.cancelled.append, self.warnings.append)
        self.goals.attach(self)

    def _hand_over(self, number: int, goal: Any) -> None:
        if goal != "held":
            self.goals.accept(number)
        if goal == "fails":
            self.goals.end(number, "aborted", None, "why")

    def notify_execute(self, handle: Any, end: Any) -> None:
        self.ends.append((handle, end))

    def finish(self) -> list[Any]:
        """Call the ends as rclpy does later, and return the results."""
        ends, self.ends = self.ends, []
        return [end(handle) for handle, end in ends]

    def accepted(self, number: int) -> Handle:
        assert self.goals.decide("go")
        handle = Handle(number)
        self.goals.begin(handle)
        return handle


@pytest.mark.parametrize("outcome", ["succeeded", "aborted", "cancelled"])
def test_a_goal_ends_with_the_given_outcome_and_result(outcome: str) -> None:
    world = Goals()
    handle = world.accepted(1)
    world.goals.feedback(1, "near")
    assert handle.log == ["execute", "near"]
    assert world.ends == []
    world.goals.end(1, outcome, "there", "")
    assert world.goals.is_ending
    assert world.finish() == ["there"]
    assert handle.log[-1] == outcome
    assert not world.goals.is_ending
    world.goals.feedback(1, "late")
    world.goals.end(1, "aborted", None, "why")
    assert world.ends == []
    assert handle.log[-1] == outcome


def test_a_goal_that_is_held_back_is_rejected() -> None:
    world = Goals()
    assert not world.goals.decide("held")
    world.goals.check()
    assert world.cancelled == []


def test_a_goal_may_end_before_it_has_begun() -> None:
    world = Goals()
    assert world.goals.decide("fails")
    handle = Handle(1)
    world.goals.begin(handle)
    assert world.finish() == ["default"]
    assert handle.log == ["execute", "aborted"]


def test_cancels_are_forwarded_until_the_end() -> None:
    world = Goals()
    first, second = world.accepted(1), world.accepted(2)
    assert world.goals.cancel(second)
    assert world.goals.cancel(first)
    assert world.cancelled == [2, 1]
    world.goals.end(1, "cancelled", None, "why")
    assert not world.goals.cancel(first)
    assert world.cancelled == [2, 1]


def test_a_goal_whose_caller_is_gone_before_it_begins_is_cancelled() -> None:
    world = Goals()
    assert world.goals.decide("go")
    world.goals.check()
    world.goals.check()
    assert world.cancelled == [1]
    assert world.warnings == ["a goal of /a is cancelled: its caller is gone"]
    world.goals.end(1, "cancelled", None, "why")
    assert world.ends == []


def test_feedback_that_cannot_be_sent_is_worth_a_warning() -> None:
    world = Goals()
    world.accepted(1)
    world.goals.feedback(1, "broken")
    assert world.warnings == ["no feedback of a goal of /a: gone"]


def test_at_the_end_every_goal_is_aborted() -> None:
    world = Goals()
    handles = [world.accepted(1), world.accepted(2)]
    world.goals.take_leave()
    world.finish()
    assert [handle.log[-1] for handle in handles] == ["aborted", "aborted"]
