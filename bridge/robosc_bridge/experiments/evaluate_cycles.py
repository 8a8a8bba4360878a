"""How long a cycle of the control loop takes: the paper's Table I with the figures of this machine.

A cycle is one decision of the executor, with the request's event and the silent steps after it. *Without middleware*
the generated controller publishes into nothing, while its sensors change. *With middleware* it drives, and publishes a
Twist that a subscriber in another process takes, with a pause between cycles: what is measured is not how fast a queue
fills.
"""

import importlib.util
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from robosc.model.structure import CommunicationKind, Model
from robosc.supervisor.structure import Supervisor
from robosc.targets import generate, write_files

CYCLES = 1000
RUNS = 3
LIMIT_S = 120.0

FAR_M, NEAR_M = 3.0, 0.2
BEAMS = 360
_TURNS = 50
"""So many things come before an obstacle appears or goes."""

PAPER: Mapping[tuple[str, bool], tuple[float, float, float, float]] = {
    ("line", True): (34, 11, 160, 25),
    ("maze", True): (40, 9, 660, 40),
    ("line", False): (5, 0, 73, 5),
    ("maze", False): (2, 0, 139, 7),
}
"""Table I: mean, minimum, maximum and standard deviation in microseconds, by scenario and whether with middleware."""

_OTHER: Mapping[str, tuple[str, Any, str]] = {
    "line": ("/line/correction", 0.1, "line_correction(&r, ++now_us, 0.1)"),
    "maze": ("/rotate_done", None, "rotate_done(&r, ++now_us)"),
}
"""What comes beside scans: its topic, its data, and the same in C."""


@dataclass(frozen=True, slots=True)
class CycleTimes:
    """Times of cycles.

    Attributes:
        experiment: `maze` or `line`.
        what: What was measured, in words.
        has_middleware: Whether messages went out.
        microseconds: Mean, minimum, maximum and standard deviation; None: not measured.
        count: How many cycles.
        why: Why it was not measured.
        median_us: What a machine does that has nothing else to do: others' work makes the mean and the maximum.
    """

    experiment: str
    what: str
    has_middleware: bool
    microseconds: tuple[float, float, float, float] | None
    count: int = 0
    why: str = ""
    median_us: float = 0.0

    @property
    def paper(self) -> tuple[float, float, float, float]:
        """The paper's figures of the same."""
        return PAPER[self.experiment, self.has_middleware]


def measure(experiment: str, supervisor: Supervisor, runs: int = RUNS, cycles: int = CYCLES) -> tuple[CycleTimes, ...]:
    """Measure a controller in every form that this machine can run.

    Args:
        experiment: `maze` or `line`; its model has a message on `/scan`, and one beside it.
        supervisor: Of a controller, not of a layer: a layer decides nothing by itself.
        runs: How often.
        cycles: How many cycles each time.
    """
    return (
        _row(experiment, "generated C, gcc -O2", False, _measured_c(experiment, supervisor, runs, cycles)),
        _row(experiment, "generated Python", False, _measured_python(experiment, supervisor, runs, cycles)),
        _row(experiment, "generated Python, rclpy", True, _measured_rclpy(experiment, supervisor, runs, cycles)),
    )


def _row(experiment: str, what: str, has_middleware: bool, found: Sequence[float] | str) -> CycleTimes:
    if isinstance(found, str):
        return CycleTimes(experiment, what, has_middleware, None, why=found)
    us = [sample * 1e6 for sample in found]
    figures = (statistics.fmean(us), min(us), max(us), statistics.pstdev(us))
    return CycleTimes(experiment, what, has_middleware, figures, len(us), median_us=statistics.median(us))


# Generated Python.


class Nothing:
    """A middleware that takes everything and does nothing: what remains is the controller's own time."""

    def prepare(self, communication: str, data: Any) -> Any:
        """The data itself."""
        return data

    def is_default(self, communication: str, message: Any) -> bool:
        """Whether there is no data."""
        return message is None

    def publish(self, communication: str, message: Any) -> None:
        """Nothing."""

    def publish_default(self, identifier: str) -> None:
        """Nothing."""

    def call(self, communication: str, request_id: int, message: Any) -> None:
        """Nothing."""

    send_goal = call

    def cancel_goal(self, communication: str, goal_id: int) -> None:
        """Nothing."""


def feed(experiment: str, number: int) -> tuple[str, Any]:
    """What comes: every other time a scan, whose obstacle comes and goes."""
    if number % 2 == 0:
        identifier, data, _ = _OTHER[experiment]
        return identifier, data
    return "/scan", SimpleNamespace(ranges=[(FAR_M, NEAR_M)[number // _TURNS % 2]] * BEAMS)


def free_way() -> tuple[str, Any]:
    """A scan in a corridor that is free ahead: either robot drives on."""
    walls = (*range(60, 121), *range(240, 301))
    return "/scan", SimpleNamespace(ranges=[0.3 if beam in walls else FAR_M for beam in range(BEAMS)])


def load_controller(file: Path) -> Any:
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


def _write(supervisor: Supervisor, target: str, folder: Path) -> Path:
    """Generate a target; the path of its supervisor's file."""
    files = generate(supervisor, target)
    write_files(files, folder)
    (name,) = (path for path in files if path.endswith(("_supervisor.py", "_supervisor.c")))
    return folder / name


def _measured_python(experiment: str, supervisor: Supervisor, runs: int, cycles: int) -> list[float]:
    samples = []
    with tempfile.TemporaryDirectory() as folder:
        module = load_controller(_write(supervisor, "python", Path(folder)))
        for _ in range(runs):
            executor = module.Executor(module.Supervisor(), Nothing())
            executor.start()
            for number in range(cycles):
                executor.receive(*feed(experiment, number))
                begin_s = time.perf_counter()
                executor.tick()
                samples.append(time.perf_counter() - begin_s)
    return samples


# Generated C.


def _measured_c(experiment: str, supervisor: Supervisor, runs: int, cycles: int) -> list[float] | str:
    gcc = shutil.which("gcc")
    if gcc is None:
        return "gcc is not installed"
    template = (Path(__file__).parent / "templates" / "cycles.c").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        unit = _write(supervisor, "c99", folder)
        filled = {"p": unit.stem, "other": _OTHER[experiment][2], "runs": str(runs), "cycles": str(cycles)}
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


# With middleware.


def _measured_rclpy(experiment: str, supervisor: Supervisor, runs: int, cycles: int) -> list[float] | str:
    if importlib.util.find_spec("rclpy") is None or importlib.util.find_spec("geometry_msgs") is None:
        return "rclpy is not installed"
    if not any(item.identifier == "/cmd_vel" for item in _requested(supervisor.model)):
        return "its model sends no velocities"
    with tempfile.TemporaryDirectory() as name:
        file = _write(supervisor, "python", Path(name))
        command = [sys.executable, "-m", "robosc_bridge.experiments.evaluate_rclpy", str(file), experiment]
        try:
            done = subprocess.run(  # noqa: S603
                [*command, str(runs), str(cycles)], capture_output=True, text=True, timeout=LIMIT_S, check=True
            )
            found: list[float] = json.loads(done.stdout.splitlines()[-1])
        except subprocess.CalledProcessError as error:
            return f"it failed: {(error.stderr.strip().splitlines() or ['without a word'])[-1]}"[:300]
        except (subprocess.SubprocessError, OSError, ValueError, IndexError) as error:
            return f"it failed: {error}"[:300]
    return found


def _requested(model: Model) -> list[Any]:
    return [item for item in model.communications if item.kind is CommunicationKind.INCOMING_MESSAGE]
