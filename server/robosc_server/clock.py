"""Time as the server sees it: the one place where it is read.

What passes is measured by the clock of the event loop that runs, which asyncio's own waits go by, too (`sleep`,
`timeout`, `wait`, `call_later`): a test has all of it pass as it likes with a loop of its own.
"""

import sys
import time


def monotonic() -> float:
    """Seconds that never go back; where no event loop runs, those of the computer.

    They are the same ones: asyncio's loops read that clock.
    """
    # A worker's process has no loop, and need not load what has.
    asyncio = sys.modules.get("asyncio")
    try:
        return time.monotonic() if asyncio is None else asyncio.get_running_loop().time()
    except RuntimeError:
        return time.monotonic()


def wall() -> float:
    """Seconds since 1970-01-01 UTC: what callers and operators read."""
    return time.time()
