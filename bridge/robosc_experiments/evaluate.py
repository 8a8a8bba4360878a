"""`robosc evaluate`: the paper's experiments, run whole, and one report of them."""

import argparse
import contextlib
import importlib
import itertools
import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

from robosc.cli.arguments import suggest
from robosc.cli.output import ExitCode, ProgressLine, UsageError, print_json
from robosc.model.structure import Deployment
from robosc.source import visible

if TYPE_CHECKING:
    from robosc.supervisor import Supervisor
    from robosc_experiments.cycles.times import CycleTimes
    from robosc_experiments.lines_of_code import CodeSize
    from robosc_experiments.report import FailedRun, Report, ReportedRun
    from robosc_experiments.scenario import Outcome

CONNECTIONS = ("serial", "ros2", "ros1")

_FASTEST = 100.0
# The limit of scene files; their reader takes too long to import for a command line.
_MOST_SEED = 2**31 - 1
_MODULES = "robosc_experiments"

_DESCRIPTION = """\
Run the paper's experiments whole: a maze solver and a line follower, each a supervisor that drives a simulated robot in
real time or faster. Write one report with pictures and tables: sequences of events, every log checked against its
supervisor, the robot's motion against the requirements, times of a control cycle, lines of code of all scenarios.
"""

_EPILOG = """\
exit status:
  0  every experiment was run, and nothing was wrong
  1  something was wrong, or an experiment could not be run; the report says what
  2  wrong use
"""


@dataclass(frozen=True)
class Experiment:
    """One of the paper's scenarios.

    Attributes:
        name: `maze` or `line`.
        function: Function of the connections' modules that runs it.
        serial_module: Module for serial lines.
        scenes: The worlds, one after the other, if no other is wanted.
        speed: Speed of the world, as a multiple of the clock's, if nothing else is wanted.
        deployment: Deployment of its supervisor.
    """

    name: str
    function: str
    serial_module: str
    scenes: tuple[str, ...]
    speed: float
    deployment: Deployment


EXPERIMENTS: Mapping[str, Experiment] = {
    "maze": Experiment("maze", "run_maze", "maze", ("maze-rooms",), 10.0, Deployment.CONTROLLER),
    # The camera shows so many pictures a second of the clock: the follower of a faster world would see too few.
    "line": Experiment("line", "run_line", "line", ("line-oval", "line-curves"), 2.0, Deployment.LAYER),
}


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "evaluate",
        help="run the paper's experiments and report them",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--experiment",
        action="append",
        choices=list(EXPERIMENTS),
        default=[],
        help="run this experiment only (may be repeated; default: both)",
    )
    parser.add_argument(
        "--connection",
        action="append",
        choices=list(CONNECTIONS),
        default=[],
        help="connection of the supervisor with the robot: serial lines and the bridge, or generated nodes on ROS 2 or "
        "ROS 1 (may be repeated; default: serial)",
    )
    scene = parser.add_argument(
        "--scene",
        metavar="NAME|FILE",
        help="the world, for one experiment (default: maze-rooms; line-oval, then line-curves); --list-scenes of "
        "'python -m robosc_simulated' names those that come with it",
    )
    suggest(scene, _scene_names)
    parser.add_argument(
        "--speed",
        type=_speed,
        metavar="N",
        help="let the world pass N times as fast as the clock (default: 10 for the maze, 2 for the line)",
    )
    parser.add_argument(
        "--seed", type=_seed, default=0, metavar="N", help="of what the scene leaves to chance (default: 0)"
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path("out/evaluation"),
        metavar="DIR",
        help="the report's folder (default: %(default)s)",
    )
    parser.add_argument(
        "--no-cycles", action="store_true", help="do not measure control cycles, which takes a minute or two"
    )
    parser.add_argument(
        "--models",
        type=Path,
        action="append",
        metavar="PATH",
        default=[],
        help="also count the lines of code of this model, or of every model in this folder (may be repeated; default: "
        "every model of the corpus with a recorded run, unless --experiment chooses; a few seconds for each)",
    )
    parser.add_argument("--no-runs", action="store_true", help="do not let robots drive: measure and count only")
    parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
    parser.set_defaults(run=run)


