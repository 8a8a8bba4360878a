"""The executor's interface to the robot: requests go to channels, readings of devices come from them.

Immediate consequences of a request, such as a rotation that fails, reach the executor later, in `deliver_pending`,
because the executor must not be called while it is at work.
"""

import logging
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from robosc_bridge.configuration import channels
from robosc_bridge.configuration.channel_mapping import ChannelMapping
from robosc_bridge.daemon.channel_data import (
    battery_data,
    finite,
    imu_data,
    is_default,
    odometry_data,
    scan_data,
    shaped,
    velocity_of,
)
from robosc_bridge.daemon.executor_inputs import Listeners, Supervised
from robosc_bridge.daemon.programs.channel import ProgramChannel
from robosc_bridge.daemon.robot.motion import MotionTarget
from robosc_bridge.daemon.robot.rotations import Rotations, service_response
from robosc_bridge.daemon.robot.stop_switch import StopSwitch
from robosc_bridge.daemon.threads.reports import Device, Sighting
from robosc_bridge.devices.interface import DriveReading, Scan

_log = logging.getLogger(__name__)

_BUMPERS = {"front": ("bumper_1",), "back": ("bumper_2",), "any": ("bumper_1", "bumper_2")}


class RobotAdapter:
    """The executor's middleware.

    Args:
        mapping: Channel that each communication of the model is mapped to.
        listeners: Identifiers that each kind of channel reports to.
        motion: Motion of the wheels.
        switch: The operator's stop.
        program_channel: Exchange with programs on the other side of a remote endpoint.
        on_failed_rotation: Function that is called with the reason of a failed rotation, if the model gets no message
            of it.
        service_timeout_s: Time after which a call fails for the executor, in seconds; None: never.
        clock: Clock that returns the time, in seconds.
    """

    def __init__(
        self,
        mapping: ChannelMapping,
        listeners: Listeners,
        motion: MotionTarget,
        switch: StopSwitch,
        program_channel: ProgramChannel,
        on_failed_rotation: Callable[[str], None],
        service_timeout_s: float | None,
        clock: Callable[[], float],
    ) -> None:
        self._channels = mapping.channels
        self._listeners = listeners
        self._motion = motion
        self._switch = switch
        self._program_channel = program_channel
        self._clock = clock
        self._by_name = {item.name: item for item in mapping.communications}
        self._by_identifier = {item.identifier: item for item in reversed(mapping.communications)}
        self._pending: deque[Callable[[Supervised], None]] = deque()
        # Calls to stop, which are answered when the wheels stand.
        self._stops: list[int] = []
        self._rotations = Rotations(
            motion, listeners, self._pending.append, on_failed_rotation, service_timeout_s, clock
        )
        self._buttons: Mapping[str, bool] = {}

    def forget(self) -> None:
        """Forget the requests of the last run, when a run of the executor ends or a new one begins."""
        self._pending.clear()
        self._stops.clear()
        self._rotations.forget()
        self._program_channel.forget()

    # The executor's side.

    def prepare(self, communication: str, data: Any) -> Any:
        """Return the data of a request, whose numbers must be finite.

        Raises:
            DataDoesNotFit: A number is not finite.
        """
        return finite(communication, data)

    def is_default(self, communication: str, message: Any) -> bool:
        """Return True if every part is zero, empty or left out."""
        return is_default(message)

    def publish(self, communication: str, message: Any) -> None:
        """Carry out a message of the supervisor on its channel."""
        item = self._by_name[communication]
        match self._channels[communication]:
            case channels.DriveChannel():
                self._rotations.end("another motion was asked for", is_own=True, at_once=True)
                self._motion.drive(velocity_of(message), self._clock())
            case channels.StopChannel():
                self._stop()
            case channels.RotateChannel() as channel:
                self._rotations.end("another rotation was asked for", is_own=True, at_once=True)
                self._rotations.begin(item, channel, None, message)
            case channels.GrpcChannel():
                self._program_channel.send(item, message)
            case channels.LogChannel():
                _log.info("%s: %.1000r", item.identifier, message)
            case _:
                pass  # `none`: dropped on purpose.

    def publish_default(self, identifier: str) -> None:
        """Carry out the all-default message: on the drive a standstill, which does not end a rotation by an angle."""
        item = self._by_identifier[identifier]
        match self._channels[item.name]:
            case channels.DriveChannel():
                if not self._motion.is_rotating:
                    self._motion.stop(self._clock())
            case channels.StopChannel() | channels.RotateChannel():
                self._stop()
            case channels.GrpcChannel():
                self._program_channel.send(item, None)
            case channels.LogChannel():
                _log.info("%s: default", identifier)
            case _:
                pass  # `none`: dropped on purpose.

    def call(self, communication: str, request_id: int, message: Any) -> None:
        """Carry out a call of a service on its channel."""
        item = self._by_name[communication]
        match self._channels[communication]:
            case channels.StopChannel():
                self._stop()
                self._stops.append(request_id)
            case channels.RotateChannel() as channel if not self._rotations.is_under_way:
                self._rotations.begin(item, channel, request_id, message)
            case channels.GrpcChannel():
                why = self._program_channel.call(item, request_id, message)
                if why:
                    self._pending.append(lambda executor: executor.on_call_failed(request_id, why))
            case _:
                self._pending.append(
                    lambda executor: executor.on_call_failed(request_id, "another rotation is under way")
                )

    def send_goal(self, communication: str, goal_id: int, message: Any) -> None:
        """Begin the action of a goal on its channel."""
        item = self._by_name[communication]
        match self._channels[communication]:
            case channels.RotateChannel() as channel if not self._rotations.is_under_way:
                self._pending.append(lambda executor: executor.on_goal_accepted(goal_id))
                self._rotations.begin(item, channel, goal_id, message)
            case channels.GrpcChannel() if self._program_channel.send_goal(item, goal_id, message):
                pass
            case _:
                self._pending.append(lambda executor: executor.on_goal_ended(goal_id, "rejected"))

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        """End the action of a goal."""
        if isinstance(self._channels[communication], channels.GrpcChannel):
            self._program_channel.cancel(goal_id)
        else:
            self._rotations.cancel(communication, goal_id)

    def stop(self, reason: str) -> None:
        """Stand still; a rotation under way has failed."""
        self._rotations.end(reason)
        self._motion.stop(self._clock(), reason)

    def abandon(self, communication: str, reason: str) -> None:
        """End a motion whose requester is gone."""
        if self._rotations.asked_by == communication:
            self._rotations.end(reason, is_own=True)

    def _stop(self) -> None:
        self._rotations.end("the robot was commanded to stop", is_own=True)
        self._motion.stop(self._clock())

    # The devices' side.

    def on_drive_reading(self, reading: DriveReading, executor: Supervised) -> None:
        """Pass on a reading of the drive base: the buttons first, then the position."""
        self._motion.on_drive_reading(reading)
        self._saw_buttons(reading.buttons, executor)
        for identifier, _ in self._listeners.of(channels.OdometryChannel):
            executor.receive(identifier, odometry_data(reading))
        for identifier, _ in self._listeners.of(channels.ImuChannel):
            executor.receive(identifier, imu_data(reading))
        for identifier, battery in self._listeners.of(channels.BatteryChannel):
            executor.receive(identifier, battery_data(reading, is_percent=battery.unit == "percent"))
        self.deliver_pending(executor)

    def watch_buttons(self, buttons: Mapping[str, bool]) -> None:
        """Handle the operator's buttons while no supervisor is executed."""
        self._switch.on_buttons([name for name, is_held in buttons.items() if is_held], None)
        # Buttons pressed meanwhile are no events of the next run, but the state of bumpers is sent at its start.
        self._buttons = {}

    def on_scan(self, scan: Scan, executor: Supervised) -> None:
        """Pass on a full revolution of the LiDAR."""
        for identifier, _ in self._listeners.of(channels.ScannerChannel):
            executor.receive(identifier, scan_data(scan))
        self.deliver_pending(executor)

    def on_line(self, sighting: Sighting, executor: Supervised) -> None:
        """Pass on whether the camera shows the line, and where."""
        correction = sighting.correction_rad_s
        kind = channels.LineLostChannel if correction is None else channels.LineChannel
        for identifier, _ in self._listeners.of(kind):
            executor.receive(identifier, shaped(self._by_identifier[identifier], correction))
        self.deliver_pending(executor)

    def on_device_change(self, device: Device, text: str, executor: Supervised, *, is_lost: bool) -> None:
        """Report to the model that a device is lost, or back again."""
        event = "lost" if is_lost else "back"
        for identifier, channel in self._listeners.of(channels.FaultChannel):
            if channel.event == event and channel.device in (str(device), "any"):
                executor.receive(identifier, shaped(self._by_identifier[identifier], text))
        if is_lost and device is Device.DRIVE:
            self._rotations.end("the drive base is lost", at_once=True)

    def on_key(self, key: str, executor: Supervised) -> None:
        """Handle a key that was typed in the terminal."""
        for identifier, channel in self._listeners.of(channels.KeyChannel):
            if channel.key == key:
                executor.receive(identifier, None)
        self.deliver_pending(executor)

    def deliver_pending(self, executor: Supervised) -> None:
        """Report the outcomes of its requests to the executor."""
        self._rotations.poll()
        if not self._motion.is_braking:
            stops, self._stops = self._stops, []
            for number in stops:
                executor.on_reply(number, service_response(""))
        while self._pending:
            self._pending.popleft()(executor)
            self._rotations.poll()

    def report_rotation(self, executor: Supervised) -> None:
        """Send the feedback of the rotation under way, if an action requested it."""
        self._rotations.report(executor)

    def _saw_buttons(self, buttons: Mapping[str, bool], executor: Supervised) -> None:
        before, self._buttons = self._buttons, dict(buttons)
        self._switch.on_buttons([name for name, is_held in buttons.items() if is_held], executor)
        for identifier, button in self._listeners.of(channels.ButtonChannel):
            was, is_held = before.get(button.name, False), buttons.get(button.name, False)
            is_meant = {"press": is_held, "release": not is_held, "change": True}[button.on]
            if was != is_held and is_meant:
                executor.receive(identifier, shaped(self._by_identifier[identifier], is_held))
        for identifier, bumper in self._listeners.of(channels.BumperChannel):
            names = _BUMPERS[bumper.side]
            touched = any(buttons.get(name, False) for name in names)
            if not before or touched != any(before.get(name, False) for name in names):
                executor.receive(identifier, shaped(self._by_identifier[identifier], touched))
