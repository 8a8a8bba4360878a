"""The loop: executes the supervisor at its period, between the devices' reports and the safety layer.

One thread runs the loop and calls the executor; the devices' threads, remote endpoints and signal handlers only put
items into its inbox.
"""

import logging
import queue
from collections.abc import Callable
from dataclasses import dataclass
from typing import assert_never

from robosc.execution.runtime.clock import Clock
from robosc.execution.runtime.event_log import EventLog
from robosc_bridge.daemon.execution import Execution, Job
from robosc_bridge.daemon.executor_inputs import Listeners
from robosc_bridge.daemon.feed import Feed, WatchedLog
from robosc_bridge.daemon.lifecycle import OVER, Lifecycle
from robosc_bridge.daemon.orders import HALTS, Orders, answer, unanswered
from robosc_bridge.daemon.program_dispatcher import ProgramDispatcher
from robosc_bridge.daemon.programs.channel import ProgramChannel
from robosc_bridge.daemon.programs.inbox import ProgramInbox
from robosc_bridge.daemon.programs.items import Clients, FromProgram
from robosc_bridge.daemon.programs.request_checker import RequestChecker
from robosc_bridge.daemon.programs.requesters import Requesters
from robosc_bridge.daemon.readiness import Readiness
from robosc_bridge.daemon.robot.adapter import RobotAdapter
from robosc_bridge.daemon.robot.motion import MotionTarget
from robosc_bridge.daemon.robot.stop_switch import StopSwitch
from robosc_bridge.daemon.snapshots import Snapshots
from robosc_bridge.daemon.states import OperatorCommand, Order, State
from robosc_bridge.daemon.threads.reports import DeviceDown, DeviceUp, Report, ResetDone, SafetyNotice, Sighting
from robosc_bridge.daemon.timing import Timing
from robosc_bridge.devices.interface import STANDSTILL, DriveReading, Scan, Velocity
from robosc_bridge.host import Queue
from robosc_bridge.safety import SafetyLayer
from robosc_bridge.skills import EmergencyStop, Rotate

_log = logging.getLogger(__name__)

PROGRAM_SHARE = 50
"""Maximum number of items from programs that are taken up in one cycle."""

PROGRAM_SHARE_S = 0.002
"""After how long in one cycle no more of it is taken up; one of it is in any case."""


@dataclass(frozen=True)
class Key:
    """A key was pressed in the terminal."""

    key: str


@dataclass(frozen=True)
class _Woken:
    """Programs have sent something."""


Item = Report | Order | Key | _Woken


