"""Replies to service calls and goals, and replies that do not come in time."""

from __future__ import annotations

from typing import Any, Optional

from robosc.execution.runtime.calls import Call, Calls, Goal, Goals, OUTCOMES
from robosc.execution.runtime.cancels import BY_NONE, Cancels
from robosc.execution.runtime.recorder import Recorder
from robosc.execution.runtime.steps import ExecutionError, Steps


class Replies:
    """
    Matcher of replies and requests, which takes the events of replies.

    Methods that take an event return whether they did.

    :param steps: Steps that take the events.
    :param cancels: Cancels of goals.
    :param recorder: Recorder of replies that match no request.
    :param calls: Service calls under way.
    :param goals: Goals under way.
    """

    __slots__ = ('_calls', '_cancels', '_goals', '_recorder', '_steps')

    def __init__(
        self, steps: Steps, cancels: Cancels, recorder: Recorder, calls: Calls, goals: Goals
    ) -> None:
        self._steps = steps
        self._cancels = cancels
        self._recorder = recorder
        self._calls = calls
        self._goals = goals

    def forget(self) -> None:
        """
        Let the model start again without the calls and goals under way.

        Their end is still awaited.
        """
        self._calls.leave_model()
        self._goals.leave_model()

    def deadline_s(self) -> float:
        """Return the clock's reading, in seconds, at which the next call, goal or end is late."""
        return min(self._calls.deadline_s(), self._goals.deadline_s(), self._cancels.deadline_s())

    def expire(self, now_s: float) -> None:
        """
        Fail the calls and goals that exceeded their time, and cancel such goals.

        Report the cancelled goals that should have ended by now.
        """
        for number in self._calls.expired(now_s):
            call = self._calls.close(number)
            if call is not None and not call.is_left:
                self._steps.happen(call.service + '.error', None, 'timeout')
                self._steps.settle()
        for goal in self._goals.expired(now_s):
            goal.is_running = False
            self._steps.happen(goal.action + '.error', None, 'timeout')
            self._steps.settle()
            self._cancels.ask(goal, 'timeout', BY_NONE)
        self._cancels.report_overdue(now_s)

    def reply(self, request_id: int, data: Any) -> bool:
        """Take in the reply to a service call."""
        call = self._close_call(request_id)
        if call is None:
            return False
        if call.is_left:
            self._recorder.unexpected({'event': call.service + '.response'})
            return False
        self._steps.happen_with_data(call.service + '.response', data)
        return True

    def require_reply(self, request_id: int, data: Any) -> None:
        """Refuse data that lacks a part of the reply to a call under way, as MissingData."""
        service = self._calls.find(request_id)
        if service is not None:
            self._steps.read(service + '.response', data)

    def require_feedback(self, goal_id: int, data: Any) -> None:
        """Do the same for feedback on a goal."""
        self._require(goal_id, '.feedback', data)

    def require_result(self, goal_id: int, outcome: str, data: Any) -> None:
        """Do the same for the result of a goal."""
        if outcome == 'succeeded':
            self._require(goal_id, '.response', data)

    def call_failed(self, request_id: int, reason: str) -> bool:
        """Note that a service call will not be answered."""
        call = self._close_call(request_id)
        if call is None or call.is_left:
            return False
        self._steps.happen(call.service + '.error', None, reason)
        return True

    def goal_accepted(self, goal_id: int) -> None:
        """Note that a goal was accepted: a cancel that was decided before is sent now."""
        goal = self._find_goal(goal_id, 'an acceptance')
        if goal is not None:
            goal.is_accepted = True
            self._cancels.send(goal)

    def feedback(self, goal_id: int, data: Any) -> bool:
        """Take in the feedback on a goal."""
        goal = self._find_goal(goal_id, 'feedback')
        if goal is None:
            return False
        if not goal.is_running:
            self._recorder.unexpected({'event': goal.action + '.feedback'})
            return False
        self._steps.happen_with_data(goal.action + '.feedback', data)
        return True

    def goal_ended(self, goal_id: int, outcome: str, data: Any) -> bool:
        """
        Note the end of a goal, or the loss of its server.

        :raises ExecutionError: There is no such outcome.
        """
        if outcome not in OUTCOMES:
            raise ExecutionError("a goal cannot end as '{}'".format(outcome))
        goal = self._find_goal(goal_id, 'a result')
        if goal is None:
            return False
        self._goals.close(goal_id)
        # Its action may be requested again.
        self._steps.is_decided = False
        if goal.is_running and outcome == 'succeeded':
            self._steps.happen_with_data(goal.action + '.response', data)
        elif goal.is_running and outcome == 'cancelled':
            self._steps.end_cancelled(goal)
        elif goal.is_running:
            self._steps.happen(goal.action + '.error', None, outcome)
        elif outcome == 'succeeded':
            self._recorder.unexpected({'event': goal.action + '.response'})
        return goal.is_running

    def cancel_refused(self, goal_id: int, ended: bool) -> None:
        """
        Note that a cancel was refused; this has no effect if the goal had ended.

        :raises ExecutionError: The goal is running.
        """
        goal = None if ended else self._find_goal(goal_id, 'a refused cancel')
        if goal is not None:
            raise ExecutionError(
                'the cancel of a running goal of {} was refused'.format(goal.action)
            )

    def _require(self, goal_id: int, kind: str, data: Any) -> None:
        goal = self._goals.find(goal_id)
        if goal is not None and goal.is_running:
            self._steps.read(goal.action + kind, data)

    def _close_call(self, request_id: int) -> Optional[Call]:
        call = self._calls.close(request_id)
        if call is None:
            self._recorder.unexpected({'what': 'a reply to no call'})
        return call

    def _find_goal(self, goal_id: int, what: str) -> Optional[Goal]:
        goal = self._goals.find(goal_id)
        if goal is None:
            self._recorder.unexpected({'what': '{} of no goal'.format(what)})
        return goal
