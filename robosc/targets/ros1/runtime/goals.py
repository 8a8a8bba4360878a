"""
Goals through actionlib's `ActionClient`: nothing waits, and every end is reported to the executor.

actionlib calls back in the threads of rospy. Its reports go through the inbox to the executor's
thread, where everything here runs. A server of actionlib reports the state of each goal in its
status messages, and does not answer a cancel. If it ignores a cancel, its later status messages
show this.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from typing import Any, Callable, FrozenSet, Optional

from robosc.targets.ros.runtime.presence import Presence
from robosc.targets.ros.runtime.reports import AbandonedGoal, Reports
from robosc.targets.ros1.runtime.inbox import Action

REFUSAL_S = 1.0
"""Seconds after a cancel after which a goal that is still running is not meant to be cancelled."""

SILENCE_S = 5.0
"""A goal whose receipt, or whose result after its end, was not heard of for so long is lost."""

UNLISTED_S = 2.5
"""A server that reports for so long without naming a goal that was sent to it does not have it."""

ANSWER_S = 2.0
"""Time without a report of a server after which that is worth a warning, in seconds."""

# actionlib_msgs/GoalStatus.
ACTIVE = 1
PREEMPTED = 2
SUCCEEDED = 3
ABORTED = 4
REJECTED = 5
RECALLED = 8
_OUTCOMES = {
    PREEMPTED: 'cancelled',
    SUCCEEDED: 'succeeded',
    ABORTED: 'aborted',
    REJECTED: 'rejected',
    RECALLED: 'cancelled',
}

# actionlib.CommState: how far client and server understand each other about a goal.
WAITING_FOR_GOAL_ACK = 0
WAITING_FOR_RESULT = 3
WAITING_FOR_CANCEL_ACK = 4
RECALLING = 5
PREEMPTING = 6
DONE = 7
_SILENT = (WAITING_FOR_GOAL_ACK, WAITING_FOR_RESULT)
_CANCEL_HEARD = (WAITING_FOR_RESULT, RECALLING, PREEMPTING, DONE)

Put = Callable[[Action, Optional[str]], None]


def feedback_kind(name: str) -> str:
    """Return the key of an action's feedback in the inbox, by its name on ROS."""
    return f'feedback of {name}'


class _Goal:
    """
    A goal whose end is not known.

    :ivar handle: Handle by which actionlib refers to it.
    :ivar state: State of its progress, as heard last.
    :ivar since_s: Time since which it has that state, in seconds.
    :ivar is_accepted: True if its server has received it without refusing it.
    :ivar cancelled_s: Time at which its cancel was asked for, in seconds, until it is heard of; or
        None.
    :ivar servers: URIs of the servers that it was sent to; empty if none are known.
    """

    __slots__ = ('cancelled_s', 'handle', 'is_accepted', 'servers', 'since_s', 'state')

    def __init__(self, now_s: float, servers: FrozenSet[str]) -> None:
        self.servers = servers
        self.handle: Any = None
        self.state = WAITING_FOR_GOAL_ACK
        self.since_s = now_s
        self.is_accepted = False
        self.cancelled_s: float | None = None


