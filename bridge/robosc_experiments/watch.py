"""Watch over a robot while a scenario runs: samples of its motion, and waits for it to drive or to stand."""

import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from robosc_experiments.scenario import Say
from robosc_experiments.tail import MotionState, latest
from robosc_simulated.motion_checks import Halt

FREE_M = 0.6
"""Distance that it drives before anything happens, and in between, in metres."""

HELD_S = 2.0
"""Time of the world for which it must stand still when something has happened, in seconds."""

_LOOK_S = 0.02


class RobotWatch:
    """Watch over what the robot does.

    Args:
        motion: Record of its motion, which grows.
        events: Function that returns the number of entries of the event log by now.
        check: Function that raises an error if a program that is needed has ended.
        say: Function that takes lines of progress.
        step_s: Longest time of the clock for anything that the robot has to do, in seconds.
        settle_s: Time of the world that it has for coming to rest, in seconds.

    Attributes:
        halts: Times when it had to stand still.
        faults: Things that it did not do in time; nothing is waited for after the first.
    """

    def __init__(
        self,
        motion: Path,
        events: Callable[[], int],
        check: Callable[[], None],
        say: Say,
        *,
        step_s: float,
        settle_s: float = 0.0,
    ) -> None:
        self.halts: list[Halt] = []
        self.faults: list[str] = []
        self._motion = motion
        self._events = events
        self._check = check
        self._say = say
        self._step_s = step_s
        self._settle_s = settle_s
        self._begin_s = time.monotonic()

    def samples(self, what: str, limit_s: float) -> Iterator[MotionState]:
        """Yield the state of the robot again and again, until the limit."""
        end_s = time.monotonic() + limit_s
        while time.monotonic() < end_s:
            self._check()
            now = latest(self._motion)
            self._say(
                f"{what}: x {now.x_m:+.2f} m  y {now.y_m:+.2f} m  {self._events():5} events  "
                f"{now.world_s:6.1f} s of the world in {time.monotonic() - self._begin_s:4.1f} s"
            )
            yield now
            time.sleep(_LOOK_S)

    def drive(self, what: str) -> None:
        """Wait until it has driven some way."""
        if self.faults:
            return
        before = latest(self._motion)
        driven_m = 0.0
        for now in self.samples(what, self._step_s):
            driven_m += math.dist((before.x_m, before.y_m), (now.x_m, now.y_m))
            before = now
            if driven_m >= FREE_M:
                return
        self.faults.append(f"the robot did not drive {what} within {self._step_s:g} s")

    def stand(self, why: str, release: Callable[[], object], *, is_commanded: bool = True) -> None:
        """Wait until it has stood still for a while; then it may go on.

        Args:
            why: Reason, for a person.
            release: Function that lets it go on.
            is_commanded: True if it has just been commanded to stand still; else it is to see for itself.
        """
        if self.faults:
            return
        commanded_s = latest(self._motion).world_s
        begin_s: float | None = None
        for now in self.samples(f"stands {why}", self._step_s):
            if not now.is_standing:
                begin_s = None
            elif begin_s is None:
                begin_s = now.world_s
            elif now.world_s - begin_s >= self._settle_s + HELD_S:
                self.halts.append(Halt(commanded_s if is_commanded else begin_s, now.world_s, why))
                release()
                return
        self.faults.append(f"the robot did not stand still {why} within {self._step_s:g} s")
