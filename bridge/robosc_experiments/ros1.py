"""The scenarios over ROS 1: a generated rospy node, the example nodes for ROS 1 and the twin, around a master.

Everything but the world runs under the Python that ROS 1 was installed for.
"""

import os
import shutil
import socket
import subprocess
import time
import xmlrpc.client
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from robosc_experiments import ros
from robosc_experiments.processes import Program, environment
from robosc_experiments.scenario import Outcome, Say, ScenarioError
from robosc_simulated.ros.ros1 import PYTHON, plain_environment

MASTER_LIMIT_S = 20.0
_POLL_S = 0.02
_MODULES = "rospy, geometry_msgs.msg, nav_msgs.msg, sensor_msgs.msg, std_msgs.msg, rosgraph_msgs.msg"


@cache
def missing() -> str | None:
    """Return the reason why nothing can be run on ROS 1 here; None: it can."""
    if _master() is None:
        return "ROS 1 is not installed: there is no rosmaster"
    try:
        found = subprocess.run(  # noqa: S603 (an interpreter of the system)
            [PYTHON, "-c", f"import {_MODULES}"], env=plain_environment(), capture_output=True, text=True, check=False
        )
    except OSError as error:
        return f"ROS 1 is not installed: {error}"
    return None if found.returncode == 0 else f"ROS 1 is not installed: {found.stderr.strip().splitlines()[-1]}"


def _master() -> str | None:
    return shutil.which("rosmaster", path=os.pathsep.join((os.environ.get("PATH", ""), "/usr/bin")))


class Ros1(ros.Middleware):
    """ROS 1 on this machine alone, with a master of its own."""

    connection = "ros1"
    helpers = "robosc_examples.ros1"
    twin = "robosc_simulated.ros.ros1"
    interpreter = PYTHON

    def node_environment(self, variables: Mapping[str, str]) -> Mapping[str, str]:
        """Without what is of this process's Python."""
        return plain_environment(variables)

    @contextmanager
    def running(self, folder: Path) -> Iterator[Mapping[str, str]]:
        """Start the master, and wait until it answers."""
        why, path = missing(), _master()
        if why is not None or path is None:
            raise ScenarioError(why or "ROS 1 is not installed")
        end_s = time.monotonic() + MASTER_LIMIT_S
        while True:
            port = _free_port()
            variables = {
                **environment(),
                "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
                "ROS_IP": "127.0.0.1",
                "ROS_HOME": str(folder / "ros_home"),
                "ROS_LOG_DIR": str(folder / "ros_log"),
            }
            program = Program(
                "master",
                (path, "--core", "-p", str(port)),
                folder,
                interpreter=PYTHON,
                variables=self.node_environment(variables),
            )
            with program as master:
                while master.status is None and not _answers(variables["ROS_MASTER_URI"]):
                    if time.monotonic() > end_s:
                        raise ScenarioError(f"the master of ROS 1 does not answer:\n{master.output()}")
                    time.sleep(_POLL_S)
                # Another program may have taken the port.
                if master.status is None:
                    yield variables
                    return
            if time.monotonic() > end_s:
                raise ScenarioError(f"the master of ROS 1 does not start:\n{master.output()}")

    def arguments(self, parameters: Mapping[str, object], remappings: Mapping[str, str]) -> list[str]:
        """Private parameters and names."""
        return [
            *(f"_{name}:={value}" for name, value in parameters.items()),
            *(f"{name}:={other}" for name, other in remappings.items()),
        ]


def _free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def _answers(address: str) -> bool:
    try:
        with xmlrpc.client.ServerProxy(address) as master:
            master.getPid("/scenario")
    except (OSError, xmlrpc.client.Error):
        return False
    return True


def run_maze(folder: Path, scene: str | Path, *, speed: float, say: Say, seed: int = 0) -> Outcome:
    """Let a robot out of a maze, over ROS 1; see `ros.run_maze`."""
    return ros.run_maze(Ros1(), folder, scene, speed=speed, say=say, seed=seed)


def run_line(folder: Path, scene: str | Path, *, speed: float, say: Say, seed: int = 0) -> Outcome:
    """Let a robot follow a line behind a supervision layer, over ROS 1; see `ros.run_line`."""
    return ros.run_line(Ros1(), folder, scene, speed=speed, say=say, seed=seed)
