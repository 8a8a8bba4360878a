"""roslaunch brings up the twin beside generated nodes, from their folders as they are: nothing is built."""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets import generate, write_files
from robosc_simulated import MotionError, load_scene, read_motion
from robosc_simulated.motion import Motion
from robosc_simulated.motion_checks import check_line, check_maze
from support.generated import example_supervisor
from support.models import EXAMPLES
from support.process import Process
from support.ros1 import Master, missing, until

pytestmark = [pytest.mark.ros1, pytest.mark.skipif(missing() is not None, reason=str(missing())), pytest.mark.real_time]

LIMIT_S = 90.0


@pytest.fixture(scope="module")
def master(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Master]:
    with Master(tmp_path_factory.mktemp("master")) as made:
        yield made


def launched(master: Master, folder: Path, *arguments: str) -> Process:
    """Roslaunch with a launch file of the package `robosc_twin`; generated packages are in the folder."""
    # This tree's own twin, wherever the interpreter finds another one.
    python = folder / "python"
    root = EXAMPLES.parent
    paths = os.pathsep.join(str(root / name) for name in (".", "bridge", "proto"))
    python.write_text(f'#!/bin/sh\nPYTHONPATH={paths} exec {sys.executable} "$@"\n')
    python.chmod(0o755)
    variables = {
        **master.variables,
        "ROS_PACKAGE_PATH": os.pathsep.join((str(EXAMPLES), str(folder / "packages"))),
        "ROBOSC_PYTHON": str(python),
    }
    command = ["/usr/bin/roslaunch", "-p", str(master.port), "robosc_twin", *arguments]
    return Process(command, variables, folder / "launch")


def motion_of(path: Path) -> Motion | None:
    """Return the motion that was written until now; None: nothing."""
    try:
        return read_motion(path)
    except (MotionError, OSError):
        return None


def end(launch: Process) -> None:
    launch.signal(signal.SIGINT)
    assert launch.wait(30.0) == 0
    assert "escalating" not in launch.stdout + launch.stderr


def driven(
    master: Master,
    folder: Path,
    package: str,
    supervisor: Supervisor,
    has_arrived: Callable[[Motion], bool],
    *arguments: str,
) -> Motion:
    """Launch a supervisor's package on the twin until the robot has arrived, and return its motion."""
    write_files(generate(supervisor, "ros1"), folder / "packages" / package)
    path = folder / "motion.jsonl"
    with launched(master, folder, *arguments, f"options:=--motion {path}") as launch:
        until(
            lambda: (found := motion_of(path)) is not None and has_arrived(found),
            "the robot to arrive",
            launch,
            limit_s=LIMIT_S,
        )
        end(launch)
    found = motion_of(path)
    assert found is not None
    return found


def test_the_maze_solver_is_launched_and_gets_out(master: Master, tmp_path: Path) -> None:
    solver = example_supervisor("maze_solver/maze_solver")
    found = driven(
        master,
        tmp_path,
        "maze_solver_controller",
        solver,
        lambda motion: any(each.happening == "goal" for each in motion.happenings),
        "maze_solver.launch",
        "scene:=maze-rooms",
        "speed:=10",
    )
    assert check_maze(load_scene("maze-rooms"), found) == ()


def test_the_supervised_line_follower_is_launched_and_keeps_to_its_line(master: Master, tmp_path: Path) -> None:
    layer = example_supervisor("line_follower/line_follower_layer", Deployment.LAYER)
    found = driven(
        master,
        tmp_path,
        "line_follower_layer_layer",
        layer,
        lambda motion: any(each.x_m > 0.9 for each in motion.samples),
        "line_follower.launch",
        "speed:=4",
    )
    assert check_line(load_scene("line-oval"), found, least_m=0.9) == ()
