"""An existing controller on ROS 2 before a supervision layer: asks what a test says, remembers what it receives."""

import json
from collections.abc import Callable
from typing import Any

from robosc.targets.ros.runtime.messages import load_message
from robosc.targets.ros.runtime.supervised import BLOCKED, callers_name
from robosc.targets.ros.topics import Topic
from support.equivalence.observation import Issued
from support.equivalence.portable import Callers
from support.equivalence.scenario import Action
from support.ros2 import Peer

_DEPTH = 1000


class Ros2Caller:
    """The caller's side.

    Args:
        peer: Peer whose node it is on.
        topics: The model's topics.
        server_types: The type of each service and action, by its name in the model.
        identifiers: The identifier of each.
        given: Function that returns the content of a message, by path.
        filled: Function that returns a message of a class with plain data in it.
    """

    def __init__(
        self,
        peer: Peer,
        topics: list[Topic],
        server_types: dict[str, Any],
        identifiers: dict[str, str],
        given: Callable[[Any], dict[str, Any]],
        filled: Callable[[Any, Any], Any],
    ) -> None:
        from std_msgs.msg import String

        self._peer = peer
        self._given = given
        self._filled = filled
        self._callers = Callers()
        self._types = server_types
        self._handles: dict[str, Any] = {}
        self._clients = {name: self._client(name, identifiers[name]) for name in server_types}
        self._published = {item.identifier: item for item in topics if item.published}
        self.issued: list[Issued] = []
        for item in topics:
            message_class = load_message(item.interface.package, item.interface.type)
            name = callers_name("", item.identifier)
            if item.received:
                self._hear(message_class, name, "pass", item.identifier)
            if item.published:
                peer.publisher(message_class, name, _DEPTH)
        peer.node.create_subscription(String, BLOCKED, self._note_blocked, _DEPTH)

    def _note_blocked(self, message: Any) -> None:
        self.issued.append(("blocked", json.loads(message.data)["identifier"], {}))

    def _hear(self, message_class: Any, name: str, kind: str, identifier: str) -> None:
        def hear(message: Any) -> None:
            self.issued.append((kind, identifier, self._given(message)))

        self._peer.node.create_subscription(message_class, name, hear, _DEPTH)

    def _client(self, name: str, identifier: str) -> Any:
        from rclpy.action import ActionClient

        type_ = self._types[name]
        if hasattr(type_, "Goal"):
            return ActionClient(self._peer.node, type_, callers_name("", identifier))
        return self._peer.node.create_client(type_, callers_name("", identifier))

    def is_connected(self) -> bool:
        """Return True if requests sent now reach the layer, and its reports come here."""
        for client in self._clients.values():
            if not (client.server_is_ready() if hasattr(client, "server_is_ready") else client.service_is_ready()):
                return False
        names = [callers_name("", identifier) for identifier in self._published]
        return all(self._peer.publisher(None, name).get_subscription_count() for name in names)

    def ask(self, action: Action) -> None:
        """Do what an action says: `ask`, `ask_call`, `ask_goal`, `ask_cancel`."""
        name = action.subject
        match action.do:
            case "ask":
                interface = self._published[name].interface
                message = self._filled(load_message(interface.package, interface.type), action.data)
                self._peer.publish(message, callers_name("", name))
            case "ask_call":
                self._call(name, self._callers.next(name), action.data)
            case "ask_goal":
                self._send(name, self._callers.next(name), action.data)
            case "ask_cancel":
                self._handles[name].cancel_goal_async()
            case _:
                raise ValueError(action.do)

    def _report(self, kind: str, name: str, number: int, data: dict[str, Any]) -> None:
        self.issued.append((kind, name, {"caller": number, **data}))

    def _call(self, name: str, number: int, data: Any) -> None:
        future = self._clients[name].call_async(self._filled(self._types[name].Request, data))

        def answered(done: Any) -> None:
            parts = self._given(done.result())
            # A default response says only why there is no other.
            self._report("answer", name, number, {} if list(parts) == ["message"] else parts)

        future.add_done_callback(answered)

    def _send(self, name: str, number: int, data: Any) -> None:
        def on_feedback(message: Any) -> None:
            self._report("feedback", name, number, self._given(message.feedback))

        def ended(done: Any) -> None:
            found = done.result()
            self._report("ended", name, number, {"how": _OUTCOMES[found.status], **self._given(found.result)})

        def answered(done: Any) -> None:
            handle = done.result()
            self._report("accept" if handle.accepted else "reject", name, number, {})
            if handle.accepted:
                self._handles[name] = handle
                handle.get_result_async().add_done_callback(ended)

        goal = self._filled(self._types[name].Goal, data)
        self._clients[name].send_goal_async(goal, on_feedback).add_done_callback(answered)


# action_msgs/msg/GoalStatus
_OUTCOMES = {4: "succeeded", 5: "cancelled", 6: "aborted"}
