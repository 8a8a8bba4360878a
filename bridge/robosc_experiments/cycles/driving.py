"""Cycles of a generated controller that drives, with real middleware to another process."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from robosc.model.structure import Communication, CommunicationKind, Model
from robosc.supervisor import Supervisor
from robosc.targets import GenerateOptions
from robosc.targets.code.c.layout import make_layout
from robosc.targets.code.naming import package_name
from robosc.targets.cpp.model import fill_name
from robosc_experiments.cycles.isolated import SCRIPTS, write_unit
from robosc_experiments.cycles.rclcpp import VARIABLES, prefixes, rclcpp_prefix
from robosc_experiments.cycles.times import LIMIT_S, OTHER, Samples, clear_scan
from robosc_experiments.processes import Program
from robosc_experiments.ros import Middleware
from robosc_experiments.ros1 import Ros1
from robosc_experiments.ros2 import Ros2
from robosc_experiments.scenario import ScenarioError

VELOCITIES = "/cmd_vel"
TOPIC = "/robosc_evaluation/cmd_vel"
"""Topic of its own: no robot listens there."""

_HEADER = Path("/usr/include/ros/ros.h")
_LIBRARIES = ("roscpp", "rosconsole", "roscpp_serialization", "rostime", "xmlrpcpp", "boost_system", "pthread", "m")
_FLAGS = ("-O2", "-ffp-contract=off")


def measured_driving(middleware: str, experiment: str, supervisor: Supervisor, runs: int, cycles: int) -> Samples | str:
    """Measure a controller that publishes velocities.

    Args:
        middleware: `roscpp`, `rclcpp`, `rclpy` or `rospy`.
        experiment: `maze` or `line`.
        supervisor: Supervisor of the controller.
        runs: Number of runs.
        cycles: Number of cycles in each run.

    Returns:
        Seconds of each `cycle` and of each `publish` alone; or the reason why there are none.
    """
    move = _mover(supervisor.model)
    if move is None:
        return "its model sends no velocities"
    ros = Ros2() if middleware in ("rclpy", "rclcpp") else Ros1()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            if middleware == "roscpp":
                command = _compiled(experiment, supervisor, move, folder)
            elif middleware == "rclcpp":
                command = _built(experiment, supervisor, move, folder)
            else:
                command = _interpreted(middleware, ros, experiment, supervisor, folder)
            return _run(ros, [*command, str(runs), str(cycles)], folder)
        except subprocess.CalledProcessError as error:
            return f"it failed: {_reason(error.stderr or '')}"[:300]
        except (ScenarioError, OSError, ValueError, IndexError, subprocess.SubprocessError) as error:
            return (str(error).splitlines() or ["it failed"])[0][:300]


def _reason(errors: str) -> str:
    """Return the line that says why a program failed: a compiler's first error, else the last line."""
    lines = errors.strip().splitlines() or ["without a word"]
    return next((line for line in lines if ": error:" in line or line.startswith("CMake Error")), lines[-1])


def _mover(model: Model) -> Communication | None:
    """The first message that sets velocities."""
    kind = CommunicationKind.INCOMING_MESSAGE
    return next((item for item in model.communications if (item.kind, item.identifier) == (kind, VELOCITIES)), None)


def _interpreted(
    middleware: str, ros: Middleware, experiment: str, supervisor: Supervisor, folder: Path
) -> Sequence[str]:
    unit = write_unit(supervisor, "python", folder / "unit")
    identifier, data, _ = OTHER[experiment]
    comes = json.dumps({"first": [identifier, data], "ranges": clear_scan()})
    return (ros.interpreter or sys.executable, str(SCRIPTS / "driving.py"), middleware, TOPIC, str(unit), comes)


