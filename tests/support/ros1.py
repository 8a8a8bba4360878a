"""Real ROS 1 in tests: a master, nodes under Debian's Python, a peer that talks to them, all in own processes."""

import contextlib
import json
import os
import queue
import shutil
import signal
import socket
import subprocess
import threading
import time
import xmlrpc.client
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Self

from support.process import EXIT_LIMIT_S, Process
from support.waiting import wait_until

PYTHON = "/usr/bin/python3"
LIMIT_S = 20.0
REPEAT_S = 0.1

_MODULES = (
    "rospy, rosmaster, roslaunch, actionlib, move_base_msgs.msg, geometry_msgs.msg, sensor_msgs.msg, std_srvs.srv, "
    "diagnostic_msgs.msg"
)


@cache
def missing() -> str | None:
    """Return the reason why tests that need ROS 1 cannot run here; None if they can."""
    if not Path(PYTHON).exists() or shutil.which("rosmaster", path="/usr/bin") is None:
        return "ROS 1 (rosmaster) is not installed"
    command = [PYTHON, "-c", f"import {_MODULES}"]
    found = subprocess.run(command, env=clean_environment(), capture_output=True, text=True, check=False)
    return None if found.returncode == 0 else f"ROS 1 is not installed: {found.stderr.splitlines()[-1]}"


def clean_environment() -> dict[str, str]:
    """The environment of programs that are not of this interpreter's: without what ROS 2's wheels put there."""
    return {"PATH": "/usr/bin:/bin", "HOME": os.environ.get("HOME", "/"), "LANG": "C.UTF-8"}


