"""Tests of the runtime that generated ROS 1 packages carry, without ROS 1.

Covered are the inbox, timers, service calls, goals, and fields of genpy.
"""

import threading
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc.targets.ros.runtime.messages import Sender, SetupError, check_shape, fields_of, headers_of, message_name
from robosc.targets.ros.runtime.presence import LOST_S
from robosc.targets.ros.runtime.reports import Reports
from robosc.targets.ros1.runtime.goals import (
    ANSWER_S,
    DONE,
    PREEMPTING,
    REFUSAL_S,
    SILENCE_S,
    UNLISTED_S,
    WAITING_FOR_CANCEL_ACK,
    WAITING_FOR_RESULT,
    ActionGoals,
)
from robosc.targets.ros1.runtime.inbox import Action, Inbox
from robosc.targets.ros1.runtime.services import MAXIMUM_PENDING, MAXIMUM_THREADS, ServiceCalls
from robosc.targets.ros1.runtime.timers import Timers
from support.executor_log import ExecutorLog

LIMIT_S = 20.0
PENDING, ACTIVE = 1, 2
ACTIVE_STATUS, SUCCEEDED, REJECTED, LOST = 1, 3, 5, 9


# The inbox.


@given(st.lists(st.sampled_from(["a", "b", None]), max_size=30), st.integers(1, 4))
def test_what_comes_is_taken_in_order_and_the_oldest_of_too_many_is_lost(kinds: list[str | None], depth: int) -> None:
    inbox = Inbox({"a": depth, "b": 2 * depth})
    done: list[int] = []
    for number, kind in enumerate(kinds):
        inbox.put(lambda number=number: done.append(number), kind)  # type: ignore[misc]
    for action in inbox.take(0.0):
        action()
    limits = {"a": depth, "b": 2 * depth, None: len(kinds)}
    kept = [n for n, kind in enumerate(kinds) if kinds[n:].count(kind) <= limits[kind]]
    assert done == kept
    assert inbox.dropped == len(kinds) - len(kept)
    assert inbox.take(0.0) == []


def test_threads_hand_over_everything_in_their_order() -> None:
    inbox = Inbox({"a": 10000, "b": 10000})
    done: list[tuple[str, int]] = []

    def work(kind: str) -> None:
        for number in range(2000):
            inbox.put(lambda number=number: done.append((kind, number)), kind)  # type: ignore[misc]

    threads = [threading.Thread(target=work, args=(kind,)) for kind in "ab"]
    for thread in threads:
        thread.start()
    while len(done) < 4000:
        found = inbox.take(LIMIT_S)
        assert found
        for action in found:
            action()
    for thread in threads:
        thread.join()
    for kind in "ab":
        assert [number for which, number in done if which == kind] == list(range(2000))


# Timers.


def test_timers_follow_the_clock_and_make_up_for_nothing() -> None:
    now = SimpleNamespace(s=10.0)
    timers = Timers(lambda: now.s)
    done: list[float] = []
    assert timers.due_in_s(0.5) == 0.5
    timers.add(1.0, lambda: done.append(now.s))
    for moment in (10.9, 11.0, 11.5, 12.125, 13.0, 17.5, 17.6, 18.5):
        now.s = moment
        timers.run_due()
    # After the gap, one at once, and the next when a period has passed.
    assert done == [11.0, 12.125, 13.0, 17.5, 18.5]
    assert timers.due_in_s(0.0) == 0.0


# Services.


class Connection:
    """A call that waits until the test says how it ends."""

    def __init__(self) -> None:
        self.end = threading.Event()
        self.outcome: Any = "reply"
        self.is_closed = False
        self.closes_at_once = True

    def __call__(self, message: Any) -> Any:
        assert self.end.wait(LIMIT_S)
        if isinstance(self.outcome, Exception):
            raise self.outcome
        return self.outcome

    def close(self) -> None:
        self.is_closed = True
        if self.closes_at_once and not self.end.is_set():
            self.outcome = OSError("closed")
            self.end.set()


