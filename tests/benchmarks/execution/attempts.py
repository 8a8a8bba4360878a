"""Time of generated C (`gcc -O2`) in nanoseconds, in loops.

*Attempt*: whether an event is allowed, five of them a scan, as the original's generated C was measured. *Event*: a
message through the whole executor: conversion, step, silent steps; every other one changes the state. *Cycle*: one
`tick` in a state that does not change.
"""

import shutil
import statistics
import subprocess
import tempfile
from pathlib import Path

from execution.c_cycles import built
from execution.robots import SMALL
from figures import text_table

RUNS = 5
LOOPS = 2_000_000

_MAIN = """
int main(void)
{
    double begin;
    if (!begin_run()) {
        return 1;
    }
    begin = now_s();
    for (int k = 0; k < @n@; k++) {
        sink += (unsigned)@p@_enabled(&r, (@p@_event_t)0) + (unsigned)@p@_enabled(&r, (@p@_event_t)1)
            + (unsigned)@p@_enabled(&r, (@p@_event_t)(@P@_EVENT_COUNT - 3))
            + (unsigned)@p@_enabled(&r, (@p@_event_t)(@P@_EVENT_COUNT - 2))
            + (unsigned)@p@_enabled(&r, (@p@_event_t)(@P@_EVENT_COUNT - 1));
    }
    printf("%.3f ", 1e9 * (now_s() - begin) / (5.0 * @n@));
    begin = now_s();
    for (int k = 0; k < @n@; k++) {
        const @p@_data_Scan_t scan = {{ranges[k & 1], 360}};
        @p@_receive_scan(&r, ++now_us, &scan);
    }
    printf("%.3f ", 1e9 * (now_s() - begin) / @n@);
    begin = now_s();
    for (int k = 0; k < @n@; k++) {
        @p@_tick(&r, ++now_us);
    }
    printf("%.3f\\n", 1e9 * (now_s() - begin) / @n@);
    return 0;
}
"""


def table() -> str:
    """Mean and least nanoseconds of an attempt, an event and a cycle."""
    gcc = shutil.which("gcc")
    if gcc is None:
        return "Generated C: gcc is not installed"
    rows = []
    for name in SMALL:
        with tempfile.TemporaryDirectory() as folder:
            program = built(name, _MAIN.replace("@n@", str(LOOPS)), Path(folder), gcc)
            runs = [
                [float(word) for word in subprocess.check_output([program], text=True).split()] for _ in range(RUNS)
            ]
        for what, samples in zip(("attempt", "event", "cycle"), zip(*runs, strict=True), strict=True):
            aim = "10" if what == "attempt" else ""
            original = "2.4" if what == "attempt" else ""
            rows.append([f"{name}: {what}", f"{statistics.fmean(samples):.1f}", f"{min(samples):.1f}", original, aim])
    return text_table("Generated C, gcc -O2", ["nanoseconds", "mean", "min", "the original's", "aim (mean)"], rows)
