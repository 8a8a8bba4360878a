"""Calls and goals where real servers cannot be made to misbehave: clients that do as a test says."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from robosc.targets.ros.runtime.presence import LOST_S
from robosc.targets.ros.runtime.reports import Reports
from robosc.targets.ros2.runtime.clients import MAXIMUM_PENDING, REFUSAL_S, ActionGoals, ServiceCalls
from support.executor_log import ExecutorLog

SUCCEEDED, CANCELED, ABORTED, UNKNOWN = 4, 5, 6, 0
NONE, REJECTED, UNKNOWN_GOAL, TERMINATED = 0, 1, 2, 3


class Future:
    """A twin of rclpy's: its callbacks run when it is done."""

    def __init__(self) -> None:
        self._callbacks: list[Callable[[Any], None]] = []
        self._result: Any = None
        self._exception: Exception | None = None

    def add_done_callback(self, callback: Callable[[Any], None]) -> None:
        self._callbacks.append(callback)

    def result(self) -> Any:
        return self._result

    def exception(self) -> Exception | None:
        return self._exception

    def done(self, result: Any = None, exception: Exception | None = None) -> None:
        self._result, self._exception = result, exception
        for callback in self._callbacks:
            callback(self)


class Client:
    """A client whose server is there or not."""

    def __init__(self) -> None:
        self.is_there = True
        self.futures: list[Future] = []
        self.removed: list[Future] = []
        self.feedback: Callable[[Any], None] = lambda message: None
        self._feedback_callbacks: dict[bytes, Any] = {b"0123456789abcdef": None}

    def service_is_ready(self) -> bool:
        return self.is_there

    server_is_ready = service_is_ready

    def call_async(self, message: Any) -> Future:
        self.futures.append(Future())
        return self.futures[-1]

    def send_goal_async(self, goal: Any, feedback_callback: Callable[[Any], None]) -> Future:
        self.feedback = feedback_callback
        return self.call_async(goal)

    def remove_pending_request(self, future: Future) -> None:
        self.removed.append(future)


class Handle:
    """A client's goal."""

    def __init__(self, accepted: bool = True) -> None:
        self.accepted = accepted
        self.goal_id = SimpleNamespace(uuid=b"0123456789abcdef")
        self.result_future = Future()
        self.cancel_futures: list[Future] = []

    def get_result_async(self) -> Future:
        return self.result_future

    def cancel_goal_async(self) -> Future:
        self.cancel_futures.append(Future())
        return self.cancel_futures[-1]


class World:
    """A service and an action with their clients."""

    def __init__(self, timeout_s: float | None = 10.0) -> None:
        self.now_s = 100.0
        self.client = Client()
        self.reports = Reports()
        self.calls = ServiceCalls(self.client, "/s", self.reports, lambda: self.now_s, timeout_s)
        self.goals = ActionGoals(self.client, "/a", self.reports, lambda: self.now_s)

    def reported(self) -> list[tuple[Any, ...]]:
        executor: Any = ExecutorLog()
        self.reports.deliver(executor)
        return list(executor.reported)

    def pass_time(self, seconds: float) -> None:
        """Let time pass as a node does: checked now and again."""
        end = self.now_s + seconds
        while self.now_s < end:
            self.now_s = min(end, self.now_s + 0.05)
            self.calls.check(self.now_s)
            self.goals.check(self.now_s)

    def accepted(self, number: int = 1) -> Handle:
        """A goal that was sent and accepted."""
        self.goals.send(number, None)
        handle = Handle()
        self.client.futures[-1].done(handle)
        assert self.reported() == [("on_goal_accepted", number)]
        return handle


def answer(code: int, *canceling: Any) -> Any:
    return SimpleNamespace(return_code=code, goals_canceling=list(canceling))


def test_reports_wait_until_they_are_delivered_and_what_they_cause_waits_again() -> None:
    reports = Reports()
    order: list[int] = []

    def first(_: Any) -> None:
        order.append(1)
        reports.add(lambda _: order.append(2))

    reports.add(first)
    executor: Any = None
    assert reports.deliver(executor) and order == [1]
    assert reports.deliver(executor) and order == [1, 2]
    assert not reports.deliver(executor)


# Services.


def test_a_call_and_its_reply() -> None:
    world = World()
    world.calls.call(7, "message")
    assert world.reported() == []
    world.client.futures[0].done("reply")
    assert world.reported() == [("on_reply", 7, "reply")]


def test_a_missing_server_is_reported_later_and_nothing_is_sent() -> None:
    world = World()
    world.client.is_there = False
    world.calls.call(1, None)
    world.goals.send(2, None)
    assert world.client.futures == []
    assert world.reported() == [
        ("on_call_failed", 1, "there is no server of /s"),
        ("on_goal_ended", 2, "lost", None),
    ]


