"""Real ROS 1 in tests of generated C++: catkin builds, an own master, nodes and peers as processes, no fixed sleeps."""

import contextlib
import json
import os
import shutil
import socket
import subprocess
import threading
from pathlib import Path
from typing import Any, Self

import pytest

from robosc.certification import make_supervisor
from robosc.language import load_bundle
from robosc.supervisor import Supervisor
from robosc.targets import generate, write_files
from support.process import Process
from support.shared import shared
from support.waiting import wait_until

LIMIT_S = 20.0
PYTHON = "/usr/bin/python3"
PEER = Path(__file__).with_name("ros1_cpp_peer.py")

_NEEDED = (
    Path("/usr/include/ros/ros.h"),
    Path("/usr/include/actionlib/client/action_client.h"),
    Path("/usr/include/move_base_msgs/MoveBaseAction.h"),
    Path("/usr/include/diagnostic_msgs/DiagnosticArray.h"),
    Path("/usr/include/std_srvs/Trigger.h"),
    Path("/usr/share/catkin/cmake/catkinConfig.cmake"),
    Path("/usr/lib/python3/dist-packages/rospy"),
    Path("/usr/lib/python3/dist-packages/move_base_msgs"),
)


def missing() -> str | None:
    """Name the parts missing to build and run roscpp nodes, as a reason to skip; None if nothing is."""
    tools = [name for name in ("cmake", "g++", "rosmaster") if shutil.which(name, path="/usr/bin:/bin") is None]
    files = [str(path) for path in _NEEDED if not path.exists()]
    lacking = [*tools, *files]
    return f"ROS 1 is not installed: {', '.join(lacking)}" if lacking else None


def plain_environment(**more: str) -> dict[str, str]:
    """An environment of the system's own Python and libraries."""
    kept = {name: os.environ[name] for name in ("HOME", "LANG", "TMPDIR") if name in os.environ}
    return {**kept, "PATH": "/usr/bin:/bin", **more}


def supervisor_of(model: Path) -> Supervisor:
    """The synthesized supervisor of a model's file."""
    made = make_supervisor(load_bundle(model))
    assert made.supervisor is not None, made.reason
    return made.supervisor


def built(supervisor: Supervisor, folder: Path, *options: str) -> Path:
    """A folder with the generated catkin package in `src`, built without a warning; its develspace is `devel`."""
    source = folder / "src"
    write_files(generate(supervisor, "ros1-cpp"), source)
    configure = ["cmake", str(source), f"-DPYTHON_EXECUTABLE={PYTHON}", "-DCMAKE_BUILD_TYPE=None", *options]
    for command in (configure, ["make", "-s"]):
        (folder / "build").mkdir(exist_ok=True)
        done = subprocess.run(
            command, cwd=folder / "build", env=plain_environment(), capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, (done.stdout + done.stderr)[-6000:]
        if command[0] == "make":
            assert "warning" not in done.stderr, done.stderr[-6000:]
    return folder


def built_once(supervisor: Supervisor, factory: pytest.TempPathFactory) -> Path:
    """The same for all tests of a run."""
    name = f"ros1_cpp_{supervisor.model.name}_{supervisor.deployment}"
    return shared(factory, name, lambda folder: built(supervisor, folder))


class Master(Process):
    """A rosmaster of its own.

    Args:
        folder: Folder for output and logs.
    """

    def __init__(self, folder: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.variables = plain_environment(
            ROS_MASTER_URI=f"http://127.0.0.1:{self.port}",
            ROS_IP="127.0.0.1",
            ROS_HOME=str(folder / "home"),
            ROS_LOG_DIR=str(folder / "log"),
        )
        self._command = ["/usr/bin/rosmaster", "--core", "-p", str(self.port)]
        super().__init__(self._command, self.variables, folder / "master")
        wait_until(self._is_up, "the master")

    def another(self, folder: Path) -> Process:
        """One in its place that knows no node; it has ended."""
        return Process(self._command, self.variables, folder)

    def _is_up(self) -> bool:
        assert self.is_running, self.stderr
        with socket.socket() as tried:
            return tried.connect_ex(("127.0.0.1", self.port)) == 0


class Peer:
    """A rospy process that obeys orders and reports what it hears.

    Args:
        master: Its master.
        folder: Folder for its errors.
        name: Name of its node.
    """

    def __init__(self, master: Master, folder: Path, name: str = "peer") -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.heard: list[dict[str, Any]] = []
        with (folder / f"{name}.txt").open("wb") as error:
            self._process = subprocess.Popen(
                [PYTHON, "-P", str(PEER), name],
                env=master.variables,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=error,
                text=True,
            )
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        try:
            wait_until(lambda: bool(self.of("ready")), "the peer")
        except BaseException:
            self.kill()
            raise

    def _listen(self) -> None:
        for line in self._process.stdout or ():
            self.heard.append(json.loads(line))

    def order(self, what: str, name: str = "", type_: str = "", data: Any = None) -> None:
        """Give an order."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"do": what, "name": name, "type": type_, "data": data}) + "\n")
        self._process.stdin.flush()
        assert not self.of("error"), self.of("error")

    def of(self, kind: str, name: str = "") -> list[Any]:
        """The data of everything of a kind that was heard so far."""
        return [item.get("data") for item in list(self.heard) if item["kind"] == kind and item.get("name", "") == name]

    def messages(self, topic: str) -> list[Any]:
        """The messages heard on a topic."""
        return self.of("message", topic)

    def publish(self, topic: str, type_: str, **fields: Any) -> None:
        """Send a message."""
        self.order("publish", topic, type_, fields)

    def kill(self) -> None:
        """End it at once, as a crash would."""
        self._process.kill()
        self._process.wait()
        self._listener.join()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()


def node_command(workspace: Path, *parameters: str) -> list[str]:
    """Return the command that starts the one node of a built package, with private parameters like `period:=0.02`."""
    folder = workspace / "build" / "devel" / "lib"
    (program,) = (*folder.glob("*/controller"), *folder.glob("*/layer"))
    return [str(program), *(f"_{parameter}" for parameter in parameters)]
