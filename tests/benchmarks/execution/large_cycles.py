"""Cycles of controllers for robots of 10 to 1,000 parts: the time must not grow with the parts that nothing happens to.

A *cycle* here is a `tick`, which issues a request, and before it the event by which the part that was told to go before
says that it is out: such an event or request changes what is allowed for at most three requests, whatever the size of
the robot (but for the hub's own, which lets all others go). What is given is processor time of a mean cycle, after as
many cycles as bring every part into play.

Usage: large_cycles.py [SIZE...]
"""

import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[2])]

from execution.c_cycles import program
from figures import text_table
from large_robots import KINDS, robot

from robosc.certification import make_supervisor
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.executor import Executor
from robosc.execution.runtime.protocol import ControlledSystem
from robosc.supervisor import Supervisor
from robosc_experiments.cycles.isolated import NullMiddleware
from support.generated import load_system
from support.models import bundle_of

SIZES = (10, 100, 300, 1000)
C_CYCLES, PYTHON_CYCLES = 200_000, 4_000
INTERPRETED_EVALUATIONS = 300_000
"""Conditions that the interpreter evaluates about, divided by those of a robot: its number of cycles."""

_MAIN = """
typedef void (*receive_t)(@p@_t *robot, uint64_t now);
static const receive_t DONE[] = {@done@};

static void run(int cycles)
{
    for (int number = 0; number < cycles; number++) {
        if (last % 3 == 0) {
            DONE[last / 3](&r, ++now_us);
        }
        last = -1;
        @p@_tick(&r, ++now_us);
    }
}

static double used_s(void)
{
    struct timespec used;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    return (double)used.tv_sec + (double)used.tv_nsec * 1e-9;
}

int main(void)
{
    if (!begin_run()) {
        return 1;
    }
    run(10 * @size@);
    const double begin = used_s();
    run(@cycles@);
    printf("%.9f\\n", (used_s() - begin) / @cycles@);
    return sink == 0;
}
"""


def made(kind: str, size: int) -> Supervisor:
    """The supervisor of a robot."""
    found = make_supervisor(bundle_of(robot(kind, size))).supervisor
    assert found is not None
    return found


def c_cycle(supervisor: Supervisor, size: int) -> float | None:
    """Seconds of a cycle of generated C."""
    gcc = shutil.which("gcc")
    if gcc is None:
        return None
    words = {"@done@": ", ".join(f"@p@_receive_done{number}" for number in range(size))}
    words |= {"@size@": str(size), "@cycles@": str(C_CYCLES)}
    main = _MAIN
    for word, text in words.items():
        main = main.replace(word, text)
    with tempfile.TemporaryDirectory() as folder:
        return float(subprocess.check_output([program(supervisor, main, Path(folder), gcc)], text=True))


class _Memory(NullMiddleware):
    """Remembers the last message that went out."""

    last = ""

    def publish(self, communication: str, message: Any) -> None:
        """Remember it."""
        self.last = communication


def python_cycle(system: ControlledSystem, size: int, cycles: int) -> float:
    """Seconds of a cycle of an executor."""
    middleware = _Memory()
    executor = Executor(system, middleware, clock=ManualClock())
    executor.start()

    def run(count: int) -> None:
        for _ in range(count):
            if middleware.last.startswith("go"):
                executor.receive(f"/done{middleware.last[2:]}", None)
            middleware.last = ""
            executor.tick()

    run(min(10 * size, cycles))
    begin = time.process_time()
    run(cycles)
    return (time.process_time() - begin) / cycles


def table(sizes: tuple[int, ...] = SIZES) -> str:
    """A row for each kind of robot and form of its controller."""
    rows = []
    for kind in KINDS:
        found: dict[str, list[float | None]] = {"generated C": [], "generated Python": [], "interpreter": []}
        for size in sizes:
            supervisor = made(kind, size)
            found["generated C"].append(c_cycle(supervisor, size))
            found["generated Python"].append(python_cycle(load_system(supervisor), size, PYTHON_CYCLES))
            count = max(20, INTERPRETED_EVALUATIONS // (10 * size))
            found["interpreter"].append(python_cycle(InterpretedSystem(supervisor), size, count))
        for name, times in found.items():
            cells = ["-" if item is None else f"{item * 1e6:.3g}" for item in times]
            first, last = times[0], times[-1]
            rows.append([f"{kind}, {name}", *cells, f"{last / first:.2f}" if first and last else "-"])
    header = ["robot and controller", *map(str, sizes), f"{sizes[-1]} : {sizes[0]}"]
    title = "Microseconds of a cycle, by the number of parts; C++ nodes run the generated C (gcc -O2)"
    return text_table(title, header, rows)


if __name__ == "__main__":
    sys.stdout.write(table(tuple(map(int, sys.argv[1:])) or SIZES) + "\n")