def test_a_call_that_fails_in_the_client() -> None:
    world = World()
    world.calls.call(1, None)
    world.client.futures[0].done(exception=ValueError("no"))
    assert world.reported() == [("on_call_failed", 1, "the call of /s failed: no")]


def test_a_server_out_of_sight_for_a_moment_is_not_lost() -> None:
    world = World()
    world.calls.call(1, None)
    for _ in range(3):
        world.client.is_there = False
        world.pass_time(0.9 * LOST_S)
        world.client.is_there = True
        world.pass_time(0.1)
    assert world.reported() == []
    world.client.is_there = False
    world.pass_time(LOST_S + 0.1)
    assert world.reported() == [("on_call_failed", 1, "the server of /s is lost")]
    assert world.client.removed == world.client.futures


def test_the_loss_of_a_call_that_is_over_its_time_is_no_news() -> None:
    world = World(timeout_s=0.5)
    world.calls.call(1, None)
    world.client.is_there = False
    world.pass_time(LOST_S + 0.1)
    assert world.reported() == []
    assert world.client.removed == world.client.futures


def test_the_time_without_calls_does_not_count_for_the_next_one() -> None:
    world = World()
    world.calls.call(1, None)
    world.client.is_there = False
    world.pass_time(0.5 * LOST_S)
    world.client.futures[0].done("reply")
    world.pass_time(LOST_S)
    world.client.is_there = True
    world.calls.call(2, None)
    world.client.is_there = False
    world.pass_time(0.5 * LOST_S)
    assert world.reported() == [("on_reply", 1, "reply")]


def test_unanswered_calls_do_not_pile_up() -> None:
    world = World()
    for number in range(MAXIMUM_PENDING + 3):
        world.calls.call(number, None)
    assert world.client.removed == world.client.futures[:3]


# Actions.


@pytest.mark.parametrize(
    ("status", "outcome"),
    [(SUCCEEDED, "succeeded"), (CANCELED, "cancelled"), (ABORTED, "aborted"), (UNKNOWN, "lost")],
)
def test_how_a_goal_ends(status: int, outcome: str) -> None:
    world = World()
    handle = world.accepted(3)
    world.client.feedback(SimpleNamespace(feedback="near"))
    handle.result_future.done(SimpleNamespace(status=status, result="there"))
    result = None if outcome == "lost" else "there"
    assert world.reported() == [("on_feedback", 3, "near"), ("on_goal_ended", 3, outcome, result)]


def test_a_rejected_goal_leaves_nothing_behind() -> None:
    world = World()
    world.goals.send(1, None)
    world.client.futures[0].done(Handle(accepted=False))
    assert world.reported() == [("on_goal_ended", 1, "rejected", None)]
    assert world.client._feedback_callbacks == {}


def test_failures_in_the_client_are_losses() -> None:
    world = World()
    world.goals.send(1, None)
    world.client.futures[0].done(exception=ValueError("no"))
    assert world.reported() == [("on_goal_ended", 1, "lost", None)]
    handle = world.accepted(2)
    handle.result_future.done(exception=ValueError("no"))
    assert world.reported() == [("on_goal_ended", 2, "lost", None)]
    world.pass_time(0.1)
    assert len(handle.cancel_futures) == 1


def test_a_goal_that_is_accepted_after_its_loss_is_cancelled() -> None:
    world = World()
    world.goals.send(1, None)
    world.client.is_there = False
    world.pass_time(LOST_S + 0.1)
    assert world.reported() == [("on_goal_ended", 1, "lost", None)]
    handle = Handle()
    world.client.futures[0].done(handle)
    assert len(handle.cancel_futures) == 1
    assert world.reported() == []


@pytest.mark.parametrize("late", ["error", "rejection"])
def test_no_goal_ends_twice(late: str) -> None:
    world = World()
    world.goals.send(1, None)
    world.client.is_there = False
    world.pass_time(LOST_S + 0.1)
    assert world.reported() == [("on_goal_ended", 1, "lost", None)]
    if late == "error":
        world.client.futures[0].done(exception=ValueError("no"))
    else:
        world.client.futures[0].done(Handle(accepted=False))
    assert world.reported() == []
    assert not world.goals.has_abandoned


def lost(world: World) -> Handle:
    """An accepted goal that was reported lost."""
    handle = world.accepted()
    world.client.is_there = False
    world.pass_time(LOST_S + 0.1)
    assert world.reported() == [("on_goal_ended", 1, "lost", None)]
    assert handle.cancel_futures == []
    assert world.goals.has_abandoned
    return handle


