"""Tests of a supervision layer's runtime on ROS 1, without ROS: calls and goals of the caller, default messages."""

import queue
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from robosc.targets.ros1.runtime.defaults import is_default
from robosc.targets.ros1.runtime.servers import CalledService, ServedAction

LIMIT_S = 10.0


# Calls.


class Calls:
    """A service whose handlers run in threads, as rospy's do."""

    def __init__(self) -> None:
        self.inbox: queue.Queue[Callable[[], None]] = queue.Queue()
        self.reported: list[tuple[int, Any]] = []
        self.threads: list[threading.Thread] = []
        self.answers: list[Any] = []
        self.service = CalledService(
            lambda: "default", self.inbox.put, lambda number, request: self.reported.append((number, request))
        )

    def call(self, request: str) -> threading.Thread:
        def work() -> None:
            with self.service.handling():
                self.answers.append(self.service.handle(request))

        thread = threading.Thread(target=work, daemon=True)
        self.threads.append(thread)
        thread.start()
        return thread

    def turn(self) -> None:
        """Do what the executor's thread does."""
        self.inbox.get(timeout=LIMIT_S)()

    def end(self) -> list[Any]:
        """All answers, in any order."""
        for thread in self.threads:
            thread.join(LIMIT_S)
            assert not thread.is_alive()
        return sorted(self.answers)


@pytest.fixture
def calls() -> Iterator[Calls]:
    made = Calls()
    yield made
    made.service.take_leave()


def test_a_call_waits_in_its_thread_until_it_is_answered(calls: Calls) -> None:
    first = calls.call("a")
    calls.turn()
    second = calls.call("b")
    calls.turn()
    assert calls.reported == [(1, "a"), (2, "b")]
    assert calls.service.is_busy
    calls.service.answer(2, "for b")
    second.join(LIMIT_S)
    assert calls.answers == ["for b"]
    assert first.is_alive()
    calls.service.answer_default(1, "why")
    assert calls.end() == ["default", "for b"]
    assert not calls.service.is_busy


def test_whoever_waits_at_the_end_gets_the_default(calls: Calls) -> None:
    calls.call("a")
    calls.turn()
    # This one has not come to the executor.
    calls.call("b")
    waiting = calls.inbox.get(timeout=LIMIT_S)
    calls.service.close()
    calls.call("c").join(LIMIT_S)
    assert calls.answers == ["default"]
    waiting()
    calls.service.take_leave()
    assert calls.end() == ["default"] * 3
    assert [request for _, request in calls.reported] == ["a", "b"]


# Goals.


class Handle:
    """A twin of actionlib's `ServerGoalHandle`."""

    def __init__(self, name: str) -> None:
        self.id = name
        self.reported: list[Any] = []

    def get_goal_id(self) -> Any:
        # A goal's id has itself an id.
        return self

    def get_goal(self) -> str:
        return f"goal {self.id}"

    def __getattr__(self, name: str) -> Any:
        return lambda *arguments: self.reported.append((name, *arguments))


class Goals:
    """An action, with an executor that obeys."""

    def __init__(self) -> None:
        self.inbox: list[Callable[[], None]] = []
        self.reported: list[Any] = []
        self.warnings: list[str] = []
        self.is_allowed = True
        self.action = ServedAction(
            "/count",
            lambda: "default",
            self.inbox.append,
            self.judge,
            lambda number: self.reported.append(number),
            self.warnings.append,
        )

    def judge(self, number: int, goal: Any) -> None:
        self.reported.append((number, goal))
        if self.is_allowed:
            self.action.accept(number)
        else:
            self.action.reject(number, "held back")

    def turn(self) -> None:
        while self.inbox:
            self.inbox.pop(0)()

    def come(self, name: str) -> Handle:
        handle = Handle(name)
        self.action.goal_came(handle)
        self.turn()
        return handle


