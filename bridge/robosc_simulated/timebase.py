"""Time as the simulated devices live it: the clock of their time-outs, and the world's time, which may pass faster.

Two times are kept apart. Whatever a device owes its host (heartbeat, bus watchdog, restart) is measured on the clock as
it is, because the host lives by it. Whatever is physical (motion, a turning scanner) is measured in world time, which
passes `factor` times as fast.

A fast world makes a host late that is not: what it does within 20 ms, a robot feels after 0.4 s where the world passes
20 times as fast. So that a machine that has no time for the host does not run the robot into a wall, the world may wait
for it, as simulators do that let time pass only step by step with a controller.
"""

import math
import threading
from collections.abc import Callable

from robosc.execution.runtime.clock import Clock, ManualClock, SystemClock

FASTEST = 100.0
"""Largest factor of a world's speed to the clock's; a fast computer lives some hundred seconds of it in one."""

_STEP_S = 0.005
# A host that is silent for longer, by the clock, has ended, or has not begun.
_AWAY_S = 1.0
_SILENCE_S = 1.0
# A host that takes so long at once is too slow for the world's factor.
_SLOW_S = 0.25


class Timebase:
    """The time that all devices of one simulation share, and the lock under which they live.

    Args:
        clock: `SystemClock`: the devices live by themselves. `ManualClock`: they live when `advance` is called.
        factor: Seconds that pass in the world in one of the clock.
        patience_s: Seconds that may pass in the world after the host was heard; then it stands still until it is
            heard again, or for the first time, and is not behind with what was sent to it. None: it never waits.

    Raises:
        ValueError: The factor or the patience is no positive, finite number, or the factor is above `FASTEST`.
    """

    def __init__(self, clock: Clock | None = None, factor: float = 1.0, patience_s: float | None = None) -> None:
        if not 0 < factor <= FASTEST:
            raise ValueError(f"the speed factor must be a positive number up to {FASTEST:g}, and is {factor:g}")
        if patience_s is not None and not (math.isfinite(patience_s) and patience_s > 0):
            raise ValueError(f"the patience with the host must be a positive number of seconds, and is {patience_s}")
        self.clock: Clock = SystemClock() if clock is None else clock
        self.factor = factor
        self.lock = threading.RLock()
        self._began_s = self.clock.monotonic()
        self._patience_s = patience_s
        # By the world's time: when it waits next, and how long it has waited.
        self._limit_s = math.inf if patience_s is None else patience_s
        self._waited_s = 0.0
        self._heard_s: float | None = None
        self._silence_s = 0.0
        self._reported_s = _SILENCE_S / 2
        self._unread: set[object] = set()
        self._members: list[Callable[[], None]] = []

    @property
    def is_manual(self) -> bool:
        """True if time passes only in `advance`."""
        return isinstance(self.clock, ManualClock)

    def now_s(self) -> float:
        """The clock's reading."""
        return self.clock.monotonic()

    def world_s(self) -> float:
        """Seconds that have passed in the world since the simulation began."""
        with self.lock:
            world_s = (self.now_s() - self._began_s) * self.factor - self._waited_s
            if world_s > self._limit_s:
                self._waited_s += world_s - self._limit_s
                world_s = self._limit_s
            return world_s

    def host_sent(self) -> None:
        """The host has sent something: the world need not wait for it."""
        with self.lock:
            now_s = self.now_s()
            if self._patience_s is None and self._heard_s is not None and now_s - self._heard_s <= _AWAY_S:
                self._silence_s = max(self._silence_s, (now_s - self._heard_s) * self.factor)
            self._heard_s = now_s
            if self._patience_s is not None and not self._unread:
                self._limit_s = self.world_s() + self._patience_s

    def new_silence_s(self) -> float | None:
        """Return the longest time without a sign of the host, in seconds of a fast world; None: nothing new to report.

        A world that passes no faster than the clock, or that waits, reports none; a longer silence is reported when it
        is twice as long as the last one that was.
        """
        with self.lock:
            if self.factor <= 1.0 or self._silence_s < 2 * self._reported_s:
                return None
            self._reported_s = self._silence_s
            return self._silence_s

    def record_work(self, seconds: float, since_s: float) -> None:
        """Somebody has lived a part of the world's time, and that has taken them time.

        Where it takes longer than that part does by the clock, nobody would ever be up to date: the rest is not lived.

        Args:
            seconds: Of the world, that were lived.
            since_s: By the clock, when that was begun.
        """
        took_s = self.now_s() - since_s
        if took_s > _SLOW_S:
            with self.lock:
                self._waited_s += max(took_s * self.factor - seconds, 0.0)

    @property
    def waits_for_host(self) -> bool:
        """True if the world waits for its host at all."""
        return self._patience_s is not None

    def read(self, line: object, *, is_behind: bool) -> None:
        """The host is behind with what was sent on a line, or not any more: while it is, hearing it is not enough."""
        with self.lock:
            (self._unread.add if is_behind else self._unread.discard)(line)

    def join(self, update: Callable[[], None]) -> None:
        """Call this whenever `advance` has moved the clock by a step."""
        with self.lock:
            self._members.append(update)

    def leave(self, update: Callable[[], None]) -> None:
        """Call it no more."""
        with self.lock:
            self._members.remove(update)

    def advance(self, seconds: float) -> None:
        """Let time pass in small steps; when it returns, all devices have lived it.

        What its host has written just before, a device hears in the first of them.

        Raises:
            TypeError: The clock moves by itself.
            ValueError: Time would go back.
        """
        if not isinstance(self.clock, ManualClock):
            raise TypeError("this clock moves by itself")
        if seconds < 0:
            raise ValueError("time does not go back")
        end_s = self.clock.now_s + seconds
        while (left_s := end_s - self.clock.now_s) > 1e-12:
            with self.lock:
                self.clock.advance(min(left_s, _STEP_S))
                members = tuple(self._members)
            # Outside the lock of the devices: each takes what it needs, in its own order.
            for update in members:
                update()
