"""Cycles and events without middleware.

A *cycle* is what the paper measures: one run of the control loop, here `tick`: a decision, the request's event,
silent steps and releases, with a middleware that does nothing. An *event* is `receive`: conversion of the data,
the step, silent steps; where one message stands for several events, such as the maze solver's scans for three, its time
is shared among them. Cycles are measured in one state, and while the sensors change, so that decisions differ.

There is no event log: with one, each event is read, taken and reported by itself, which takes time. What
an executor need not do again it is not seen to do here: a request is asked whether it is allowed only after something
changed that it depends on, so a large robot's cycle takes little longer than a small one's.
"""

import statistics
import time
from collections import Counter

from execution import c_cycles
from execution.robots import LARGE, SMALL, WITHOUT, feed, supervisor
from figures import micro
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.executor import Executor
from robosc.execution.runtime.protocol import ControlledSystem
from robosc_experiments.cycles.isolated import NullMiddleware
from robosc_experiments.cycles.times import CYCLES, RUNS
from support.generated import load_system

AIM_CYCLE, AIM_EVENT = "5", "2"


def _executor(system: ControlledSystem) -> Executor:
    executor = Executor(system, NullMiddleware())
    executor.start()
    return executor


def _steady(name: str, system: ControlledSystem) -> list[float]:
    """Cycles in one state: nothing is received between them."""
    samples = []
    for _ in range(RUNS):
        executor = _executor(system)
        for number in range(2):
            executor.receive(*feed(name, number))
        for _ in range(CYCLES):
            begin = time.perf_counter()
            executor.tick()
            samples.append(time.perf_counter() - begin)
    return samples


def _changing(name: str, system: ControlledSystem) -> tuple[list[float], list[float]]:
    """Cycles and events while the sensors change."""
    cycles, events = [], []
    batches = Counter(info.identifier for info in system.description.communications if info.kind == "outgoing message")
    for _ in range(RUNS):
        executor = _executor(system)
        for number in range(CYCLES):
            identifier, data = feed(name, number)
            begin = time.perf_counter()
            executor.receive(identifier, data)
            middle = time.perf_counter()
            executor.tick()
            cycles.append(time.perf_counter() - middle)
            events.append((middle - begin) / batches[identifier])
    return cycles, events


_KINDS = ("cycle", "cycle, sensors changing", "event")


def _python_rows(
    name: str, kind: str, system: ControlledSystem, means: dict[tuple[str, str], float]
) -> list[list[str]]:
    cycles, events = _changing(name, system)
    rows = []
    for what, samples in zip(_KINDS, (_steady(name, system), cycles, events), strict=True):
        paper = "" if what == "event" or name == LARGE else WITHOUT[name]
        aim = "" if kind != "generated Python" else AIM_EVENT if what == "event" else AIM_CYCLE
        rows.append([f"{name}, {kind}: {what}", *micro(samples), paper, aim])
        means[name, what] = statistics.median(samples)
    return rows


def rows() -> list[list[str]]:
    """Rows of the table: reference, generated Python, generated C; then the large robot beside the small ones."""
    found: list[list[str]] = []
    reference: dict[tuple[str, str], float] = {}
    means: dict[tuple[str, str], float] = {}
    for name in (*SMALL, LARGE):
        made = supervisor(name)
        found += _python_rows(name, "reference executor", InterpretedSystem(made), reference)
        found += _python_rows(name, "generated Python", load_system(made), means)
        if name != LARGE:
            found += c_cycles.rows(name)
    for what in _KINDS:
        factor = means[LARGE, what] / max(means[name, what] for name in SMALL)
        found.append([f"{LARGE}: {what}, times the slower small robot's", f"{factor:.2f}", "", "", "", "", "", "3"])
    return found