def test_nothing_is_decided_in_the_thread_that_a_goal_comes_in() -> None:
    goals, handle = Goals(), Handle("x")
    goals.action.goal_came(handle)
    assert handle.reported == goals.reported == []
    goals.turn()
    assert goals.reported == [(1, "goal x")]
    assert handle.reported == [("set_accepted",)]


@pytest.mark.parametrize(
    ("outcome", "method"), [("succeeded", "set_succeeded"), ("aborted", "set_aborted"), ("cancelled", "set_canceled")]
)
def test_a_goal_ends_with_the_given_outcome_and_result(outcome: str, method: str) -> None:
    goals = Goals()
    handle = goals.come("x")
    goals.action.feedback(1, "half")
    goals.action.end(1, outcome, "result", "why")
    assert handle.reported == [("set_accepted",), ("publish_feedback", "half"), (method, "result", "why")]


def test_a_goal_that_is_held_back_is_rejected_and_forgotten() -> None:
    goals = Goals()
    goals.is_allowed = False
    handle = goals.come("x")
    assert handle.reported == [("set_rejected", "default", "held back")]
    goals.action.cancel_came(handle)
    goals.turn()
    assert goals.reported == [(1, "goal x")]


def test_a_cancel_is_handed_over_with_its_goal_until_that_has_ended() -> None:
    goals = Goals()
    goals.come("x")
    goals.come("y")
    # actionlib makes a new handle for a cancel.
    goals.action.cancel_came(Handle("y"))
    goals.turn()
    assert goals.reported[-1] == 2
    goals.action.end(2, "cancelled", None, "")
    goals.action.cancel_came(Handle("y"))
    goals.turn()
    assert goals.reported == [(1, "goal x"), (2, "goal y"), 2]


def test_goals_that_run_at_the_end_are_aborted_and_new_ones_rejected() -> None:
    goals = Goals()
    handle, late = goals.come("x"), Handle("y")
    goals.action.close()
    goals.action.goal_came(late)
    goals.action.take_leave()
    assert goals.inbox == []
    assert late.reported == [("set_rejected", "default", "the layer has ended")]
    assert handle.reported[-1] == ("set_aborted", "default", "the layer has ended")


def test_a_caller_that_cannot_be_reached_is_a_warning() -> None:
    class Gone(Handle):
        def set_accepted(self) -> None:
            raise OSError("no way")

    goals = Goals()
    goals.action.goal_came(Gone("x"))
    goals.turn()
    assert goals.warnings == ["no acceptance of a goal of /count: no way"]


# Default messages, as genpy makes them.


class Header:
    __slots__ = ("frame_id", "seq")
    _slot_types = ("string", "uint32")

    def __init__(self, seq: int = 0) -> None:
        self.seq = seq
        self.frame_id = ""


class Point:
    __slots__ = ("x", "y")
    _slot_types = ("float64", "float64")

    def __init__(self, x: float = 0.0, y: float = 0.0) -> None:
        self.x, self.y = x, y


class Message:
    __slots__ = ("data", "header", "name", "numbers", "place", "places")
    _slot_types = ("uint8[]", "std_msgs/Header", "string", "float64[2]", "geometry_msgs/Point", "geometry_msgs/Point[]")

    def __init__(self, **values: Any) -> None:
        defaults = {"data": b"", "header": Header(), "name": "", "numbers": [0.0, 0.0], "place": Point(), "places": []}
        for name, value in {**defaults, **values}.items():
            setattr(self, name, value)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({}, True),
        ({"header": Header(7)}, True),
        # A received message has tuples where a new message has lists.
        ({"numbers": (0.0, -0.0), "places": ()}, True),
        ({"numbers": (0.0, 5e-324)}, False),
        ({"place": Point(0.0, -0.001)}, False),
        ({"places": [Point()]}, False),
        ({"data": b"\0"}, False),
        ({"name": "x"}, False),
    ],
)
def test_which_messages_are_all_default(values: Any, expected: bool) -> None:
    assert is_default(Message(**values)) is expected
