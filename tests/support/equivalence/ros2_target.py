"""The generated ROS 2 package as a node of its own process, over DDS."""

import json
import signal
import sys
import time
from array import array
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from robosc.execution.interpreter import describe
from robosc.model.structure import CommunicationKind, Deployment
from robosc.supervisor import Supervisor
from robosc.targets import generate, write_files
from robosc.targets.ros.runtime.messages import basic_field, load_message, load_server, message_name
from robosc.targets.ros.topics import servers, topics
from support.equivalence.node_target import LIMIT_S, NodeTarget, deciding
from support.equivalence.observation import Issued, Sight
from support.equivalence.portable import flat
from support.equivalence.ros2_caller import Ros2Caller
from support.equivalence.scenario import Action, Scenario
from support.ros2 import Peer, RosProcess, environment, own_domain
from support.ros2_servers import End, HeldAction, HeldService, ServerHost

_DEPTH = 1000
_RUNNING = ("running", "waiting for the first message")
_ENDS = {"succeeded": End.SUCCEED, "aborted": End.ABORT, "cancelled": End.CANCEL}


class Ros2Surroundings:
    """A node on a domain of its own, and everything that it talks to in this process.

    Args:
        supervisor: Supervisor that the node is generated from.
        folder: Folder for files and output.
        python: Words that begin the node's command.
    """

    def __init__(self, supervisor: Supervisor, folder: Path, python: Sequence[str] = (sys.executable,)) -> None:
        self._program, *self._words = python
        self._supervisor = supervisor
        self._model = supervisor.model
        self._folder = folder
        self._stack = ExitStack()
        self._issued: list[Issued] = []
        # The first service or action of each identifier, which has the server, and that of each of them.
        self._offered: dict[str, str] = {}
        self._server_of: dict[str, str] = {}
        self._services: dict[str, HeldService] = {}
        self._actions: dict[str, HeldAction] = {}
        self._seen: dict[str, int] = {}
        self._cancelled: dict[str, int] = {}
        self._is_layer = supervisor.deployment is Deployment.LAYER
        self._caller: Ros2Caller | None = None
        self._ticked_ns = 0

    def start(self, scenario: Scenario, folder: Path) -> None:
        """Start node and surroundings."""
        files = generate(self._supervisor, "ros2")
        write_files(files, self._folder / "package")
        package = next(path.partition("/")[0] for path in files if path.endswith("/node.py"))
        domain = self._stack.enter_context(own_domain())
        variables = environment(domain, self._folder)
        self._peer = self._stack.enter_context(Peer(domain, variables))
        host = self._stack.enter_context(ServerHost(domain)) if servers(self._model) else None
        self._connect(host)
        from diagnostic_msgs.msg import DiagnosticArray
        from std_msgs.msg import String

        self._peer.node.create_subscription(String, "/state", self._note_tick, _DEPTH)
        reports = self._peer.receive(DiagnosticArray, "/diagnostics")
        parameters = folder.parent / "parameters.yaml"
        parameters.write_text(
            json.dumps({"/**": {"ros__parameters": _parameters(scenario, folder, self._supervisor.deployment)}})
        )
        command = [*self._words, "-m", f"{package}.node", "--ros-args", "--params-file", str(parameters)]
        self._node = self._stack.enter_context(
            RosProcess(command, variables, self._folder / "run", [self._folder / "package"], program=self._program)
        )
        self._peer.wait_for_peers([item.identifier for item in topics(self._model)])
        self._peer.spin_until(
            # Only the node knows when it no longer waits for its servers.
            lambda: any(status.message.startswith(_RUNNING) for report in reports for status in report.status),
            LIMIT_S,
            "the node to run",
            self._node,
        )
        self._peer.spin_until(self._is_connected, LIMIT_S, "connections", self._node)

    def _connect(self, host: ServerHost | None) -> None:
        for topic in topics(self._model):
            message_class = load_message(topic.interface.package, topic.interface.type)
            if topic.received:
                self._peer.publisher(message_class, topic.identifier, _DEPTH)
            if topic.published:
                self._receive(message_class, topic.identifier)
        types: dict[str, Any] = {}
        for item in self._model.communications:
            if host is None or item.kind not in (CommunicationKind.SERVICE, CommunicationKind.ACTION):
                continue
            info = next(i for i in describe(self._supervisor).communications if i.name == item.name)
            is_action = item.kind is CommunicationKind.ACTION
            offered = self._offered.setdefault(item.identifier, item.name)
            self._server_of[item.name] = offered
            type_ = load_server(_ServerType(is_action, str(info.package), str(info.interface)))  # type: ignore[arg-type]
            types[item.name] = type_
            if offered != item.name:
                continue
            self._seen[item.name] = 0
            if is_action:
                # The end of a cancelled goal is a step of its own.
                self._actions[item.name] = HeldAction(host, type_, item.identifier, ends_on_cancel=False)
            else:
                self._services[item.name] = HeldService(host, type_, item.identifier)
        if self._is_layer:
            identifiers = {item.name: item.identifier for item in self._model.communications}
            self._caller = Ros2Caller(self._peer, list(topics(self._model)), types, identifiers, _given, _filled)

    def _receive(self, message_class: Any, topic: str) -> None:
        def receive(message: Any) -> None:
            self._issued.append(("publish", topic, _given(message)))

        self._peer.node.create_subscription(message_class, topic, receive, _DEPTH)

    def _is_connected(self) -> bool:
        names = [topic.identifier for topic in topics(self._model) if topic.received]
        if self._caller and not self._caller.is_connected():
            return False
        return all(self._peer.publisher(None, name).get_subscription_count() for name in names)

    def send(self, topic: str, data: Any) -> None:
        """Publish."""
        found = next(item for item in topics(self._model) if item.identifier == topic)
        message = load_message(found.interface.package, found.interface.type)()
        _fill(message, data)
        self._peer.publish(message, topic)

    def _note_tick(self, _: Any, information: Any) -> None:
        self._ticked_ns = information["source_timestamp"]

    def wait_for_tick(self) -> None:
        """Wait until the node's own timer has ticked: it then publishes its state, as the middleware notices."""
        now_ns = time.time_ns()
        self._peer.spin_until(lambda: self._ticked_ns > now_ns, LIMIT_S, "a tick of the node", self._node)

    def answer(self, action: Action) -> None:
        """Let a server do it."""
        name = self._server_of[action.subject]
        match action.do:
            case "reply":
                self._services[name].answer(**_fields(self._response(name), action.data))
            case "accept":
                server = self._actions[name]
                self._peer.spin_until(lambda: len(server.handles) == self._seen[name], LIMIT_S, "the goal", self._node)
            case "feedback":
                self._actions[name].feedback(**_fields(self._actions[name].action_class.Feedback, action.data))
            case "end":
                result = _fields(self._actions[name].action_class.Result, action.data)
                self._actions[name].end(_ENDS[action.how], **result)
            case _:
                raise ValueError(action.do)

    def _response(self, name: str) -> Any:
        return self._services[name].service_class.Response

    def ask(self, action: Action) -> None:
        """Let the existing controller do it."""
        assert self._caller is not None
        self._caller.ask(action)

    def take_issued(self) -> list[Issued]:
        """Return everything that came since the last call."""
        found, self._issued = self._issued, []
        if self._caller:
            found += self._caller.issued
            self._caller.issued = []
        for kind, server_of in (("call", self._services), ("goal", self._actions)):
            for name, server in server_of.items():
                requests = server.requests
                while self._seen[name] < len(requests):
                    found.append((kind, name, _given(requests[self._seen[name]])))
                    self._seen[name] += 1
        for name, action in self._actions.items():
            found += [("cancel", name, {})] * (action.cancels - self._cancelled.get(name, 0))
            self._cancelled[name] = action.cancels
        return found

    def settle(self) -> None:
        """See `Peer.settle`."""
        self._peer.settle(self._node, LIMIT_S)

    def spin(self) -> None:
        """For a moment."""
        self._peer.spin_for(0.002)
        assert self._node.is_running, self._node.stderr

    def stop(self) -> None:
        """Stop by a signal."""
        self._node.signal(signal.SIGTERM)
        assert self._node.wait() == 0, self._node.stderr
        self._peer.spin_for(0.1)

    def close(self) -> None:
        """End it all."""
        self._stack.close()