class Daemon:
    """The loop.

    Args:
        job: Job that is executed.
        safety: Safety layer through which all motion passes.
        rotate: The skill that rotates.
        emergency_stop: The operator's stop.
        clock: The only source of time.
        log: The executor's event log.
        feed: Feed for watchers; None: there are no watchers.
        inbox: Queue that the loop waits at; None: one of this computer.
        timing: Measurement of the bridge's times; None: one of its own.
    """

    def __init__(
        self,
        job: Job,
        safety: SafetyLayer,
        rotate: Rotate,
        emergency_stop: EmergencyStop,
        clock: Clock,
        log: EventLog,
        feed: Feed | None = None,
        inbox: Queue[Item] | None = None,
        timing: Timing | None = None,
    ) -> None:
        self._safety = safety
        self._clock = clock
        self._timing = timing or Timing(clock.monotonic)
        self.beat: Callable[[float], None] = lambda now_s: None
        feed = feed or Feed()
        self._inbox: Queue[Item] = queue.SimpleQueue() if inbox is None else inbox
        checker = RequestChecker(job.supervisor.model, job.mapping, is_layer=job.is_layer)
        self._from_programs = ProgramInbox(lambda: self._inbox.put(_Woken()), checker.check)
        self._orders = Orders()
        self._readiness = Readiness(needs_scanner=job.needs_scanner, needs_camera=job.needs_camera)
        self._lifecycle = lifecycle = Lifecycle(job, safety, self._readiness, self._orders, clock)
        listeners, clients = Listeners(job.mapping), Clients()
        program_channel = ProgramChannel(job.mapping, listeners, clients)
        self._switch = StopSwitch(emergency_stop, listeners, lifecycle.operator_stop, lifecycle.operator_resume)
        self._motion = MotionTarget(rotate, self._command)
        self._robot = RobotAdapter(
            job.mapping,
            listeners,
            self._motion,
            self._switch,
            program_channel,
            lifecycle.rotation_failed,
            job.settings.service_timeout_s,
            clock.monotonic,
        )
        requesters = Requesters(
            checker,
            clients,
            self._robot.abandon,
            job.settings.command_timeout_s,
            clock.monotonic,
        )
        self._execution = Execution(job, self._robot, requesters, clock, WatchedLog(log, feed))
        self._programs = ProgramDispatcher(clients, program_channel, requesters, self._execution, self._robot)
        self._snapshots = Snapshots(feed, self._execution, self._readiness, clock, self._timing.figures)
        lifecycle.attach(self._execution, self._robot, self._motion, self._switch, self._snapshots.note)
        self._wish = Velocity()
        # Taken out of the inbox, and not taken up to its end.
        self._in_hand: tuple[Item, ...] = ()
        self._hurry: Callable[[], None] = lambda: None

    # `beat` is called at the end of each cycle, with its time.

    @property
    def state(self) -> State:
        """State of the daemon."""
        return self._lifecycle.state

    @property
    def problem(self) -> str:
        """The fault that has stopped it; empty: none."""
        return self._lifecycle.problem

    @property
    def overruns(self) -> int:
        """Number of decisions that came too late by a whole period, and were left out."""
        return self._execution.overruns

    def connect(
        self, hurry: Callable[[], None], reset_drive: Callable[[], None], are_alive: Callable[[], bool]
    ) -> None:
        """Set the functions that wake the drive base's thread, reset its motors, and check that all threads live."""
        self._hurry = hurry
        self._lifecycle.connect(hurry, reset_drive, are_alive)

    def post(self, item: Report | Key | OperatorCommand | Order | FromProgram) -> None:
        """Put an item into the inbox of the loop; from any thread or signal handler, never waits."""
        if isinstance(item, FromProgram):
            self._from_programs.put(item)
            return
        if isinstance(item, OperatorCommand):
            item = Order(item, "", unanswered)
        if isinstance(item, Order) and item.command in HALTS:
            # These do not wait for the loop, and what came before them does not undo them.
            self._orders.halting(item)
            self._safety.operator_stop() if item.command is OperatorCommand.STOP else self._safety.disable()
            self._hurry()
        self._inbox.put(item)
        if self.state is State.OVER:
            self._drain()

    def run(self) -> None:
        """Run cycles until an order, a signal or a fault ends the loop."""
        try:
            while self.state is not State.OVER:
                try:
                    item = self._inbox.get(timeout=self._pause_s())
                except queue.Empty:
                    self.cycle()
                else:
                    self.cycle(item)
        finally:
            self._lifecycle.state = State.OVER
            self._close()

    def _pause_s(self) -> float:
        return max(self._execution.due_s - self._clock.monotonic(), 0.0) if self._from_programs.is_empty else 0.0

    def _close(self) -> None:
        """Answer all that wait, and close."""
        for item in self._in_hand:
            _refuse(item)
        self._drain()
        self._orders.close(OVER)

    def _drain(self) -> None:
        while True:
            try:
                item = self._inbox.get_nowait()
            except queue.Empty:
                break
            _refuse(item)

    def cycle(self, *items: Item) -> None:
        """Handle the items of the inbox, and let the supervisor decide if a decision is due."""
        self._in_hand = items
        self._safety.loop_cycled(self._clock.monotonic())
        self._in_hand = ()
        for item in items:
            self._handle(item)
        # Items that come meanwhile wait: they cannot keep the loop from its cycle.
        for _ in range(self._inbox.qsize()):
            self._handle(self._inbox.get_nowait())
        self._take_from_programs()
        now_s = self._clock.monotonic()
        if now_s >= self._execution.due_s:
            self._decide(now_s)
        self._lifecycle.poll(now_s)
        executor = self._execution.executor
        if self.state is State.RUNNING and executor is not None:
            # A safe stop holds all motions, whatever identifiers are released.
            self._motion.pause(bool(executor.reasons), now_s)
            self._motion.refresh(now_s)
        self._snapshots.poll(self.state, self.problem, self._lifecycle.notice)
        self.beat(now_s)
        if self.state is State.OVER:
            self._close()

    def _decide(self, now_s: float) -> None:
        is_running = self.state is State.RUNNING
        if is_running:
            self._timing.deciding()
        else:
            self._timing.rested()
        self._execution.decide(now_s, is_running=is_running)
        if is_running:
            self._timing.decided()

    def _take_from_programs(self) -> None:
        """Take up some of what programs have sent: what the model makes of large data takes its time."""
        end_s = self._clock.monotonic() + PROGRAM_SHARE_S
        for _ in range(PROGRAM_SHARE):
            arrived = self._from_programs.take()
            if arrived is None:
                break
            self._programs.take(arrived)
            if self._clock.monotonic() >= end_s:
                break

    def _handle(self, item: Item) -> None:
        executor = self._execution.executor
        match item:
            case DriveReading():
                self._readiness.reading = item
                self._timing.reading_taken(item.time_s)
                if executor is not None:
                    self._robot.on_drive_reading(item, executor)
                else:
                    self._robot.watch_buttons(item.buttons)
            case Scan():
                self._readiness.scan = item
                if executor is not None:
                    self._timing.scan_taken(item.time_s)
                    self._robot.on_scan(item, executor)
                    self._timing.scan_passed()
            case Sighting():
                if executor is not None:
                    self._robot.on_line(item, executor)
            case DeviceUp(device):
                self._lifecycle.device_up(device)
            case DeviceDown():
                self._lifecycle.device_down(item)
            case SafetyNotice():
                self._lifecycle.safety_changed(item)
            case ResetDone(problem):
                self._lifecycle.reset_done(problem)
            case Key(key):
                self._switch.on_key(key, executor)
                if executor is not None:
                    self._robot.on_key(key, executor)
            case Order():
                self._in_hand = (item,)
                self._lifecycle.execute(item)
                self._in_hand = ()
            case _Woken():
                pass  # Every cycle takes up the items that woke it.
            case _:
                assert_never(item)

    def _command(self, velocity: Velocity, now_s: float) -> None:
        is_other = velocity != self._wish
        if is_other:
            # Before the command can be taken up.
            self._timing.commanding()
        self._safety.command(velocity, now_s)
        if not is_other:
            return
        self._wish = velocity
        # On its way, a rotation has another speed after each exchange; the next one is soon enough for it.
        if not self._motion.is_rotating or velocity == STANDSTILL:
            self._hurry()


def _refuse(item: Item) -> None:
    """Answer an order that is not taken up any more."""
    if isinstance(item, Order):
        answer(item, "" if item.command is OperatorCommand.QUIT else OVER)
