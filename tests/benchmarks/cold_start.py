"""Whole-process time of the commands with a warm file cache: processor time, which a busy machine changes little, and
what a user waits for; and what the processor time goes into."""

import os
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from figures import text_table

ROOT = Path(__file__).parents[2]
RUNS = 11
AIMS_S = {"check": 0.15, "synth": 0.25}
"""Processor time that a command may take, with that of Python itself."""

MODELS = (
    "examples/line_follower/line_follower.rscd",
    "examples/maze_solver/maze_solver.rscd",
    "examples/navigation/navigation.rscd",
    "examples/object_finder/object_finder.rscd",
    "examples/person_follower/person_follower.rscd",
    "examples/goals/patrol/patrol.rscd",
    "tests/models/wafer_handling.cif",
)

_IMPORT = re.compile(r"import time: +(\d+) \| +\d+ \| +(\S+)")


class _Run(NamedTuple):
    processor_s: float
    wall_s: float


def _run(command: list[str], environment: dict[str, str]) -> _Run:
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    return _Run(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall)


def _median(command: list[str], environment: dict[str, str]) -> _Run:
    _run(command, environment)
    runs = [_run(command, environment) for _ in range(RUNS)]
    return _Run(statistics.median(run.processor_s for run in runs), statistics.median(run.wall_s for run in runs))


def _imports(words: list[str], environment: dict[str, str]) -> list[str]:
    """Return how many modules a command loads and the least seconds that this took, then the same of RoboSC's own."""
    command = [sys.executable, "-X", "importtime", "-m", "robosc.cli.command", *words]
    best: dict[str, int] = {}
    for _ in range(5):
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        for found in _IMPORT.finditer(done.stderr):
            best[found[2]] = min(int(found[1]), best.get(found[2], sys.maxsize))
    own = {name: spent for name, spent in best.items() if name.partition(".")[0] == "robosc"}
    return [str(len(best)), f"{sum(best.values()) / 1e6:.3f}", str(len(own)), f"{sum(own.values()) / 1e6:.3f}"]


def table() -> str:
    """Medians of eleven runs of each command on each model, and what they load on the first of them."""
    robosc = shutil.which("robosc", path=str(Path(sys.executable).parent))
    assert robosc is not None, "install the project first"
    rows, loaded = [], []
    with tempfile.TemporaryDirectory() as cache:
        # Compiled modules are part of a warm cache, whatever the caller's environment says.
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": cache}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        python = _median([sys.executable, "-c", "pass"], environment)
        rows.append(["python -c pass", f"{python.processor_s:.3f}", "", "", f"{python.wall_s:.3f}"])
        for model in MODELS:
            for command, aim in AIMS_S.items():
                found = _median([robosc, command, str(ROOT / model)], environment)
                # The CIF model is no small one: its search takes seconds.
                wanted = "" if model.endswith(".cif") and command == "synth" else f"{aim:.2f}"
                own = found.processor_s - python.processor_s
                label = f"robosc {command} {Path(model).name}"
                rows.append([label, f"{found.processor_s:.3f}", f"{own:.3f}", wanted, f"{found.wall_s:.3f}"])
        for command in AIMS_S:
            loaded.append([f"robosc {command}", *_imports([command, str(ROOT / MODELS[0])], environment)])
    titles = ["command", "processor", "without Python", "aim", "wall"]
    whole = text_table("Cold start, seconds (whole process, user and system, median of 11)", titles, rows)
    titles = ["command", "modules", "seconds", "of RoboSC", "seconds"]
    return f"{whole}\n\n{text_table('Modules of a cold start, line follower', titles, loaded)}"
