"""The robot Porter on ROS 1, its supervision layer, and what is on both of its sides."""

import json
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from robosc.certification import make_supervisor
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from support import porter
from support.models import bundle_of
from support.process import Process
from support.ros1 import PYTHON, Master, Peer, start_node, until
from support.waiting import wait_until

PACKAGE = "porter_layer"
CARELESS = Path(__file__).with_name("ros1_careless.py")

# The action types that Debian's ROS 1 has.
_OTHER_TYPES = {
    "use Fibonacci from test_msgs": "use Test from actionlib",
    "object Order { order: integer }": "object Order { goal: integer }",
    "object Sequence { sequence: array(integer) }": "object End { result: integer }",
    "response: Sequence, feedback: Sequence": "response: End, feedback: integer",
    "value.sequence[0]": "value",
}

RECEIVED = {
    "/cmd_vel": "geometry_msgs/Twist",
    "/volume": "std_msgs/Float32",
    "/blocked": "std_msgs/String",
    "/state": "std_msgs/String",
    "/supervised/scan": "sensor_msgs/LaserScan",
}
SENT = {
    "/allowed": "std_msgs/Bool",
    "/scan": "sensor_msgs/LaserScan",
    "/supervised/cmd_vel": "geometry_msgs/Twist",
    "/supervised/volume": "std_msgs/Float32",
}
COUNT = "actionlib/Test"
POWER = "std_srvs/SetBool"

# actionlib_msgs/GoalStatus, and of actionlib.CommState that a goal is active, and that it has ended.
PREEMPTED, SUCCEEDED, ABORTED, REJECTED = 2, 3, 4, 5
WAITING, DONE = 2, 7


def model() -> str:
    """The model's text."""
    return of_ros1(porter.MODEL)


def of_ros1(text: str) -> str:
    """The text of a model whose action is of a type that ROS 1 has."""
    for old, new in _OTHER_TYPES.items():
        assert old in text
        text = text.replace(old, new)
    return text


def porter_supervisor() -> Supervisor:
    """Synthesized and verified, as a layer."""
    made = make_supervisor(bundle_of(model()), deployment=Deployment.LAYER)
    assert made.supervisor is not None, made.reason
    return made.supervisor


