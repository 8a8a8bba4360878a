"""The target `ros2`: a complete ament_python package around the generated supervisor."""

import json
import pprint
from collections.abc import Callable
from importlib import resources

import jinja2

from robosc._version import __version__
from robosc.errors import UnsupportedModelError
from robosc.model.structure import Communication, CommunicationKind, Interface, Model
from robosc.supervisor.structure import Supervisor
from robosc.targets.files import GeneratedFiles
from robosc.targets.python.generate import header
from robosc.targets.python.layout import make_layout
from robosc.targets.python.naming import snake_case
from robosc.targets.python.package import package_name, python_files, with_relative_imports
from robosc.targets.python.text import printable
from robosc.targets.registry import GenerateOptions
from robosc.targets.ros2.runtime.parameters import declarations
from robosc.targets.ros2.state_topic import state_topic
from robosc.targets.ros2.topics import Topic, sent_paths, servers, shapes_of, topics
from robosc.targets.words import requirement_text

_OWN_DEPENDENCIES = (
    "ament_index_python",
    "diagnostic_msgs",
    "launch",
    "launch_ros",
    "rcl_interfaces",
    "rclpy",
    "std_msgs",
)
_MAXIMUM_STARTER = 100
_DIAGNOSTICS = Interface("DiagnosticArray", "diagnostic_msgs")
_RUNTIME_MODULES = ("clients.py", "early.py", "health.py", "messages.py", "parameters.py", "scans.py")
_RELEASED_TYPES = frozenset({"Twist", "TwistStamped"})

# Path of each file from a template: the template's name.
_TEMPLATES = {
    "README.md": "README.md.j2",
    "config/parameters.yaml": "parameters.yaml.j2",
    "launch/controller.launch.py": "controller.launch.py.j2",
    "package.xml": "package.xml.j2",
    "setup.cfg": "setup.cfg.j2",
    "setup.py": "setup.py.j2",
    "test/test_supervisor.py": "test_supervisor.py.j2",
    "{package}/interfaces.py": "interfaces.py.j2",
    "{package}/middleware.py": "middleware.py.j2",
    "{package}/node.py": "node.py.j2",
    "{package}/start.py": "start.py.j2",
    "{package}/state_topic.py": "state_topic.py.j2",
}


def generate(supervisor: Supervisor, options: GenerateOptions) -> GeneratedFiles:
    """The package's files.

    Raises:
        UnsupportedModelError: The model has something that this version cannot do on ROS 2.
    """
    name = package_name(supervisor, options, "controller")
    found, asked = topics(supervisor), servers(supervisor.model)
    _require_own_names(name, found, asked)
    files = {f"{name}/{path}": text for path, text in python_files(supervisor).items()}
    for module in _RUNTIME_MODULES:
        text = resources.files("robosc.targets.ros2.runtime").joinpath(module).read_text(encoding="utf-8")
        files[f"{name}/runtime/{module}"] = header(supervisor) + with_relative_imports(text)
    environment, context = _environment(), _context(supervisor, name, found, asked)
    for path, template in _TEMPLATES.items():
        files[path.format(package=name)] = environment.get_template(template).render(context)
    files[f"resource/{name}"] = ""
    return GeneratedFiles(files)


def _require_own_names(package: str, found: tuple[Topic, ...], asked: tuple[Communication, ...]) -> None:
    """Do nothing if neither the package nor the topics that it has anyway are called like something of the model's."""
    if package in _packages(found, asked):
        raise UnsupportedModelError(
            f"target ros2: the generated package would be called {package}, like a package whose types it uses"
        )
    for topic in found:
        if topic.identifier.lstrip("/") == "diagnostics" and topic.interface != _DIAGNOSTICS:
            raise UnsupportedModelError(
                f"target ros2: the topic {topic.identifier} is of the type {topic.interface.package}/"
                f"{topic.interface.type}, but every generated node publishes diagnostic_msgs/DiagnosticArray there"
            )


def _packages(found: tuple[Topic, ...], asked: tuple[Communication, ...]) -> set[str]:
    """The packages of all types."""
    return {topic.interface.package for topic in found} | {item.interface.package for item in asked if item.interface}


def release_identifiers(found: tuple[Topic, ...]) -> tuple[str, ...]:
    """The identifiers that keep acting after a message: velocities (semantics 3.6)."""
    return tuple(
        topic.identifier
        for topic in found
        if topic.published and topic.interface.package == "geometry_msgs" and topic.interface.type in _RELEASED_TYPES
    )


def _context(
    supervisor: Supervisor, package: str, found: tuple[Topic, ...], asked: tuple[Communication, ...]
) -> dict[str, object]:
    """What the templates speak of."""
    model = supervisor.model
    layout = make_layout(supervisor)
    tables = state_topic(model)
    requested = [item for item in model.communications if item.kind is not CommunicationKind.OUTGOING_MESSAGE]
    return {
        "version": __version__,
        "model": model.name,
        "package": package,
        "digest": supervisor.certificate.bundle_sha256,
        "header": header(supervisor),
        "certificate": {
            field: printable(str(getattr(supervisor.certificate, field)))
            for field in ("safe", "controllable", "nonblocking", "maximally_permissive", "method", "states")
        },
        "requirements": [printable(requirement_text(item)) for item in model.requirements],
        "topics": found,
        "parameters": declarations(release_identifiers(found)),
        "release_identifiers": release_identifiers(found),
        "dependencies": sorted({*_OWN_DEPENDENCIES, *_packages(found, asked)}),
        "servers": asked,
        "shapes": _shapes(model),
        "sent": {item.name: sent_paths(model, item) for item in requested},
        "starter": f"start_{snake_case(model.name)[:_MAXIMUM_STARTER]}",
        "requests": tuple(f"{item.name}.request" for item in requested),
        "controllable": layout.controllable,
        "uncontrollable": layout.uncontrollable,
        "definition": tables.definition,
        "transitions": tables.transitions,
    }


def _shapes(model: Model) -> dict[str, object]:
    return {event: shape for item in model.communications for event, shape in shapes_of(model, item).items()}


def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("robosc.targets.ros2"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        # Escapes what goes into XML; every other value is escaped by a filter or is a checked name.
        autoescape=jinja2.select_autoescape(enabled_extensions=("xml.j2",)),
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
    environment.filters.update(filters)
    return environment
