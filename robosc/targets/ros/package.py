"""Parts of the packages for ROS 2 and ROS 1: values that templates refer to, filters that escape, copied modules."""

import json
import pprint
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from importlib import resources

import jinja2

from robosc._version import __version__
from robosc.errors import UnsupportedModelError
from robosc.model.structure import Communication, CommunicationKind, Deployment, Interface, Model
from robosc.supervisor import Supervisor
from robosc.targets.code.naming import snake_case
from robosc.targets.code.text import printable
from robosc.targets.events import has_plant_location
from robosc.targets.model_text import requirement_text
from robosc.targets.python.generate import header
from robosc.targets.python.layout import make_layout
from robosc.targets.python.package import beside_supervisor, python_text
from robosc.targets.registry import GenerateOptions
from robosc.targets.ros.runtime.parameters import Parameter
from robosc.targets.ros.state_topic import state_topic
from robosc.targets.ros.topics import Topic, sent_paths, shapes_of

MAXIMUM_STARTER = 100

EVENT_LOG_FOLDER = "event_log"
"""Folder of the event log if the user asked for it without a folder: in the folder that the node is started in."""

_DIAGNOSTICS = Interface("DiagnosticArray", "diagnostic_msgs")
_RELEASED_TYPES = frozenset({"Twist", "TwistStamped"})
_TITLES = {Deployment.CONTROLLER: "Supervisory controller", Deployment.LAYER: "Supervision layer"}


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
    """The identifiers that keep acting after a message: velocities (semantics 3.6)."""
    return tuple(
        topic.identifier
        for topic in found
        if topic.published and topic.interface.package == "geometry_msgs" and topic.interface.type in _RELEASED_TYPES
    )


def context(
    supervisor: Supervisor, package: str, found: tuple[Topic, ...], asked: tuple[Communication, ...]
) -> dict[str, object]:
    """Return the values that the templates of every kind of package refer to."""
    model = supervisor.model
    layout = make_layout(supervisor)
    tables = state_topic(model)
    requested = [item for item in model.communications if item.kind is not CommunicationKind.OUTGOING_MESSAGE]
    return {
        "version": __version__,
        "model": model.name,
        "package": package,
        "title": _TITLES[supervisor.deployment],
        "digest": supervisor.certificate.bundle_sha256,
        "header": header(supervisor),
        "certificate": {
            field: printable(str(getattr(supervisor.certificate, field)))
            for field in ("safe", "controllable", "nonblocking", "maximally_permissive", "method", "states")
        },
        "requirements": [printable(requirement_text(item)) for item in model.requirements],
        "topics": found,
        "release_identifiers": release_identifiers(found),
        "servers": asked,
        "deployment": str(supervisor.deployment),
        "shapes": _shapes(model, supervisor.deployment),
        "sent": {item.name: sent_paths(model, item) for item in requested},
        "starter": f"start_{snake_case(model.name)[:MAXIMUM_STARTER]}",
        "requests": tuple(f"{item.name}.request" for item in requested),
        "controllable": layout.controllable,
        "uncontrollable": layout.uncontrollable,
        "definition": tables.definition,
        "transitions": tables.transitions,
        "called": tuple(item.name for item in model.communications if has_plant_location(item)),
    }


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
    return tuple(item._replace(default=values.get(item.name, item.default)) for item in parameters)


def python_files(supervisor: Supervisor, package: str, modules: Mapping[str, str]) -> dict[str, str]:
    """Return a package's Python files without a template, by path: the supervisor, and what a node runs on.

    Args:
        supervisor: Supervisor to generate.
        package: The package's name.
        modules: Runtime modules, such as `early`, with the packages that they are copied from.
    """
    top = header(supervisor)
    files = {
        f"{package}/__init__.py": f'{top}"""The supervisor of the robot {supervisor.model.name} and its node."""\n',
        f"{package}/supervisor.py": python_text(supervisor, f"{package}.supervisor"),
        f"{package}/runtime/__init__.py": f'{top}"""Runtime of the node: no part of it depends on the model."""\n',
    }
    for module, folder in modules.items():
        text = resources.files(folder).joinpath(f"{module}.py").read_text(encoding="utf-8")
        files[f"{package}/runtime/{module}.py"] = top + beside_supervisor(text)
    return files


@cache
def environment(target: str) -> jinja2.Environment:
    """Templates of a target's package, and those that all packages share."""
    found = jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(target), jinja2.PackageLoader(__package__)]),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        # Escapes what goes into XML; every other value is escaped by a filter or is a checked name.
        autoescape=jinja2.select_autoescape(enabled_extensions=("xml.j2", "launch.j2")),
    )
    filters: dict[str, Callable[..., object]] = {
        "json": json.dumps,
        "literal": ascii,
        "names": lambda communications: tuple(item.name for item in communications),
        "printable": printable,
        "quality": lambda quality: f"{quality[0].replace('_', ' ')}, depth {quality[1]}",
        "pretty": lambda value: pprint.pformat(value, width=110, sort_dicts=False),
        "split_lines": str.splitlines,
    }
    found.filters.update(filters)
    return found
