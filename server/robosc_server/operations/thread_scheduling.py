"""Scheduling policies of threads."""

import contextlib
import os
from collections.abc import Iterator


@contextlib.contextmanager
def batched_threads() -> Iterator[None]:
    """Give the threads that begin in this context the scheduling policy SCHED_BATCH.

    Such a thread does not stop others when it wakes up. The thread by which gRPC reports what has happened to calls
    wakes up four times a call, for microseconds; with the usual policy it stops the thread that runs the handlers.
    """
    is_changed = False
    # Other systems have no such policy, and a sandbox may forbid the system call: the server then is only slower.
    with contextlib.suppress(AttributeError, OSError):
        # A policy that somebody chose for the whole server remains.
        if os.sched_getscheduler(0) == os.SCHED_OTHER:
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
            is_changed = True
    try:
        yield
    finally:
        if is_changed:
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
