"""The robot as the executor sees it: requests go to channels, and what the devices tell comes from them.

What follows from a request at once, such as that a turn has failed, is told to the executor later, in `settle`: it must
not be called while it is at work.
"""

import logging
import math
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol

from robosc.execution.protocol import DataDoesNotFit
from robosc.model.structure import Communication, CommunicationKind
from robosc_bridge.configuration import channels
from robosc_bridge.configuration.ties import Ties
from robosc_bridge.daemon.motion import Motion
from robosc_bridge.daemon.readings import battery_data, imu_data, odometry_data, scan_data, shaped
from robosc_bridge.daemon.reports import Device
from robosc_bridge.devices.interface import DriveReading, Scan, Velocity
from robosc_bridge.skills import EmergencyStop, StopEvent

_log = logging.getLogger(__name__)

_SERVICE_SHARE = 0.9
"""How much of a call's time a turn may take."""

STOP_HELD = "a button that stops the robot is pressed"
"""Why nothing can go on."""

_BUMPERS = {"front": ("bumper_1",), "back": ("bumper_2",), "any": ("bumper_1", "bumper_2")}


class Supervised(Protocol):
    """What the robot tells the executor."""

    def receive(self, identifier: str, data: Any) -> None:
        """A message came."""

    def on_reply(self, request_id: int, data: Any) -> None:
        """A call was answered."""

    def on_call_failed(self, request_id: int, reason: str) -> None:
        """A call failed."""

    def on_goal_accepted(self, goal_id: int) -> None:
        """A goal is under way."""

    def on_feedback(self, goal_id: int, data: Any) -> None:
        """How far a goal is."""

    def on_goal_ended(self, goal_id: int, outcome: str, data: Any = None) -> None:
        """A goal has ended."""


class _Turn:
    """A turn under way: who wants to know of its end."""

    def __init__(
        self, asked: Communication, channel: channels.RotateChannel, number: int | None, end_s: float = math.inf
    ) -> None:
        self.asked = asked
        self.channel = channel
        self.number = number
        self.end_s = end_s


