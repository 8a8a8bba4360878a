"""Whole-process time of the commands with a warm file cache: what a user waits for."""

import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from figures import text_table

ROOT = Path(__file__).parents[2]
RUNS = 7
AIMS_S = {"check": 0.4, "synth": 0.8}


def _seconds(command: list[str], environment: dict[str, str]) -> float:
    begin = time.perf_counter()
    subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    return time.perf_counter() - begin


def table() -> str:
    """Minimum, median and maximum of seven runs of each command on each example."""
    robosc = shutil.which("robosc", path=str(Path(sys.executable).parent))
    assert robosc is not None, "install the project first"
    rows = []
    with tempfile.TemporaryDirectory() as cache:
        # Compiled modules are part of a warm cache, whatever the caller's environment says.
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": cache}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        commands = [("python -c pass", [sys.executable, "-c", "pass"], "")]
        for name in ("line_follower/line_follower", "maze_solver/maze_solver", "navigation/navigation"):
            model = str(ROOT / "examples" / f"{name}.rscd")
            commands += [
                (f"robosc {command} {name.split('/')[1]}", [robosc, command, model], f"{AIMS_S[command]:.1f}")
                for command in ("check", "synth")
            ]
        for label, command, aim in commands:
            _seconds(command, environment)
            runs = [_seconds(command, environment) for _ in range(RUNS)]
            rows.append([label, *(f"{figure:.3f}" for figure in (min(runs), statistics.median(runs), max(runs))), aim])
    return text_table("Cold start, seconds (whole process)", ["command", "min", "median", "max", "aim"], rows)