def free_port() -> int:
    """A port without a listener."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


class Master:
    """A `rosmaster` of a test's own.

    Args:
        folder: Folder for what ROS writes.

    Attributes:
        variables: The environment of those that talk to it.
        process: The master.
    """

    def __init__(self, folder: Path) -> None:
        deadline = time.monotonic() + LIMIT_S
        while True:
            port = free_port()
            self.variables = {
                **clean_environment(),
                "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
                "ROS_IP": "127.0.0.1",
                "ROS_HOME": str(folder / "ros_home"),
                "ROS_LOG_DIR": str(folder / "ros_log"),
            }
            self.port = port
            self.process = self._start(folder)
            # Another process may have taken the port.
            while self.process.is_running:
                if self.is_up():
                    return
                assert time.monotonic() < deadline, f"no master\n{self.process.stderr}"
                time.sleep(0.01)
            assert time.monotonic() < deadline, f"no master\n{self.process.stderr}"

    def _start(self, folder: Path) -> Process:
        return Process(["/usr/bin/rosmaster", "--core", "-p", str(self.port)], self.variables, folder / "master")

    def is_up(self) -> bool:
        """Return True if the master answers."""
        try:
            with xmlrpc.client.ServerProxy(self.variables["ROS_MASTER_URI"]) as master:
                master.getPid("/test")
        except OSError:
            return False
        return True

    def delete_parameters(self, name: str) -> None:
        """Take what is below a name off the parameter server."""
        with xmlrpc.client.ServerProxy(self.variables["ROS_MASTER_URI"]) as master:
            master.deleteParam("/test", name)

    def set_parameter(self, name: str, value: Any) -> None:
        """Put a parameter on the parameter server."""
        with xmlrpc.client.ServerProxy(self.variables["ROS_MASTER_URI"]) as master:
            master.setParam("/test", name, value)

    def start_anew(self, folder: Path) -> None:
        """End it, and start another at its place."""
        self.process.__exit__(None, None, None)
        self.process = self._start(folder)
        wait_until(self.is_up, "the new master")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.__exit__(None, None, None)


class Peer:
    """The other side of a node: a process of `ros1_peer`, which obeys orders.

    Args:
        master: Master that it talks to.
        folder: Folder for its output.
        name: Name of its node.

    Attributes:
        received: Messages by topic, with the time of each.
        requests: Requests to services, by name.
        goals: Goals of actions, by name.
        cancels: Number of cancels of an action, by name.
        called: The numbers of calls that it made; may be emptied.
        replies: Outcomes of calls that it made, by number.
        sent: Everything heard of goals that it sent, by number.
    """

    def __init__(self, master: Master, folder: Path, name: str = "test_peer") -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._error = (folder / f"{name}.txt").open("wb")
        file = Path(__file__).with_name("ros1_peer.py")
        self._process = subprocess.Popen(
            [PYTHON, str(file), name],
            env=dict(master.variables),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._error,
            text=True,
        )
        self.received: dict[str, list[tuple[float, Any]]] = {}
        self.requests: dict[str, list[Any]] = {}
        self.goals: dict[str, list[Any]] = {}
        self.cancels: dict[str, int] = {}
        self.called: set[int] = set()
        self.replies: dict[int, dict[str, Any]] = {}
        self.sent: dict[int, list[dict[str, Any]]] = {}
        self._count = 0
        self._replies: queue.Queue[dict[str, Any]] = queue.Queue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self._reply("ready")

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            item = json.loads(line)
            if "topic" in item:
                self.received[item["topic"]].append((item["time"], item["message"]))
            elif "service" in item:
                self.requests[item["service"]].append(item["request"])
            elif "goal" in item:
                self.goals[item["action"]].append(item["goal"])
            elif "cancel" in item:
                self.cancels[item["action"]] += 1
            elif "call" in item:
                self.replies[item["call"]] = item
            elif "sent" in item:
                self.sent[item["sent"]].append(item)
            else:
                self._replies.put(item)

    def _reply(self, kind: str) -> Any:
        item = self._replies.get(timeout=LIMIT_S)
        assert kind in item, item
        return item

    def do(self, what: str, **arguments: Any) -> None:
        """Order it to do something."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"do": what, **arguments}) + "\n")
        self._process.stdin.flush()

    def subscribe(self, topic: str, type_name: str) -> None:
        """Collect the messages of a topic in `received`."""
        self.received[topic] = []
        self.do("subscribe", topic=topic, type=type_name)

    def advertise(self, topic: str, type_name: str) -> None:
        """Be ready to publish on a topic."""
        self.do("publish", topic=topic, type=type_name, message=None)

    def publish(self, topic: str, type_name: str, **fields: Any) -> None:
        """Send a message."""
        self.do("publish", topic=topic, type=type_name, message=fields)

    def serve(self, name: str, type_name: str) -> None:
        """Offer a service whose calls wait for `answer` or `refuse`."""
        self.requests[name] = []
        self.do("service", name=name, type=type_name)

    def act(self, name: str, type_name: str, **options: Any) -> None:
        """Offer an action, as of `ros1_peer.Server`."""
        self.goals[name] = []
        self.cancels[name] = 0
        self.do("action", name=name, type=type_name, options=options)

    def call(self, name: str, type_name: str, **fields: Any) -> int:
        """Call a service: a number, under which the reply will be in `replies`."""
        self._count += 1
        self.called.add(self._count)
        self.do("call", id=self._count, name=name, type=type_name, message=fields)
        return self._count

    def send(self, name: str, type_name: str, **fields: Any) -> int:
        """Send a goal: a number, under which what is heard of it will be in `sent`."""
        self._count += 1
        self.sent[self._count] = []
        self.do("send", id=self._count, name=name, type=type_name, message=fields)
        return self._count

    def ends(self, topic: str) -> list[str]:
        """The nodes that are connected with this one on a topic."""
        self.do("ends", topic=topic)
        reply = self._reply("ends")
        return [*reply["publishers"], *reply["subscribers"]]

    def names(self) -> Any:
        """Return the names that the master knows: nodes by topic and service."""
        self.do("names")
        return self._reply("names")["names"]

    def settle(self) -> None:
        """Wait until it has done all that it was ordered to do."""
        self.names()

    def values(self, topic: str) -> list[Any]:
        """The messages of a topic so far."""
        return [message for _, message in self.received[topic]]

    def die(self) -> None:
        """End it at once, as a crash would."""
        self.do("die")
        self._process.wait(EXIT_LIMIT_S)

    def stop(self) -> None:
        """Keep it from taking anything, as a hung program would."""
        self._process.send_signal(signal.SIGSTOP)

    def go_on(self) -> None:
        """Let a stopped one go on."""
        self._process.send_signal(signal.SIGCONT)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        self._reader.join(EXIT_LIMIT_S)
        for stream in (self._process.stdin, self._process.stdout, self._error):
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()


def start_node(
    master: Master, folder: Path, package: Path, module: str, arguments: Sequence[str] = (), **variables: str
) -> Process:
    """A module of a generated package, run from its folder without building anything."""
    environment = {**master.variables, "PYTHONPATH": str(package), "PYTHONDONTWRITEBYTECODE": "1", **variables}
    return Process([PYTHON, "-m", module, *arguments], environment, folder)


def until(
    condition: Callable[[], bool],
    what: str,
    process: Process,
    repeat: Callable[[], object] = lambda: None,
    limit_s: float = LIMIT_S,
) -> None:
    """Poll until a condition is true; now and again repeat something, for the first messages may be lost.

    Raises:
        AssertionError: It did not become true in time, or the process ended.
    """
    wait_until(
        condition,
        what,
        limit_s,
        repeat=repeat,
        fault=lambda: "" if process.is_running else "the node ended",
        heard=lambda: process.stderr,
    )
