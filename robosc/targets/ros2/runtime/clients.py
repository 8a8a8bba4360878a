"""
Service calls and goals through clients of ROS 2.

No call waits, and every end is reported to the executor.

The clients are parameters with the interface of rclpy's `Client` and `ActionClient`. Everything
runs in the node's one thread. Replies are kept in `Reports` until the node's loop passes them on,
because the executor must not be called from within itself. This would happen if a server is
missing at the moment of a request.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Callable
import os
from typing import Any

from robosc.targets.ros.runtime.presence import Presence
from robosc.targets.ros.runtime.reports import AbandonedGoal, Reports
from robosc.targets.ros2.runtime.inquiry import Endpoints, Inquiry, MEMORY_S

REFUSAL_S = 0.25
"""Time after a refused cancel during which the goal's end may still be on its way, in seconds."""

MAXIMUM_PENDING = 16
"""Calls of one service whose reply is still listened for, so that a late one is noticed."""

ANSWER_S = 2.0
"""Time without an answer of a server after which that is worth a warning, in seconds."""

RESULT_S = 5.0
"""A goal that its server shows as ended, and whose result does not come for so long, is over."""

# action_msgs/msg/GoalStatus.
_OUTCOMES = {4: 'succeeded', 5: 'cancelled', 6: 'aborted'}

# action_msgs/srv/CancelGoal: why a cancel was refused. The others are REJECTED, and NONE for no
# goal, which rclpy's own server answers instead.
_UNKNOWN_GOAL = 2
_GOAL_TERMINATED = 3


class _Call:
    """
    A call without a reply so far.

    :ivar future: Future of its reply.
    :ivar deadline_s: Time at which the executor no longer waits for it, in seconds.
    :ivar presence: Presence of the server that was called.
    """

    __slots__ = ('deadline_s', 'future', 'presence')

    def __init__(self, future: Any, deadline_s: float, presence: Presence) -> None:
        self.future = future
        self.deadline_s = deadline_s
        self.presence = presence


class ServiceCalls:
    """
    The calls of one service.

    :param client: Client with `service_is_ready`, `call_async` and `remove_pending_request`.
    :param name: The service's name on ROS.
    :param reports: Reports that take the replies.
    :param monotonic: The executor's clock.
    :param timeout_s: Time after which the executor itself counts a call as failed, in seconds, or
        None.
    :param servers: Endpoints of its servers.
    """

    def __init__(
        self,
        client: Any,
        name: str,
        reports: Reports,
        monotonic: Callable[[], float],
        timeout_s: float | None,
        servers: Endpoints,
    ) -> None:
        self.name = name
        self._client = client
        self._reports = reports
        self._monotonic = monotonic
        self._timeout_s = float('inf') if timeout_s is None else timeout_s
        self._servers = servers
        self._calls: dict[int, _Call] = {}

    def is_ready(self) -> bool:
        """Return True if there is a server."""
        return bool(self._client.service_is_ready())

    def call(self, request_id: int, message: Any) -> None:
        """Call it without waiting."""
        if not self.is_ready():
            self._fail(request_id, f'there is no server of {self.name}')
            return
        future = self._client.call_async(message)
        self._calls[request_id] = _Call(
            future, self._monotonic() + self._timeout_s, Presence(self._serving())
        )
        future.add_done_callback(lambda done: self._answered(request_id, done))
        if len(self._calls) > MAXIMUM_PENDING:
            self._forget(next(iter(self._calls)))

    def _serving(self) -> Callable[[], bool]:
        """
        Return the function that tells whether a server that is there now is there later.

        It is not where the node that had its name is another process: a server that works on a
        call need not answer questions, and names of nodes are unique.
        """
        called = self._servers.look()

        def is_there() -> bool:
            if not self.is_ready():
                return False
            seen = self._servers.seen()
            if not called or not seen:
                return True
            taken = {node for gid, node in seen.items() if gid not in called and node}
            return any(gid in seen and node not in taken for gid, node in called.items())

        return is_there

    def check(self, now_s: float) -> None:
        """
        Notice a lost server: every call to it has failed.

        :param now_s: Reading of a steady clock.
        """
        lost = [item for item in self._calls.items() if item[1].presence.is_lost(now_s)]
        for request_id, call in lost:
            self._forget(request_id)
            if self._monotonic() < call.deadline_s:
                self._fail(request_id, f'the server of {self.name} is lost')

    def warnings(self) -> list[str]:
        """Return what keeps the service from being of use, in words."""
        return _several(self.name, self._servers)

    def _forget(self, request_id: int) -> None:
        self._client.remove_pending_request(self._calls.pop(request_id).future)

    def _fail(self, request_id: int, reason: str) -> None:
        self._reports.add(lambda executor: executor.on_call_failed(request_id, reason))

    def _answered(self, request_id: int, future: Any) -> None:
        self._calls.pop(request_id, None)
        error = future.exception()
        if error is not None:
            self._fail(request_id, f'the call of {self.name} failed: {error}')
            return
        reply = future.result()
        self._reports.add(lambda executor: executor.on_reply(request_id, reply))


