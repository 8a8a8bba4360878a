"""Control cycles of robots with goals, beside those of the same robots without.

A *cycle* is one message, with its event, and one decision, in generated Python with a middleware that does nothing and
without an event log. Processor time is measured, of both robots in turn and in the same process, so that neither other
programs nor the speed of the computer at that moment favour one; the median counts. Both request the same: the shuttle
drives to and fro, one request in each cycle, which is the most that goals can cost. With a scan, each cycle also
receives 360 ranges, of which the model reads some, as on a robot with a LiDAR.
"""

import statistics
import time
from typing import Any

from figures import text_table
from robosc.certification import make_supervisor
from robosc_experiments.cycles.isolated import NullMiddleware
from support.generated import load_module
from support.models import bundle_of

ROUNDS, CYCLES = 40, 1_000

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


def _executor(goals: str) -> Any:
    made = make_supervisor(bundle_of(_SHUTTLE.replace("@goals@", goals)))
    assert made.supervisor is not None, made.diagnostics
    module = load_module(made.supervisor)
    executor = module.Executor(module.Supervisor(), NullMiddleware())
    executor.start()
    return executor


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


def table() -> str:
    """Table of this benchmark."""
    without, with_goals = _executor(""), _executor(_GOALS)
    rows = []
    for name, measure in (
        ("decision in a state that does not change", _steady_us),
        ("request and answer in each cycle", _driving_us),
        ("request, answer and scan in each cycle", _scanning_us),
    ):
        samples = [(measure(without), measure(with_goals)) for _ in range(ROUNDS)]
        left, right = (statistics.median(column) for column in zip(*samples, strict=True))
        rows.append([name, f"{left:.2f}", f"{right:.2f}", f"{right / left:.2f}"])
    return text_table("Goals: processor time of a cycle in us", ["cycle", "without goals", "with goals", "ratio"], rows)