def _compiled(experiment: str, supervisor: Supervisor, move: Communication, folder: Path) -> Sequence[str]:
    """Return the command of the program with roscpp."""
    gcc, gxx = shutil.which("gcc"), shutil.which("g++")
    if gcc is None or gxx is None or not _HEADER.exists():
        raise ScenarioError("gcc, g++ or roscpp is not installed")
    unit = _write_program("roscpp", "ros1-cpp", experiment, supervisor, move, folder)
    libraries = [f"-l{name}" for name in _LIBRARIES]
    _call(unit.parent, [gcc, "-std=c99", *_FLAGS, "-c", unit.name, "-o", "unit.o"])
    _call(unit.parent, [gxx, "-std=c++17", *_FLAGS, "driving.cpp", "unit.o", *libraries, "-o", "driving"])
    return (str(unit.parent / "driving"),)


def _built(experiment: str, supervisor: Supervisor, move: Communication, folder: Path) -> Sequence[str]:
    """Return the command of the program with rclcpp, which CMake finds and builds."""
    prefix = rclcpp_prefix()
    if prefix is None:
        raise ScenarioError(f"rclcpp is not installed: no folder of {' or '.join(VARIABLES)} has it")
    cmake, gcc, gxx = (shutil.which(name) for name in ("cmake", "gcc", "g++"))
    if cmake is None or gcc is None or gxx is None:
        raise ScenarioError("cmake, gcc or g++ is not installed")
    unit = _write_program("rclcpp", "ros2-cpp", experiment, supervisor, move, folder)
    text = (SCRIPTS / "driving_rclcpp.cmake").read_text(encoding="utf-8")
    text = text.replace("@flags@", " ".join(_FLAGS)).replace("@p@", unit.stem)
    (unit.parent / "CMakeLists.txt").write_text(text, encoding="utf-8")
    found = ";".join(map(str, prefixes()))
    compilers = (f"-DCMAKE_C_COMPILER={gcc}", f"-DCMAKE_CXX_COMPILER={gxx}")
    _call(unit.parent, [cmake, "-S", ".", "-B", "build", f"-DCMAKE_PREFIX_PATH={found}", *compilers])
    _call(unit.parent, [cmake, "--build", "build"])
    # Its libraries come before those of other packages of ROS 2, such as the wheels that this Python may have.
    libraries = os.pathsep.join(filter(None, (str(prefix / "lib"), os.environ.get("LD_LIBRARY_PATH", ""))))
    return ("/usr/bin/env", f"LD_LIBRARY_PATH={libraries}", str(unit.parent / "build" / "driving"))


def _write_program(
    middleware: str, target: str, experiment: str, supervisor: Supervisor, move: Communication, folder: Path
) -> Path:
    """Write the program in C++ beside the files of a target; return the path of its supervisor's file."""
    unit = write_unit(supervisor, target, folder / "unit")
    layout = make_layout(supervisor)
    filled = {
        "p": unit.stem,
        "middleware": middleware,
        "communication": layout.communications[move.name],
        "package": package_name(supervisor, GenerateOptions(), "controller"),
        "fill": fill_name(layout, move),
        "first": OTHER[experiment][2],
        "topic": TOPIC,
        "ranges": ", ".join(map(repr, clear_scan())),
    }
    text = (SCRIPTS / "driving.cpp").read_text(encoding="utf-8")
    for place, other in filled.items():
        text = text.replace(f"@{place}@", other)
    (unit.parent / "driving.cpp").write_text(text, encoding="utf-8")
    shutil.copy(SCRIPTS / f"driving_{middleware}.hpp", unit.parent)
    return unit


def _call(folder: Path, command: Sequence[str]) -> None:
    subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True, timeout=LIMIT_S)  # noqa: S603


def _run(ros: Middleware, command: Sequence[str], folder: Path) -> Samples:
    """Run the program with a subscriber beside it, and return the content of the last line that it prints."""
    with ros.running(folder) as variables:
        theirs: Mapping[str, str] = ros.node_environment(variables)
        kind = "rclpy" if ros.connection == "ros2" else "rospy"
        arguments = (str(SCRIPTS / "subscriber.py"), kind, TOPIC)
        with Program("subscriber", arguments, folder, interpreter=ros.interpreter, variables=theirs):
            done = subprocess.run(  # noqa: S603
                command, env=dict(theirs), capture_output=True, text=True, timeout=LIMIT_S, check=True
            )
    found: Samples = json.loads(done.stdout.splitlines()[-1])
    return found