def _scene_names() -> tuple[str, ...]:
    from robosc_simulated.scene import scene_names

    return scene_names()


def _speed(text: str) -> float:
    value = float(text)
    if not (math.isfinite(value) and 0 < value <= _FASTEST):
        raise ValueError
    return value


def _seed(text: str) -> int:
    value = int(text)
    if not 0 <= value <= _MOST_SEED:
        raise ValueError
    return value


# Argparse prints these names.
_seed.__name__ = f"whole number from 0 to {_MOST_SEED},"
_speed.__name__ = f"number above 0, up to {_FASTEST:g},"


def run(arguments: argparse.Namespace) -> int:
    """Run and report; 0 if nothing was wrong.

    Raises:
        UsageError: The report cannot be written, or its options do not fit together.
    """
    names: Sequence[str] = list(dict.fromkeys(arguments.experiment)) or list(EXPERIMENTS)
    connections: Sequence[str] = list(dict.fromkeys(arguments.connection)) or ["serial"]
    if arguments.scene is not None and len(names) > 1:
        raise UsageError("--scene is the world of one experiment: name it with --experiment")
    from robosc_experiments.corpus import CORPUS, models_of
    from robosc_experiments.processes import interruptible
    from robosc_experiments.report import write_report

    wanted: Sequence[Path] = arguments.models
    if not wanted and not arguments.experiment and CORPUS.is_dir():
        wanted = [CORPUS]
    try:
        models = models_of(wanted)
    except OSError as error:
        raise UsageError(f"cannot read {error.filename}: {error.strerror or error}") from error
    folder: Path = arguments.output
    progress = ProgressLine()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # No server, bridge or robot runs on, whichever signal ends this program.
        with interruptible():
            report = evaluated(
                [EXPERIMENTS[name] for name in names],
                connections,
                folder,
                scene=arguments.scene,
                speed=arguments.speed,
                seed=arguments.seed,
                models=models,
                has_runs=not arguments.no_runs,
                has_cycles=not arguments.no_cycles,
                say=progress.show,
            )
        files = write_report(report, folder)
    except OSError as error:
        raise UsageError(f"cannot write {error.filename or folder}: {error.strerror or error}") from error
    finally:
        progress.clear()
    if arguments.json:
        print_json(_document(report, files))
    else:
        _print(report, files)
    return ExitCode.OK if report.has_passed else ExitCode.FAILED


def evaluated(
    experiments: Sequence[Experiment],
    connections: Sequence[str],
    folder: Path,
    *,
    scene: str | None,
    speed: float | None,
    seed: int,
    models: Mapping[str, Path],
    has_runs: bool,
    has_cycles: bool,
    say: Callable[[str], None],
) -> "Report":
    """Run experiments, and gather the contents of a report of them.

    Args:
        experiments: Experiments to run.
        connections: Connections to run them over.
        folder: Folder of the report; every run gets a new folder in it.
        scene: The world; None: each experiment's own ones.
        speed: Speed of the world, as a multiple of the clock's; None: each experiment's own.
        seed: Seed of what a scene leaves to chance.
        models: More models whose lines of code are counted, by name.
        has_runs: True if the experiments are run; else only their code is looked at.
        has_cycles: True if control cycles are measured.
        say: Function that takes lines of progress.
    """
    from robosc_experiments.corpus import scenario_sizes
    from robosc_experiments.report import Report, machine_facts

    runs: list[ReportedRun] = []
    failures: list[FailedRun] = []
    cycles: list[CycleTimes] = []
    sizes: dict[str, tuple[CodeSize, ...]] = {}
    for experiment in experiments if has_runs else ():
        for connection, place in product(connections, experiment.scenes if scene is None else (scene,)):
            title = f"{experiment.name} over {connection}, {place}"
            found = _run(
                experiment,
                connection,
                folder,
                place,
                speed or experiment.speed,
                seed,
                lambda text, title=title: say(f"{title}: {text}"),  # type: ignore[misc]
            )
            if isinstance(found, _Reported):
                runs.append(found.run)
            elif found not in failures:
                # A part that no world can be run without is reported once.
                failures.append(found)
    for experiment in experiments:
        say(f"{experiment.name}: lines of code")
        sizes[experiment.name], controller = _sizes(experiment)
        if has_cycles:
            say(f"{experiment.name}: control cycles")
            cycles += _cycles(experiment, controller)
    for number, (name, model) in enumerate(models.items(), 1):
        say(f"lines of code, model {number} of {len(models)}: {name}")
        # An experiment may have the name, too.
        sizes[name if name not in sizes else visible(str(model))] = scenario_sizes(model)
    date = time.strftime("%Y-%m-%d", time.gmtime())
    return Report(tuple(runs), tuple(failures), tuple(cycles), sizes, machine_facts(date))


