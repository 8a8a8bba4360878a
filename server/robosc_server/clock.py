"""Clock of the server: the only module that reads the time.

Durations are measured with the clock of the running event loop, which asyncio's own waits use as well (`sleep`,
`timeout`, `wait`, `call_later`): a test with its own loop controls all of them.
"""

import sys
import time
from collections.abc import Callable


def monotonic() -> float:
    """Return monotonic seconds of the running event loop, or of the computer where no loop runs.

    Both are the same clock, except in tests.
    """
    # A worker process has no event loop and need not import asyncio.
    asyncio = sys.modules.get("asyncio")
    try:
        return time.monotonic() if asyncio is None else asyncio.get_running_loop().time()
    except RuntimeError:
        return time.monotonic()


def running_clock() -> Callable[[], float]:
    """Return the clock of the running event loop, for several looks at it."""
    clock: Callable[[], float] = sys.modules["asyncio"].get_running_loop().time
    return clock


def wall_clock_s() -> float:
    """Return the seconds since 1970-01-01 UTC, for times that callers and operators read."""
    return time.time()
