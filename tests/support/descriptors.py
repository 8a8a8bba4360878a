"""File descriptors that this process has open."""

import gc
from pathlib import Path


def open_descriptors() -> int:
    """Return the number of open descriptors, once what earlier tests left to the garbage collector is closed.

    Threads that earlier tests have left may close some at any time: it is compared by "not more than before".
    """
    gc.collect()
    return len(list(Path("/proc/self/fd").iterdir()))  # One of them is of this very listing.