@dataclass(frozen=True)
class _Reported:
    run: "ReportedRun"


def _run(
    experiment: Experiment,
    connection: str,
    folder: Path,
    scene: str,
    speed: float,
    seed: int,
    say: Callable[[str], None],
) -> "_Reported | FailedRun":
    from robosc_experiments.report import FailedRun
    from robosc_experiments.scenario import ScenarioError

    module = experiment.serial_module if connection == "serial" else connection
    place = _new_folder(folder, f"{experiment.name}-{connection}")
    try:
        run_scenario = getattr(importlib.import_module(f"{_MODULES}.{module}"), experiment.function)
        outcome = run_scenario(place, scene, speed=speed, say=say, seed=seed)
        return _Reported(reported(outcome, folder))
    except ScenarioError as error:
        return FailedRun(experiment.name, connection, str(error))
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("robosc"):
            raise
        return FailedRun(experiment.name, connection, f"the package {error.name} is not installed")


def _new_folder(folder: Path, name: str) -> Path:
    """A new, empty folder for a run: what an earlier one has left stays, and one that is under way has its own."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in itertools.count(1):
        with contextlib.suppress(FileExistsError):
            (place := folder / f"{name}-{number}").mkdir()
            break
    return place


def reported(outcome: "Outcome", folder: Path) -> "ReportedRun":
    """Return the report of a run: its log is read and checked, its pictures are drawn into its folder.

    Args:
        outcome: The run.
        folder: Folder of the report.

    Raises:
        ScenarioError: The files that the run has left behind cannot be read.
    """
    from robosc.errors import InvalidSupervisorError
    from robosc.event_logs import LogError, PlotError, check_log, draw_sequence, read_log
    from robosc.supervisor.codec import decode
    from robosc_experiments.report import ReportedRun
    from robosc_experiments.scenario import ScenarioError
    from robosc_simulated.motion import MotionError

    folder.mkdir(parents=True, exist_ok=True)
    try:
        log = read_log(outcome.event_log)
        check = check_log(log, decode(outcome.supervisor.read_bytes()))
        sequence, page = outcome.folder / "sequence.png", outcome.folder / "sequence.html"
        for path in (sequence, page):
            # The paper leaves out repeated data, too, which would hide the rest.
            draw_sequence(log, path, only_changes=True, title=f"{outcome.name} over {outcome.connection}")
        map_ = _map(outcome)
    except (LogError, PlotError, InvalidSupervisorError, MotionError) as error:
        raise ScenarioError(str(error)) from error
    return ReportedRun(
        experiment=outcome.name,
        connection=outcome.connection,
        scene=outcome.scene.name,
        check=check,
        faults=outcome.faults,
        figures=tuple((name, f"{value:.4g}") for name, value in outcome.figures.items()),
        sequence=_relative(sequence, folder),
        page=_relative(page, folder),
        map=_relative(map_, folder),
    )


def _map(outcome: "Outcome") -> Path:
    """The robot's way in its world."""
    from robosc_simulated.map_picture import draw_map
    from robosc_simulated.motion import read_motion

    path = outcome.folder / "map.png"
    draw_map(outcome.scene, read_motion(outcome.motion), path)
    return path


