"""An existing controller on ROS 1 before a supervision layer: asks what a test says, remembers what it receives."""

import json
from typing import Any

from robosc.targets.ros.runtime.supervised import BLOCKED, callers_name
from robosc.targets.ros.topics import Topic
from support.equivalence.node_target import given, set_parts
from support.equivalence.observation import Issued
from support.equivalence.portable import Callers
from support.equivalence.scenario import Action
from support.ros1 import Peer

# actionlib_msgs/GoalStatus; actionlib.CommState.
_OUTCOMES = {2: "cancelled", 3: "succeeded", 4: "aborted", 8: "cancelled"}
_REJECTED = 5
_ACTIVE, _DONE = 2, 7


class Ros1Caller:
    """The caller's side.

    Args:
        peer: Peer whose node it is on.
        topics: The model's topics.
        server_types: The type of each service and action, by its name in the model.
        identifiers: The identifier of each.
        basic: The actions whose feedback is of a basic type in the model: it is the one field of a message.
    """

    def __init__(
        self,
        peer: Peer,
        topics: list[Topic],
        server_types: dict[str, str],
        identifiers: dict[str, str],
        basic: set[str],
    ) -> None:
        self._basic = basic
        self._peer = peer
        self._topics = topics
        self._types = server_types
        self._names = {name: callers_name("", identifier) for name, identifier in identifiers.items()}
        self._callers = Callers()
        self._calls: dict[int, tuple[str, int]] = {}
        self._goals: dict[int, tuple[str, int]] = {}
        self._last: dict[str, int] = {}
        self._taken: dict[object, int] = {}
        for item in topics:
            name = callers_name("", item.identifier)
            if item.received:
                peer.subscribe(name, _type(item))
            if item.published:
                peer.advertise(name, _type(item))
        peer.subscribe(BLOCKED, "std_msgs/String")

    def names(self) -> list[str]:
        """The topics on which it must be connected with the layer."""
        return [callers_name("", item.identifier) for item in self._topics]

    def ask(self, action: Action) -> None:
        """Do what an action says: `ask`, `ask_call`, `ask_goal`, `ask_cancel`."""
        name, data = action.subject, action.data
        fields = {} if data is None else data if isinstance(data, dict) else {"data": data}
        match action.do:
            case "ask":
                found = next(item for item in self._topics if item.identifier == name)
                self._peer.publish(callers_name("", name), _type(found), **fields)
            case "ask_call":
                number = self._callers.next(name)
                self._calls[self._peer.call(self._names[name], self._types[name], **fields)] = (name, number)
            case "ask_goal":
                number = self._callers.next(name)
                self._last[name] = self._peer.send(self._names[name], self._types[name], **fields)
                self._goals[self._last[name]] = (name, number)
            case "ask_cancel":
                self._peer.do("withdraw", id=self._last[name])
            case _:
                raise ValueError(action.do)

    def take_issued(self) -> list[Issued]:
        """Return everything that was reported to the caller since the last call."""
        peer = self._peer
        found: list[Issued] = []
        for item in self._topics:
            if item.received:
                values = self._new(item.identifier, peer.values(callers_name("", item.identifier)))
                found += [("pass", item.identifier, given(item.interface, value)) for value in values]
        blocked = [json.loads(value["data"]) for value in self._new(BLOCKED, peer.values(BLOCKED))]
        found += [("blocked", value["identifier"], {}) for value in blocked]
        for call in [call for call in self._calls if call in peer.replies]:
            name, number = self._calls.pop(call)
            reply = peer.replies[call]
            parts = set_parts(reply.get("reply") or reply)
            # A default response says only why there is no other.
            parts = {} if list(parts) == ["message"] else parts
            found.append(("answer", name, {"caller": number, **parts}))
        for goal, (name, number) in self._goals.items():
            for heard in self._new(goal, peer.sent[goal]):
                for kind, data in _contents(heard):
                    parts = dict.fromkeys([""], *data.values()) if kind == "feedback" and name in self._basic else data
                    found.append((kind, name, {"caller": number, **parts}))
        return found

    def _new(self, key: object, values: list[Any]) -> list[Any]:
        before = self._taken.get(key, 0)
        self._taken[key] = len(values)
        return values[before:]


def _contents(heard: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """Express what a client of an action hears in the words of the suite."""
    if "feedback" in heard:
        return [("feedback", set_parts(heard["feedback"]))]
    if heard["state"] == _ACTIVE:
        return [("accept", {})]
    if heard["state"] != _DONE:
        return []
    if heard["status"] == _REJECTED:
        return [("reject", {})]
    return [("ended", {"how": _OUTCOMES[heard["status"]], **set_parts(heard["result"])})]


def _type(topic: Topic) -> str:
    return f"{topic.interface.package}/{topic.interface.type}"
