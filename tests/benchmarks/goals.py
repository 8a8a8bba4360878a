"""Control cycles of robots with goals, beside those of the same robots without.

A *cycle* is one message, with its event, and one decision, with a middleware that does nothing and without an event
log. Processor time is measured, of both robots in turn, so that neither other programs nor the speed of the computer at
that moment favour one; the least of many rounds counts. Both request the same: the shuttle drives to and fro, one
request in each cycle, which is the most that goals can cost. With a scan, each cycle also receives 360 ranges, of which
the model reads some, as on a robot with a LiDAR.
"""

import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from execution.c_cycles import program
from figures import text_table
from robosc.certification import make_supervisor
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.executor import Executor
from robosc.supervisor import Supervisor
from robosc_experiments.cycles.isolated import NullMiddleware
from support.generated import load_module
from support.models import bundle_of

ROUNDS, CYCLES = 40, 1_000
C_CYCLES = 100_000

_SHUTTLE = """robot Shuttle {
    datatype object Scan { ranges: array(double) }
    interface laser use LaserScan from sensor_msgs
    datatype enum Front from Scan to { min(value.ranges[340..20]) > 0.5 -> free default -> near }
    component Eyes {
        outgoing message scan with identifier: "/scan", type: Front links laser
        behaviour { variable front: Front = free on response from scan do front := value initial marked state open { } }
    }
    component Base {
        incoming message go with identifier: "/go", type: none
        incoming message back with identifier: "/back", type: none
        outgoing message arrived with identifier: "/arrived", type: none
        behaviour {
            initial marked state here { on request to go goto leaving }
            state leaving { on response from arrived goto there }
            marked state there { on request to back goto returning }
            state returning { on response from arrived goto here }
        }
    }
    requirement { go, back } needs Eyes.front = free
@goals@
}"""
_GOALS = """    goal always eventually Base.here
    goal always eventually Base.there
    assume always eventually Eyes.front = free
    assume Base.leaving leads to Base.there
    assume Base.returning leads to Base.here
"""
_SCAN = {"ranges": [1.0] * 360}


_C_MAIN = """
static double processor_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

int main(void)
{
    double begin_s;
    if (!begin_run()) {
        return 1;
    }
    begin_s = processor_s();
    for (int k = 0; k < @n@; k++) {
        @p@_tick(&r, ++now_us);
    }
    printf("%.3f ", 1e9 * (processor_s() - begin_s) / @n@);
    begin_s = processor_s();
    for (int k = 0; k < @n@; k++) {
        @p@_tick(&r, ++now_us);
        @p@_receive_arrived(&r, ++now_us);
    }
    printf("%.3f ", 1e9 * (processor_s() - begin_s) / @n@);
    begin_s = processor_s();
    for (int k = 0; k < @n@; k++) {
        const @p@_data_Scan_t scan = {{ranges[0], 360}};
        @p@_receive_scan(&r, ++now_us, &scan);
        @p@_tick(&r, ++now_us);
        @p@_receive_arrived(&r, ++now_us);
    }
    printf("%.3f\\n", 1e9 * (processor_s() - begin_s) / @n@);
    return 0;
}
"""
_CYCLES = (
    "decision in a state that does not change",
    "request and answer in each cycle",
    "request, answer and scan in each cycle",
)


def _supervisor(goals: str) -> Supervisor:
    made = make_supervisor(bundle_of(_SHUTTLE.replace("@goals@", goals)))
    assert made.supervisor is not None, made.diagnostics
    return made.supervisor


def _generated(supervisor: Supervisor) -> Any:
    module = load_module(supervisor)
    return module.Executor(module.Supervisor(), NullMiddleware())


def _interpreted(supervisor: Supervisor) -> Any:
    return Executor(InterpretedSystem(supervisor), NullMiddleware())


def _steady_us(executor: Any) -> float:
    begin_ns = time.process_time_ns()
    for _ in range(CYCLES):
        executor.tick()
    return (time.process_time_ns() - begin_ns) / CYCLES / 1e3


def _driving_us(executor: Any) -> float:
    begin_ns = time.process_time_ns()
    for _ in range(CYCLES):
        executor.tick()
        executor.receive("/arrived", None)
    return (time.process_time_ns() - begin_ns) / CYCLES / 1e3


def _scanning_us(executor: Any) -> float:
    begin_ns = time.process_time_ns()
    for _ in range(CYCLES):
        executor.receive("/scan", _SCAN)
        executor.tick()
        executor.receive("/arrived", None)
    return (time.process_time_ns() - begin_ns) / CYCLES / 1e3


def _rows(form: str, left: Sequence[Sequence[float]], right: Sequence[Sequence[float]]) -> list[list[str]]:
    """Rows of a form of the controller: the least of what was measured without goals and with them."""
    rows = []
    for cycle, without, with_goals in zip(_CYCLES, zip(*left, strict=True), zip(*right, strict=True), strict=True):
        low, high = min(without), min(with_goals)
        rows.append([f"{form}: {cycle}", f"{low:.3f}", f"{high:.3f}", f"{high / low:.2f}"])
    return rows


def _python_rows(
    form: str, make: Callable[[Supervisor], Any], supervisors: Sequence[Supervisor], rounds: int
) -> list[list[str]]:
    executors = [make(supervisor) for supervisor in supervisors]
    measured: list[list[list[float]]] = [[], []]
    for executor in executors:
        executor.start()
    for _ in range(rounds):
        for executor, samples in zip(executors, measured, strict=True):
            samples.append([measure(executor) for measure in (_steady_us, _driving_us, _scanning_us)])
    return _rows(form, *measured)


def _c_rows(supervisors: Sequence[Supervisor]) -> list[list[str]]:
    gcc = shutil.which("gcc")
    if gcc is None:
        return [["generated C: not measured, gcc is not installed", "", "", ""]]
    measured: list[list[list[float]]] = [[], []]
    with tempfile.TemporaryDirectory() as folder:
        programs = []
        for number, supervisor in enumerate(supervisors):
            place = Path(folder, str(number))
            place.mkdir()
            programs.append(program(supervisor, _C_MAIN.replace("@n@", str(C_CYCLES)), place, gcc))
        for _ in range(ROUNDS):
            for path, samples in zip(programs, measured, strict=True):
                words = subprocess.check_output([path], text=True).split()
                samples.append([float(word) / 1e3 for word in words])
    return _rows("generated C", *measured)


def table() -> str:
    """Table of this benchmark."""
    supervisors = [_supervisor(""), _supervisor(_GOALS)]
    rows = [
        *_python_rows("generated Python", _generated, supervisors, ROUNDS),
        *_c_rows(supervisors),
        *_python_rows("interpreter", _interpreted, supervisors, ROUNDS // 4),
    ]
    return text_table("Goals: processor time of a cycle in us", ["cycle", "without goals", "with goals", "ratio"], rows)