class Robot:
    """The executor's middleware.

    Args:
        ties: What each communication of the model is tied to.
        motion: What moves the wheels.
        emergency_stop: The operator's stop.
        on_stop: Called when the operator stops the robot: the safety layer hears of it first.
        on_resume: Called when the operator lets it go on; why it cannot, or nothing.
        on_failed_turn: Called with the reason when a turn has failed of which the model hears nothing.
        service_timeout_s: When the executor takes a call for failed; None: never.
        clock: What the time is, in seconds.
    """

    def __init__(
        self,
        ties: Ties,
        motion: Motion,
        emergency_stop: EmergencyStop,
        on_stop: Callable[[], None],
        on_resume: Callable[[], str],
        on_failed_turn: Callable[[str], None],
        service_timeout_s: float | None,
        clock: Callable[[], float],
    ) -> None:
        self._ties = ties
        self._motion = motion
        self._emergency_stop = emergency_stop
        self._on_stop = on_stop
        self._on_resume = on_resume
        self._on_failed_turn = on_failed_turn
        self._service_timeout_s = math.inf if service_timeout_s is None else service_timeout_s
        self._clock = clock
        self._by_name = {item.name: item for item in ties.communications}
        self._by_identifier = {item.identifier: item for item in reversed(ties.communications)}
        self._owed: deque[Callable[[Supervised], None]] = deque()
        self._turn: _Turn | None = None
        self._buttons: Mapping[str, bool] = {}

    def begin(self) -> None:
        """A new run of an executor: what an earlier one asked for is none of its business."""
        self._owed.clear()
        self._turn = None

    # The executor's side.

    def prepare(self, communication: str, data: Any) -> Any:
        """The request itself: plain data, whose numbers must be finite.

        Raises:
            DataDoesNotFit: One is not.
        """
        for number in _numbers(data):
            if not math.isfinite(number):
                raise DataDoesNotFit(f"'{communication}' has a number that is not finite")
        return data

    def is_default(self, communication: str, message: Any) -> bool:
        """Whether every part is zero, empty or left out."""
        return _is_default(message)

    def publish(self, communication: str, message: Any) -> None:
        """Do what a message asks for."""
        item = self._by_name[communication]
        match self._ties.channels[communication]:
            case channels.DriveChannel():
                self._end_turn("another motion was asked for", is_own=True)
                self._motion.drive(_velocity(message), self._clock())
            case channels.StopChannel():
                self._stop()
            case channels.RotateChannel() as channel:
                self._end_turn("another turn was asked for", is_own=True)
                self._begin_turn(_Turn(item, channel, None), message)
            case channels.LogChannel():
                _log.info("%s: %s", item.identifier, message)
            case _:
                pass  # `none`: dropped on purpose.

    def publish_default(self, identifier: str) -> None:
        """The all-default message: on the drive, a standstill, which a turn by an angle does not mind."""
        match self._ties.channels[self._by_identifier[identifier].name]:
            case channels.DriveChannel():
                if not self._motion.is_turning:
                    self._motion.stop(self._clock())
            case channels.StopChannel() | channels.RotateChannel():
                self._stop()
            case channels.LogChannel():
                _log.info("%s: default", identifier)
            case _:
                pass  # `none`: dropped on purpose.

    def call(self, communication: str, request_id: int, message: Any) -> None:
        """Do what a service is called for."""
        item = self._by_name[communication]
        match self._ties.channels[communication]:
            case channels.StopChannel():
                self._stop()
                self._owed.append(lambda executor: executor.on_reply(request_id, _done("")))
            case channels.RotateChannel() as channel if self._turn is None:
                # Before the executor believes that it failed, it must have.
                end_s = self._clock() + self._service_timeout_s * _SERVICE_SHARE
                self._begin_turn(_Turn(item, channel, request_id, end_s), message)
            case _:
                self._owed.append(lambda executor: executor.on_call_failed(request_id, "another turn is under way"))

    def send_goal(self, communication: str, goal_id: int, message: Any) -> None:
        """Begin what an action is asked for."""
        item = self._by_name[communication]
        channel = self._ties.channels[communication]
        if isinstance(channel, channels.RotateChannel) and self._turn is None:
            self._owed.append(lambda executor: executor.on_goal_accepted(goal_id))
            self._begin_turn(_Turn(item, channel, goal_id), message)
        else:
            self._owed.append(lambda executor: executor.on_goal_ended(goal_id, "rejected"))

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        """End a turn that an action asked for."""
        turn = self._turn
        if turn is not None and turn.number == goal_id and turn.asked.name == communication:
            self._turn = None
            self._motion.stop(self._clock(), "it was cancelled")
            self._owed.append(lambda executor: executor.on_goal_ended(goal_id, "cancelled"))

    def stop(self, reason: str, executor: Supervised | None) -> None:
        """Stand still; a turn under way has failed."""
        self._end_turn(reason)
        self._motion.stop(self._clock(), reason)
        if executor is not None:
            self.settle(executor)

    def _stop(self) -> None:
        self._end_turn("the robot was told to stop", is_own=True)
        self._motion.stop(self._clock())

    def _begin_turn(self, turn: _Turn, message: Any) -> None:
        angle = _angle(message) * (1.0 if turn.channel.direction == "left" else -1.0)
        self._turn = turn
        self._motion.turn(math.radians(angle) if turn.channel.unit == "degrees" else angle, self._clock())

    def _end_turn(self, reason: str, *, is_own: bool = False) -> None:
        """End a turn; `is_own`: because the model itself asked for another motion, so that it knows."""
        if self._turn is not None:
            self._motion.stop(self._clock(), reason)
            self._look_at_turn(is_own=is_own)

    # The devices' side.

    def saw_drive(self, reading: DriveReading, executor: Supervised) -> None:
        """The drive base told something: buttons first, then where the robot is."""
        self._motion.saw(reading)
        self._saw_buttons(reading.buttons, executor)
        for identifier, channel in self._told((channels.OdometryChannel, channels.ImuChannel, channels.BatteryChannel)):
            match channel:
                case channels.OdometryChannel():
                    executor.receive(identifier, odometry_data(reading))
                case channels.ImuChannel():
                    executor.receive(identifier, imu_data(reading))
                case channels.BatteryChannel(unit=unit):
                    executor.receive(identifier, battery_data(reading, is_percent=unit == "percent"))
        self.settle(executor)

    def watch_buttons(self, buttons: Mapping[str, bool]) -> None:
        """Heed the operator's buttons while no supervisor is executed."""
        held = [name for name, is_held in buttons.items() if is_held]
        self._saw_stop(self._emergency_stop.update(held_buttons=held), None)
        # What was pressed meanwhile is no event for the next run, but bumpers are told at its start.
        self._buttons = {}

    # The operator's side.

    @property
    def is_stopped(self) -> bool:
        """Whether the operator has stopped the robot, and not let it go on since."""
        return self._emergency_stop.is_stopped

    def stop_remotely(self, executor: Supervised | None) -> None:
        """The operator has stopped the robot from elsewhere."""
        self._saw_stop(self._emergency_stop.update(remote=StopEvent.STOP), executor)
        if executor is not None:
            self.settle(executor)

    def resume_remotely(self, executor: Supervised | None) -> str:
        """The operator lets it go on from elsewhere; why it cannot."""
        if not self._emergency_stop.is_stopped:
            return "no operator has stopped the robot"
        event = self._emergency_stop.update(remote=StopEvent.RESUME)
        why = self._saw_stop(event, executor) if event is not None else STOP_HELD
        if executor is not None:
            self.settle(executor)
        return why

    def tell_stop(self, executor: Supervised) -> None:
        """A new run has begun: a stop from before it still holds."""
        if self._emergency_stop.is_stopped:
            self._tell_stop(StopEvent.STOP, executor)

    @property
    def is_stop_held(self) -> bool:
        """Whether a button that stops the robot is pressed."""
        return self._emergency_stop.is_held

    def forget_stop(self) -> None:
        """Everything is reset."""
        self._emergency_stop.is_stopped = False

    def saw_scan(self, scan: Scan, executor: Supervised) -> None:
        """A full turn of the LiDAR."""
        data = scan_data(scan)
        for identifier, _ in self._told((channels.ScannerChannel,)):
            executor.receive(identifier, data)
        self.settle(executor)

    def saw_device(self, device: Device, text: str, executor: Supervised, *, is_lost: bool) -> None:
        """A device is lost, or back again."""
        event = "lost" if is_lost else "back"
        for identifier, channel in self._told((channels.FaultChannel,)):
            if not isinstance(channel, channels.FaultChannel):
                continue
            if channel.event == event and channel.device in (str(device), "any"):
                executor.receive(identifier, shaped(self._by_identifier[identifier], text))
        if is_lost and device is Device.DRIVE:
            self._end_turn("the drive base is lost")
        self.settle(executor)

    def saw_key(self, key: str, executor: Supervised | None) -> None:
        """A key was typed in the terminal."""
        self._saw_stop(self._emergency_stop.update(keys=(key,)), executor)
        if executor is None:
            return
        for identifier, channel in self._told((channels.KeyChannel,)):
            if isinstance(channel, channels.KeyChannel) and channel.key == key:
                executor.receive(identifier, None)
        self.settle(executor)

    def settle(self, executor: Supervised) -> None:
        """Tell the executor what has become of its requests."""
        self._look_at_turn()
        while self._owed:
            self._owed.popleft()(executor)
            self._look_at_turn()

    def _saw_buttons(self, buttons: Mapping[str, bool], executor: Supervised) -> None:
        before, self._buttons = self._buttons, dict(buttons)
        held = [name for name, is_held in buttons.items() if is_held]
        self._saw_stop(self._emergency_stop.update(held_buttons=held), executor)
        for identifier, channel in self._told((channels.ButtonChannel, channels.BumperChannel)):
            item = self._by_identifier[identifier]
            match channel:
                case channels.ButtonChannel(name=name, on=on):
                    was, is_held = before.get(name, False), buttons.get(name, False)
                    is_meant = {"press": is_held, "release": not is_held, "change": True}[on]
                    if was != is_held and is_meant:
                        executor.receive(identifier, shaped(item, is_held))
                case channels.BumperChannel(side=side):
                    names = _BUMPERS[side]
                    touched = any(buttons.get(name, False) for name in names)
                    if not before or touched != any(before.get(name, False) for name in names):
                        executor.receive(identifier, shaped(item, touched))

    def _saw_stop(self, event: StopEvent | None, executor: Supervised | None) -> str:
        """The operator did something; why it has no effect."""
        if event is StopEvent.STOP:
            self._on_stop()
        why = self._on_resume() if event is StopEvent.RESUME else ""
        if why:
            self._emergency_stop.is_stopped = True
        elif executor is not None and event is not None:
            self._tell_stop(event, executor)
        return why

    def _tell_stop(self, event: StopEvent, executor: Supervised) -> None:
        for identifier, channel in self._told((channels.EmergencyStopChannel,)):
            if isinstance(channel, channels.EmergencyStopChannel) and channel.event == event:
                executor.receive(identifier, None)

    def _told(self, kinds: tuple[type[channels.Channel], ...]) -> Iterator[tuple[str, channels.Channel]]:
        """Identifier and channel of what is told on channels of some kinds, each identifier once."""
        seen = set()
        for item in self._ties.communications:
            channel = self._ties.channels[item.name]
            is_told = item.kind is CommunicationKind.OUTGOING_MESSAGE and isinstance(channel, kinds)
            if is_told and item.identifier not in seen:
                seen.add(item.identifier)
                yield item.identifier, channel

    def _look_at_turn(self, *, is_own: bool = False) -> None:
        """Whether a turn has ended: who asked for it is told so, later."""
        turn = self._turn
        if turn is not None and self._motion.is_turning and self._clock() >= turn.end_s:
            self._motion.stop(self._clock(), "the turn takes longer than a call may")
        if turn is None or self._motion.is_turning:
            return
        self._turn = None
        has_arrived, reason, number = self._motion.has_arrived, self._motion.reason, turn.number
        if not has_arrived:
            _log.warning("the turn asked for by %s has failed: %s", turn.asked.identifier, reason)
        if number is None:
            told = len(self._owed)
            outcomes = ("done", "any") if has_arrived else ("failed", "any")
            for identifier, channel in self._told((channels.RotatedChannel,)):
                if isinstance(channel, channels.RotatedChannel) and channel.outcome in outcomes:
                    self._owed.append(lambda executor, name=identifier: executor.receive(name, None))  # type: ignore[misc]
            if not has_arrived and not is_own and len(self._owed) == told:
                self._on_failed_turn(reason)
        elif turn.asked.kind is CommunicationKind.ACTION:
            outcome = "succeeded" if has_arrived else "aborted"
            self._owed.append(lambda executor: executor.on_goal_ended(number, outcome, _done(reason)))
        elif has_arrived:
            self._owed.append(lambda executor: executor.on_reply(number, _done("")))
        else:
            self._owed.append(lambda executor: executor.on_call_failed(number, reason))

    def report_turn(self, executor: Supervised) -> None:
        """Tell how far a turn is that an action asked for."""
        turn = self._turn
        if turn is not None and turn.number is not None and turn.asked.kind is CommunicationKind.ACTION:
            left = self._motion.remaining_rad * (1.0 if turn.channel.direction == "left" else -1.0)
            left = math.degrees(left) if turn.channel.unit == "degrees" else left
            feedback = turn.asked.feedback
            executor.on_feedback(turn.number, {"remaining": left} if hasattr(feedback, "name") else left)


def _done(reason: str) -> dict[str, Any]:
    return {"success": not reason, "message": reason}


def _velocity(message: Any) -> Velocity:
    twist = message if isinstance(message, dict) else {}
    twist = twist.get("twist", twist) or {}
    linear, angular = twist.get("linear") or {}, twist.get("angular") or {}
    return Velocity(float(linear.get("x") or 0.0), float(angular.get("z") or 0.0))


def _angle(message: Any) -> float:
    if isinstance(message, dict):
        message = message.get("data", message.get("angle"))
    return float(message or 0.0)


def _numbers(data: Any) -> Iterator[float]:
    if isinstance(data, dict):
        for part in data.values():
            yield from _numbers(part)
    elif isinstance(data, list | tuple):
        for part in data:
            yield from _numbers(part)
    elif isinstance(data, float):
        yield data


def _is_default(data: Any) -> bool:
    if isinstance(data, dict):
        return all(_is_default(part) for part in data.values())
    return not data