class Porter:
    """The robot, whose wheels do what came last, its servers, and a look at what the layer does.

    Args:
        package: The generated package.
        master: The ROS master.
        peer: Robot, observer and existing controller in one process; it has the servers.
        folder: Folder for what processes write.
        has_servers: True if it has servers at all.
    """

    def __init__(self, package: Path, master: Master, peer: Peer, folder: Path, has_servers: bool) -> None:
        self.package = package
        self.master = master
        self.peer = peer
        self.folder = folder
        self.run = 0
        self.layer: Process | None = None
        self._parameters: Sequence[str] | None = None
        for topic, type_name in RECEIVED.items():
            peer.subscribe(topic, type_name)
        for topic, type_name in SENT.items():
            peer.advertise(topic, type_name)
        if has_servers:
            peer.serve("/power", POWER)
            peer.act("/count", COUNT, ends_on_cancel=False)

    # The layer's life.

    @property
    def home(self) -> Path:
        """For what this run writes."""
        return self.folder / f"run{self.run}"

    def process(self, module: str, *arguments: str, name: str = "layer") -> Process:
        return start_node(self.master, self.home / name, self.package, f"{PACKAGE}.{module}", arguments)

    def start(
        self,
        *parameters: str,
        after: Sequence[str] = (),
        command: Sequence[str] = ("-m", f"{PACKAGE}.start"),
    ) -> None:
        """Start the layer anew, and perhaps the existing controller with it."""
        self.leave()
        self.run += 1
        self.peer.do("clear")
        self.master.delete_parameters(f"/{PACKAGE}")
        for messages in self.peer.received.values():
            messages.clear()
        arguments = ["_period:=0.02", "_publish_state:=true", f"_log_folder:={self.home / 'events'}", *parameters]
        variables = {**self.master.variables, "PYTHONPATH": str(self.package), "PYTHONDONTWRITEBYTECODE": "1"}
        self.layer = Process([PYTHON, *command, *arguments, *after], variables, self.home / "layer")
        self.meet()

    def meet(self) -> None:
        """Wait until the layer is connected both ways, and has begun."""
        self.until(lambda: all(map(self._is_connected, (*RECEIVED, *SENT))), "the connections")
        self.until(lambda: self.state("Power") == "idle", "the layer to begin")

    def _is_connected(self, topic: str) -> bool:
        return f"/{PACKAGE}" in self.peer.ends(topic)

    def ensure(self, *parameters: str) -> None:
        """Have a layer with these parameters in its initial state, if possible the one that runs."""
        if self._parameters == parameters and self.layer is not None and self.layer.is_running:
            self._parameters = None
            self.peer.do("clear")
            # One that came late would be the first call of the next test.
            self.until(lambda: self.peer.called <= self.peer.replies.keys(), "every call to be answered")
            self.until(lambda: self.state("Power") == self.state("Counter") == "idle", "the layer to be idle")
            self.allow(False)
        else:
            self.start(*parameters)
            self.peer.called.clear()
        self._parameters = parameters

    def leave(self) -> None:
        """End what runs, as a crash would, and wait until no node is connected with it."""
        self._parameters = None
        if self.layer is not None:
            self.layer.__exit__(None, None, None)
            self.layer = None
            wait_until(self._is_alone, "the connections to be gone")

    def _is_alone(self) -> bool:
        if not any(map(self._is_connected, (*RECEIVED, *SENT))):
            return True
        # A subscriber that is gone is only noticed when something is sent to it.
        for topic, type_name in SENT.items():
            self.peer.publish(topic, type_name)
        return False

    def end(self, status: int = 0) -> list[Any]:
        """End the layer: its event log."""
        assert self.layer is not None
        self.layer.signal(signal.SIGTERM)
        return self.ended(status)

    def ended(self, status: int) -> list[Any]:
        """The event log of a layer that has ended by itself."""
        assert self.layer is not None
        assert self.layer.wait() == status, self.layer.stderr
        (log,) = (self.home / "events").iterdir()
        return [json.loads(line) for line in log.read_text().splitlines()]

    def until(self, condition: Callable[[], bool], what: str, repeat: Callable[[], object] = lambda: None) -> None:
        assert self.layer is not None
        until(condition, what, self.layer, repeat)

    # Observations.

    @property
    def commands(self) -> list[Any]:
        return self.peer.values("/cmd_vel")

    @property
    def speed(self) -> float:
        """Speed of the robot, as in the last command."""
        return float(self.commands[-1]["linear"]["x"]) if self.commands else 0.0

    @property
    def blocked(self) -> list[str]:
        return [str(json.loads(message["data"])["identifier"]) for message in self.peer.values("/blocked")]

    def _current(self, component: str) -> Any:
        states = self.peer.values("/state")
        return json.loads(states[-1]["data"])["current"][component] if states else None

    def state(self, component: str) -> str | None:
        current = self._current(component)
        return None if current is None else str(current["state"])

    def variable(self, component: str, name: str) -> str:
        return str(self._current(component)["variables"][name])

    def blocks(self, identifier: str, count: int = 1, repeat: Callable[[], object] = lambda: None) -> None:
        """Wait until so many requests more were held back."""
        before = self.blocked.count(identifier)
        self.until(
            lambda: self.blocked.count(identifier) >= before + count, f"{count} of {identifier} held back", repeat
        )

    # Acts.

    def allow(self, is_allowed: bool) -> None:
        state = "granted" if is_allowed else "denied"
        self.until(
            lambda: self.state("Permission") == state,
            f"the permission {state}",
            lambda: self.peer.publish("/allowed", SENT["/allowed"], data=is_allowed),
        )

    def send(self, speed: float, **others: float) -> None:
        """The existing controller sends a velocity."""
        topic = "/supervised/cmd_vel"
        self.peer.publish(topic, SENT[topic], linear={"x": speed}, angular=others)

    def drive(self) -> None:
        self.allow(True)
        self.until(lambda: self.speed == 0.3, "the robot to move", lambda: self.send(0.3))

    def call(self) -> int:
        """The existing controller calls the service."""
        return self.peer.call("/supervised/power", POWER, data=True)

    def reply(self, number: int) -> Any:
        """The reply to a call."""
        self.until(lambda: number in self.peer.replies, "a reply")
        return self.peer.replies[number]["reply"]

    def answer(self, **fields: Any) -> None:
        """The robot answers the call that waits."""
        self.peer.do("answer", name="/power", message=fields)

    def goal(self, number: int = 5) -> int:
        """The existing controller sends a goal."""
        return self.peer.send("/supervised/count", COUNT, goal=number)

    def reached_goal(self) -> int:
        """A goal that has reached the robot."""
        before = len(self.peer.goals["/count"])
        goal = self.goal()
        self.until(lambda: len(self.peer.goals["/count"]) > before, "the goal to reach the robot")
        return goal

    def end_of(self, goal: int) -> tuple[int, Any]:
        """Status and result of a goal that the existing controller sent."""

        def ends() -> list[Any]:
            return [item for item in self.peer.sent[goal] if item.get("state") == DONE]

        self.until(lambda: bool(ends()), "the end of a goal")
        return ends()[-1]["status"], ends()[-1]["result"]


@contextmanager
def porter_robot(package: Path, folder: Path, has_servers: bool = True) -> Iterator[Porter]:
    """A robot with a master of its own; its layer is ended at the latest at the end."""
    with Master(folder) as master, Peer(master, folder) as peer:
        made = Porter(package, master, peer, folder, has_servers)
        try:
            yield made
        finally:
            if made.layer is not None:
                made.layer.__exit__(None, None, None)
