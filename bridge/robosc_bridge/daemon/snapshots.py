"""Snapshots of the loop: one at each change that a person should see at once."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from robosc.execution.runtime.clock import Clock
from robosc.execution.runtime.progress import Progress
from robosc_bridge.daemon.feed import Feed, Snapshot
from robosc_bridge.daemon.readiness import Readiness
from robosc_bridge.daemon.states import State
from robosc_bridge.daemon.threads.reports import SafetyNotice
from robosc_bridge.daemon.timing import TimingFigures

INTERVAL_S = 0.05
"""Time between snapshots that differ in measurements alone."""


class ExecutionState(Protocol):
    """State of the supervisor at work, for snapshots."""

    overruns: int

    @property
    def stops(self) -> tuple[str, ...]:
        """Reasons why the executor requests nothing."""

    @property
    def changes(self) -> int:
        """Number that grows with each change of state."""

    @property
    def progress(self) -> Progress | None:
        """State of what the strategy aims at and assumes, if there is one."""

    @property
    def cancelling(self) -> tuple[str, ...]:
        """Actions whose goal was to be cancelled and has not ended."""

    @property
    def overdue_cancels(self) -> tuple[str, ...]:
        """Those of them whose goal should have ended by now."""

    def components(self) -> Mapping[str, Mapping[str, Any]]:
        """State and variables of each component."""

    def enabled(self) -> tuple[str, ...]:
        """The requests that are allowed now."""

    def communications(self) -> Mapping[str, str]:
        """Location of each service and action."""


class Snapshots:
    """Maker of snapshots, which leaves out those without news.

    Args:
        feed: Feed that shows the snapshots.
        execution: The supervisor at work.
        readiness: Knowledge about the devices.
        clock: The time.
        timing: Function that returns the bridge's own times.
    """

    def __init__(
        self,
        feed: Feed,
        execution: ExecutionState,
        readiness: Readiness,
        clock: Clock,
        timing: Callable[[], TimingFigures] = TimingFigures,
    ) -> None:
        self._feed = feed
        self._execution = execution
        self._readiness = readiness
        self._clock = clock
        self._timing = timing
        self._number = 0
        self._changes = -1
        self._components: Mapping[str, Mapping[str, Any]] = {}
        self._enabled: tuple[str, ...] = ()
        self._communications: Mapping[str, str] = {}
        self._shown: tuple[object, ...] = ()
        self._due_s = -1.0

    def note(self, kind: str, what: str) -> None:
        """Send an event of the bridge itself to watchers; log files have no such entries."""
        if self._feed.is_watched:
            self._feed.append({"time": self._clock.wall(), "kind": kind, "what": what})

    def poll(self, state: State, problem: str, notice: SafetyNotice) -> None:
        """Show a snapshot at the end of a cycle, after a change or when the last measurements shown are old."""
        stops, changes = self._execution.stops, self._execution.changes
        if changes != self._changes:
            self._changes = changes
            self._components = self._execution.components()
            self._enabled = self._execution.enabled()
            self._communications = self._execution.communications()
        cancels = self._execution.cancelling, self._execution.overdue_cancels
        devices = self._readiness.devices
        seen = (state, problem, notice, stops, devices, self._components, self._communications, *cancels)
        now_s = self._clock.monotonic()
        if seen == self._shown and now_s < self._due_s:
            return
        if not self._shown or self._shown[0] is not state:
            self.note("state", f"{state}: {problem}" if problem else str(state))
        self._shown = seen
        self._due_s = now_s + INTERVAL_S
        self._number += 1
        self._feed.show(
            Snapshot(
                self._number,
                self._clock.wall(),
                state,
                problem,
                notice.reasons,
                notice.warnings,
                stops,
                devices,
                self._components,
                self._enabled,
                self._readiness.reading,
                self._readiness.scan,
                self._execution.overruns,
                self._communications,
                self._timing(),
                self._execution.progress,
                *cancels,
            )
        )
