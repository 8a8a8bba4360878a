"""Lateness of this machine in waking a program that sleeps for a millisecond: no program here reacts sooner.

A thread runs on each processor, with priority over all other programs where that is permitted; its lateness is then
time that the machine's host took away. Measures until its standard input ends, then prints as JSON the data that
`Machine` reads.
"""

import json
import os
import select
import sys
import threading
import time

SLEEP_S = 0.001
AWAY_S = 0.001
"""Later than this, and the processor counts as having been away."""


def _sample(processor: int, late_s: list[float], away_s: list[tuple[float, float]], is_over: threading.Event) -> None:
    os.sched_setaffinity(0, {processor})
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except PermissionError:
        sys.stderr.write("wakeups: not before other programs: what they take counts as the machine's\n")
    while not is_over.is_set():
        begin_s = time.monotonic()
        time.sleep(SLEEP_S)
        end_s = time.monotonic()
        late_s.append(round(end_s - begin_s - SLEEP_S, 6))
        if late_s[-1] > AWAY_S:
            away_s.append((begin_s + SLEEP_S, end_s))


def main() -> int:
    """Measure."""
    late_s: list[float] = []
    away_s: list[tuple[float, float]] = []
    is_over = threading.Event()
    threads = [
        threading.Thread(target=_sample, args=(processor, late_s, away_s, is_over))
        for processor in os.sched_getaffinity(0)
    ]
    for thread in threads:
        thread.start()
    poll = select.poll()
    poll.register(sys.stdin.fileno(), select.POLLIN)
    while poll.poll() and os.read(sys.stdin.fileno(), 1):
        pass
    is_over.set()
    for thread in threads:
        thread.join()
    sys.stdout.write(json.dumps({"late_s": late_s, "away_s": sorted(away_s)}) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
