"""
Common part of the executors of both deployments, around any `ControlledSystem`.

An adapter calls an executor from one thread: `tick` once in a period, the other methods when a
message or reply comes. The middleware must not call the executor back from within a call. No
method raises an exception: one of the system or of the middleware becomes a fault, and the robot
comes to rest. The one exception is `MissingData`, for data that the caller must not leave out:
nothing has happened then.

A request is always taken in this order: prepare its message, take the event, take all silent
steps, make the releases that are due, send the message. So no request is decided on an old state.
"""

from __future__ import annotations

from enum import Enum
from functools import wraps
from typing import Any, Callable, cast, Optional, Tuple, TypeVar

from robosc.execution.runtime.calls import Calls, Goals
from robosc.execution.runtime.cancels import Cancels
from robosc.execution.runtime.clock import Clock, SystemClock
from robosc.execution.runtime.event_log import EventLog, NullLog
from robosc.execution.runtime.progress import Progress, ProgressAccount
from robosc.execution.runtime.protocol import (
    batches,
    ControlledSystem,
    Description,
    MissingData,
    OUTGOING,
    RobotSide,
    StrategicSystem,
)
from robosc.execution.runtime.recorder import Counters, Recorder
from robosc.execution.runtime.release import Releases
from robosc.execution.runtime.replies import Replies
from robosc.execution.runtime.requests import by_identifier, requests_of
from robosc.execution.runtime.safe_stop import describe_error, SafeStop
from robosc.execution.runtime.sensors import Sensors
from robosc.execution.runtime.settings import require_settings_of, Settings, settings_for
from robosc.execution.runtime.steps import ExecutionError, Steps

_FAULT = 'fault'
_STOPPED_BY_HAND = 'stop'


class Status(str, Enum):
    """Status of an executor."""

    NEW = 'new'
    """Not started."""
    WAITING = 'waiting'
    """
    No requests before the first message of every sensor with a maximum age, and before the calls
    and goals from before a restart have ended: the initial state knows nothing of them.
    """
    RUNNING = 'running'
    STOPPING = 'stopping'
    """At rest, but some cancelled goals have not ended yet."""
    STOPPED = 'stopped'


class DeploymentError(ValueError):
    """A supervisor made for another deployment, or of a model that cannot be deployed so."""


_Method = TypeVar('_Method', bound=Callable[..., None])


def guarded(method: _Method) -> _Method:
    """
    Return the method; each exception becomes a fault, and `_finish` follows in any case.

    Missing data is the fault of the caller instead.
    """

    @wraps(method)
    def wrapper(self: Runner, *arguments: Any, **named: Any) -> None:
        try:
            method(self, *arguments, **named)
        except MissingData as error:
            self._refuse(error)
        except Exception as error:
            self._fail(describe_error(error))
        self._finish()

    return cast(_Method, wrapper)


