"""Meaning of a supervision layer on ROS, and the names of a model that have no meaning there."""

from collections.abc import Callable, Iterable

from robosc.errors import UnsupportedModelError
from robosc.model.structure import Communication, CommunicationKind
from robosc.targets.ros.runtime.supervised import BLOCKED, SUPERVISED
from robosc.targets.ros.topics import Topic

Renamed = tuple[tuple[str, str], ...]
"""Old and new names."""


def remapped_names(
    found: tuple[Topic, ...],
    asked: tuple[Communication, ...],
    remapped: Callable[[Iterable[str], Iterable[str]], Renamed],
) -> Renamed:
    """Old and new name of everything that an existing controller has to call otherwise.

    Args:
        found: The topics.
        asked: The services and actions.
        remapped: Names everything, given topics and services, and actions: the two ROS make actions of other parts.
    """
    services = [item.identifier for item in asked if item.kind is CommunicationKind.SERVICE]
    actions = [item.identifier for item in asked if item.kind is CommunicationKind.ACTION]
    return remapped([*(topic.identifier for topic in found), *services], actions)


def require_names_of_a_layer(found: tuple[Topic, ...], asked: tuple[Communication, ...]) -> None:
    """Do nothing if the names on both sides of a layer say which of the model's communications something is.

    Raises:
        UnsupportedModelError: They do not; says which and why.
    """
    for identifier in (*(topic.identifier for topic in found), *(item.identifier for item in asked)):
        _require_own_sides(identifier)
    for topic in found:
        if _bare(topic.identifier) == BLOCKED:
            raise UnsupportedModelError(
                f"the topic {topic.identifier} is where a supervision layer reports the requests that it holds back"
            )
        if topic.published and topic.received:
            raise UnsupportedModelError(
                f"'{topic.published[0].name}' goes to the topic {topic.identifier} and '{topic.received[0].name}' "
                "comes from it: a supervision layer would take what it lets through for a message of the robot"
            )
    _require_one_each("topics", ((topic.identifier, topic.identifier) for topic in found))
    for kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION):
        _require_one_each(f"{kind}s", ((item.identifier, item.identifier) for item in asked if item.kind is kind))


def require_own_topics(
    found: tuple[Topic, ...], asked: tuple[Communication, ...], action_topics: tuple[str, ...]
) -> None:
    """Do nothing if no topic is one of those that an action is made of: a layer has a server of its own there.

    Args:
        found: The topics.
        asked: The services and actions.
        action_topics: Topics that an action is made of, below its name; none where an action has a name of its own.

    Raises:
        UnsupportedModelError: One is; says which.
    """
    parts = {
        _bare(f"{item.identifier}/{part}"): item.name
        for item in asked
        if item.kind is CommunicationKind.ACTION
        for part in action_topics
    }
    for topic in found:
        action = parts.get(_bare(topic.identifier))
        if action is not None:
            raise UnsupportedModelError(
                f"the topic {topic.identifier} is a part of the action '{action}', which a supervision layer offers "
                "by itself"
            )


def _bare(identifier: str) -> str:
    """A name without the slash that makes it absolute: where there is no namespace, the two are one name."""
    return identifier.lstrip("/")


def _require_own_sides(identifier: str) -> None:
    if identifier.startswith("~"):
        raise UnsupportedModelError(
            f"the name {identifier} belongs to one node, and a supervision layer stands between two: "
            "give it a name such as /x"
        )
    if f"{_bare(identifier)}/".startswith(f"{SUPERVISED}/"):
        raise UnsupportedModelError(
            f"the name {identifier} is on the existing controller's side of a supervision layer"
        )


def _require_one_each(what: str, named: Iterable[tuple[str, str]]) -> None:
    """Refuse two identifiers with one name: a layer could not distinguish what comes there."""
    first: dict[str, str] = {}
    for identifier, text in named:
        name = _bare(identifier)
        other = first.setdefault(name, text)
        if other != text:
            raise UnsupportedModelError(
                f"the {what} '{other}' and '{text}' have one name, /{name}: a supervision layer could not tell which "
                "of them is meant"
            )