def _relative(path: Path, folder: Path) -> str:
    """Return the name that a page in a folder uses for a file below it."""
    return path.resolve().relative_to(folder.resolve()).as_posix()


def _supervisor(experiment: Experiment, deployment: Deployment) -> "tuple[Supervisor, CodeSize]":
    """The supervisor of an experiment's model over serial lines, and the model's size.

    Raises:
        UsageError: There is none.
    """
    from robosc.certification import make_supervisor
    from robosc.language import load_bundle
    from robosc.language.interfaces import interface_folders
    from robosc_experiments.lines_of_code import model_size

    model: Path = importlib.import_module(f"{_MODULES}.{experiment.serial_module}").MODEL
    bundle = load_bundle(model, (), interface_folders())
    made = make_supervisor(bundle, deployment=deployment)
    if made.supervisor is None:
        raise UsageError(f"{model}: {made.reason or 'the model has errors'}")
    return made.supervisor, model_size(bundle)


def _sizes(experiment: Experiment) -> "tuple[tuple[CodeSize, ...], Supervisor]":
    """Lines of code of the model and its targets; and its supervisor as a controller."""
    from robosc_experiments.lines_of_code import target_sizes

    controller, model = _supervisor(experiment, Deployment.CONTROLLER)
    deployed = controller
    if experiment.deployment is not Deployment.CONTROLLER:
        deployed, _ = _supervisor(experiment, experiment.deployment)
    return (model, *target_sizes(deployed)), controller


def _cycles(experiment: Experiment, controller: "Supervisor") -> "tuple[CycleTimes, ...]":
    from robosc_experiments.cycles.measure import measure

    return measure(experiment.name, controller)


def _document(report: "Report", files: Sequence[Path]) -> dict[str, object]:
    return {
        "status": "passed" if report.has_passed else "failed",
        "report": str(files[0]),
        "runs": [
            {
                "experiment": run.experiment,
                "connection": run.connection,
                "scene": run.scene,
                "events": run.check.events,
                "requests": run.check.requests,
                "blocked": run.check.blocked,
                "violations": run.check.violation_count,
                "faults": list(run.faults),
                "figures": dict(run.figures),
            }
            for run in report.runs
        ],
        "not_run": [
            {"experiment": item.experiment, "connection": item.connection, "why": item.why} for item in report.failures
        ],
        "cycles": [
            {
                "experiment": times.experiment,
                "what": times.what,
                "has_middleware": times.has_middleware,
                "cycles": times.count,
                "median_us": None if times.microseconds is None else times.median_us,
                "not_measured": times.why,
            }
            for times in report.cycles
        ],
        "lines_of_code": {
            name: {size.name: {"lines": size.lines, "files": size.files, "why_not": size.why} for size in members}
            for name, members in report.sizes.items()
        },
    }


def _print(report: "Report", files: Sequence[Path]) -> None:
    from robosc_experiments.size_tables import summaries

    lines = [
        f"{run.experiment} over {run.connection}, {run.scene}: {run.check.events} events, log: {run.log_verdict}, "
        f"motion: {run.motion_verdict}"
        for run in report.runs
    ]
    lines += [f"{item.experiment} over {item.connection}: not run: {item.why}" for item in report.failures]
    found = [each for each in summaries(report.sizes) if not each.is_model]
    if found:
        medians = ", ".join(f"{each.name} {each.factors[1]:.1f}" for each in found)
        lines.append(f"lines of code, times the model's (medians of {len(report.sizes)}): {medians}")
    lines += [report.verdict, *map(str, files[:2])]
    sys.stdout.write("".join(f"{visible(line)}\n" for line in lines))