class Calls:
    """The calls of one service, with the executor's thread in the test's hands."""

    def __init__(self) -> None:
        self.inbox = Inbox({})
        self.reports = Reports()
        self.executor: Any = ExecutorLog()
        self.connections: list[Connection] = []
        self.closes_at_once = True
        self.calls = ServiceCalls("/s", self._connect, self.inbox.put, self.reports)

    def _connect(self) -> Connection:
        self.connections.append(Connection())
        self.connections[-1].closes_at_once = self.closes_at_once
        return self.connections[-1]

    def end(self, index: int, outcome: Any) -> None:
        self.connections[index].outcome = outcome
        self.connections[index].end.set()

    def turn(self, count: int) -> list[Any]:
        """Let the results of so many calls in: what the executor receives."""
        done = 0
        while done < count:
            found = self.inbox.take(LIMIT_S)
            assert found
            for action in found:
                action()
            done += len(found)
        self.reports.deliver(self.executor)
        reported, self.executor.reported = self.executor.reported, []
        return list(reported)


def test_replies_and_failures_reach_the_executor_in_its_own_thread() -> None:
    calls = Calls()
    calls.calls.call(1, "m")
    calls.calls.call(2, "m")
    calls.end(1, ValueError("no such service"))
    assert calls.turn(1) == [("on_call_failed", 2, "the call of /s failed: no such service")]
    assert calls.connections[1].is_closed and not calls.connections[0].is_closed
    calls.end(0, "it")
    assert calls.turn(1) == [("on_reply", 1, "it")]


def test_calls_that_never_end_are_given_up_one_by_one() -> None:
    calls = Calls()
    for number in range(MAXIMUM_PENDING + 1):
        calls.calls.call(number, "m")
    assert [item.is_closed for item in calls.connections] == [True] + MAXIMUM_PENDING * [False]
    # Its thread has ended, and nobody hears of it.
    assert calls.turn(1) == []
    for number in range(1, MAXIMUM_PENDING + 1):
        calls.end(number, number)
    assert sorted(calls.turn(MAXIMUM_PENDING)) == [("on_reply", n, n) for n in range(1, MAXIMUM_PENDING + 1)]


def test_there_is_a_limit_to_calls_that_cannot_even_be_given_up() -> None:
    calls = Calls()
    calls.closes_at_once = False
    for number in range(MAXIMUM_THREADS + 1):
        calls.calls.call(number, "m")
    assert len(calls.connections) == MAXIMUM_THREADS
    assert calls.turn(0) == [("on_call_failed", MAXIMUM_THREADS, f"{MAXIMUM_THREADS} calls of /s have not ended")]
    for index in range(MAXIMUM_THREADS):
        calls.end(index, index)
    calls.turn(MAXIMUM_THREADS)
    calls.calls.call(99, "m")
    calls.end(-1, "again")
    assert calls.turn(1) == [("on_reply", 99, "again")]


# Goals.


class Handle:
    """A goal as actionlib's client has it."""

    def __init__(self) -> None:
        self.state, self.status, self.result = 0, 0, None
        self.cancels = 0

    def get_comm_state(self) -> int:
        return self.state

    def get_goal_status(self) -> int:
        return self.status

    def get_result(self) -> Any:
        return self.result

    def cancel(self) -> None:
        self.cancels += 1