class _ServerType:
    """A stand-in for a server, with what loading its type needs."""

    def __init__(self, is_action: bool, package: str, type_: str) -> None:
        self.is_action, self.package, self.type_name = is_action, package, type_


def _parameters(scenario: Scenario, folder: Path, deployment: Deployment) -> dict[str, Any]:
    """The settings as the node's parameters."""
    settings = scenario.all_settings()
    found: dict[str, Any] = {
        **deciding(settings, deployment),
        "period": settings.period_s,
        "service_timeout": settings.service_timeout_s,
        "cancel_timeout": settings.cancel_timeout_s,
        "on_unknown": settings.on_unknown,
        "log_folder": str(folder),
        "server_wait": LIMIT_S,
        "publish_state": True,
    }
    if settings.max_age_s:
        found["max_age"] = [f"{topic}={age}" for topic, age in settings.max_age_s.items()]
    if settings.priority and deployment is Deployment.CONTROLLER:
        found["priority"] = list(settings.priority)
    if settings.release_identifiers is not None:
        found["release_identifiers"] = list(settings.release_identifiers) or [""]
    return found


def _fill(message: Any, data: Any) -> None:
    """Put plain data into a message."""
    if data is None:
        return
    given = data if isinstance(data, dict) else {basic_field(type(message)): data}
    for name, value in given.items():
        if isinstance(value, dict):
            _fill(getattr(message, name), value)
        else:
            setattr(message, name, value)


def _filled(message_class: Any, data: Any) -> Any:
    """A message with plain data in it."""
    message = message_class()
    _fill(message, data)
    return message


def _fields(message_class: Any, data: Any) -> dict[str, Any]:
    """The fields of a reply with plain data in it."""
    message = _filled(message_class, data)
    return {name: getattr(message, name) for name in message.get_fields_and_field_types()}


def _given(message: Any) -> dict[str, Any]:
    """Return the content of a message, by path, without defaults such as the 1 of a quaternion's `w`."""
    defaults = _parts(type(message)())
    return {path: value for path, value in _parts(message).items() if value and value != defaults.get(path)}


def _parts(message: Any) -> dict[str, Any]:
    is_basic = message_name(type(message)).startswith("std_msgs/") and hasattr(message, "data")
    return flat(message.data) if is_basic else flat(_plain(message))


def _plain(message: Any) -> Any:
    if isinstance(message, list | array):
        return [_plain(part) for part in message]
    if not hasattr(message, "get_fields_and_field_types"):
        return message if isinstance(message, bool | int | float | str) else None
    return {name: _plain(getattr(message, name)) for name in message.get_fields_and_field_types() if name != "header"}


def ros2_target(supervisor: Supervisor, folder: Path, python: Sequence[str] = (sys.executable,)) -> NodeTarget:
    """The target `ros2`, under the Python that a command begins with."""
    sight = Sight(has_requests=supervisor.deployment is Deployment.CONTROLLER)
    return NodeTarget("ros2", supervisor.model, Ros2Surroundings(supervisor, folder, python), folder / "events", sight)