class ActionGoals:
    """
    The goals of one action.

    :param client: Client with `send_goal` and `last_status_msg` as actionlib's `ActionClient`.
    :param is_ready: Function that returns True if its server is connected.
    :param servers: Function that returns the name of the node of each server that is connected, by
        its URI, which another process of the same name has not.
    :param name: The action's name on ROS.
    :param put: The inbox's method of that name.
    :param reports: Reports that take what is heard of goals.
    :param monotonic: The clock.
    """

    def __init__(
        self,
        client: Any,
        is_ready: Callable[[], bool],
        servers: Callable[[], dict[str, str]],
        name: str,
        put: Put,
        reports: Reports,
        monotonic: Callable[[], float],
    ) -> None:
        self.name = name
        self.is_ready = is_ready
        self._client = client
        self._put = put
        self._reports = reports
        self._monotonic = monotonic
        self._servers = servers
        self._presence = Presence(self._is_served)
        self._no_result = ''
        self._last_status: Any = None
        self._heard_s = 0.0
        self._goals: dict[int, _Goal] = {}
        self._abandoned: dict[int, AbandonedGoal] = {}

    def send(self, goal_id: int, message: Any) -> None:
        """Send a goal without waiting."""
        if not self.is_ready():
            self._end(goal_id, 'lost')
            return
        goal = self._goals[goal_id] = _Goal(self._monotonic(), frozenset(self._servers()))
        try:
            goal.handle = self._client.send_goal(
                message, self._transition(goal_id), self._feedback(goal_id)
            )
        except Exception:
            del self._goals[goal_id]
            raise

    def cancel(self, goal_id: int) -> None:
        """Ask for the cancel of an accepted goal without waiting."""
        goal = self._goals.get(goal_id)
        # Its end may be known here and wait to be reported.
        if goal is not None:
            # No notice of the cancel is taken of a goal whose end is known and only its result
            # awaited.
            goal.cancelled_s = None if goal.state in _CANCEL_HEARD else self._monotonic()
            goal.handle.cancel()

    def check(self, now_s: float) -> None:
        """Notice lost servers, those that are back, silent goals and cancels that are ignored."""
        status = self._client.last_status_msg
        if status is not self._last_status:
            self._last_status, self._heard_s = status, now_s
        if not self._goals:
            self._presence.forget()
        elif self._presence.is_lost(now_s):
            for goal_id in list(self._goals):
                self._abandon(goal_id)
        for goal_id, goal in list(self._goals.items()):
            if self._is_silent(goal, now_s):
                if goal.state == WAITING_FOR_RESULT:
                    self._no_result = (
                        f'the server of {self.name} gave no result of a goal that ended'
                    )
                self._abandon(goal_id, is_served=True)
            elif goal.cancelled_s is not None and self._heard_s >= goal.cancelled_s + REFUSAL_S:
                goal.cancelled_s = None
                self._refuse(goal_id)
        if self._abandoned:
            self._look_for_server()

    def _is_served(self) -> bool:
        """Return True if a server that some goal was sent to is there."""
        found = self._servers()
        return self.is_ready() and any(
            not goal.servers or not goal.servers.isdisjoint(found) for goal in self._goals.values()
        )

    def _is_silent(self, goal: _Goal, now_s: float) -> bool:
        """Return True if a server has not named a goal, or not given its result, for too long."""
        if goal.state == WAITING_FOR_GOAL_ACK and self._heard_s >= goal.since_s + UNLISTED_S:
            return True
        return goal.state in _SILENT and now_s >= goal.since_s + SILENCE_S

    def warnings(self) -> list[str]:
        """Return what keeps the action from being of use, in words."""
        nodes = sorted(self._servers().values())
        found = (
            [f'{len(nodes)} servers of {self.name}: {", ".join(nodes)}'] if len(nodes) > 1 else []
        )
        if self._no_result:
            found.append(self._no_result)
        limit_s = self._monotonic() - ANSWER_S
        for goal in self._goals.values():
            if goal.state == WAITING_FOR_GOAL_ACK and goal.since_s <= limit_s:
                found.append(f'no server of {self.name} has accepted or rejected a goal so far')
            elif goal.state == WAITING_FOR_RESULT and goal.since_s <= limit_s:
                found.append(f'the server of {self.name} gives no result of a goal that ended')
            elif max(goal.since_s, self._heard_s) <= limit_s:
                found.append(f'the server of {self.name} reports nothing about a goal')
        return found

    @property
    def unsettled(self) -> list[str]:
        """
        Return what may begin or run on, in words, although its cancel is wanted.

        A goal that its server has not named, and one whose cancel it has not heard.
        """
        answers = [
            'its cancel' if goal.is_accepted else 'it'
            for goal in self._goals.values()
            if goal.state == WAITING_FOR_GOAL_ACK or goal.cancelled_s is not None
        ]
        answers += ['it' for abandoned in self._abandoned.values() if abandoned.is_served]
        return [
            f'a goal of {self.name} may be running: its server has not answered {answer}'
            for answer in answers
        ]

    def cancel_unanswered(self) -> None:
        """Ask for the cancel of goals that may still be accepted: a server remembers it."""
        for goal in self._goals.values():
            if goal.state == WAITING_FOR_GOAL_ACK:
                goal.handle.cancel()

    @property
    def has_abandoned(self) -> bool:
        """Return True if a goal that was reported lost may be running."""
        return bool(self._abandoned)

    def cancel_abandoned(self) -> None:
        """
        Ask for the cancel of every goal that was reported lost.

        Its server may be there and only be unseen.
        """
        for abandoned in list(self._abandoned.values()):
            abandoned.is_asked = True
            abandoned.handle.cancel()

    def _abandon(self, goal_id: int, is_served: bool = False) -> None:
        """Report a goal as lost, and keep it: it may be running, or on its way to the server."""
        self._abandoned[goal_id] = AbandonedGoal(self._goals[goal_id].handle, is_served)
        self._end(goal_id, 'lost')

    def _look_for_server(self) -> None:
        """Cancel lost goals as soon as their server is seen: they would run on."""
        is_there = self.is_ready()
        for abandoned in list(self._abandoned.values()):
            if not is_there:
                abandoned.is_asked = False
            elif not abandoned.is_asked:
                abandoned.is_asked = True
                abandoned.handle.cancel()

    # Callbacks of actionlib, in the threads of rospy.

    def _transition(self, goal_id: int) -> Callable[[Any], None]:
        def on_transition(handle: Any) -> None:
            state, status = handle.get_comm_state(), handle.get_goal_status()
            result = handle.get_result() if state == DONE else None
            self._put(lambda: self._changed(goal_id, state, status, result), None)

        return on_transition

    def _feedback(self, goal_id: int) -> Callable[[Any, Any], None]:
        return lambda handle, data: self._put(
            lambda: self._on_feedback(goal_id, data), feedback_kind(self.name)
        )

    # The same in the executor's thread.

    def _on_feedback(self, goal_id: int, data: Any) -> None:
        if goal_id in self._goals:
            self._reports.add(lambda executor: executor.on_feedback(goal_id, data))

    def _changed(self, goal_id: int, state: int, status: int, result: Any) -> None:
        goal = self._goals.get(goal_id)
        if goal is None:
            # It was reported lost; now it has ended, or its server has heard the cancel.
            if state in _CANCEL_HEARD:
                self._abandoned.pop(goal_id, None)
            return
        goal.state, goal.since_s = state, self._monotonic()
        if state in _CANCEL_HEARD:
            goal.cancelled_s = None
        if state == DONE:
            # Any other status means that the server does not know the goal: it was started anew.
            outcome = _OUTCOMES.get(status, 'lost')
            self._no_result = ''
            self._end(goal_id, outcome, None if outcome == 'lost' else result)
        elif (
            not goal.is_accepted
            and state != WAITING_FOR_CANCEL_ACK
            and status not in (REJECTED, RECALLED)
        ):
            goal.is_accepted = True
            self._reports.add(lambda executor: executor.on_goal_accepted(goal_id))

    def _refuse(self, goal_id: int) -> None:
        self._reports.add(lambda executor: executor.on_cancel_refused(goal_id, False))

    def _end(self, goal_id: int, outcome: str, result: Any = None) -> None:
        self._goals.pop(goal_id, None)
        self._reports.add(lambda executor: executor.on_goal_ended(goal_id, outcome, result))
