"""Parts of the packages for ROS 2 and ROS 1, in Python and C++: checks, and values that templates refer to."""

from collections.abc import Iterator
from contextlib import contextmanager

from robosc.automata.executable import CALLED_KINDS
from robosc.errors import UnsupportedModelError
from robosc.model.structure import Communication, CommunicationKind, Deployment, Interface, Model
from robosc.supervisor import Supervisor
from robosc.targets.code.naming import snake_case
from robosc.targets.code.python.generate import header
from robosc.targets.code.python.layout import make_layout
from robosc.targets.code.templates import shared_values
from robosc.targets.registry import GENERAL_ERRORS, GenerateOptions
from robosc.targets.ros.runtime.parameters import Parameter
from robosc.targets.ros.state_topic import state_topic
from robosc.targets.ros.topics import Topic, sent_paths, shapes_of

MAXIMUM_STARTER = 100

EVENT_LOG_FOLDER = "event_log"
"""Folder of the event log if the option names no folder: in the folder that the node is started in."""

_DIAGNOSTICS = Interface("DiagnosticArray", "diagnostic_msgs")
_RELEASED_TYPES = frozenset({"Twist", "TwistStamped"})
_TITLES = {Deployment.CONTROLLER: "Supervisory controller", Deployment.LAYER: "Supervision layer"}

# Codes of the check's warnings and notes that are errors for packages of ROS: their nodes would not start.
_ERRORS = GENERAL_ERRORS | {
    "field-type-mismatch",
    "invalid-identifier",
    "no-header",
    "unknown-field",
    "unknown-ros-type",
}

ROS1_CPP_ERRORS = _ERRORS | {"ros2-only"}
"""Codes for ROS 1 in C++."""

ROS1_ERRORS = ROS1_CPP_ERRORS | {"cpp-only"}
"""Codes for ROS 1 in Python."""

ROS2_CPP_ERRORS = _ERRORS | {"ros1-only"}
"""Codes for ROS 2 in C++."""

ROS2_ERRORS = ROS2_CPP_ERRORS | {"cpp-only", "not-in-ros2-python"}
"""Codes for ROS 2 in Python."""


@contextmanager
def error_context(target: str) -> Iterator[None]:
    """Errors about the model name the target.

    Raises:
        UnsupportedModelError: One was raised inside.
    """
    try:
        yield
    except UnsupportedModelError as error:
        raise UnsupportedModelError(f"target {target}: {error}") from error


def require_own_names(package: str, found: tuple[Topic, ...], asked: tuple[Communication, ...]) -> None:
    """Do nothing if neither the package nor the topics that a node has anyway are called like something of the model's.

    Raises:
        UnsupportedModelError: They are; says which.
    """
    if package in packages(found, asked):
        raise UnsupportedModelError(
            f"the generated package would be called {package}, like a package whose types it uses"
        )
    for topic in found:
        if topic.identifier.lstrip("/") == "diagnostics" and topic.interface != _DIAGNOSTICS:
            raise UnsupportedModelError(
                f"the topic {topic.identifier} is of the type {topic.interface.package}/"
                f"{topic.interface.type}, but every generated node publishes diagnostic_msgs/DiagnosticArray there"
            )


def packages(found: tuple[Topic, ...], asked: tuple[Communication, ...]) -> set[str]:
    """The packages of all types."""
    return {topic.interface.package for topic in found} | {item.interface.package for item in asked if item.interface}


def release_identifiers(found: tuple[Topic, ...]) -> tuple[str, ...]:
    """The identifiers that keep acting after a message: velocities."""
    return tuple(
        topic.identifier
        for topic in found
        if topic.published and topic.interface.package == "geometry_msgs" and topic.interface.type in _RELEASED_TYPES
    )


def context(
    supervisor: Supervisor,
    package: str,
    found: tuple[Topic, ...],
    asked: tuple[Communication, ...],
    options: GenerateOptions,
) -> dict[str, object]:
    """Return the values that the templates of every kind of package refer to."""
    model = supervisor.model
    layout = make_layout(supervisor)
    tables = state_topic(model)
    requested = [item for item in model.communications if item.kind is not CommunicationKind.OUTGOING_MESSAGE]
    return {
        **shared_values(supervisor, package, options.metadata),
        "title": _TITLES[supervisor.deployment],
        "header": header(supervisor),
        "topics": found,
        "release_identifiers": release_identifiers(found),
        "servers": asked,
        "shares": _shares(asked),
        "deployment": str(supervisor.deployment),
        "shapes": _shapes(model, supervisor.deployment),
        "sent": {item.name: sent_paths(model, item) for item in requested},
        "starter": f"start_{snake_case(model.name)[:MAXIMUM_STARTER]}",
        "requests": tuple(f"{item.name}.request" for item in requested),
        "controllable": layout.executable.issued,
        "uncontrollable": layout.executable.received,
        "definition": tables.definition,
        "transitions": tables.transitions,
        "called": tuple(item.name for item in model.communications if item.kind in CALLED_KINDS),
    }


def _shares(asked: tuple[Communication, ...]) -> dict[str, str | None]:
    """For each service and action the first one of its kind with its identifier, if that is another."""
    first: dict[tuple[CommunicationKind, str], str] = {}
    for item in asked:
        first.setdefault((item.kind, item.identifier), item.name)
    return {item.name: found if (found := first[item.kind, item.identifier]) != item.name else None for item in asked}


def _shapes(model: Model, deployment: Deployment) -> dict[str, object]:
    return {
        event: shape for item in model.communications for event, shape in shapes_of(model, item, deployment).items()
    }


def chosen(parameters: tuple[Parameter, ...], options: GenerateOptions) -> tuple[Parameter, ...]:
    """Parameters as a package's parameter file sets them: with what the user chose about generated nodes."""
    values: dict[str, object] = {}
    if options.publish_state:
        values["publish_state"] = True
    if options.log_events:
        values["log_folder"] = EVENT_LOG_FOLDER
    values["state_message"] = str(options.state_message)
    return tuple(item._replace(default=values.get(item.name, item.default)) for item in parameters)