def _several(name: str, servers: Endpoints) -> list[str]:
    nodes = servers.nodes()
    if len(nodes) < 2:
        return []
    return [f'{len(nodes)} servers of {name}: {", ".join(nodes)}']


class _Goal:
    """
    A goal whose end is not known.

    :ivar uuid: Its name on ROS.
    :ivar servers: Endpoints of the servers that it was sent to; empty if none are shown.
    :ivar handle: Handle by which rclpy refers to it, once it was accepted.
    :ivar is_asked: True if its cancel was asked for and not answered.
    :ivar refused_s: Time at which its cancel was refused although it may be running, in seconds,
        or None.
    :ivar is_unknown: True if the refusal said that the server does not know it.
    :ivar sent_s: Time at which it was sent, in seconds.
    :ivar heard_s: Time of its last feedback, in seconds.
    :ivar ended_s: Time since which its server shows it as ended, in seconds, or None.
    """

    __slots__ = (
        'ended_s',
        'handle',
        'heard_s',
        'is_asked',
        'is_unknown',
        'refused_s',
        'sent_s',
        'servers',
        'uuid',
    )

    def __init__(self, name: bytes, servers: frozenset[bytes], now_s: float) -> None:
        self.uuid = name
        self.servers = servers
        self.sent_s = now_s
        self.handle: Any = None
        self.is_asked = False
        self.refused_s: float | None = None
        self.is_unknown = False
        self.heard_s = float('-inf')
        self.ended_s: float | None = None


