"""Time as the server sees it: the one place where it is read.

What passes is measured by the clock of the event loop that runs, which asyncio's own waits go by, too (`sleep`,
`timeout`, `wait`, `call_later`): a test has all of it pass as it likes with a loop of its own.
"""

import asyncio
import time


def monotonic() -> float:
    """Seconds that never go back; in a thread without an event loop, those of the computer.

    They are the same ones: asyncio's loops read that clock.
    """
    try:
        loop = asyncio.get_running_loop()
    except RuntimeError:
        return time.monotonic()
    return loop.time()


def wall() -> float:
    """Seconds since 1970-01-01 UTC: what callers and operators read."""
    return time.time()