class Runner:
    """
    Runner that takes messages and replies of the robot, and brings the robot to rest.

    :param system: Plants, requirements and supervisor with their state.
    :param robot: The robot's side of the middleware.
    :param deployment: `controller` or `layer`.
    :param settings: Settings that the deployment chose; the defaults if None.
    :param clock: The only source of time; the computer's if None.
    :param log: The event log; none if None.
    :ivar settings: The settings in force, with all release identifiers.
    :raises DeploymentError: The model has actions and the supervisor was made for another
        deployment.
    :raises SettingsError: A setting is wrong, or names what the model does not have.
    """

    def __init__(
        self,
        system: ControlledSystem,
        robot: RobotSide,
        deployment: str,
        settings: Optional[Settings],
        clock: Optional[Clock],
        log: Optional[EventLog],
    ) -> None:
        infos = system.description.communications
        _require_deployment(system.description, deployment)
        self.settings = settings_for(settings or Settings(), system.description)
        require_settings_of(self.settings, deployment)
        self._system = system
        self._robot = robot
        self._clock: Clock = SystemClock() if clock is None else clock
        self._recorder = Recorder(system, self._clock, NullLog() if log is None else log)
        released = self.settings.release_identifiers or ()
        self._requests = requests_of(infos, released)
        self._releases = Releases(
            system, released, by_identifier(self._requests), deployment == 'controller'
        )
        self._calls = Calls(self.settings.service_timeout_s)
        actions = [info.name for info in infos if info.kind == 'action']
        self._goals = Goals(system, actions, self.settings.action_timeout_s)
        self._sensors = Sensors(
            [
                (info.name, info.identifier, info.max_age_s)
                for info in infos
                if info.kind == OUTGOING
            ],
            self.settings.max_age_s,
        )
        self._has_watched_sensors = bool(self._sensors)
        self._cancels = Cancels(robot, self._recorder, self._goals, self.settings.cancel_timeout_s)
        self._cancels.wake = self._wake_at
        self._safe_stop = SafeStop(robot, self._releases, self._goals, self._cancels)
        self._progress = self._new_progress()
        self._steps = Steps(
            system,
            robot,
            self._recorder,
            self._releases,
            self._goals,
            self._cancels,
            self.settings.on_unknown,
            self._progress,
        )
        self._replies = Replies(
            self._steps, self._cancels, self._recorder, self._calls, self._goals
        )
        self._batches = batches(infos)
        self._is_started = False
        self._may_request = False
        self._now_s = 0.0
        # No deadline passes before this reading of the clock.
        self._deadline_s = 0.0

    # Properties for adapters.

    @property
    def status(self) -> Status:
        """Return current status of the executor."""
        if self._safe_stop.reasons:
            return (
                Status.STOPPING
                if self._safe_stop.is_awaiting(self._clock.monotonic())
                else Status.STOPPED
            )
        if not self._is_started:
            return Status.NEW
        return Status.RUNNING if self._may_request else Status.WAITING

    @property
    def reasons(self) -> Tuple[str, ...]:
        """Reasons why it is stopped, in words; empty if it is not."""
        return tuple(self._safe_stop.reasons.values())

    @property
    def is_faulty(self) -> bool:
        """Return True if a fault stopped it; only `restart` ends that."""
        return _FAULT in self._safe_stop.reasons

    @property
    def missing_sensors(self) -> Tuple[str, ...]:
        """Return identifiers of the sensors with a maximum age that have not come yet."""
        return self._sensors.unseen()

    @property
    def old_goals(self) -> Tuple[str, ...]:
        """Return the actions with a goal from before a restart that has not ended."""
        return self._goals.left()

    @property
    def old_calls(self) -> Tuple[str, ...]:
        """Return the services with a call from before a restart that is not over."""
        return self._calls.left()

    @property
    def counters(self) -> Counters:
        """Return counts of what went wrong so far."""
        return self._recorder.counters()

    @property
    def cancelling(self) -> Tuple[str, ...]:
        """Return the actions whose goal was to be cancelled and has not ended, in source order."""
        return self._cancels.cancelling()

    @property
    def overdue_cancels(self) -> Tuple[str, ...]:
        """Return those of them whose goal has not ended within the time for that."""
        return self._cancels.overdue()

    @property
    def progress(self) -> Optional[Progress]:
        """
        Return how far the strategy is; None where there is none.

        This brings the account up to date, so that it is for the thread of all other calls, too.
        """
        if self._progress is None:
            return None
        return self._progress.at(self._clock.monotonic())

    # Reports of an adapter.

    @guarded
    def start(self) -> None:
        """Begin in the initial state; earlier messages are ignored. Idempotent."""
        if not self._is_started:
            self._begin()

    def watch(self) -> None:
        """
        Check the time between two decisions.

        The check finds stale sensors, overdue replies, and messages and cancels still to be sent.
        None of these may wait for the next decision, so an adapter with a long period calls it in
        between.
        """
        if not self._is_started:
            return
        try:
            self._look_at_clock()
            if not self._may_request:
                self._safe_stop.retry()
        except Exception as error:
            self._fail(describe_error(error))

    def receive(self, identifier: str, data: Any) -> None:
        """
        Take a message of the robot as one batch.

        The batch has the events of all messages of the model on that identifier.

        :param identifier: Identifier on which the message came.
        :param data: Mapping or object with the properties, or the plain value of a basic type;
            None for no data.
        :raises MissingData: A part is missing that cannot be unknown by its type: nothing happens.
        """
        # This is written out for speed: the cycle time of the controller.
        if not self._is_started:
            return
        try:
            now = self._now_s = self._recorder.began_s = self._clock.monotonic()
            if now >= self._deadline_s:
                self._check_time(now)
            batch = self._batches.get(identifier)
            if batch is None:
                self._recorder.unexpected({'what': 'a message on {}'.format(identifier)})
                return
            if self._steps.happen_at_once(identifier, data):
                if self._has_watched_sensors:
                    for name, _ in batch:
                        self._see(name)
            else:
                # None of them happens if another one lacks data.
                readings = [self._steps.read(event, data) for _, event in batch]
                for (name, event), reading in zip(batch, readings):
                    if self._steps.happen_reading(event, reading, may_keep=True):
                        self._see(name)
            self._end_batch()
        except MissingData as error:
            self._refuse(error)
        except Exception as error:
            self._fail(describe_error(error))

    @guarded
    def on_reply(self, request_id: int, data: Any) -> None:
        """Take in the reply to a service call (MissingData as `receive`)."""
        self._look_at_clock()
        self._replies.require_reply(request_id, data)
        self._take_reply(request_id, data)

    @guarded
    def on_call_failed(self, request_id: int, reason: str) -> None:
        """Note that a service call has no reply: its server is absent, lost or refuses it."""
        self._look_at_clock()
        is_event = self._replies.call_failed(request_id, reason)
        self._update_may_request()
        if is_event:
            self._end_batch()

    @guarded
    def on_goal_accepted(self, goal_id: int) -> None:
        """Note that a goal was accepted by its server."""
        self._look_at_clock()
        self._replies.goal_accepted(goal_id)

    @guarded
    def on_feedback(self, goal_id: int, data: Any) -> None:
        """Take in the feedback on a goal (MissingData as `receive`)."""
        self._look_at_clock()
        self._replies.require_feedback(goal_id, data)
        self._take_feedback(goal_id, data)

    @guarded
    def on_goal_ended(self, goal_id: int, outcome: str, data: Any = None) -> None:
        """
        Take the end of a goal, or the loss of its server.

        :param goal_id: Id of the goal.
        :param outcome: `succeeded`, `rejected`, `aborted`, `cancelled` or `lost`.
        :param data: Its result, if it succeeded.
        :raises MissingData: As `receive`.
        """
        self._look_at_clock()
        self._replies.require_result(goal_id, outcome, data)
        self._take_end(goal_id, outcome, data)

    @guarded
    def on_cancel_refused(self, goal_id: int, ended: bool) -> None:
        """
        Take the refusal of a cancel.

        :param goal_id: Id of the goal.
        :param ended: True if the reason is that the goal had ended already; its result follows or
            came already.
        """
        self._look_at_clock()
        self._replies.cancel_refused(goal_id, ended)

    def stop(self, reason: str, is_fault: bool = False) -> None:
        """
        Come to rest until `restart`.

        The adapter calls it on a signal, or, with `is_fault`, on a fault that it found. Running
        goals are cancelled: the status is `stopping` until they have ended, for at most 0.5 s.
        """
        self._now_s = self._recorder.began_s = self._clock.monotonic()
        if is_fault:
            self._fail(reason)
        else:
            self._stop(_STOPPED_BY_HAND, reason)

    @guarded
    def restart(self) -> None:
        """
        Begin again in the initial state, also after a fault.

        Goals and calls under way belong to the old run. Nothing is requested before they have
        ended, or the time for such a call is over.
        """
        self._now_s = self._recorder.began_s = self._clock.monotonic()
        if not self._safe_stop.reasons or self._safe_stop.unsent:
            self._come_to_rest()
        if self._safe_stop.unsent:
            raise ExecutionError('no restart: the robot could not be brought to rest')
        self._safe_stop.reasons.clear()
        self._recorder.note('restart', '')
        self._begin()

    # Time.

    def _begin(self) -> None:
        self._is_started = True
        now = self._now_s = self._recorder.began_s = self._clock.monotonic()
        self._replies.forget()
        self._sensors.start(now)
        self._steps.restart()
        self._steps.settle()
        self._deadline_s = self._next_deadline(now)
        self._update_may_request()

    def _look_at_clock(self) -> None:
        """Read the clock, and first handle all times that are over by now."""
        now = self._clock.monotonic()
        self._now_s = self._recorder.began_s = now
        if now >= self._deadline_s and self._is_started:
            self._check_time(now)

    def _next_deadline(self, now: float) -> float:
        next_s = min(self._replies.deadline_s(), self._sensors.deadline_s(now))
        return next_s if self._progress is None else min(next_s, self._progress.due_s)

    def _new_progress(self) -> Optional[ProgressAccount]:
        if not self._system.description.has_strategy:
            return None
        account = ProgressAccount(
            cast(StrategicSystem, self._system),
            self._recorder,
            tuple(request.name for request in self._requests),
            self.settings.assumption_timeout_s,
        )
        account.wake = self._wake_at
        return account

    def _wake_at(self, due_s: float) -> None:
        self._deadline_s = min(self._deadline_s, due_s)

    def _check_time(self, now: float) -> None:
        """
        Handle all times that are over by now. Never raises.

        Messages are handled after a fault, too: if the end of a goal were lost, the goal would
        never count as ended.
        """
        try:
            self._end_what_is_over(now)
        except Exception as error:
            self._fail(describe_error(error))

    def _end_what_is_over(self, now: float) -> None:
        """Handle replies and assumptions that did not come in time, and stale sensors."""
        self._replies.expire(now)
        self._update_may_request()
        if self._progress is not None:
            self._progress.expire(now)
        for name, identifier in self._sensors.stale(now):
            if _stale_key(name) not in self._safe_stop.reasons:
                self._stop(_stale_key(name), '{} on {} is stale'.format(name, identifier))
        self._deadline_s = self._next_deadline(now)

    def _see(self, name: str) -> None:
        """Note a message: its sensor is fresh again, which ends a stop because of it."""
        if self._sensors.see(name, self._now_s):
            if self._safe_stop.reasons.pop(_stale_key(name), None) is not None:
                self._recorder.note('resume', '{} is back'.format(name))
                self._deadline_s = self._next_deadline(self._now_s)
            self._update_may_request()

    # Methods that the deployments override.

    def _end_batch(self) -> None:
        """Silent steps after a batch."""
        self._steps.settle()

    def _take_reply(self, request_id: int, data: Any) -> None:
        is_event = self._replies.reply(request_id, data)
        self._update_may_request()
        if is_event:
            self._end_batch()

    def _take_feedback(self, goal_id: int, data: Any) -> None:
        if self._replies.feedback(goal_id, data):
            self._end_batch()

    def _take_end(self, goal_id: int, outcome: str, data: Any) -> None:
        is_event = self._replies.goal_ended(goal_id, outcome, data)
        self._update_may_request()
        if is_event:
            self._end_batch()

    def _refuse(self, error: MissingData) -> None:
        """Refuse data that lacks what every message has; an adapter may override it."""
        raise error

    def _finish(self) -> None:
        """End the handling of a message or reply, also after a failure. Never raises."""

    def _update_may_request(self) -> None:
        self._may_request = (
            self._is_started
            and not self._safe_stop.reasons
            and self._sensors.are_all_seen()
            and not self._calls.left()
            and not self._goals.left()
        )

    # Safe stop.

    def _fail(self, reason: str) -> None:
        """Note a fault. Never raises."""
        self._recorder.fault(reason)
        self._safe_stop.reasons.setdefault(_FAULT, reason)
        self._come_to_rest()

    def _stop(self, key: str, reason: str) -> None:
        """Make a safe stop that is no fault. Never raises."""
        self._recorder.note('stop', reason)
        self._safe_stop.reasons.setdefault(key, reason)
        self._come_to_rest()

    def _come_to_rest(self) -> None:
        """
        Stop all requests and wheels, and cancel goals; a failure is a fault.

        Never raises.
        """
        self._may_request = False
        for failure in self._safe_stop.stop(self._now_s):
            self._recorder.fault(failure)
            self._safe_stop.reasons.setdefault(_FAULT, failure)


def _require_deployment(description: Description, deployment: str) -> None:
    if description.deployment != deployment and any(
        info.kind == 'action' for info in description.communications
    ):
        raise DeploymentError(
            "this supervisor was made for the deployment '{}', and its model has actions; "
            "make one for the deployment '{}'".format(description.deployment, deployment)
        )


def _stale_key(name: str) -> str:
    return 'stale ' + name