class Goals:
    """The goals of one action: a client that does as the test says, and its clock."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.is_there = True
        self.last_status_msg: Any = None
        self.handles: list[Handle] = []
        self.callbacks: list[tuple[Any, Any]] = []
        self.waiting: list[Action] = []
        self.reports = Reports()
        self.executor: Any = ExecutorLog()
        self.servers: dict[str, str] = {}
        self.goals = ActionGoals(
            self,
            lambda: self.is_there,
            lambda: self.servers,
            "/a",
            lambda action, kind: self.waiting.append(action),
            self.reports,
            self.now,
        )

    def now(self) -> float:
        return self.now_s

    def send_goal(self, message: Any, transition: Any, feedback: Any) -> Handle:
        self.handles.append(Handle())
        self.callbacks.append((transition, feedback))
        return self.handles[-1]

    def changes(self, state: int, status: int, result: Any = None, index: int = -1) -> list[Any]:
        handle = self.handles[index]
        handle.state, handle.status, handle.result = state, status, result
        self.callbacks[index][0](handle)
        return self.reported()

    def passes(self, seconds: float, hears: bool = True) -> list[Any]:
        """Time passes, looked at often; the server may send status messages meanwhile."""
        for _ in range(round(seconds / 0.05)):
            self.now_s += 0.05
            if hears:
                self.last_status_msg = object()
            self.goals.check(self.now_s)
        return self.reported()

    def reported(self) -> list[Any]:
        while self.waiting:
            self.waiting.pop(0)()
        self.reports.deliver(self.executor)
        reported, self.executor.reported = self.executor.reported, []
        return list(reported)


@pytest.fixture
def goals() -> Goals:
    made = Goals()
    made.goals.send(1, "goal")
    return made


def test_a_goal_is_accepted_once_and_succeeds(goals: Goals) -> None:
    assert goals.changes(PENDING, 0) == [("on_goal_accepted", 1)]
    assert goals.changes(ACTIVE, ACTIVE_STATUS) == []
    goals.callbacks[0][1](None, "half")
    assert goals.reported() == [("on_feedback", 1, "half")]
    assert goals.changes(WAITING_FOR_RESULT, SUCCEEDED) == []
    assert goals.changes(DONE, SUCCEEDED, "all") == [("on_goal_ended", 1, "succeeded", "all")]
    goals.callbacks[0][1](None, "late")
    assert goals.reported() == goals.passes(10.0) == []


@pytest.mark.parametrize(
    ("status", "outcome"), [(2, "cancelled"), (4, "aborted"), (5, "rejected"), (8, "cancelled"), (9, "lost")]
)
def test_every_other_end_has_a_result_if_its_server_sent_one(goals: Goals, status: int, outcome: str) -> None:
    result = None if outcome == "lost" else "partly"
    assert goals.changes(DONE, status, "partly") == [("on_goal_ended", 1, outcome, result)]


def test_a_rejected_goal_is_never_accepted(goals: Goals) -> None:
    assert goals.changes(PENDING, REJECTED) == []


def test_without_a_server_a_goal_is_lost_at_once() -> None:
    goals = Goals()
    goals.is_there = False
    goals.goals.send(1, "goal")
    assert goals.reported() == [("on_goal_ended", 1, "lost", None)]
    assert goals.handles == []


def test_a_server_that_is_lost_and_back_is_asked_to_cancel(goals: Goals) -> None:
    goals.changes(ACTIVE, ACTIVE_STATUS)
    goals.is_there = False
    assert goals.passes(LOST_S - 0.1) == []
    assert goals.passes(0.2) == [("on_goal_ended", 1, "lost", None)]
    assert goals.goals.has_abandoned and goals.handles[0].cancels == 0
    # Its process is gone.
    assert goals.goals.unsettled == []
    goals.is_there = True
    goals.passes(0.5)
    assert goals.handles[0].cancels == 1
    assert goals.changes(PREEMPTING, 6) == []
    assert not goals.goals.has_abandoned


def test_a_server_that_was_only_unseen_for_a_moment_is_not_lost(goals: Goals) -> None:
    goals.changes(ACTIVE, ACTIVE_STATUS)
    for _ in range(5):
        goals.is_there = not goals.is_there
        assert goals.passes(LOST_S - 0.1) == []


@pytest.mark.parametrize("state", [None, WAITING_FOR_RESULT])
def test_a_goal_that_nothing_is_heard_of_is_lost_and_cancelled(goals: Goals, state: int | None) -> None:
    if state is not None:
        goals.changes(state, SUCCEEDED)
    assert goals.passes(SILENCE_S - 0.1, hears=state is not None) == []
    waiting = "no server of /a has accepted or rejected a goal so far"
    assert goals.goals.warnings() == [
        waiting if state is None else "the server of /a gives no result of a goal that ended"
    ]
    assert goals.passes(0.2, hears=False) == [("on_goal_ended", 1, "lost", None)]
    assert goals.handles[0].cancels == 1
    # Until its server has been heard, it may be running.
    assert goals.goals.unsettled == ["a goal of /a may be running: its server has not answered it"]
    goals.changes(DONE, LOST)
    assert goals.goals.unsettled == []


def test_a_server_that_reports_and_does_not_name_a_goal_does_not_have_it(goals: Goals) -> None:
    assert goals.passes(UNLISTED_S) == []
    assert goals.passes(0.1) == [("on_goal_ended", 1, "lost", None)]


def test_another_process_of_the_same_name_is_another_server(goals: Goals) -> None:
    goals.servers["http://a:1"] = "/server"
    goals.goals.send(2, "goal")
    goals.changes(ACTIVE, ACTIVE_STATUS, index=1)
    goals.goals._goals.pop(1)
    assert goals.passes(10.0) == []
    goals.servers = {"http://a:2": "/server"}
    assert goals.passes(LOST_S) == []
    assert goals.passes(0.2) == [("on_goal_ended", 2, "lost", None)]
    assert goals.handles[1].cancels == 1


def test_what_keeps_an_action_from_being_of_use(goals: Goals) -> None:
    goals.changes(ACTIVE, ACTIVE_STATUS)
    assert goals.goals.warnings() == []
    goals.passes(ANSWER_S + 0.1, hears=False)
    assert goals.goals.warnings() == ["the server of /a reports nothing about a goal"]
    goals.passes(0.1)
    assert goals.goals.warnings() == []
    goals.servers = {"http://a:1": "/b", "http://a:2": "/a"}
    assert goals.goals.warnings() == ["2 servers of /a: /a, /b"]
    goals.servers = {}
    goals.changes(WAITING_FOR_RESULT, SUCCEEDED)
    goals.passes(SILENCE_S + 0.1)
    assert goals.goals.warnings() == ["the server of /a gave no result of a goal that ended"]
    goals.goals.send(2, "goal")
    goals.changes(DONE, SUCCEEDED, "all")
    assert goals.goals.warnings() == []


def test_what_a_stop_leaves(goals: Goals) -> None:
    assert goals.goals.unsettled == ["a goal of /a may be running: its server has not answered it"]
    goals.goals.cancel_unanswered()
    assert goals.handles[0].cancels == 1
    goals.changes(ACTIVE, ACTIVE_STATUS)
    assert goals.goals.unsettled == []
    goals.goals.cancel(1)
    assert goals.goals.unsettled == ["a goal of /a may be running: its server has not answered its cancel"]
    goals.changes(PREEMPTING, 6)
    assert goals.goals.unsettled == []
    goals.goals.cancel_unanswered()
    assert goals.handles[0].cancels == 2


def test_a_running_goal_may_take_as_long_as_it_likes(goals: Goals) -> None:
    goals.changes(ACTIVE, ACTIVE_STATUS)
    assert goals.passes(10 * SILENCE_S) == []


def test_a_cancel_while_only_the_result_is_awaited_is_not_refused(goals: Goals) -> None:
    goals.changes(ACTIVE, ACTIVE_STATUS)
    goals.changes(WAITING_FOR_RESULT, SUCCEEDED)
    goals.goals.cancel(1)
    assert goals.passes(2 * REFUSAL_S) == []
    assert goals.handles[0].cancels == 1


def test_a_cancel_that_a_living_server_ignores_is_refused_once(goals: Goals) -> None:
    goals.changes(ACTIVE, ACTIVE_STATUS)
    goals.goals.cancel(1)
    goals.changes(WAITING_FOR_CANCEL_ACK, ACTIVE_STATUS)
    # A server that says nothing may be slow, or its time stands still.
    assert goals.passes(3 * REFUSAL_S, hears=False) == []
    assert goals.passes(0.1) == [("on_cancel_refused", 1, False)]
    assert goals.passes(3 * REFUSAL_S) == []


def test_what_was_on_its_way_before_a_cancel_does_not_answer_it(goals: Goals) -> None:
    goals.changes(PENDING, 0)
    goals.goals.cancel(1)
    goals.changes(ACTIVE, ACTIVE_STATUS)
    assert goals.passes(2 * REFUSAL_S) == [("on_cancel_refused", 1, False)]


def test_a_cancel_that_is_heard_may_take_its_time(goals: Goals) -> None:
    goals.changes(ACTIVE, ACTIVE_STATUS)
    goals.goals.cancel(1)
    goals.changes(PREEMPTING, 6)
    assert goals.passes(10 * REFUSAL_S) == []
    assert goals.changes(DONE, 2) == [("on_goal_ended", 1, "cancelled", None)]
    # Its end is known.
    goals.goals.cancel(1)
    assert goals.handles[0].cancels == 1


# Fields of genpy's classes, as the real ones declare them.


class Time:
    __slots__ = ["nsecs", "secs"]

    def __init__(self) -> None:
        self.secs = self.nsecs = 0


Time.__module__ = "genpy.rostime"


class Header:
    __slots__ = ["frame_id", "seq", "stamp"]
    _type = "std_msgs/Header"
    _slot_types: ClassVar = ["string", "uint32", "time"]

    def __init__(self) -> None:
        self.seq, self.stamp, self.frame_id = 0, Time(), ""


class Odd:
    __slots__ = ["data", "fixed", "flag", "header", "late", "many", "old", "small", "wide"]
    _type = "odd_msgs/Odd"
    _slot_types: ClassVar = [
        "uint8[]", "float32[9]", "bool", "std_msgs/Header", "duration", "odd_msgs/Odd[]", "byte", "char", "float64",
    ]  # fmt: skip

    def __init__(self) -> None:
        self.data, self.fixed, self.flag, self.header = b"", [0.0] * 9, False, Header()
        self.many: list[Any] = []
        self.late, self.old, self.small, self.wide = Time(), 0, 0, 0.0


def test_genpys_types_are_named_in_the_words_of_ros_2() -> None:
    assert (
        fields_of(Odd)
        == fields_of(Odd())
        == {
            "data": "sequence<uint8>",
            "fixed": "float[9]",
            "flag": "boolean",
            "header": "std_msgs/Header",
            "late": "genpy/Duration",
            "many": "sequence<odd_msgs/Odd>",
            "old": "int8",
            "small": "uint8",
            "wide": "double",
        }
    )
    assert fields_of(Time()) == {"secs": "uint32", "nsecs": "uint32"}
    assert (message_name(Odd), message_name(Time)) == ("odd_msgs/Odd", "genpy/Time")


def test_shapes_and_senders_work_on_genpys_classes() -> None:
    check_shape(Odd, {"data": ["integer"], "fixed": ["double"], "flag": "boolean", "old": "integer"}, "m")
    with pytest.raises(SetupError, match="the field 'old' of odd_msgs/Odd is int8, in the model it is double"):
        check_shape(Odd, {"old": "double"}, "m")
    with pytest.raises(SetupError, match="odd_msgs/Odd has no field 'new'; it has data, fixed"):
        check_shape(Odd, {"new": "double"}, "m")
    sender = Sender(Odd, {"flag": "boolean", "small": "integer"}, (("flag",), ("small",)), "m")
    sender.fill({"flag": True, "small": 255})
    assert (sender.message.flag, sender.message.small, sender.is_default) == (True, 255, False)
    with pytest.raises(Exception, match=r"small: 256 is outside 0\.\.255"):
        sender.fill({"small": 256})
    assert headers_of(sender.message, "m") == [sender.message.header]
