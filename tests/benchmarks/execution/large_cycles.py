"""Cycles of controllers for robots of 10 to 1,000 parts: the time must not grow with the parts that nothing happens to.

A *cycle* here is a `tick`, which issues a request, and before it the event by which the part that was told to go before
says that it is out: such an event or request changes what is allowed for at most three requests, whatever the size of
the robot (but for the hub's own, which lets all others go). What is given is processor time of a mean cycle, after as
many cycles as bring every part into play; the least of some rounds, since other programs only make them longer. What
still grows is what a processor takes for code and data that were not used for long, which are those of one part after
the other here.
"""

import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from execution.c_cycles import program
from figures import text_table
from large_robots import KINDS, robot
from robosc.certification import make_supervisor
from robosc.execution.interpreter import InterpretedSystem, WatchingSystem
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.executor import Executor
from robosc.execution.runtime.protocol import ControlledSystem
from robosc.supervisor import Supervisor
from robosc_experiments.cycles.isolated import NullMiddleware
from support.generated import load_system
from support.models import bundle_of

SIZES = (10, 100, 300, 1000)

C_CYCLES, PYTHON_CYCLES, ROUNDS = 200_000, 4_000, 5
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
        built = program(supervisor, main, Path(folder), gcc)
        return min(float(subprocess.check_output([built], text=True)) for _ in range(ROUNDS))


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

    def round_s() -> float:
        begin = time.process_time()
        run(cycles)
        return (time.process_time() - begin) / cycles

    run(min(10 * size, cycles))
    return min(round_s() for _ in range(ROUNDS))


def _cycles(kind: str, size: int) -> Iterator[tuple[str, float | None]]:
    """Yield each form of a controller, and seconds of its cycle."""
    supervisor = made(kind, size)
    yield "generated C", c_cycle(supervisor, size)
    yield "generated Python", python_cycle(load_system(supervisor), size, PYTHON_CYCLES)
    yield "interpreter of the bridge", python_cycle(WatchingSystem(supervisor), size, PYTHON_CYCLES)
    count = max(20, INTERPRETED_EVALUATIONS // (10 * size))
    yield "reference interpreter", python_cycle(InterpretedSystem(supervisor), size, count)


def table(sizes: tuple[int, ...] = SIZES) -> str:
    """A row for each kind of robot and form of its controller."""
    rows = []
    for kind in KINDS:
        found: dict[str, list[float | None]] = {}
        for size in sizes:
            for name, time_s in _cycles(kind, size):
                found.setdefault(name, []).append(time_s)
        for name, times in found.items():
            cells = ["-" if item is None else f"{item * 1e6:.3g}" for item in times]
            first, last = times[0], times[-1]
            rows.append([f"{kind}, {name}", *cells, f"{last / first:.2f}" if first and last else "-"])
    header = ["robot and controller", *map(str, sizes), "last : first"]
    title = "Microseconds of a cycle, by the number of parts; C++ nodes run the generated C (gcc -O2)"
    return text_table(title, header, rows)
