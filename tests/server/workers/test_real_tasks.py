"""Real models in processes of their own: what becomes of them is what the function makes of them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.run import run_task
from robosc_server.tasks.task import Reason, Result, TaskKind, TaskLimits
from support.automata_models import TWO_TANKS
from support.hostile_models import products
from support.real_tasks import LIMITS, RealRunning, reason_of, synthesis, task_of
from support.real_tasks import real as real
from support.requests import MESSAGES, automata_bundle, bundle_at

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("kind", [TaskKind.CHECK, TaskKind.SYNTHESIZE, TaskKind.EXPLORE])
def test_the_outcome_is_that_of_the_function(real: RealRunning, kind: TaskKind) -> None:
    bundle = bundle_at(ROOT / "examples" / "line_follower" / "line_follower.rscd")
    task = task_of(MESSAGES[kind](bundle=bundle), kind)
    outcome = real.run(task)
    assert isinstance(outcome, Result)
    assert outcome == run_task(kind, task.request, LIMITS, lambda report: None)


ROBOTS = """
from support.hostile_models import buttons
from support.requests import small_request
for kind in TaskKind:
    done(kind, lambda: small_request(kind, buttons(2)))
"""
AUTOMATA = """
from robosc_api.v1 import synthesis_pb2 as pb
from support.automata_models import EMPTY, TWO_TANKS
from support.requests import MESSAGES, automata_bundle
more = {TaskKind.GENERATE: {'target': 'c99'}, TaskKind.SYNTHESIZE: {'modular': True}}
for text in (TWO_TANKS, EMPTY):
    for kind in [kind for kind in TaskKind if kind is not TaskKind.FORMAT]:
        bundle = lambda: automata_bundle(text, pb.LANGUAGE_CIF, 'tank.cif')
        done(kind, lambda: MESSAGES[kind](bundle=bundle(), **more.get(kind, {})))
"""


@pytest.mark.parametrize(
    ("requests", "count"), [(ROBOTS, len(TaskKind)), (AUTOMATA, 2 * (len(TaskKind) - 1))], ids=["robots", "automata"]
)
def test_processes_find_everything_loaded(requests: str, count: int) -> None:
    program = (
        "import sys\n"
        "from robosc_server.tasks.task import TaskKind, TaskLimits\n"
        "from robosc_server.workers.fork_server import _load\n"
        "function = _load('robosc_server.tasks.run:run_task')\n"
        "def done(kind, request):\n"
        "    loaded = set(sys.modules)\n"
        "    content = request().SerializeToString()\n"
        "    print(function(kind, content, TaskLimits(), lambda report: None).__class__.__name__, end=' ')\n"
        "    print(*sorted(set(sys.modules) - loaded))\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    command = [sys.executable, "-c", program + requests]
    done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    assert [line.strip() for line in done.stdout.splitlines()] == ["Result"] * count


def test_a_model_with_too_large_diagrams_reaches_the_limit_of_nodes(real: RealRunning) -> None:
    assert reason_of(real.run(synthesis(products()), TaskLimits(nodes=20_000))) is Reason.NODE_LIMIT


def test_automata_keep_to_the_limits_of_a_process(real: RealRunning) -> None:
    """Millions of states, one by one, take more time than there is; the process ends, and others go on."""
    many = "".join(
        f"plant p{n}: controllable c; location a: initial; marked; edge c goto b; location b: edge c goto a; end\n"
        for n in range(30)
    )
    bundle = automata_bundle(many, pb.LANGUAGE_CIF, "many.cif")
    task = task_of(pb.ExploreRequest(bundle=bundle, maximum_states=10**9), TaskKind.EXPLORE)
    for limits, reason in (
        (TaskLimits(seconds=2), Reason.TIME_LIMIT),
        (TaskLimits(cpu_seconds=2), Reason.CPU_LIMIT),
    ):
        assert reason_of(real.run(task, limits)) is reason
    small = automata_bundle(TWO_TANKS, pb.LANGUAGE_CIF, "tank.cif")
    assert isinstance(real.run(task_of(pb.CheckRequest(bundle=small), TaskKind.CHECK)), Result)
