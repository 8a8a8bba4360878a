"""The loop: executes the supervisor at its period, between what devices tell and what the safety layer lets through.

One thread runs it and calls the executor; the devices' threads and signal handlers only put something into its inbox.
"""

import logging
import queue
from collections.abc import Callable
from dataclasses import dataclass

from robosc.execution.clock import Clock
from robosc.execution.event_log import EventLog
from robosc.execution.executor import Executor
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.settings import Settings
from robosc.supervisor import Supervisor
from robosc_bridge.configuration.ties import Ties
from robosc_bridge.daemon.motion import Motion
from robosc_bridge.daemon.reports import Device, DeviceDown, DeviceUp, Report, ResetDone, SafetyNotice, Sighting
from robosc_bridge.daemon.robot import Robot
from robosc_bridge.daemon.states import Command, State
from robosc_bridge.devices.interface import DriveReading, Scan, Velocity
from robosc_bridge.safety import LATCHING, Reason, SafetyLayer
from robosc_bridge.skills import EmergencyStop, Rotate

_log = logging.getLogger(__name__)

STOP_LIMIT_S = 3.0
"""How long the motors may take to let go."""


# They end by themselves, and belong to every start and stop.
_ORDINARY = frozenset({Reason.STANDBY, Reason.TORQUE_AWAITED, Reason.COMMAND_SILENT})
# An operator's stop is no fault; what is wrong with the supervisor is told by itself.
_GRAVE = frozenset(LATCHING) - {Reason.OPERATOR_STOP, Reason.SUPERVISOR_FAULT}


@dataclass(frozen=True)
class Key:
    """A key was typed in the terminal."""

    key: str


@dataclass(frozen=True)
class Job:
    """What is executed.

    Attributes:
        supervisor: Of the deployment `controller`.
        ties: What its communications are tied to.
        settings: Of the executor.
        needs_scanner: Whether a LiDAR must be there before it starts.
        needs_camera: Whether a camera must.
        starts_itself: Whether it starts as soon as the devices are there; else it stays in standby.
        stays_after_fault: Whether it waits for somebody to start it again after a fault; else it ends.
    """

    supervisor: Supervisor
    ties: Ties
    settings: Settings
    needs_scanner: bool
    starts_itself: bool
    stays_after_fault: bool = False
    needs_camera: bool = False


