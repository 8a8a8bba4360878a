"""Generated ROS 1 nodes, rospy and roscpp, as processes of their own on a real rosmaster."""

import re
import signal
import time
import xmlrpc.client
from collections import Counter
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from robosc.execution.interpreter import describe
from robosc.expressions import ObjectType
from robosc.model.structure import CommunicationKind, Deployment
from robosc.supervisor import Supervisor
from robosc.targets import generate, write_files
from robosc.targets.ros.topics import Topic, servers, topics
from support.equivalence.node_target import IN_CPP, LIMIT_S, NodeTarget, given, node_parameters, set_parts
from support.equivalence.observation import Issued, Sight
from support.equivalence.ros1_caller import Ros1Caller
from support.equivalence.scenario import Action, Scenario
from support.process import Process
from support.ros1 import PYTHON, Master, Peer, until
from support.ros1_cpp import node_command
from support.waiting import wait_until

_RUNNING = ("running", "waiting for the first message")
_SPIN_S = 0.002
_DIAGNOSTICS = "/diagnostics"


class Ros1Surroundings:
    """A node on a master of its own, and a peer on rospy that has everything that it talks to.

    Args:
        supervisor: Supervisor that the node was generated from.
        node: Name of the node.
        command: Command that starts it.
        folder: Folder for files and output.
        python_path: Path of its modules, if it is in Python.
    """

    def __init__(
        self, supervisor: Supervisor, node: str, command: Sequence[str], folder: Path, python_path: str = ""
    ) -> None:
        self._supervisor = supervisor
        self._topics = topics(supervisor.model)
        self._name = node
        self._command = command
        self._folder = folder
        self._python_path = python_path
        self._stack = ExitStack()
        self._servers: dict[str, str] = {}
        self._is_layer = supervisor.deployment is Deployment.LAYER
        self._caller: Ros1Caller | None = None
        # Number of messages at the peer that were taken, by kind and name.
        self._taken: dict[tuple[str, str], int] = {}
        # Number of goals that have ended, by the name of the action on ROS.
        self._ended: Counter[str] = Counter()

    def start(self, scenario: Scenario, folder: Path) -> None:
        """Start node and surroundings."""
        self._master = self._stack.enter_context(Master(self._folder))
        for name, value in node_parameters(scenario, folder, self._supervisor.deployment).items():
            self._master.set_parameter(f"/{self._name}/{name}", value)
        self._peer = self._stack.enter_context(Peer(self._master, self._folder))
        for topic in self._topics:
            if topic.received:
                self._peer.advertise(topic.identifier, _type(topic))
            if topic.published:
                self._peer.subscribe(topic.identifier, _type(topic))
        self._peer.subscribe(_DIAGNOSTICS, "diagnostic_msgs/DiagnosticArray")
        self._serve()
        variables = {**self._master.variables, "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": self._python_path}
        self._node = self._stack.enter_context(Process(self._command, variables, self._folder / "run"))
        until(self._is_running, "the node to run", self._node)
        until(self._is_connected, "the connections", self._node)

    def _serve(self) -> None:
        """Offer every service and action, as `ros1_peer` has them."""
        linked = {item.name: item for item in describe(self._supervisor).communications}
        types: dict[str, str] = {}
        for item in servers(self._supervisor.model):
            name = re.sub("^~/", f"/{self._name}/", item.identifier)
            type_name = f"{linked[item.name].package}/{linked[item.name].interface}"
            if item.kind is CommunicationKind.ACTION:
                type_name = type_name.removesuffix("Action")
            types[item.name] = type_name
            is_offered = name in self._servers.values()
            self._servers[item.name] = name
            if is_offered:
                continue
            if item.kind is CommunicationKind.SERVICE:
                self._peer.serve(name, type_name)
            else:
                # The end of a cancelled goal is a step of its own.
                self._peer.act(name, type_name, ends_on_cancel=False)
        if self._is_layer:
            basic = {i.name for i in self._supervisor.model.communications if not isinstance(i.feedback, ObjectType)}
            self._caller = Ros1Caller(self._peer, list(self._topics), types, self._servers, basic)

    def _is_running(self) -> bool:
        reports = self._peer.values(_DIAGNOSTICS)
        return any(status["message"].startswith(_RUNNING) for report in reports for status in report["status"])

    def _is_connected(self) -> bool:
        """Each end says whom it sends to: what is sent now arrives."""
        found = self._connections()
        for name in self._caller.names() if self._caller else ():
            if f"/{self._name}" not in self._peer.ends(name):
                return False
        return all(
            (not topic.received or f"/{self._name}" in self._peer.ends(topic.identifier))
            and (not topic.published or "/" + topic.identifier.lstrip("/") in found)
            for topic in self._topics
        )

    def _connections(self) -> set[str]:
        """The topics on which the node has a subscriber, as it reports itself."""
        # Fields of each: number, the other end, direction, transport, topic.
        return {item[4] for item in _answer(self._ask_node("getBusInfo")) if item[2] == "o"}

    def _has_heard_ends(self) -> bool:
        """Return True if the node has received the results of all goals that have ended, as it reports itself."""
        found = self._ask_node("getBusStats")
        # Statistics of sent and received messages; roscpp gives them without a code and words. Each topic has its
        # connections, and each of these: number, bytes, messages, dropped messages.
        received = (found if isinstance(found[0], list) else _answer(found))[1]
        heard = {topic: sum(connection[2] for connection in connections) for topic, connections in received}
        return all(heard.get(f"{name}/result", 0) >= count for name, count in self._ended.items())

    def _ask_node(self, method: str) -> Any:
        with xmlrpc.client.ServerProxy(self._master.variables["ROS_MASTER_URI"]) as master:
            uri: Any = _answer(master.lookupNode("/test", f"/{self._name}"))
        with xmlrpc.client.ServerProxy(uri) as node:
            return getattr(node, method)("/test")

    def send(self, topic: str, data: Any) -> None:
        """Publish."""
        found = next(item for item in self._topics if item.identifier == topic)
        self._peer.publish(topic, _type(found), **_fields(data))

    def answer(self, action: Action) -> None:
        """Let a server do it."""
        name = self._servers[action.subject]
        if action.do == "end":
            self._ended[name] += 1
        match action.do:
            case "reply":
                self._peer.do("answer", name=name, message=_fields(action.data))
            case "feedback":
                self._peer.do("feedback", name=name, message=action.data)
            case "end":
                how = {"cancelled": "canceled"}.get(action.how, action.how)
                self._peer.do("end", name=name, how=how, message=_fields(action.data))
            case "accept":
                # The peer does this by itself, as soon as the goal comes.
                pass
            case _:
                raise ValueError(action.do)

    def ask(self, action: Action) -> None:
        """Let the existing controller do it."""
        assert self._caller is not None
        self._caller.ask(action)

    def take_issued(self) -> list[Issued]:
        """Return everything that came since the last call."""
        peer = self._peer
        found: list[Issued] = self._caller.take_issued() if self._caller else []
        for topic in self._topics:
            if topic.published:
                values = self._new("publish", topic.identifier, peer.values(topic.identifier))
                found += [("publish", topic.identifier, given(topic.interface, value)) for value in values]
        for on_ros, name in {on_ros: name for name, on_ros in self._servers.items()}.items():
            found += [
                ("call", name, set_parts(item)) for item in self._new("call", name, peer.requests.get(on_ros, []))
            ]
            found += [("goal", name, set_parts(item)) for item in self._new("goal", name, peer.goals.get(on_ros, []))]
            cancels = [None] * peer.cancels.get(on_ros, 0)
            found += [("cancel", name, {}) for _ in self._new("cancel", name, cancels)]
        return found

    def _new(self, kind: str, name: str, values: Sequence[Any]) -> Sequence[Any]:
        before = self._taken.get((kind, name), 0)
        self._taken[kind, name] = len(values)
        return values[before:]

    def settle(self) -> None:
        """Wait for the end of a cancelled goal: the next one may come only then, and other messages do not wait for it.

        The acceptance of a goal does not show, either, and actionlib takes what follows without it, too.
        """
        until(self._has_heard_ends, "the ends of goals", self._node)

    def spin(self) -> None:
        """For a moment: the peer is a process of its own."""
        time.sleep(_SPIN_S)
        assert self._node.is_running, self._node.stderr

    def stop(self) -> None:
        """Stop by a signal."""
        self._node.signal(signal.SIGTERM)
        assert self._node.wait() == 0, self._node.stderr
        published = [topic.identifier for topic in self._topics if topic.published]
        wait_until(lambda: not any(map(self._peer.ends, published)), "the end of the connections", LIMIT_S)

    def close(self) -> None:
        """End it all."""
        self._stack.close()


