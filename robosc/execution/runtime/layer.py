"""
The executor of a supervision layer.

It lets an existing controller's requests through or not.

The existing controller, the caller, communicates with the layer instead of the robot. Its messages
come in through `on_request`, `on_call`, `on_goal` and `on_cancel`; messages for it go out through
a `LayerMiddleware`. Everything else is as in a controller, except that the layer issues no
requests of its own: in a period it only checks the time.
"""

from __future__ import annotations

from typing import Any, Callable, Dict, Optional, Sequence, Tuple

from robosc.execution.runtime.callers import Callers
from robosc.execution.runtime.calls import Goal
from robosc.execution.runtime.cancels import BY_CALLER
from robosc.execution.runtime.clock import Clock
from robosc.execution.runtime.command_timeouts import CommandTimeouts
from robosc.execution.runtime.event_log import EventLog
from robosc.execution.runtime.limits import Limited, limited
from robosc.execution.runtime.middleware_messages import is_finite
from robosc.execution.runtime.protocol import (
    CommunicationInfo,
    ControlledSystem,
    LayerMiddleware,
    RobotSide,
)
from robosc.execution.runtime.requests import Request
from robosc.execution.runtime.runner import DeploymentError, guarded, Runner, Status
from robosc.execution.runtime.safe_stop import describe_error
from robosc.execution.runtime.settings import Settings
from robosc.execution.runtime.steps import ExecutionError

_INCOMING_MESSAGE = 'incoming message'

_A_FAULT = 'a fault'
_NOT_ALLOWED = 'not allowed now'
_NOT_FINITE = 'a NaN or an infinity'
_NOT_KNOWN = 'no message of the model'
_NOT_WITHIN = 'no number is within all limits'
_FAILED = 'the call failed or took too long'
_TOO_LONG = 'it took too long, or the layer began anew'
_TURNED = 'the supervisor cancelled it: a requirement no longer holds'
_CAME_TO_REST = 'it was cancelled, because the robot was stopped'
_STILL_RUNNING = 'its last goal may still be under way'
_OLD_GOALS = 'goals from before the restart have not ended'
_OLD_CALLS = 'calls from before the restart have not been answered'
_AT_REST = {
    Status.NEW: 'not started',
    Status.WAITING: 'waiting for sensors',
    Status.STOPPING: 'stopped',
    Status.STOPPED: 'stopped',
}