class Daemon:
    """The loop and its state.

    Args:
        job: What is executed.
        safety: Through which all motion passes.
        rotate: The skill that turns.
        emergency_stop: The operator's stop.
        clock: The only source of time.
        log: The executor's event log.

    Attributes:
        state: What it is doing.
        problem: The fault that has stopped it; empty: none.
        overruns: How many decisions came too late by a whole period, and were left out.
    """

    def __init__(
        self,
        job: Job,
        safety: SafetyLayer,
        rotate: Rotate,
        emergency_stop: EmergencyStop,
        clock: Clock,
        log: EventLog,
    ) -> None:
        self.state = State.STARTING
        self.problem = ""
        self.overruns = 0
        self._job = job
        self._safety = safety
        self._clock = clock
        self._log = log
        self._inbox: queue.SimpleQueue[Report | Command | Key] = queue.SimpleQueue()
        self._motion = Motion(rotate, self._command)
        self._robot = Robot(
            job.ties,
            self._motion,
            emergency_stop,
            self._operator_stop,
            self._operator_resume,
            self._turn_failed,
            job.settings.service_timeout_s,
            clock.monotonic,
        )
        self._executor: Executor | None = None
        self._due_s = clock.monotonic()
        self._wish = Velocity()
        self._is_up = {
            Device.DRIVE: False,
            Device.SCANNER: not job.needs_scanner,
            Device.CAMERA: not job.needs_camera,
        }
        self._awaited: tuple[Device, ...] = ()
        self._scan: Scan | None = None
        self._has_torque = False
        self._stop_end_s = 0.0
        self._after_stop = State.STANDBY
        self._hurry: Callable[[], None] = lambda: None
        self._reset_drive: Callable[[], None] = lambda: None
        self._are_alive: Callable[[], bool] = lambda: True
        self._is_drive_lost = False
        self._failed_turn = ""

    def connect(
        self, hurry: Callable[[], None], reset_drive: Callable[[], None], are_alive: Callable[[], bool]
    ) -> None:
        """Tell how the drive base's thread is told to hurry and to reset its motors, and whether all threads live."""
        self._hurry = hurry
        self._reset_drive = reset_drive
        self._are_alive = are_alive

    def post(self, item: Report | Command | Key) -> None:
        """Tell the loop something; from any thread or signal handler, never waits."""
        if item in (Command.STOP, Command.QUIT):
            # These do not wait for the loop's turn.
            self._safety.operator_stop() if item is Command.STOP else self._safety.disable()
            self._hurry()
        self._inbox.put(item)

    def run(self) -> None:
        """Take turns until somebody wants it to end."""
        while self.state is not State.OVER:
            try:
                item = self._inbox.get(timeout=max(self._due_s - self._clock.monotonic(), 0.0))
            except queue.Empty:
                self.turn()
            else:
                self.turn(item)

    def turn(self, *items: Report | Command | Key) -> None:
        """Handle what has come, and decide if it is time."""
        now_s = self._clock.monotonic()
        self._safety.loop_turned(now_s)
        for item in items:
            self._handle(item)
        while True:
            try:
                self._handle(self._inbox.get_nowait())
            except queue.Empty:
                break
        now_s = self._clock.monotonic()
        if now_s >= self._due_s:
            self._decide(now_s)
        self._look_at_state(now_s)
        if self.state is State.RUNNING and self._executor is not None:
            # In a safe stop nothing moves, whatever identifiers are released.
            self._motion.pause(bool(self._executor.reasons), now_s)
            self._motion.refresh(now_s)

    def _decide(self, now_s: float) -> None:
        if self._executor is not None:
            self._executor.tick()
            self._robot.settle(self._executor)
            self._robot.report_turn(self._executor)
        period_s = self._job.settings.period_s
        self._due_s += period_s
        if self._due_s <= now_s:
            missed = int((now_s - self._due_s) / period_s) + 1
            self.overruns += missed if self.state is State.RUNNING else 0
            self._due_s += missed * period_s

    def _handle(self, item: Report | Command | Key) -> None:
        match item:
            case DriveReading():
                self._has_torque = item.is_torque_on
                if self._executor is not None:
                    self._robot.saw_drive(item, self._executor)
                else:
                    self._robot.watch_buttons(item.buttons)
            case Scan():
                self._scan = item
                if self._executor is not None:
                    self._robot.saw_scan(item, self._executor)
            case Sighting():
                if self._executor is not None:
                    self._robot.saw_line(item, self._executor)
            case DeviceUp(device):
                self._device_came(device)
            case DeviceDown():
                self._device_went(item)
            case SafetyNotice():
                self._heed(item)
            case ResetDone(problem):
                _log.log(logging.ERROR if problem else logging.INFO, "reset: %s", problem or "done")
            case Key(key):
                if self._executor is not None:
                    self._robot.saw_key(key, self._executor)
            case Command():
                self._obey(item)

    def _device_came(self, device: Device) -> None:
        _log.info("the %s is there", device)
        was_up, self._is_up[device] = self._is_up[device], True
        if self._executor is not None and not was_up:
            self._robot.saw_device(device, f"the {device} is back", self._executor, is_lost=False)
        if device is Device.DRIVE and self.state is State.FAULT and self._is_drive_lost:
            # Nothing moves before somebody says so.
            self._is_drive_lost = False
            self.problem = ""
            self.state = State.STANDBY

    def _device_went(self, report: DeviceDown) -> None:
        was_up, self._is_up[report.device] = self._is_up[report.device], False
        if report.is_first:
            _log.error("%s: %s", report.device, report.problem)
        if report.device is Device.SCANNER:
            self._scan = None
        if report.device is Device.DRIVE:
            self._has_torque = False
        if self._executor is None or not was_up:
            return
        self._robot.saw_device(report.device, report.problem, self._executor, is_lost=True)
        if report.device is Device.DRIVE:
            self._is_drive_lost = True
            self._fault(f"the drive base is lost: {report.problem}")

    def _heed(self, notice: SafetyNotice) -> None:
        """Tell a person why nothing moves; what only a person can end ends the run."""
        for warning in notice.warnings:
            _log.warning("%s", warning)
        for reason in notice.reasons:
            # Before the start, nothing has told anything yet.
            is_news = self.state is State.RUNNING and reason not in _ORDINARY
            _log.log(logging.WARNING if is_news else logging.DEBUG, "%s", reason)
        grave = [reason for reason in notice.reasons if reason in _GRAVE]
        if grave and self.state is State.RUNNING:
            self._fault(" ".join(grave))

    def _obey(self, command: Command) -> None:
        match command:
            case Command.START if self.state is State.STANDBY:
                self._begin()
            case Command.STOP:
                self._robot.stop("the operator has stopped the robot", self._executor)
            case Command.STANDBY if self.state in (State.RUNNING, State.FAULT):
                self._end("standby", State.STANDBY)
            case Command.QUIT if self.state is not State.STOPPING or self._after_stop is not State.OVER:
                self._end("the bridge ends", State.OVER)
            case Command.RESET:
                self._reset()
            case _:
                pass  # They mean nothing in this state.

    def _reset(self) -> None:
        remaining = self._safety.reset()
        if remaining:
            _log.error("reset: %s", " ".join(remaining))
            return
        self._reset_drive()
        if self.state in (State.RUNNING, State.FAULT):
            self._end("reset", State.STANDBY)

    def _begin(self) -> None:
        job = self._job
        self._executor = Executor(InterpretedSystem(job.supervisor), self._robot, job.settings, self._clock, self._log)
        self._due_s = self._clock.monotonic()
        self.problem = ""
        self.state = State.RUNNING
        self._safety.enable()
        self._robot.begin()
        self._executor.start()
        if self._scan is not None:
            # It must not decide on nothing while the last one is at hand.
            self._robot.saw_scan(self._scan, self._executor)
        _log.info("running")

    def _end(self, reason: str, then: State) -> None:
        """Bring the robot to rest; `then` follows once the motors have let go."""
        if self._executor is not None:
            self._executor.stop(reason)
        self._motion.stop(self._clock.monotonic(), reason)
        self._safety.disable()
        self._hurry()
        self.state, self._after_stop = State.STOPPING, then
        self._stop_end_s = self._clock.monotonic() + STOP_LIMIT_S

    def _fault(self, problem: str) -> None:
        _log.error("%s", problem)
        self._end(problem, State.FAULT if self._job.stays_after_fault else State.OVER)
        self.problem = problem

    def _look_at_state(self, now_s: float) -> None:
        if self.state is State.RUNNING and not self._are_alive():
            self._fault("a device's thread has ended")
        if self._failed_turn and self.state is State.RUNNING:
            self._fault(f"a turn has failed, and no message of the model tells it so: {self._failed_turn}")
        self._failed_turn = ""
        if self.state is State.STARTING:
            self._tell_what_is_awaited()
        match self.state:
            case State.STARTING if all(self._is_up.values()) and (self._scan or not self._job.needs_scanner):
                self.state = State.STANDBY
                _log.info("standby")
                if self._job.starts_itself:
                    self._begin()
            case State.RUNNING if self._executor is not None and self._executor.is_faulty:
                self._safety.supervisor_fault()
                self._fault("; ".join(self._executor.reasons))
            case State.STOPPING if not self._has_torque or not self._is_up[Device.DRIVE] or now_s >= self._stop_end_s:
                if self._has_torque and self._is_up[Device.DRIVE]:
                    self.problem = self.problem or f"the motors have not let go within {STOP_LIMIT_S:g} s"
                    _log.error("%s", self.problem)
                self._executor = None
                self.state = self._after_stop
                _log.info("%s", self.state)

    def _tell_what_is_awaited(self) -> None:
        awaited = tuple(device for device, is_up in self._is_up.items() if not is_up)
        if awaited and awaited != self._awaited:
            _log.info("waiting for the %s", " and the ".join(awaited))
        self._awaited = awaited

    def _command(self, velocity: Velocity, now_s: float) -> None:
        self._safety.command(velocity, now_s)
        if velocity != self._wish:
            self._wish = velocity
            self._hurry()

    def _operator_stop(self) -> None:
        self._safety.operator_stop()
        self._hurry()
        # What was wanted before does not move the robot afterwards.
        self._robot.stop("the operator has stopped the robot", None)

    def _operator_resume(self) -> bool:
        remaining = self._safety.reset()
        if remaining:
            _log.error("the robot cannot go on: %s", " ".join(remaining))
        elif self.state is State.RUNNING:
            self._safety.enable()
        return not remaining

    def _turn_failed(self, reason: str) -> None:
        self._failed_turn = reason or "it was ended"
