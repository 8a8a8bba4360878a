"""Cycles and events of generated C, compiled with gcc -O2, each measured with the clock of the operating system."""

import shutil
import subprocess
import tempfile
from pathlib import Path

from execution.robots import WITHOUT, supervisor
from figures import micro
from robosc.supervisor import Supervisor
from robosc.targets import generate
from robosc.targets.code.c.layout import make_layout
from robosc_experiments.cycles.times import CYCLES, RUNS

# The callbacks are those of `robosc_experiments/cycles/scripts/changing.c`, which is compiled as it is.
_COMMON = """
#define _POSIX_C_SOURCE 199309L
#include "@p@.h"
#include <stdio.h>
#include <time.h>

static double ranges[2][360];
static volatile unsigned sink;
static int last = -1; /* the communication whose message went out last */

static bool publish(void *context, const @p@_request_t *request)
{
    (void)context;
    sink += (unsigned)request->communication;
    last = (int)request->communication;
    return true;
}

static bool publish_default(void *context, @p@_topic_t topic)
{
    (void)context;
    sink += (unsigned)topic;
    return true;
}

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static @p@_t r;
static uint64_t now_us;

/* Start the controller; true if it could be made. */
static bool begin_run(void)
{
    @p@_callbacks_t callbacks = {0};
    callbacks.publish = publish;
    callbacks.publish_default = publish_default;
    for (int k = 0; k < 360; k++) {
        ranges[0][k] = 3.0;
        ranges[1][k] = 0.2;
    }
    if (!@p@_init(&r, NULL, &callbacks)) {
        return false;
    }
    @p@_start(&r, now_us);
    return true;
}
"""

_MAIN = """
static void receive(int number)
{
    if (number % 2) {
        const @p@_data_Scan_t scan = {{ranges[number / 50 % 2], 360}};
        @p@_receive_scan(&r, ++now_us, &scan);
    } else {
        @other@;
    }
}

int main(void)
{
    for (int run = 0; run < 2 * @runs@; run++) {
        const bool is_changing = run % 2 != 0;
        if (!begin_run()) {
            return 1;
        }
        for (int number = 0; number < 2; number++) {
            receive(number);
        }
        for (int number = 0; number < @cycles@; number++) {
            const double begin = now_s();
            double middle = begin;
            if (is_changing) {
                receive(number);
                middle = now_s();
            }
            @p@_tick(&r, ++now_us);
            const double end = now_s();
            printf("%d %.9f %.9f\\n", (int)is_changing, end - middle, middle - begin);
        }
    }
    return 0;
}
"""

_OTHER = {
    "line_follower": "@p@_receive_line_correction(&r, ++now_us, 0.1)",
    "maze_solver": "@p@_receive_rotate_done(&r, ++now_us)",
}


def built(name: str, main: str, folder: Path, gcc: str) -> Path:
    """A program around the generated C of a robot."""
    return program(supervisor(name), main, folder, gcc)


def program(made: Supervisor, main: str, folder: Path, gcc: str) -> Path:
    """A program around the generated C of a supervisor."""
    prefix = make_layout(made).prefix
    for path, text in generate(made, "c99").items():
        (folder / path).write_text(text, encoding="utf-8")
    (folder / "bench.c").write_text(
        (_COMMON + main).replace("@p@", prefix).replace("@P@", prefix.upper()), encoding="utf-8"
    )
    command = [gcc, "-std=c99", "-O2", "-ffp-contract=off", f"{prefix}.c", "bench.c", "-lm", "-o", "bench"]
    subprocess.run(command, cwd=folder, check=True)
    return folder / "bench"


def rows(name: str) -> list[list[str]]:
    """Rows of the table."""
    gcc = shutil.which("gcc")
    if gcc is None:
        return [[f"{name}, generated C: not measured, gcc is not installed", *[""] * 7]]
    main = _MAIN.replace("@other@", _OTHER[name]).replace("@runs@", str(RUNS)).replace("@cycles@", str(CYCLES))
    with tempfile.TemporaryDirectory() as folder:
        text = subprocess.check_output([built(name, main, Path(folder), gcc)], text=True)
    samples = [[float(word) for word in line.split()] for line in text.splitlines()]
    steady = [cycle for is_changing, cycle, _ in samples if not is_changing]
    cycles = [cycle for is_changing, cycle, _ in samples if is_changing]
    events = [event for is_changing, _, event in samples if is_changing]
    label = f"{name}, generated C"
    return [
        [f"{label}: cycle", *micro(steady), WITHOUT[name], ""],
        [f"{label}: cycle, sensors changing", *micro(cycles), WITHOUT[name], ""],
        [f"{label}: event", *micro(events), "", ""],
    ]