def test_a_lost_goal_is_cancelled_when_its_server_is_back() -> None:
    world = World()
    handle = lost(world)
    world.client.is_there = True
    world.pass_time(1.0)
    assert len(handle.cancel_futures) == 1
    handle.cancel_futures[0].done(answer(NONE, "the goal"))
    assert not world.goals.has_abandoned
    world.client.feedback(SimpleNamespace(feedback="near"))
    handle.result_future.done(SimpleNamespace(status=CANCELED, result=None))
    assert world.reported() == []


def test_the_cancel_of_a_lost_goal_is_asked_for_again_if_it_got_no_answer() -> None:
    world = World()
    handle = lost(world)
    for count in (1, 2):
        world.client.is_there = True
        world.pass_time(0.5)
        assert len(handle.cancel_futures) == count
        world.client.is_there = False
        world.pass_time(0.5)
    handle.cancel_futures[1].done(exception=ValueError("no"))
    assert world.goals.has_abandoned
    world.client.is_there = True
    world.pass_time(0.5)
    assert len(handle.cancel_futures) == 3


def test_a_stop_cancels_a_lost_goal_although_its_server_is_not_seen() -> None:
    world = World()
    handle = lost(world)
    world.goals.cancel_abandoned()
    assert len(handle.cancel_futures) == 1
    handle.cancel_futures[0].done(answer(REJECTED))
    assert not world.goals.has_abandoned
    assert world.reported() == []


def test_a_lost_goal_that_ends_is_not_cancelled() -> None:
    world = World()
    handle = lost(world)
    handle.result_future.done(SimpleNamespace(status=SUCCEEDED, result="there"))
    assert not world.goals.has_abandoned
    world.client.is_there = True
    world.pass_time(1.0)
    assert handle.cancel_futures == []
    assert world.reported() == []


def test_a_cancel_that_is_granted_waits_for_the_result() -> None:
    world = World()
    handle = world.accepted()
    world.goals.cancel(1)
    handle.cancel_futures[0].done(answer(NONE, "the goal"))
    world.pass_time(2 * REFUSAL_S)
    assert world.reported() == []
    handle.result_future.done(SimpleNamespace(status=CANCELED, result=None))
    assert world.reported() == [("on_goal_ended", 1, "cancelled", None)]


def test_a_cancel_of_a_goal_that_had_ended_means_nothing() -> None:
    world = World()
    handle = world.accepted()
    world.goals.cancel(1)
    handle.cancel_futures[0].done(answer(TERMINATED))
    assert world.reported() == [("on_cancel_refused", 1, True)]


@pytest.mark.parametrize(
    ("code", "report"),
    [
        (NONE, ("on_cancel_refused", 1, False)),
        (REJECTED, ("on_cancel_refused", 1, False)),
        (UNKNOWN_GOAL, ("on_goal_ended", 1, "lost", None)),
    ],
)
def test_a_refused_cancel_is_reported_when_no_result_follows(code: int, report: tuple[Any, ...]) -> None:
    """A goal that its server does not know is lost; another one runs on."""
    world = World()
    handle = world.accepted()
    world.goals.cancel(1)
    handle.cancel_futures[0].done(answer(code))
    world.pass_time(0.8 * REFUSAL_S)
    assert world.reported() == []
    world.pass_time(REFUSAL_S)
    assert world.reported() == [report]
    world.pass_time(2 * REFUSAL_S)
    assert world.reported() == []


@pytest.mark.parametrize("code", [NONE, REJECTED, UNKNOWN_GOAL])
def test_a_refused_cancel_of_a_goal_that_ends_at_that_moment_means_nothing(code: int) -> None:
    world = World()
    handle = world.accepted()
    world.goals.cancel(1)
    handle.cancel_futures[0].done(answer(code))
    handle.result_future.done(SimpleNamespace(status=SUCCEEDED, result="there"))
    world.pass_time(2 * REFUSAL_S)
    assert world.reported() == [("on_goal_ended", 1, "succeeded", "there")]


def test_cancels_and_their_answers_after_the_end_mean_nothing() -> None:
    world = World()
    handle = world.accepted()
    world.goals.cancel(1)
    handle.result_future.done(SimpleNamespace(status=ABORTED, result=None))
    handle.cancel_futures[0].done(answer(REJECTED))
    world.goals.cancel(1)
    assert len(handle.cancel_futures) == 1
    assert world.reported() == [("on_goal_ended", 1, "aborted", None)]


def test_a_cancel_that_fails_in_the_client_waits_for_the_loss() -> None:
    world = World()
    handle = world.accepted()
    world.goals.cancel(1)
    handle.cancel_futures[0].done(exception=ValueError("no"))
    world.client.is_there = False
    world.pass_time(LOST_S + 0.1)
    assert world.reported() == [("on_goal_ended", 1, "lost", None)]
