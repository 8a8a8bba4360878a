"""Execution of the supervisor, run by run, and its state for snapshots."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from robosc.execution.interpreter import WatchingSystem
from robosc.execution.runtime.clock import Clock
from robosc.execution.runtime.event_log import EventLog
from robosc.execution.runtime.executor import Executor
from robosc.execution.runtime.layer import Layer
from robosc.execution.runtime.progress import Progress
from robosc.execution.runtime.protocol import requesting
from robosc.execution.runtime.settings import Settings
from robosc.model.structure import CommunicationKind
from robosc.supervisor import Supervisor
from robosc_bridge.configuration.channel_mapping import ChannelMapping
from robosc_bridge.daemon.programs.requesters import Requesters
from robosc_bridge.daemon.robot.adapter import RobotAdapter

_CALLED = (str(CommunicationKind.SERVICE), str(CommunicationKind.ACTION))


@dataclass(frozen=True)
class Job:
    """Job that is executed.

    Attributes:
        supervisor: Supervisor that is executed.
        mapping: Channels that its communications are mapped to.
        settings: Settings of the executor.
        needs_scanner: True if a LiDAR must be there before the job starts.
        starts_itself: True if the job starts as soon as the devices are there; else it stays in standby.
        stays_after_fault: True if the bridge waits after a fault until an operator starts it again; else it ends.
        is_layer: True for a supervision layer, which judges the requests of programs; False for a controller.
        needs_camera: True if a camera must be there before the job starts.
    """

    supervisor: Supervisor
    mapping: ChannelMapping
    settings: Settings
    needs_scanner: bool
    starts_itself: bool
    stays_after_fault: bool = False
    is_layer: bool = False
    needs_camera: bool = False


class Execution:
    """One executor at a time.

    Args:
        job: Job that is executed.
        robot: Robot that the job moves.
        requesters: Programs that send requests, if the job is a supervision layer.
        clock: The only source of time.
        log: The event log.

    Raises:
        DeploymentError: The supervisor was made for another deployment, or cannot be deployed like this.
        SettingsError: A setting is wrong, or names what the model does not have.

    Attributes:
        executor: Executor at work; None: no supervisor is executed.
        due_s: Time of the next decision, in seconds.
        overruns: Number of decisions that were left out because the previous one took too long.
    """

    def __init__(self, job: Job, robot: RobotAdapter, requesters: Requesters, clock: Clock, log: EventLog) -> None:
        self.executor: Executor | Layer | None = None
        self.due_s = clock.monotonic()
        self.overruns = 0
        self._job = job
        self._robot = robot
        self._requesters = requesters
        self._clock = clock
        self._log = log
        self._system: WatchingSystem | None = None
        # Another run is another state, whatever its system has counted.
        self._run = 0
        self._has_begun = False
        # Once now, so that what cannot be executed is found at the start of the program.
        _, system = self._made()
        self._names = tuple(info.name for info in requesting(system.description.communications))
        self._called = tuple(info.name for info in system.description.communications if info.kind in _CALLED)

    @property
    def layer(self) -> Layer | None:
        """The executor, if it is one of a supervision layer."""
        return self.executor if isinstance(self.executor, Layer) else None

    def begin(self) -> Executor | Layer:
        """Begin a new run in the initial state; its executor must still be started by `start`."""
        if self._has_begun and self._log.is_active:
            # One log for all runs: who reads it must know that the state is the initial one again.
            self._log.write({"time": self._clock.wall(), "kind": "restart", "what": ""})
        self._has_begun = True
        self._run += 1 << 32
        self._robot.forget()
        self._requesters.forget()
        self.executor, self._system = self._made()
        self.due_s = self._clock.monotonic()
        return self.executor

    def _made(self) -> tuple[Executor | Layer, WatchingSystem]:
        system = WatchingSystem(self._job.supervisor)
        settings, clock, log = self._job.settings, self._clock, self._log
        if self._job.is_layer:
            return Layer(system, self._robot, self._requesters, settings, clock, log), system
        return Executor(system, self._robot, settings, clock, log), system

    def end(self) -> None:
        """End the run."""
        self._run += 1 << 32
        self.executor = self._system = None
        self._robot.forget()
        self._requesters.forget()

    def decide(self, now_s: float, *, is_running: bool) -> None:
        """Let the executor decide, after a period; decisions that are late by whole periods are left out."""
        if self.executor is not None:
            if self.layer is not None:
                self._requesters.release_silent(self.layer)
            self.executor.tick()
            self._robot.deliver_pending(self.executor)
            self._robot.report_rotation(self.executor)
        period_s = self._job.settings.period_s
        self.due_s += period_s
        if self.due_s <= now_s:
            missed = int((now_s - self.due_s) / period_s) + 1
            self.overruns += missed if is_running else 0
            self.due_s += missed * period_s

    @property
    def stops(self) -> tuple[str, ...]:
        """Reasons why the executor issues no request; empty: it may issue requests, or nothing is executed."""
        return () if self.executor is None else self.executor.reasons

    @property
    def changes(self) -> int:
        """Number that changes whenever the state that watchers see may have changed."""
        return self._run + (0 if self._system is None else self._system.changes)

    @property
    def progress(self) -> Progress | None:
        """State of what the strategy aims at and assumes; None: there is no strategy, or nothing is executed."""
        return None if self.executor is None else self.executor.progress

    @property
    def cancelling(self) -> tuple[str, ...]:
        """Actions whose goal was to be cancelled and has not ended."""
        return () if self.executor is None else self.executor.cancelling

    @property
    def overdue_cancels(self) -> tuple[str, ...]:
        """Those of them whose goal should have ended by now."""
        return () if self.executor is None else self.executor.overdue_cancels

    def components(self) -> Mapping[str, Mapping[str, Any]]:
        """State and variables of each component with a behaviour; empty: nothing is executed."""
        return {} if self._system is None else self._system.state()

    def enabled(self) -> tuple[str, ...]:
        """Names of the requests that are allowed now, in the model's order."""
        return () if self._system is None else tuple(self._names[number] for number in self._system.enabled_requests())

    def communications(self) -> Mapping[str, str]:
        """Location of each service and action; empty: nothing is executed."""
        return {} if self._system is None else {name: self._system.location(name) for name in self._called}
