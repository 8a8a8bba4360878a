"""Cycles that publish a Twist through real middleware, and publish() alone beside it.

The controller runs as it does in a node; a subscriber in another process takes what it publishes, so that each publish
really sends. There is a pause between cycles: what is measured is not how fast a queue fills.
"""

import json
import os
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from execution.robots import SMALL, WITH, supervisor
from figures import micro
from robosc.targets import GenerateOptions, generate, write_files
from support.ros2 import environment, own_domain

SCRIPTS = Path(__file__).parent / "scripts"
DEBIAN_PYTHON = "/usr/bin/python3"
LIMIT_S = 30.0
_CPP_LIBRARIES = "-lroscpp -lrosconsole -lroscpp_serialization -lrostime -lxmlrpcpp -lboost_system -lpthread".split()
_AIM = "34"

Samples = dict[str, list[float]]
"""Seconds of `cycle` and of `publish` alone."""


@contextmanager
def _ended(process: "subprocess.Popen[str]") -> Iterator["subprocess.Popen[str]"]:
    """A process that ends with the block."""
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def rows() -> list[list[str]]:
    """Rows of the table: each robot on each middleware; one line says so where a middleware is missing."""
    found: list[list[str]] = []
    for kind, measure in (("rclpy", _rclpy), ("rospy", _rospy), ("roscpp", _roscpp)):
        for name in SMALL:
            label = f"{name}, {'generated C' if kind == 'roscpp' else 'generated Python'}, {kind}"
            samples = measure(name)
            if isinstance(samples, str):
                found.append([f"{label}: not measured, {samples}", *[""] * 7])
                continue
            aim = _AIM if kind == "rclpy" else ""
            found.append([f"{label}: cycle with publish", *micro(samples["cycle"]), WITH[name], aim])
            found.append([f"{label}: publish alone", *micro(samples["publish"]), "", ""])
            own = statistics.fmean(samples["cycle"]) - statistics.fmean(samples["publish"])
            found.append([f"{label}: difference of the means", f"{own * 1e6:.2f}", "", "", "", "", "", ""])
    return found


def _rclpy(name: str) -> Samples | str:
    try:
        import rclpy  # noqa: F401
    except ImportError:
        return "rclpy is not installed"
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        variables = {**os.environ, **environment(stack.enter_context(own_domain()), folder)}
        return _measured(name, folder, sys.executable, "rclpy", variables, stack)


def _rospy(name: str) -> Samples | str:
    missing = _missing_ros1()
    if missing:
        return missing
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        return _measured(name, folder, DEBIAN_PYTHON, "rospy", _master(stack, folder), stack)


def _measured(name: str, folder: Path, python: str, kind: str, variables: dict[str, str], stack: ExitStack) -> Samples:
    """What the script measures that runs the generated package."""
    write_files(generate(supervisor(name), "python", GenerateOptions("measured")), folder)
    _subscriber(stack, [python, str(SCRIPTS / f"{kind}_subscriber.py")], variables)
    command = [python, str(SCRIPTS / "python_cycle.py"), kind, str(folder), name]
    return _samples(command, variables)


def _subscriber(stack: ExitStack, command: list[str], variables: dict[str, str]) -> None:
    stack.enter_context(_ended(subprocess.Popen(command, env=variables, stdout=subprocess.DEVNULL, text=True)))


def _samples(command: list[str], variables: dict[str, str]) -> Samples:
    output = subprocess.check_output(command, env=variables, text=True, timeout=3 * LIMIT_S)
    found: Samples = json.loads(output.splitlines()[-1])
    return found


def _missing_ros1() -> str:
    if shutil.which("rosmaster", path="/usr/bin") is None:
        return "ROS 1 is not installed"
    command = [DEBIAN_PYTHON, "-c", "import rospy, geometry_msgs.msg"]
    done = subprocess.run(command, env=_debian(), capture_output=True, check=False)
    return "rospy is not installed" if done.returncode else ""


def _debian() -> dict[str, str]:
    """An environment for Debian's own programs: nothing of a virtual environment."""
    kept = {name: value for name, value in os.environ.items() if name in ("HOME", "LANG", "TMPDIR", "USER")}
    return {**kept, "PATH": "/usr/bin:/bin"}


def _master(stack: ExitStack, folder: Path) -> dict[str, str]:
    """Start a master of its own on a free port: the environment of its nodes."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    variables = {
        **_debian(),
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
        "ROS_IP": "127.0.0.1",
        "ROS_HOME": str(folder),
        "ROS_LOG_DIR": str(folder / "log"),
    }
    command = [DEBIAN_PYTHON, "/usr/bin/rosmaster", "--core", "-p", str(port)]
    with (folder / "master.txt").open("w") as output:
        stack.enter_context(_ended(subprocess.Popen(command, env=variables, stdout=output, stderr=output, text=True)))
    _wait(lambda: _listens(port), "the master")
    return variables


def _listens(port: int) -> bool:
    with socket.socket() as client:
        return client.connect_ex(("127.0.0.1", port)) == 0


def _wait(condition: Callable[[], Any], what: str) -> None:
    deadline = time.monotonic() + LIMIT_S
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"waited {LIMIT_S} s in vain for {what}")
        time.sleep(0.02)


def _roscpp(name: str) -> Samples | str:
    missing = _missing_ros1()
    if missing or shutil.which("g++") is None or not Path("/usr/include/ros/ros.h").exists():
        return missing or "roscpp or g++ is not installed"
    prefix = f"{name}_supervisor"
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        for path, text in generate(supervisor(name), "c99").items():
            (folder / path).write_text(text, encoding="utf-8")
        text = (SCRIPTS / "roscpp_cycle.cpp").read_text(encoding="utf-8")
        for place, filled in (
            ("@p@", prefix),
            ("@P@", prefix.upper()),
            ("@other@", _OTHER[name]),
        ):
            text = text.replace(place, filled)
        (folder / "bench.cpp").write_text(text, encoding="utf-8")
        for command in (
            ["gcc", "-std=c99", "-O2", "-c", f"{prefix}.c", "-o", "unit.o"],
            ["g++", "-O2", "bench.cpp", "unit.o", *_CPP_LIBRARIES, "-lm", "-o", "bench"],
        ):
            subprocess.run(command, cwd=folder, env=_debian(), check=True)
        variables = _master(stack, folder)
        _subscriber(stack, [DEBIAN_PYTHON, str(SCRIPTS / "rospy_subscriber.py")], variables)
        return _samples([str(folder / "bench")], variables)


_OTHER = {
    "line_follower": "line_follower_supervisor_receive_line_correction(&r, ++now_us, 0.1)",
    "maze_solver": "maze_solver_supervisor_receive_rotate_done(&r, ++now_us)",
}
