"""An event loop whose clock stands still until a test has time pass: timers of servers fire when the test says so.

All of a server's waits go by its loop's clock (`robosc_server.clock`), so nothing is slept for, and nothing happens
while a slow machine computes. What comes from outside, of sockets, threads and processes, comes as always.
"""

import asyncio
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from typing import Any

import pytest

from support.waiting import PATIENCE_S


class HeldLoop(asyncio.SelectorEventLoop):
    """A loop on time of its own.

    Args:
        now_s: First reading of its clock.
    """

    def __init__(self, now_s: float = 1000.0) -> None:
        self._now_s = now_s
        super().__init__()

    def time(self) -> float:
        """Return the time in seconds."""
        return self._now_s

    def advance(self, seconds: float) -> None:
        """Let time pass, each timer at its moment, and what follows from it; called from another thread."""
        passed: Future[None] = Future()
        self.call_soon_threadsafe(self._begin, seconds, lambda: passed.set_result(None))
        passed.result(PATIENCE_S)

    async def passed(self, seconds: float) -> None:
        """Do the same; called on the loop."""
        passed = self.create_future()
        self._begin(seconds, lambda: passed.set_result(None))
        await passed

    def _begin(self, seconds: float, done: Callable[[], None]) -> None:
        self._pass(self._now_s + seconds, done)

    def _pass(self, until_s: float, done: Callable[[], None]) -> None:
        ours: Any = self
        # A copy, made in one step: other threads put callbacks there at any time.
        for handle in ours._ready.copy():
            if isinstance(handle, asyncio.TimerHandle):
                # It is called a rounding error too early, and might put itself off for ever.
                self._now_s = max(self._now_s, handle.when())
        if not ours._ready:  # Else others have their turn first.
            timers = [timer.when() for timer in ours._scheduled if not timer.cancelled()]
            next_s = min(timers, default=until_s)
            if next_s > until_s or not timers:
                self._now_s = until_s
                done()
                return
            self._now_s = max(self._now_s, next_s)
        self.call_soon(self._pass, until_s, done)


@pytest.fixture
def loop() -> HeldLoop:
    """Loop that a test which is a coroutine runs on."""
    return HeldLoop()


def on_held_time[T](test: Callable[[HeldLoop], Coroutine[Any, Any, T]]) -> T:
    """Run a test on a `HeldLoop` and return its result."""
    loops: list[HeldLoop] = []

    def made() -> HeldLoop:
        loops.append(HeldLoop())
        return loops[0]

    async def run() -> T:
        return await test(loops[0])

    with asyncio.Runner(loop_factory=made) as runner:
        return runner.run(run())
