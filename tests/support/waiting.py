"""Waiting for conditions without an event; others are awaited by their events.

It is asked for often, and a limit is there for failing tests alone: nothing is decided by how long it takes.
"""

import asyncio
import inspect
import time
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any

PATIENCE_S = 60.0
"""Maximum waiting time of a test for what must happen, in seconds; only a failing test waits so long."""

_PAUSE_S = 0.005


_REPEAT_S = 0.1


def eventually(condition: Callable[[], bool]) -> bool:
    """Return True if a condition becomes true."""
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > end_s:
            return False
        time.sleep(_PAUSE_S)
    return True


def wait_until[Found](
    look: Callable[[], Found | None],
    what: str = "what is looked for",
    limit_s: float = PATIENCE_S,
    *,
    repeat: Callable[[], object] = lambda: None,
    fault: Callable[[], str] = lambda: "",
    heard: Callable[[], str] = lambda: "",
) -> Found:
    """Return what a look finds, as soon as it is true.

    Args:
        look: Function that looks for it.
        what: Description of it in words.
        limit_s: Time after which it is taken for lost, in seconds.
        repeat: Function called now and again meanwhile: the first messages of a new connection may be lost.
        fault: Function that says why it cannot come any more; an empty text while it can.
        heard: Function that returns what others have sent, for the failure.

    Raises:
        AssertionError: It was not found.
    """
    end_s = time.monotonic() + limit_s
    next_s = time.monotonic()
    while not (found := look()):
        assert time.monotonic() < end_s, f"waited {limit_s:g} s in vain for {what}\n{heard()}"
        assert not fault(), f"{fault()}, waiting for {what}\n{heard()}"
        if time.monotonic() >= next_s:
            repeat()
            next_s = time.monotonic() + _REPEAT_S
        time.sleep(_PAUSE_S)
    return found


async def until(condition: Callable[[], bool | Awaitable[bool]]) -> None:
    """Let others run until a condition holds.

    Raises:
        AssertionError: It never does.
    """
    end_s = time.monotonic() + PATIENCE_S
    while True:
        holds = condition()
        if await holds if inspect.isawaitable(holds) else holds:
            return
        assert time.monotonic() < end_s, "it never came true"
        # Not by the loop's clock, which a test may hold; and others have no more to do than to get their turn.
        await asyncio.to_thread(time.sleep, _PAUSE_S) if _is_held() else await asyncio.sleep(_PAUSE_S)


def _is_held() -> bool:
    return hasattr(asyncio.get_running_loop(), "advance")


def limited[T](test: Coroutine[Any, Any, T]) -> T:
    """Run a test on an event loop of its own, which ends, and return its result."""

    async def run() -> T:
        async with asyncio.timeout(PATIENCE_S):
            return await test

    return asyncio.run(run())