class Layer(Runner):
    """
    Executor that runs a controlled system as a supervision layer.

    :param system: Plants, requirements and supervisor with their state.
    :param robot: The robot's side of the middleware.
    :param caller: The existing controller's side.
    :param settings: Settings that the deployment chose; the defaults if None.
    :param clock: The only source of time; the computer's if None.
    :param log: The event log; none if None.
    :raises DeploymentError: The model has actions and the supervisor was made for a controller, or
        it does not distinguish its requests on one identifier.
    :raises SettingsError: A setting is wrong, or names what the model does not have.
    """

    def __init__(
        self,
        system: ControlledSystem,
        robot: RobotSide,
        caller: LayerMiddleware,
        settings: Optional[Settings] = None,
        clock: Optional[Clock] = None,
        log: Optional[EventLog] = None,
    ) -> None:
        super().__init__(system, robot, 'layer', settings, clock, log)
        self._caller = caller
        self._named = {request.name: request for request in self._requests}
        self._messages = _sharing(system.description.communications, _INCOMING_MESSAGE)
        self._groups = {
            name: names
            for kind in ('service', 'action')
            for names in _sharing(system.description.communications, kind).values()
            for name in names
        }
        self._defaults = frozenset(
            info.name for info in system.description.communications if info.is_when_default
        )
        self._callers = Callers(self._calls, self._goals)
        self._command_timeouts = CommandTimeouts(self._releases, self.settings.command_timeout_s)

    # Data from the existing controller.

    @guarded
    def on_request(self, identifier: str, message: Any) -> None:
        """
        Let a message of the existing controller through, or hold it back.

        It goes through unchanged, but for the numbers that limits move.

        :param identifier: Identifier that the message is for.
        :param message: Mapping or object with the properties, or the plain value of a basic type;
            None for no data.
        """
        names = self._messages.get(identifier)
        if names is None:
            self._recorder.unexpected({'what': 'a request on {}'.format(identifier)})
            return
        why: Optional[str] = _A_FAULT
        try:
            self._look_at_clock()
            self._command_timeouts.arrived(identifier, self._now_s)
            why = self._let_message_through(names, message)
        finally:
            if why is not None:
                self._hold_back(identifier, why)

    @guarded
    def on_call(self, service: str, call_id: Any, message: Any) -> None:
        """
        Take a service call of the existing controller.

        A call that is held back gets a default response at once.

        :param service: Name of the service in the model; any of those on one identifier, which
            `when` tells apart.
        :param call_id: Id by which its answer is to be addressed; the executor only hands it back.
        :param message: The request.
        """
        request = self._request_of(service, 'service')
        if request is None:
            return
        why: Optional[str] = _A_FAULT
        try:
            self._look_at_clock()
            why = self._let_call_through(request, call_id, message)
        finally:
            if why is not None:
                self._notify(self._caller.answer_default, service, call_id, why)
                self._hold_back(request.identifier, why)

    @guarded
    def on_goal(self, action: str, goal_id: Any, message: Any) -> None:
        """
        Take a goal of the existing controller: reject it if it is held back, else accept it.

        :param action: Name of the action in the model; any of those on one identifier, which
            `when` tells apart.
        :param goal_id: Id of the goal on the caller's side.
        :param message: The goal.
        """
        request = self._request_of(action, 'action')
        if request is None:
            return
        why: Optional[str] = _A_FAULT
        try:
            self._look_at_clock()
            why = self._let_goal_through(request, goal_id, message)
        finally:
            if why is not None:
                self._notify(self._caller.reject_goal, action, goal_id, why)
                self._hold_back(request.identifier, why)

    @guarded
    def on_cancel(self, action: str, goal_id: Any) -> None:
        """
        Cancel a goal for the existing controller.

        The cancel is always forwarded, also while the robot is stopped; its event follows when the
        goal has ended.

        :param action: Name of the action in the model, as in `on_goal`.
        :param goal_id: Id of the goal on the caller's side.
        """
        self._look_at_clock()
        waiting = self._callers.find_goal(self._groups.get(action, ()), goal_id)
        goal = None if waiting is None else self._goals.find(waiting.number)
        if waiting is None or goal is None:
            self._recorder.unexpected({'what': 'a cancel of no goal of {}'.format(action)})
            return
        waiting.is_cancelled = True
        self._cancels.ask(goal, 'the caller', BY_CALLER)

    @guarded
    def on_silent(self, identifier: str) -> None:
        """
        Release the last message on an identifier now.

        The existing controller is known to have stopped sending there.

        :param identifier: Identifier on which it sent messages; if none of them acts, nothing
            happens.
        """
        self._look_at_clock()
        if self._releases.is_acting(identifier):
            self._steps.release(identifier)

    # Data from the robot, and time.

    def receive(self, identifier: str, data: Any) -> None:
        """Take in a message of the robot as one batch, and pass it on."""
        super().receive(identifier, data)
        self._finish()
        if self._is_started and identifier in self._batches:
            self._notify(self._caller.pass_on, identifier, data)

    def tick(self) -> None:
        """Let a period pass: nothing is decided in a layer, so this is `watch`."""
        self.watch()

    def watch(self) -> None:
        """
        Time has passed.

        Check for stale sensors, a silent caller, overdue replies, and messages still to be sent.
        """
        super().watch()
        self._finish()

    def _next_deadline(self, now: float) -> float:
        return min(super()._next_deadline(now), self._command_timeouts.deadline_s())

    def _end_what_is_over(self, now: float) -> None:
        for identifier in self._command_timeouts.silent(now):
            self._steps.release(identifier)
        super()._end_what_is_over(now)
        # Calls and goals that are over end for the caller before all that comes at the same
        # moment.
        self._finish()

    def _take_reply(self, request_id: int, data: Any) -> None:
        waiting = self._callers.close_call(request_id)
        try:
            super()._take_reply(request_id, data)
        finally:
            if waiting is not None:
                self._notify(self._caller.answer, waiting.service, waiting.call_id, data)

    def _take_feedback(self, goal_id: int, data: Any) -> None:
        waiting = self._callers.goal(goal_id)
        try:
            super()._take_feedback(goal_id, data)
        finally:
            if waiting is not None:
                self._notify(self._caller.pass_feedback, waiting.action, waiting.goal_id, data)

    def _take_end(self, goal_id: int, outcome: str, data: Any) -> None:
        own = self._goals.find(goal_id)
        try:
            super()._take_end(goal_id, outcome, data)
        finally:
            # An end that does not exist is a fault, and ends nothing.
            waiting = None if self._goals.find(goal_id) else self._callers.close_goal(goal_id)
            if waiting is not None:
                end = waiting.outcome(outcome)
                why = _why_aborted(own, outcome) if end == 'aborted' else ''
                self._notify(
                    self._caller.end_goal, waiting.action, waiting.goal_id, end, data, why
                )

    def _finish(self) -> None:
        """Report calls and goals that failed or violate a requirement. Never raises."""
        for call in self._callers.close_failed_calls():
            self._notify(self._caller.answer_default, call.service, call.call_id, _FAILED)
        for goal in self._callers.close_failed_goals():
            self._notify(
                self._caller.end_goal, goal.action, goal.goal_id, 'aborted', None, _TOO_LONG
            )

    # Requests: why each is held back, or None if it went through.

    def _let_message_through(self, names: Sequence[str], message: Any) -> Optional[str]:
        why = self._refusal(message)
        if why is not None:
            return why
        request = self._recognized(names, message)
        if request is None:
            return _NOT_KNOWN
        if not self._system.enabled(request.event):
            return _NOT_ALLOWED
        found = self._limited(request, message)
        if found is None:
            return _NOT_WITHIN
        message, moved = found
        # A message with a moved number counts as acting, whatever it is: a release too many does
        # no harm.
        is_default = (
            request.keeps_acting and not moved and self._robot.is_default(request.name, message)
        )
        self._take(request, message, moved)
        if request.keeps_acting:
            data = message if request.has_limits else None
            self._releases.sent(request.name, request.identifier, is_default, data)
        self._robot.publish(request.name, message)
        return None

    def _let_call_through(self, request: Request, call_id: Any, message: Any) -> Optional[str]:
        why = self._refusal(message)
        if why is not None:
            return why
        chosen = self._recognized(self._groups[request.name], message)
        if chosen is None:
            return _NOT_KNOWN
        request = chosen
        if not self._system.enabled(request.event):
            return _NOT_ALLOWED
        found = self._limited(request, message)
        if found is None:
            return _NOT_WITHIN
        message, moved = found
        self._take(request, message, moved)
        number = self._calls.call(self._robot, request.name, message, self._now_s)
        self._callers.open_call(number, request.name, call_id)
        return None

    def _let_goal_through(self, request: Request, goal_id: Any, message: Any) -> Optional[str]:
        why = self._refusal(message)
        if why is not None:
            return why
        chosen = self._recognized(self._groups[request.name], message)
        if chosen is None:
            return _NOT_KNOWN
        request = chosen
        if self._goals.is_open(request.name):
            return _STILL_RUNNING
        if not self._system.enabled(request.event):
            return _NOT_ALLOWED
        found = self._limited(request, message)
        if found is None:
            return _NOT_WITHIN
        message, moved = found
        self._take(request, message, moved)
        goal = self._goals.send(self._robot, request.name, message, self._now_s)
        self._caller.accept_goal(request.name, goal_id)
        self._callers.open_goal(goal.number, request.name, goal_id)
        return None

    def _refusal(self, message: Any) -> Optional[str]:
        """Return the reason why no request, or none with this message, is let through now."""
        if not self._may_request:
            status = self.status
            if status is Status.WAITING and self._goals.left():
                return _OLD_GOALS
            if status is Status.WAITING and self._calls.left():
                return _OLD_CALLS
            return _AT_REST[status]
        return None if is_finite(message) else _NOT_FINITE

    def _limited(self, request: Request, message: Any) -> Optional[Limited]:
        """Return the message with its numbers within the limits that apply; None if none are."""
        if not request.has_limits:
            return Limited(message, ())
        return limited(message, self._system.limits(request.name))

    def _take(self, request: Request, message: Any, moved: Sequence[str]) -> None:
        """Take the request and the silent steps after it, before its message goes out."""
        if moved:
            self._recorder.limited(request.event, moved)
        self._steps.take(request.event, message)
        self._steps.settle(request.name)
        # A message that goes out now may wait for time to pass: looked up as soon as the clock
        # is read again.
        self._deadline_s = self._now_s

    def _recognized(self, names: Sequence[str], message: Any) -> Optional[Request]:
        """
        Return the request of a message: the first whose condition is true.

        :raises ExecutionError: An enum of the message is unknown, and that is a fault.
        """
        for name in names:
            if name in self._defaults:
                if self._robot.is_default(name, message):
                    return self._named[name]
                continue
            match = self._system.matches(name, message)
            if match.unknown:
                self._recorder.unknown(name + '.request', match.unknown)
            if match.enum_unknown and self.settings.on_unknown == 'fault':
                raise ExecutionError(
                    'unknown at {}: {}'.format(name + '.request', ', '.join(match.unknown))
                )
            if match.enum_unknown and self.settings.on_unknown == 'keep':
                return None
            if match.holds:
                return self._named[name]
        return None

    def _request_of(self, name: str, kind: str) -> Optional[Request]:
        request = self._named.get(name)
        if request is not None and request.kind == kind:
            return request
        self._recorder.unexpected({'what': 'a request of the {} {}'.format(kind, name)})
        return None

    def _hold_back(self, identifier: str, why: str) -> None:
        self._recorder.blocked(identifier, why)
        self._notify(self._caller.blocked, identifier, why)

    def _notify(self, method: Callable[..., None], *arguments: Any) -> None:
        """Notify the caller; a failure of the call is a fault. Never raises."""
        try:
            method(*arguments)
        except Exception as error:
            self._fail(describe_error(error))


def _why_aborted(goal: Optional[Goal], outcome: str) -> str:
    """Return why a goal that its caller did not cancel has ended as aborted for it."""
    if goal is None or not goal.is_cancelling or outcome != 'cancelled':
        return 'its server: {}'.format(outcome)
    return _TURNED if goal.cancelled_by else _CAME_TO_REST


def _sharing(infos: Sequence[CommunicationInfo], kind: str) -> Dict[str, Tuple[str, ...]]:
    """
    Return the communications of a kind on each identifier, in source order.

    :raises DeploymentError: One that has no condition is not the last of its identifier.
    """
    found: Dict[str, Tuple[CommunicationInfo, ...]] = {}
    for info in infos:
        if info.kind == kind:
            found[info.identifier] = (*found.get(info.identifier, ()), info)
    for identifier, sharing in found.items():
        for info in sharing[:-1]:
            if not info.has_condition:
                raise DeploymentError(
                    "what comes on '{}' may be '{}' or '{}': a supervision layer needs 'when: "
                    "CONDITION' in the list of '{}'".format(
                        identifier, info.name, sharing[-1].name, info.name
                    )
                )
    return {
        identifier: tuple(info.name for info in sharing) for identifier, sharing in found.items()
    }
