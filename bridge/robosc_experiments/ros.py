"""A robot on ROS: a generated node, helper nodes of the example robots and the twin, as processes of their own.

Nothing but the starting of programs differs between ROS 2 and ROS 1: that is a `Middleware`. Generated nodes live by
the computer's clock; where the world passes N times as fast, a controller decides N times as often.
"""

import os
import sys
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from robosc.certification import make_supervisor
from robosc.errors import RoboscError
from robosc.language import load_bundle
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor, encode
from robosc.targets import generate, write_files
from robosc_experiments.line import BOX, line_figures
from robosc_experiments.line import MODEL as LINE_MODEL
from robosc_experiments.maze import LIMIT_S, WORLD_LIMIT_S, path_figures
from robosc_experiments.processes import Program, finish
from robosc_experiments.records import Recorded
from robosc_experiments.scenario import Connection, Outcome, Say, ScenarioError
from robosc_experiments.serial import EXAMPLES, scene_of
from robosc_experiments.tail import LineCount
from robosc_experiments.watch import FREE_M, RobotWatch
from robosc_simulated.motion_checks import SETTLE_S, check_line, check_maze
from robosc_simulated.scene import scene_names

HELPERS = EXAMPLES / "robosc_examples"
MAZE_MODEL = EXAMPLES / "maze_solver" / "maze_solver.rscd"
"""For the ways of 1 m that the mazes of the package have."""

FASTEST, SLOWEST = 25.0, 0.5
"""Fastest and slowest speed of the world, as a multiple of the clock's."""

MAZE_PATIENCE_S, LINE_PATIENCE_S = 0.15, 0.06
"""Times of the world, in seconds, for which a robot in motion goes on without a new velocity.

A controller decides every 0.1 s, a camera shows a picture every 0.05 s: with not much more than one of them for each
velocity, few are on their way together, and what follows from one is not late, however busy the machine is.
"""

REACTION_S = 0.5
"""Time of the clock until a stop from outside the world has gone from the panel through the layer, in seconds.

The world does not know of it, and passes meanwhile.
"""

STEP_LIMIT_S = 60.0
_PERIOD_S = 0.1
_FINEST_PERIOD_S = 0.005
_SIMULATOR_LIMIT_S = 60.0


class Middleware(ABC):
    """A ROS, as programs on it are started.

    Attributes:
        connection: Name of it in an outcome.
        helpers: The package of the helper nodes.
        twin: The module of the twin.
        interpreter: Interpreter of the nodes; None: that of this process.
    """

    connection: Connection
    helpers: str
    twin: str
    interpreter: str | None = None

    @abstractmethod
    def running(self, folder: Path) -> AbstractContextManager[Mapping[str, str]]:
        """Have it ready within the block, and give the environment of the programs that talk on it.

        Args:
            folder: Folder for whatever it writes.

        Raises:
            ScenarioError: It is not installed, or does not start.
        """

    def node_environment(self, variables: Mapping[str, str]) -> Mapping[str, str]:
        """The environment of its nodes, where their interpreter is another one."""
        return variables

    @abstractmethod
    def arguments(self, parameters: Mapping[str, object], remappings: Mapping[str, str]) -> list[str]:
        """The arguments of a node that has parameters and other names."""


@dataclass(frozen=True)
class Setting(Recorded):
    """Setting of a run.

    Attributes:
        middleware: ROS to run on.
        source: Name or file of the scene.
        seed: Seed of what the scene leaves to chance.
        speed: Speed of the world, as a multiple of the clock's.
        patience_s: Time of the world, in seconds, for which a robot in motion goes on without a new velocity.
    """

    middleware: Middleware
    source: str
    seed: int
    speed: float
    patience_s: float

    @property
    def settle_s(self) -> float:
        """Maximum time of the world that the robot may take to stand still, in seconds."""
        return SETTLE_S + REACTION_S * self.speed


