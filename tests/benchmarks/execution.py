"""Time of a control cycle and of an event, without middleware, beside the paper's Table I.

A *cycle* is what the paper measures: one run of the control loop, here `tick`: a decision, the request's event,
silent steps and releases, with a middleware that does nothing. An *event* is `receive`: conversion of the data,
the step, silent steps. The second table runs the cycles while the sensors change, so that decisions differ.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import generated_c
from figures import micro, text_table
from null_middleware import NullMiddleware
from robosc.execution.executor import Executor
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.protocol import ControlledSystem
from support.generated import example_supervisor, load_system

CYCLES = 1000
RUNS = 3

SCANS = tuple(SimpleNamespace(ranges=[distance] * 360) for distance in (3.0, 0.2))


def _line_follower(executor: Executor, number: int) -> tuple[str, Any]:
    """A robot on its line; now and then an obstacle."""
    return ("/scan", SCANS[number // 50 % 2]) if number % 2 else ("/line/correction", 0.1)


def _maze_solver(executor: Executor, number: int) -> tuple[str, Any]:
    """Walls come and go; every rotation ends."""
    return ("/scan", SCANS[number // 50 % 2]) if number % 2 else ("/rotate_done", None)


EXAMPLES: dict[str, tuple[Callable[[Executor, int], tuple[str, Any]], str, str]] = {
    "line_follower/line_follower": (_line_follower, "5 / 0 / 73 / 5", "5"),
    "maze_solver/maze_solver": (_maze_solver, "2 / 0 / 139 / 7", "2"),
}


def _executor(system: ControlledSystem) -> Executor:
    executor = Executor(system, NullMiddleware())
    executor.start()
    return executor


def _steady(system: ControlledSystem, feed: Callable[[Executor, int], tuple[str, Any]]) -> list[float]:
    """Cycles in one state: nothing is received between them."""
    samples = []
    for _ in range(RUNS):
        executor = _executor(system)
        for number in range(2):
            executor.receive(*feed(executor, number))
        for _ in range(CYCLES):
            begin = time.perf_counter()
            executor.tick()
            samples.append(time.perf_counter() - begin)
    return samples


def _changing(
    system: ControlledSystem, feed: Callable[[Executor, int], tuple[str, Any]]
) -> tuple[list[float], list[float]]:
    """Cycles and events while the sensors change."""
    cycles, events = [], []
    for _ in range(RUNS):
        executor = _executor(system)
        for number in range(CYCLES):
            identifier, data = feed(executor, number)
            begin = time.perf_counter()
            executor.receive(identifier, data)
            middle = time.perf_counter()
            executor.tick()
            cycles.append(time.perf_counter() - middle)
            events.append(middle - begin)
    return cycles, events


def table() -> str:
    """Mean, minimum, maximum and standard deviation in microseconds of 3 x 1000 cycles each; then generated C."""
    rows = []
    for name, (feed, paper, aim) in EXAMPLES.items():
        supervisor = example_supervisor(name)
        systems: dict[str, ControlledSystem] = {
            "generated": load_system(supervisor),
            "interpreted": InterpretedSystem(supervisor),
        }
        for kind, system in systems.items():
            cycles, events = _changing(system, feed)
            label = f"{name.split('/')[1]}, {kind}"
            rows.append([f"{label}: cycle", *micro(_steady(system, feed)), paper, aim])
            rows.append([f"{label}: cycle, sensors changing", *micro(cycles), paper, aim])
            rows.append([f"{label}: event", *micro(events), "", ""])
    header = ["microseconds", "mean", "min", "max", "s.d.", "paper: mean/min/max/s.d.", "aim (mean)"]
    return text_table("Execution without middleware", header, rows) + "\n\n" + generated_c.table()