def _answer(found: Any) -> Any:
    """The value that a master or a node answers with."""
    code, words, value = found
    assert code == 1, words
    return value


def _type(topic: Topic) -> str:
    return f"{topic.interface.package}/{topic.interface.type}"


def _fields(data: Any) -> dict[str, Any]:
    """Plain data as fields of a message: a value of a basic type is that of the one field of a message for it."""
    if data is None:
        return {}
    return data if isinstance(data, dict) else {"data": data}


def ros1_target(supervisor: Supervisor, folder: Path) -> NodeTarget:
    """The target `ros1`: the node run from the generated package as it is."""
    files = generate(supervisor, "ros1")
    package = folder / "package"
    write_files(files, package)
    name = next(path.partition("/")[0] for path in files if path.endswith("/node.py"))
    surroundings = Ros1Surroundings(supervisor, name, [PYTHON, "-m", f"{name}.node"], folder, str(package))
    sight = Sight(has_requests=supervisor.deployment is Deployment.CONTROLLER)
    return NodeTarget("ros1", supervisor.model, surroundings, folder / "events", sight)


def ros1_cpp_target(supervisor: Supervisor, workspace: Path, folder: Path) -> NodeTarget:
    """The target `ros1-cpp`: the node of a workspace in which its package was built."""
    command = node_command(workspace)
    name = Path(command[0]).parent.name
    surroundings = Ros1Surroundings(supervisor, name, command, folder)
    sight = replace(IN_CPP, has_requests=supervisor.deployment is Deployment.CONTROLLER)
    return NodeTarget("ros1-cpp", supervisor.model, surroundings, folder / "events", sight)