class Stage:
    """The programs of a run; use it as a context manager.

    Args:
        setting: Setting of the run.
        variables: Environment of the programs.
        package: Folder of the generated package.

    Attributes:
        setting: Setting of the run.
        simulator: The twin.
    """

    def __init__(self, setting: Setting, variables: Mapping[str, str], package: Path) -> None:
        self.setting = setting
        self._package = package
        self._variables = variables
        node_environment = setting.middleware.node_environment(variables)
        paths = (str(package), str(HELPERS), node_environment.get("PYTHONPATH", ""))
        self._node_environment = {**node_environment, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
        self._stack = ExitStack()
        self._programs: list[Program] = []
        self.simulator = self._program("simulator", ["-m", setting.middleware.twin, *self._world()], is_node=False)

    def _world(self) -> list[str]:
        setting = self.setting
        return [
            *("--scene", setting.source, "--seed", str(setting.seed), "--speed", str(setting.speed)),
            *("--wait", str(setting.patience_s), "--motion", str(setting.motion)),
        ]

    def _program(self, name: str, arguments: Sequence[str], *, is_node: bool = True, is_asked: bool = False) -> Program:
        return Program(
            name,
            arguments,
            self.setting.folder,
            is_preferred=not is_node,
            is_asked=is_asked or not is_node,
            interpreter=self.setting.middleware.interpreter if is_node else None,
            variables=self._node_environment if is_node else self._variables,
        )

    def _start(self, program: Program) -> Program:
        self._stack.enter_context(program)
        self._programs.append(program)
        return program

    def helper(
        self,
        node: str,
        parameters: Mapping[str, object] | None = None,
        remappings: Mapping[str, str] | None = None,
        *,
        is_asked: bool = False,
    ) -> Program:
        """Start a helper node."""
        middleware = self.setting.middleware
        arguments = middleware.arguments(parameters or {}, remappings or {})
        return self._start(self._program(node, ["-m", f"{middleware.helpers}.{node}", *arguments], is_asked=is_asked))

    def supervisor_node(self, existing: str | None = None) -> Program:
        """Start the generated node.

        Args:
            existing: The helper node that is the existing controller behind a layer.
        """
        setting = self.setting
        period_s = max(_PERIOD_S / setting.speed, _FINEST_PERIOD_S)
        parameters: dict[str, object] = {"log_folder": str(setting.events), "period": period_s}
        (module,) = (path.parent.name for path in self._package.glob("*/start.py"))
        arguments = ["-m", f"{module}.start", *setting.middleware.arguments(parameters, {})]
        if existing is not None:
            interpreter = setting.middleware.interpreter or sys.executable
            arguments += ["--controller", interpreter, "-m", f"{setting.middleware.helpers}.{existing}"]
        return self._start(self._program("supervisor", arguments))

    def start_world(self) -> None:
        """Start the twin: from now on there is something to see and to move.

        Raises:
            ScenarioError: It cannot be served; says why.
        """
        self._start(self.simulator)
        if (said := self.simulator.answer(_SIMULATOR_LIMIT_S)) != "ready":
            raise ScenarioError(f"the simulator said {said!r}")

    def require(self) -> None:
        """Raise ScenarioError if a program has ended by itself."""
        for program in self._programs:
            program.require()

    def finish(self) -> dict[str, float]:
        """Bring the robot to rest and end all programs, the twin last; processors' seconds, as figures.

        Raises:
            ScenarioError: One of them did not end in order.
        """
        used = {f"{program.name}_cpu_s": program.cpu_s for program in self._programs}
        nodes = [program for program in self._programs if program is not self.simulator]
        for program in (*reversed(nodes), self.simulator):
            finish(program)
        return used

    def __enter__(self) -> "Stage":
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()


@contextmanager
def prepared_stage(setting: Setting, say: Say) -> Iterator[Stage]:
    """A stage with nothing on it yet but a generated package; all has ended after the block.

    Raises:
        ScenarioError: A step fails; says which.
    """
    if not SLOWEST <= setting.speed <= FASTEST:
        raise ScenarioError(f"the speed must be from {SLOWEST:g} to {FASTEST:g}, and is {setting.speed:g}")
    if not setting.model.is_file() or not HELPERS.is_dir():
        raise ScenarioError(f"there is no model {setting.model}; scenarios are run in the source tree")
    setting.folder.mkdir(parents=True, exist_ok=True)
    if any(setting.folder.iterdir()):
        raise ScenarioError(f"{setting.folder} is not empty")
    say("making the supervisor")
    supervisor = _supervisor(setting)
    package = setting.folder / "package"
    write_files(generate(supervisor, setting.middleware.connection), package)
    with (
        setting.middleware.running(setting.folder) as variables,
        Stage(setting, variables, package) as stage,
    ):
        yield stage


def _supervisor(setting: Setting) -> Supervisor:
    try:
        made = make_supervisor(load_bundle(setting.model), deployment=setting.deployment)
    except (RoboscError, OSError) as error:
        raise ScenarioError(f"there is no supervisor of {setting.model}: {error}") from error
    if made.supervisor is None:
        raise ScenarioError(f"there is no supervisor of {setting.model}: {made.reason}")
    setting.supervisor.write_bytes(encode(made.supervisor))
    return made.supervisor


def run_maze(
    middleware: Middleware,
    folder: Path,
    scene: str | Path,
    *,
    speed: float,
    say: Say,
    seed: int = 0,
) -> Outcome:
    """Let a robot out of a maze, with a generated controller and the rotator of the example robots.

    Args:
        middleware: ROS to run on.
        folder: Folder that everything is written to; empty, or not there yet.
        scene: Name or file of the maze.
        speed: Speed of the world, as a multiple of the clock's.
        say: Function that takes lines of progress.
        seed: Seed of what the scene leaves to chance.

    Raises:
        ScenarioError: It could not be run to its end. A robot that does not find the way out is no such error, but a
            fault of the outcome.
    """
    setting = _setting(middleware, folder, MAZE_MODEL, Deployment.CONTROLLER, scene, seed, speed, MAZE_PATIENCE_S)
    if setting.scene.goal is None:
        raise ScenarioError(f"the scene {setting.scene.name} has no goal: there is no way out of it")
    with prepared_stage(setting, say) as stage:
        stage.helper("rotator")
        stage.supervisor_node()
        stage.start_world()
        watch = _watch(stage, say)
        for now in watch.samples("in the maze", LIMIT_S):
            if stage.simulator.ask("goal") != "not yet" or now.world_s > WORLD_LIMIT_S:
                break
        figures = stage.finish()
    motion = setting.read_motion()
    return setting.outcome(
        "maze", setting.middleware.connection, check_maze(setting.scene, motion), {**figures, **path_figures(motion)}
    )


def run_line(
    middleware: Middleware,
    folder: Path,
    scene: str | Path,
    *,
    speed: float,
    say: Say,
    seed: int = 0,
) -> Outcome:
    """Let a robot follow a line behind a generated supervision layer around a follower that heeds nothing.

    A box is put on the line and taken away again, and the stop button is pressed: each time the robot must stand
    still, while its follower goes on asking.

    Args:
        middleware: ROS to run on.
        folder: Folder that everything is written to; empty, or not there yet.
        scene: Name or file of a scene with a line and an obstacle called `box`.
        speed: Speed of the world, as a multiple of the clock's.
        say: Function that takes lines of progress.
        seed: Seed of what the scene leaves to chance.

    Raises:
        ScenarioError: It could not be run to its end. A robot that moves when it must not is no such error, but a
            fault of the outcome.
    """
    setting = _setting(middleware, folder, LINE_MODEL, Deployment.LAYER, scene, seed, speed, LINE_PATIENCE_S)
    place = setting.scene
    if place.line is None or BOX not in {each.name for each in place.obstacles}:
        raise ScenarioError(f"the scene {place.name} needs a line, and an obstacle called {BOX}")
    with prepared_stage(setting, say) as stage:
        stage.helper("line_detector", {}, {"/image": "/camera/image_raw"})
        panel = stage.helper("stop_panel", is_asked=True)
        stage.supervisor_node("careless_line_follower")
        stage.start_world()
        watch = _watch(stage, say)
        box = f"obstacle {BOX}"
        watch.drive("along the line")
        stage.simulator.send(f"{box} back")
        watch.stand("for the box on the line", lambda: stage.simulator.send(f"{box} away"), is_commanded=False)
        watch.drive("without the box")
        panel.send("stop")
        watch.stand("after the stop button", lambda: panel.send("resume"))
        watch.drive("after the resume button")
        figures = stage.finish()
    motion = setting.read_motion()
    judged = check_line(place, motion, watch.halts, settle_s=setting.settle_s, least_m=3 * FREE_M)
    faults = (*watch.faults, *judged)
    return setting.outcome("line", setting.middleware.connection, faults, {**figures, **line_figures(place, motion)})


def _watch(stage: Stage, say: Say) -> RobotWatch:
    setting = stage.setting
    # The node makes its log when it has started.
    counts: list[LineCount] = []

    def events() -> int:
        if not counts:
            counts.extend(LineCount(path) for path in setting.events.glob("*.jsonl"))
        return sum(count.poll() for count in counts)

    return RobotWatch(setting.motion, events, stage.require, say, step_s=STEP_LIMIT_S, settle_s=setting.settle_s)


def _setting(
    middleware: Middleware,
    folder: Path,
    model: Path,
    deployment: Deployment,
    scene: str | Path,
    seed: int,
    speed: float,
    patience_s: float,
) -> Setting:
    # The twin has another working folder.
    source = scene if isinstance(scene, str) and scene in scene_names() else str(Path(scene).resolve())
    place = scene_of(source, seed)
    return Setting(folder.resolve(), model.resolve(), deployment, place, middleware, source, seed, speed, patience_s)
