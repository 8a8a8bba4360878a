"""Cycles of generated C and generated Python by themselves: they publish into nothing, while their sensors change."""

import importlib.util
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from robosc.supervisor import Supervisor
from robosc.targets import generate, write_files
from robosc_experiments.cycles.times import LIMIT_S, OTHER, feed

SCRIPTS = Path(__file__).parent / "scripts"


class NullMiddleware:
    """A middleware that takes everything and does nothing: what remains is the controller's own time."""

    def prepare(self, communication: str, data: Any) -> Any:
        """The data itself."""
        return data

    def is_default(self, communication: str, message: Any) -> bool:
        """Return True if there is no data."""
        return message is None

    def publish(self, communication: str, message: Any) -> None:
        """Do nothing."""

    def publish_default(self, identifier: str) -> None:
        """Do nothing."""

    def call(self, communication: str, request_id: int, message: Any) -> None:
        """Do nothing."""

    send_goal = call

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        """Do nothing."""


def _load(file: Path) -> Any:
    """The module of a generated controller."""
    spec = importlib.util.spec_from_file_location(file.stem, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"{file} is no module")
    module = importlib.util.module_from_spec(spec)
    # Named tuples and protocols look their module up by its name.
    sys.modules[spec.name] = module
    try:
        spec.loader.exec_module(module)
    finally:
        del sys.modules[spec.name]
    return module


def write_unit(supervisor: Supervisor, target: str, folder: Path) -> Path:
    """Generate a target into a folder; the path of its supervisor's file."""
    files = generate(supervisor, target)
    write_files(files, folder)
    (name,) = (path for path in files if path.endswith(("_supervisor.py", "_supervisor.c")))
    return folder / name


def measured_python(experiment: str, supervisor: Supervisor, runs: int, cycles: int) -> list[float]:
    """Seconds of each cycle of generated Python, in this process."""
    samples = []
    with tempfile.TemporaryDirectory() as folder:
        module = _load(write_unit(supervisor, "python", Path(folder)))
        for _ in range(runs):
            executor = module.Executor(module.Supervisor(), NullMiddleware())
            executor.start()
            for number in range(cycles):
                executor.receive(*feed(experiment, number))
                begin_s = time.perf_counter()
                executor.tick()
                samples.append(time.perf_counter() - begin_s)
    return samples


def measured_c(experiment: str, supervisor: Supervisor, runs: int, cycles: int) -> list[float] | str:
    """Seconds of each cycle of generated C, compiled with `gcc -O2`; or why there are none."""
    gcc = shutil.which("gcc")
    if gcc is None:
        return "gcc is not installed"
    template = (SCRIPTS / "changing.c").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        unit = write_unit(supervisor, "c99", folder)
        filled = {"p": unit.stem, "other": OTHER[experiment][2], "runs": str(runs), "cycles": str(cycles)}
        for place, text in filled.items():
            template = template.replace(f"@{place}@", text)
        (folder / "cycles.c").write_text(template, encoding="utf-8")
        options = ["-std=c99", "-O2", "-ffp-contract=off"]
        command = [gcc, *options, unit.name, "cycles.c", "-lm", "-o", "cycles"]
        try:
            subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=LIMIT_S)  # noqa: S603
            output = subprocess.check_output([folder / "cycles"], text=True, timeout=LIMIT_S)  # noqa: S603
        except (OSError, subprocess.SubprocessError) as error:
            return f"the generated C was not compiled or did not run: {error}"[:300]
    return [float(line) for line in output.splitlines()]
