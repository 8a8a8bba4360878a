"""What a bridge in virtual time does and holds: for the benchmark of endurance."""

import gc
import math
import os
from pathlib import Path
from typing import Any

from virtual_robot import CLOCK, VirtualRobot

from robosc.execution.executor import Executor
from robosc_bridge.safety import SafetyLayer

_PAGE_KB = os.sysconf("SC_PAGE_SIZE") // 1024


class Watch:
    """Counts what a robot does.

    Args:
        robot: Whose bridge has not begun yet.
    """

    def __init__(self, robot: VirtualRobot) -> None:
        self._robot = robot
        self._decisions = self._scans = 0
        self._first_due_s = self._last_due_s = math.nan
        self._late_s = 0.0
        self._driven_m = 0.0
        self._place_m = (robot.world.x_m, robot.world.y_m)
        watch = self
        tick, saw_scan = Executor.tick, SafetyLayer.saw_scan

        def counted_tick(self: Executor) -> None:
            watch._decided()
            tick(self)

        def counted_scan(self: SafetyLayer, *arguments: Any) -> None:
            watch._scans += 1
            saw_scan(self, *arguments)

        Executor.tick = counted_tick  # type: ignore[method-assign]
        SafetyLayer.saw_scan = counted_scan  # type: ignore[method-assign,assignment]

    def _decided(self) -> None:
        # Only the loop knows its schedule.
        self._last_due_s = self._robot.machine.daemon._execution.due_s
        if not self._decisions:
            self._first_due_s = self._last_due_s
        self._decisions += 1
        self._late_s = max(self._late_s, CLOCK.now_s - self._last_due_s)

    def step(self) -> None:
        """A step was taken."""
        world = self._robot.world
        place_m = (world.x_m, world.y_m)
        if place_m != self._place_m:
            self._driven_m += math.dist(place_m, self._place_m)
            self._place_m = place_m

    def counted(self) -> dict[str, Any]:
        """What was done so far."""
        daemon = self._robot.machine.daemon
        periods = self._decisions - 1 + daemon.overruns
        drift_s = self._last_due_s - self._first_due_s - periods * self._robot.period_s
        return {
            "decisions": self._decisions,
            "exchanges": self._robot.exchanges,
            "scans": self._scans,
            "drift_s": drift_s,
            "late_s": self._late_s,
            "overruns": daemon.overruns,
            "driven_m": self._driven_m,
            "collisions": self._robot.world.collisions,
        }

    def held(self) -> dict[str, int]:
        """What is held now."""
        gc.collect()
        return {
            "memory_kb": int(Path("/proc/self/statm").read_text().split()[1]) * _PAGE_KB,
            "objects": len(gc.get_objects()),
            "inbox": self._robot.machine.daemon._inbox.qsize(),
            "files": len(list(Path("/proc/self/fd").iterdir())),
        }
