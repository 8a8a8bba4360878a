"""Calls and goals that a supervision layer let through, with their callers."""

from __future__ import annotations

from typing import Any, Dict, List, NamedTuple, Optional, Sequence

from robosc.execution.runtime.calls import Calls, Goals


class CallerCall(NamedTuple):
    """
    A service call that waits for its answer.

    :ivar service: Its service.
    :ivar call_id: Id of the call on the caller's side.
    """

    service: str
    call_id: Any


class CallerGoal:
    """
    A goal that has not ended for its caller.

    :ivar number: Number of the goal on the robot's side.
    :ivar action: Its action.
    :ivar goal_id: Id of the goal on the caller's side.
    :ivar is_cancelled: True if its caller asked to cancel it: it then ends as its server ends it.
    """

    __slots__ = ('action', 'goal_id', 'is_cancelled', 'number')

    def __init__(self, number: int, action: str, goal_id: Any) -> None:
        self.number = number
        self.action = action
        self.goal_id = goal_id
        self.is_cancelled = False

    def outcome(self, outcome: str) -> str:
        """
        Return the outcome of the goal for its caller.

        :param outcome: Outcome from its server, or `rejected` or `lost`.
        """
        if outcome == 'succeeded' or (self.is_cancelled and outcome == 'cancelled'):
            return outcome
        return 'aborted'


class Callers:
    """
    Calls and goals that the existing controller waits for.

    An id of the robot's side never meets one of the caller's side.

    :param calls: Service calls under way on the robot's side.
    :param goals: Goals under way there.
    """

    __slots__ = ('_calls', '_goals', '_waiting_calls', '_waiting_goals')

    def __init__(self, calls: Calls, goals: Goals) -> None:
        self._calls = calls
        self._goals = goals
        self._waiting_calls: Dict[int, CallerCall] = {}
        self._waiting_goals: Dict[int, CallerGoal] = {}

    def open_call(self, number: int, service: str, call_id: Any) -> None:
        """Note that a call went through under a number of the robot's side."""
        self._waiting_calls[number] = CallerCall(service, call_id)

    def open_goal(self, number: int, action: str, goal_id: Any) -> None:
        """Note that a goal went through under a number of the robot's side."""
        self._waiting_goals[number] = CallerGoal(number, action, goal_id)

    def close_call(self, number: int) -> Optional[CallerCall]:
        """Return the call that is about to be answered, or None if its caller has gone."""
        return self._waiting_calls.pop(number, None)

    def close_goal(self, number: int) -> Optional[CallerGoal]:
        """Return the goal that is about to end for its caller, or None if the caller has gone."""
        return self._waiting_goals.pop(number, None)

    def goal(self, number: int) -> Optional[CallerGoal]:
        """Return the goal with a number of the robot's side, if its caller waits for it."""
        return self._waiting_goals.get(number)

    def find_goal(self, actions: Sequence[str], goal_id: Any) -> Optional[CallerGoal]:
        """Return a goal of some actions by its id on the caller's side, unless it ended there."""
        for goal in self._waiting_goals.values():
            if goal.action in actions and goal.goal_id == goal_id:
                return goal
        return None

    def close_failed_calls(self) -> List[CallerCall]:
        """
        Return calls that are no longer under way and were not answered.

        They ended in `error`, or before a restart.
        """
        failed = [number for number in self._waiting_calls if self._calls.find(number) is None]
        return [self._waiting_calls.pop(number) for number in failed]

    def close_failed_goals(self) -> List[CallerGoal]:
        """List the goals that the model no longer executes, though no result has ended them."""
        failed = [number for number, goal in self._waiting_goals.items() if self._has_failed(goal)]
        return [self._waiting_goals.pop(number) for number in failed]

    def _has_failed(self, goal: CallerGoal) -> bool:
        own = self._goals.find(goal.number)
        return own is None or not (own.is_running or goal.is_cancelled)
