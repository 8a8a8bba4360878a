"""Calls and goals where real servers cannot be made to misbehave: clients that do as a test says."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from robosc.targets.ros.runtime.presence import LOST_S
from robosc.targets.ros.runtime.reports import Reports
from robosc.targets.ros2.runtime.clients import (
    ANSWER_S,
    MAXIMUM_PENDING,
    REFUSAL_S,
    RESULT_S,
    ActionGoals,
    ServiceCalls,
)
from robosc.targets.ros2.runtime.inquiry import CERTAIN_S, LOOK_S, MEMORY_S, Endpoints, Inquiry
from support.action_servers import Asked, Process
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
        self.uuids: list[bytes] = []
        self.feedback: Callable[[Any], None] = lambda message: None
        self._feedback_callbacks: dict[bytes, Any] = {b"0123456789abcdef": None}

    def service_is_ready(self) -> bool:
        return self.is_there

    server_is_ready = service_is_ready

    def call_async(self, message: Any) -> Future:
        self.futures.append(Future())
        return self.futures[-1]

    def send_goal_async(self, goal: Any, feedback_callback: Callable[[Any], None], goal_uuid: bytes) -> Future:
        self.feedback = feedback_callback
        self.uuids.append(goal_uuid)
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
    """A service and an action with their clients.

    Attributes:
        shown: The processes that the middleware shows as servers of both; those that live answer questions.
    """

    def __init__(self, timeout_s: float | None = 10.0) -> None:
        self.now_s = 100.0
        self.executors_s = 0.0
        self.client = Client()
        self.reports = Reports()
        self.shown: list[Process] = []
        self.cancels, self.results = Asked("cancel", self.shown), Asked("result", self.shown)

        def steady() -> float:
            return self.now_s

        self.calls = ServiceCalls(
            self.client,
            "/s",
            self.reports,
            lambda: self.now_s - self.executors_s,
            timeout_s,
            Endpoints(lambda: self.shown, steady),
        )
        self.goals = ActionGoals(
            self.client,
            "/a",
            self.reports,
            steady,
            bytes,
            Endpoints(lambda: self.shown, steady),
            Inquiry(self.cancels, self.results, steady),
        )

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
        """A goal that was sent and accepted; whatever was reported before is forgotten."""
        self.reported()
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


# Servers that are others than those that were asked.


def driving(world: World) -> tuple[Process, Handle]:
    """A goal that is under way, and its server."""
    server = Process(1)
    world.shown.append(server)
    handle = world.accepted()
    (name,) = world.client.uuids
    server.goals.add(name)
    world.pass_time(1.0)
    assert world.cancels.requests == world.results.requests == []
    return server, handle


@pytest.mark.parametrize("node", ["/server", "/another"])
def test_a_killed_server_that_is_still_shown_is_lost_when_another_one_takes_its_name(node: str) -> None:
    world = World()
    server, handle = driving(world)
    server.is_alive = False
    world.pass_time(5.0)
    assert world.reported() == []
    world.shown.append(Process(2, node))
    world.pass_time(CERTAIN_S - 0.3)
    assert world.reported() == []
    world.pass_time(0.3 + 2 * LOOK_S)
    assert world.reported() == [("on_goal_ended", 1, "lost", None)]
    assert world.goals.warnings() == [f"2 servers of /a: {', '.join(sorted(['/server', node]))}"]
    # It is cancelled all the same: its server may be slow, and not dead.
    assert len(handle.cancel_futures) == 1
    handle.cancel_futures[0].done(answer(UNKNOWN_GOAL))
    assert not world.goals.has_abandoned


def test_a_goal_of_a_living_server_is_not_lost_because_another_one_is_there() -> None:
    world = World()
    server, _ = driving(world)
    world.shown.append(Process(2, "/another"))
    world.pass_time(60.0)
    assert world.reported() == []
    assert world.cancels.requests and not server.cancelled
    # Neither is it where several others do not know it.
    world.shown.append(Process(3, "/third"))
    world.pass_time(60.0)
    assert world.reported() == []
    server.is_alive = False
    world.pass_time(MEMORY_S + CERTAIN_S + 2 * LOOK_S)
    assert world.reported() == [("on_goal_ended", 1, "lost", None)]


def test_a_server_that_gives_feedback_and_answers_no_question_is_at_work() -> None:
    world = World()
    server, _ = driving(world)
    server.is_alive = False
    world.shown.append(Process(2))
    for _ in range(10):
        world.client.feedback(SimpleNamespace(feedback="near"))
        world.pass_time(0.9 * MEMORY_S)
    assert {item[0] for item in world.reported()} == {"on_feedback"}
    world.pass_time(MEMORY_S + LOOK_S)
    assert world.reported() == [("on_goal_ended", 1, "lost", None)]


def test_where_nobody_answers_nothing_is_certain() -> None:
    world = World()
    server, _ = driving(world)
    server.is_alive = False
    world.shown.append(Process(2))
    world.shown[1].is_alive = False
    world.pass_time(15.0)
    assert world.reported() == []
    del world.shown[0]
    world.pass_time(LOST_S + 2 * LOOK_S)
    assert world.reported() == [("on_goal_ended", 1, "lost", None)]


def test_a_server_that_knows_the_result_is_not_contradicted_by_one_that_does_not() -> None:
    world = World()
    server, handle = driving(world)
    server.goals.clear()
    world.results.status = SUCCEEDED
    world.shown.append(Process(2))
    world.pass_time(10.0)
    assert world.reported() == []
    handle.result_future.done(SimpleNamespace(status=SUCCEEDED, result="there"))
    assert world.reported() == [("on_goal_ended", 1, "succeeded", "there")]


def test_other_endpoints_in_the_place_of_those_that_a_goal_was_sent_to_are_another_server() -> None:
    world = World()
    driving(world)
    world.shown[:] = [Process(2)]
    world.pass_time(0.9 * LOST_S)
    assert world.reported() == []
    world.pass_time(0.1 * LOST_S + 2 * LOOK_S)
    assert world.reported() == [("on_goal_ended", 1, "lost", None)]
    # The next goal is the new one's.
    world.shown[0].goals.add(world.client.uuids[-1])
    world.accepted(2)
    world.pass_time(10.0)
    assert world.reported() == []


def test_a_middleware_that_shows_no_endpoints_has_servers_all_the_same() -> None:
    world = World()
    world.accepted()
    world.pass_time(10.0)
    world.shown.append(Process(1))
    world.pass_time(10.0)
    assert world.reported() == []
    assert world.goals.warnings() == []


def test_a_call_of_a_killed_server_whose_name_another_process_has_taken_has_failed() -> None:
    world = World()
    world.shown.append(Process(1))
    world.calls.call(1, None)
    world.pass_time(5.0)
    world.shown.append(Process(2))
    world.pass_time(0.9 * LOST_S)
    assert world.reported() == []
    world.pass_time(0.1 * LOST_S + 2 * LOOK_S)
    assert world.reported() == [("on_call_failed", 1, "the server of /s is lost")]
    # A call that both may have got is the new one's.
    world.calls.call(2, None)
    world.pass_time(5.0)
    del world.shown[0]
    world.pass_time(3.0)
    assert world.reported() == []
    assert world.calls.warnings() == []


def test_a_call_goes_on_when_another_node_offers_the_same_service() -> None:
    world = World()
    world.shown.append(Process(1))
    world.calls.call(1, None)
    world.shown.append(Process(2, "/another"))
    world.pass_time(9.0)
    assert world.reported() == []
    assert world.calls.warnings() == ["2 servers of /s: /another, /server"]


def test_a_lost_call_is_found_while_the_executors_time_stands_still() -> None:
    world = World()
    world.shown.append(Process(1))
    world.calls.call(1, None)
    world.client.is_there = False
    for _ in range(40):
        world.now_s += 0.05
        world.executors_s += 0.05
        world.calls.check(world.now_s)
    assert world.reported() == [("on_call_failed", 1, "the server of /s is lost")]


def test_a_goal_without_an_answer_and_one_without_a_result_are_worth_a_warning() -> None:
    world = World()
    world.goals.send(1, None)
    assert world.goals.warnings() == []
    world.pass_time(ANSWER_S)
    assert world.goals.warnings() == ["no server of /a has accepted or rejected a goal so far"]
    handle: Any = Handle()
    handle.status = 2
    world.client.futures[-1].done(handle)
    world.pass_time(ANSWER_S)
    assert world.goals.warnings() == []
    handle.status = SUCCEEDED
    world.pass_time(ANSWER_S + 0.1)
    assert world.goals.warnings() == ["the server of /a gives no result of a goal that ended"]


@pytest.mark.parametrize(("status", "outcome"), [(SUCCEEDED, "lost"), (CANCELED, "cancelled"), (ABORTED, "aborted")])
def test_a_goal_that_ended_and_has_no_result_is_over(status: int, outcome: str) -> None:
    world = World()
    handle: Any = world.accepted()
    handle.status = status
    world.pass_time(0.9 * RESULT_S)
    assert world.reported() == []
    world.pass_time(0.1 * RESULT_S + 0.1)
    assert world.reported() == [("on_goal_ended", 1, outcome, None)]
    assert world.goals.warnings() == ["the server of /a gave no result of a goal that ended"]
    handle = world.accepted(2)
    handle.result_future.done(SimpleNamespace(status=UNKNOWN, result=None))
    assert world.goals.warnings() == ["the server of /a did not know a goal that it had accepted"]
    handle = world.accepted(3)
    handle.result_future.done(SimpleNamespace(status=SUCCEEDED, result=None))
    assert world.goals.warnings() == []


# What a stop leaves.


def test_a_goal_that_was_not_answered_may_begin_and_one_whose_cancel_was_not_may_run_on() -> None:
    world = World()
    assert world.goals.unsettled == []
    world.goals.send(1, None)
    assert world.goals.unsettled == ["a goal of /a may be running: its server has not answered it"]
    server = Process(1)
    world.shown.append(server)
    server.goals.add(world.client.uuids[-1])
    world.goals.cancel_unanswered()
    assert server.cancelled == world.client.uuids
    handle = Handle()
    world.client.futures[-1].done(handle)
    # Nobody wants its cancel so far.
    assert world.goals.unsettled == []
    world.goals.cancel(1)
    assert world.goals.unsettled == ["a goal of /a may be running: its server has not answered its cancel"]
    handle.cancel_futures[0].done(answer(REJECTED))
    assert len(world.goals.unsettled) == 1
    world.pass_time(2 * REFUSAL_S)
    assert ("on_cancel_refused", 1, False) in world.reported()
    assert world.goals.unsettled == []
    world.goals.cancel(1)
    handle.cancel_futures[1].done(answer(NONE, "the goal"))
    assert world.goals.unsettled == []
    world.goals.cancel_unanswered()
    assert len(server.cancelled) == 1


@pytest.mark.parametrize("end", ["rejected", "lost", "failed"])
def test_a_goal_that_was_answered_leaves_nothing(end: str) -> None:
    world = World()
    world.goals.send(1, None)
    if end == "rejected":
        world.client.futures[-1].done(Handle(accepted=False))
    elif end == "lost":
        world.client.is_there = False
        world.pass_time(LOST_S + 0.1)
    else:
        world.client.futures[-1].done(exception=ValueError("no"))
    assert world.goals.unsettled == []
