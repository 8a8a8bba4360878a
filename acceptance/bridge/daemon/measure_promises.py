"""Measures the table of promises (docs/bridge-promises.md), and writes it: a program, no test.

    PYTHONPATH=tests .venv/bin/python acceptance/bridge/daemon/measure_promises.py --runs 200 --real 10

On the virtual clock every run is exact. In real time a run is repeated if the machine kept a thread of it waiting: what
would be measured is the machine. Exit status 1: a promise was not kept; the page stays as it was.
"""

import argparse
import logging
import random
import re
import sys

from robosc_bridge.transport.system_host import SYSTEM_HOST
from support.promises import HEAD, PAGE, PROMISES, Promise, measured_s, row
from support.real_time import Lateness

LATE_S = 0.02
"""Lateness of a thread above which a run in real time is repeated, in seconds."""

TRIALS = 6
"""Runs at most for one that counts; of a machine that is always late, the least late one counts."""


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("--runs", type=int, default=200, help="runs of each row on the virtual clock (default: 200)")
    parser.add_argument("--real", type=int, default=10, help="runs of each row in real time (default: 10)")
    parser.add_argument(
        "--only", default="", help="rows whose fault or drive contains this alone; the page is not written"
    )
    options = parser.parse_args()
    logging.disable(logging.CRITICAL)
    rows, broken = [HEAD, "|---|---|---|---|---|---|"], 0
    for promise in PROMISES:
        if options.only and options.only not in f"{promise.base} {promise.fault}":
            continue
        chance = random.Random(f"{promise.base} {promise.fault} page")
        try:
            virtual_s = max(measured_s(promise, chance) for _ in range(options.runs))
            real_s = max(_in_real_time_s(promise, chance) for _ in range(options.real))
        except AssertionError as error:
            broken += 1
            print(f"BROKEN {promise.base}: {promise.fault}: {error}", flush=True)
            continue
        rows.append(row(promise, virtual_s, real_s))
        print(rows[-1], flush=True)
    if broken or options.only:
        return int(broken > 0)
    text = PAGE.read_text(encoding="utf-8")
    text = re.sub(rf"{re.escape(HEAD)}\n(\|.*\n)+", lambda _: "\n".join(rows) + "\n", text)
    counts = f"{options.runs} runs on the virtual clock and of {options.real} in real time"
    text = re.sub(r"\d+ runs on the virtual clock and of \d+ in real time", counts, text)
    PAGE.write_text(text, encoding="utf-8")
    return 0


def _in_real_time_s(promise: Promise, chance: random.Random) -> float:
    found = list[tuple[float, float]]()
    problem: AssertionError | None = None
    for _ in range(TRIALS):
        with Lateness() as lateness:
            try:
                took_s = measured_s(promise, chance, SYSTEM_HOST)
            except AssertionError as error:
                problem = error
                continue
        found.append((lateness.worst_s, took_s))
        if lateness.worst_s <= LATE_S:
            break
    if not found:
        assert problem is not None
        raise problem
    return min(found)[1]


if __name__ == "__main__":
    sys.exit(main())