class ActionGoals:
    """
    The goals of one action.

    :param client: Client with `server_is_ready` and `send_goal_async`.
    :param name: The action's name on ROS.
    :param reports: Reports that take what is heard of goals.
    :param monotonic: A steady clock.
    :param make_uuid: Function that makes the message `UUID` of 16 bytes.
    :param servers: Endpoints of its servers.
    :param inquiry: Questions to them.
    """

    def __init__(
        self,
        client: Any,
        name: str,
        reports: Reports,
        monotonic: Callable[[], float],
        make_uuid: Callable[[bytes], Any],
        servers: Endpoints,
        inquiry: Inquiry,
    ) -> None:
        self.name = name
        self._client = client
        self._reports = reports
        self._monotonic = monotonic
        self._make_uuid = make_uuid
        self._servers = servers
        self._inquiry = inquiry
        self._presence = Presence(self._is_served)
        self._goals: dict[int, _Goal] = {}
        self._abandoned: dict[int, AbandonedGoal] = {}
        self._no_result = ''

    def is_ready(self) -> bool:
        """Return True if there is a server."""
        return bool(self._client.server_is_ready())

    def send(self, goal_id: int, message: Any) -> None:
        """Send a goal without waiting."""
        if not self.is_ready():
            self._end(goal_id, 'lost')
            return
        goal = _Goal(os.urandom(16), frozenset(self._servers.look()), self._monotonic())
        future = self._client.send_goal_async(
            message,
            feedback_callback=self._feedback(goal_id),
            goal_uuid=self._make_uuid(goal.uuid),
        )
        self._goals[goal_id] = goal
        future.add_done_callback(lambda done: self._answered(goal_id, done))

    def cancel(self, goal_id: int) -> None:
        """Ask for the cancel of an accepted goal without waiting."""
        goal = self._goals.get(goal_id)
        # Its end may be known here and wait to be reported.
        if goal is not None:
            goal.is_asked = True
            future = goal.handle.cancel_goal_async()
            future.add_done_callback(lambda done: self._cancel_answered(goal_id, done))

    def check(self, now_s: float) -> None:
        """
        Notice a lost server, one that is back, and goals that have ended or are not cancelled.

        :param now_s: Reading of a steady clock.
        """
        if not self._goals:
            self._presence.forget()
        elif self._presence.is_lost(now_s):
            for goal_id in list(self._goals):
                self._abandon(goal_id)
        self._ask_about_goals(now_s)
        if self._abandoned:
            self._look_for_server()
        for goal_id, goal in list(self._goals.items()):
            self._await_result(goal_id, goal, now_s)
            if goal.refused_s is not None and now_s >= goal.refused_s + REFUSAL_S:
                goal.refused_s = None
                if goal.is_unknown:
                    self._end(goal_id, 'lost')
                else:
                    self._refuse(goal_id, is_ended=False)

    def _is_served(self) -> bool:
        """Return True if a server that some goal was sent to is there."""
        seen = self._servers.seen()
        return self.is_ready() and any(
            not seen or not goal.servers or not goal.servers.isdisjoint(seen)
            for goal in self._goals.values()
        )

    def _ask_about_goals(self, now_s: float) -> None:
        """
        Find a goal that no living server knows, where more than one server is shown.

        One of them may be dead, or both may be at work.
        """
        if len(self._servers.seen()) < 2 or not self._goals:
            self._inquiry.end()
            return
        # An action has at most one goal at a time.
        for goal_id, goal in list(self._goals.items())[:1]:
            if self._inquiry.is_unknown(goal.uuid) and now_s >= goal.heard_s + MEMORY_S:
                self._inquiry.end()
                self._abandon(goal_id)

    def _await_result(self, goal_id: int, goal: _Goal, now_s: float) -> None:
        """End a goal whose server shows that it has ended, and gives no result."""
        outcome = _OUTCOMES.get(getattr(goal.handle, 'status', 0))
        if outcome is None:
            return
        if goal.ended_s is None:
            goal.ended_s = now_s
        elif now_s >= goal.ended_s + RESULT_S:
            self._no_result = f'the server of {self.name} gave no result of a goal that ended'
            # A success without its result is a failure.
            self._end(goal_id, 'lost' if outcome == 'succeeded' else outcome)

    def warnings(self) -> list[str]:
        """Return what keeps the action from being of use, in words."""
        found = _several(self.name, self._servers)
        if self._no_result:
            found.append(self._no_result)
        limit_s = self._monotonic() - ANSWER_S
        for goal in self._goals.values():
            if goal.handle is None and goal.sent_s <= limit_s:
                found.append(f'no server of {self.name} has accepted or rejected a goal so far')
            elif goal.ended_s is not None and goal.ended_s <= limit_s:
                found.append(f'the server of {self.name} gives no result of a goal that ended')
        return found

    @property
    def unsettled(self) -> list[str]:
        """
        Return what may begin or run on, in words, although its cancel is wanted.

        A goal that its server has not answered, and one whose cancel it has not answered.
        """
        return [
            f'a goal of {self.name} may be running: its server has not answered '
            + ('it' if goal.handle is None else 'its cancel')
            for goal in self._goals.values()
            if goal.handle is None or goal.is_asked or goal.refused_s is not None
        ]

    def cancel_unanswered(self) -> None:
        """Ask for the cancel of goals that may still be accepted, should a server be busy."""
        for goal in self._goals.values():
            if goal.handle is None:
                self._inquiry.cancel(goal.uuid)

    @property
    def has_abandoned(self) -> bool:
        """Return True if a goal that was reported lost may be running."""
        return bool(self._abandoned)

    def cancel_abandoned(self) -> None:
        """
        Ask for the cancel of every goal that was reported lost.

        Its server may be there and only be unseen.
        """
        for goal_id in list(self._abandoned):
            self._cancel_abandoned(goal_id)

    def _abandon(self, goal_id: int) -> None:
        """Report a goal as lost, and keep it if it was accepted: it may still be running."""
        handle = self._goals[goal_id].handle
        if handle is not None:
            self._abandoned[goal_id] = AbandonedGoal(handle)
        self._end(goal_id, 'lost')

    def _look_for_server(self) -> None:
        """Cancel lost goals as soon as their server is seen: they would run on."""
        is_there = self.is_ready()
        for goal_id, abandoned in list(self._abandoned.items()):
            if not is_there:
                abandoned.is_asked = False
            elif not abandoned.is_asked:
                self._cancel_abandoned(goal_id)

    def _cancel_abandoned(self, goal_id: int) -> None:
        abandoned = self._abandoned[goal_id]
        abandoned.is_asked = True
        future = abandoned.handle.cancel_goal_async()
        future.add_done_callback(lambda done: self._abandoned_answered(goal_id, done))

    def _abandoned_answered(self, goal_id: int, future: Any) -> None:
        # The server has heard it, whatever it says; a client's failure is tried again when the
        # server is seen anew.
        if future.exception() is None:
            self._abandoned.pop(goal_id, None)

    def _feedback(self, goal_id: int) -> Callable[[Any], None]:
        def receive(message: Any) -> None:
            if goal_id not in self._goals:
                return  # It was reported lost.
            self._goals[goal_id].heard_s = self._monotonic()
            data = message.feedback
            self._reports.add(lambda executor: executor.on_feedback(goal_id, data))

        return receive

    def _answered(self, goal_id: int, future: Any) -> None:
        """Note that the server accepted or rejected a goal."""
        goal = self._goals.get(goal_id)
        if future.exception() is not None:
            if goal is not None:
                self._end(goal_id, 'lost')
            return
        handle = future.result()
        if not handle.accepted:
            # rclpy keeps the callback of a rejected goal for ever.
            getattr(self._client, '_feedback_callbacks', {}).pop(bytes(handle.goal_id.uuid), None)
            if goal is not None:
                self._end(goal_id, 'rejected')
            return
        if goal is None:
            # Its server counted as lost: this goal would run on.
            self._abandoned[goal_id] = AbandonedGoal(handle)
            self._cancel_abandoned(goal_id)
            return
        goal.handle = handle
        if goal.servers:
            # One that was found in between may be the one that accepted it.
            goal.servers |= frozenset(self._servers.seen())
        self._reports.add(lambda executor: executor.on_goal_accepted(goal_id))
        handle.get_result_async().add_done_callback(lambda done: self._result_came(goal_id, done))

    def _result_came(self, goal_id: int, future: Any) -> None:
        if goal_id not in self._goals:
            # It was reported lost; now it has really ended, unless the client failed.
            if future.exception() is None:
                self._abandoned.pop(goal_id, None)
            return
        if future.exception() is not None:
            self._abandon(goal_id)
            return
        answer = future.result()
        # Any other status means that the server does not know the goal: it was started anew, or
        # keeps no results.
        outcome = _OUTCOMES.get(answer.status, 'lost')
        self._no_result = ''
        if outcome == 'lost':
            self._no_result = f'the server of {self.name} did not know a goal that it had accepted'
        self._end(goal_id, outcome, None if outcome == 'lost' else answer.result)

    def _cancel_answered(self, goal_id: int, future: Any) -> None:
        if goal_id not in self._goals or future.exception() is not None:
            return  # Ended, or its server is about to be noticed as lost.
        answer = future.result()
        self._goals[goal_id].is_asked = False
        if answer.goals_canceling:
            return
        if answer.return_code == _GOAL_TERMINATED:
            self._refuse(goal_id, is_ended=True)
        else:
            # The server may say so because the goal has just ended: its result may be on its way.
            goal = self._goals[goal_id]
            goal.refused_s = self._monotonic()
            goal.is_unknown = answer.return_code == _UNKNOWN_GOAL

    def _refuse(self, goal_id: int, is_ended: bool) -> None:
        self._reports.add(lambda executor: executor.on_cancel_refused(goal_id, is_ended))

    def _end(self, goal_id: int, outcome: str, result: Any = None) -> None:
        self._goals.pop(goal_id, None)
        self._reports.add(lambda executor: executor.on_goal_ended(goal_id, outcome, result))
