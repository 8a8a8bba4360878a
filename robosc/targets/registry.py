"""The registry of targets: found by name, imported when they are used.

Built-in targets are listed here; an installed distribution adds its own through the entry-point group
`robosc.targets` (name = target, value = `module:attribute` of a `Target`), a program through `register`.
"""

import importlib
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from enum import StrEnum
from typing import TYPE_CHECKING, Protocol

from robosc._version import YEAR
from robosc.automata.structure import System
from robosc.errors import RoboscError, UnsupportedModelError
from robosc.supervisor import AddedCondition, DecisionDiagram, Supervisor
from robosc.targets.files import GeneratedFiles

if TYPE_CHECKING:
    from importlib.metadata import EntryPoints

ENTRY_POINT_GROUP = "robosc.targets"

_PACKAGE = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,199}\Z")
_FILE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.+-]{0,199}\Z")
_NODE = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,199}\Z")
_NAMESPACE = re.compile(r"(?=.{1,200}\Z)/?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*/?\Z")
_MAINTAINER = re.compile(r"(.*\S)\s*<([^<>]*)>\s*\Z")
# The address is one that catkin_pkg, which reads package.xml, takes.
_EMAIL = re.compile(r"[-A-Za-z0-9_%+]+(\.[-A-Za-z0-9_%+]+)*@([-A-Za-z0-9]+\.)+[A-Za-z]{2,}\Z")
# The line is one that ament_copyright takes after the word Copyright.
_COPYRIGHT = re.compile(r"\d{4}(-\d{4})?(, *\d{4}(-\d{4})?)*,? +\S.*\Z", re.ASCII)
_VERSION = re.compile(r"(0|[1-9][0-9]{0,8})(\.(0|[1-9][0-9]{0,8})){2}\Z")
_MAXIMUM_TEXT = 200


@dataclass(frozen=True, slots=True)
class SupervisedController:
    """An existing controller that a supervision layer stands before: what to start.

    Attributes:
        package: Its package.
        executable: Its program, or None where a launch file starts it.
        launch_file: Its launch file, or None where it is a program.
        namespace: Namespace of its program below that of the layer, or None for the layer's own.
        name: Name of the node of its program, or None for the program's own.

    Raises:
        ValueError: A name is none of a package, file, namespace or node, or there is not exactly one file; says which.
    """

    package: str
    executable: str | None = None
    launch_file: str | None = None
    namespace: str | None = None
    name: str | None = None

    def __post_init__(self) -> None:
        if not _PACKAGE.match(self.package):
            raise ValueError("'package' must be the name of a package")
        if (self.executable is None) == (self.launch_file is None):
            raise ValueError("it must have either an executable or a launch file")
        for name in (self.executable, self.launch_file):
            if name is not None and not _FILE.match(name):
                raise ValueError("an executable or launch file must be the name of a file, without a path")
        if self.launch_file is not None and (self.namespace, self.name) != (None, None):
            raise ValueError("a launch file names its nodes itself: namespace and name are for an executable")
        if self.namespace is not None and not _NAMESPACE.match(self.namespace):
            raise ValueError("'namespace' must be a name of ROS, or several with '/' between them")
        if self.name is not None and not _NODE.match(self.name):
            raise ValueError("'name' must be the name of a node: letters, digits and underscores")


@dataclass(frozen=True, slots=True)
class PackageMetadata:
    """Data of a generated ROS package about itself, which stand in its `package.xml` and in notices of its files.

    Attributes:
        maintainer: Name of who maintains it.
        email: E-mail address of the maintainer.
        license: Its licence, such as `Apache-2.0`.
        version: Its version, three numbers, or None for the version of RoboSC.
        copyright: Years and name of who holds the copyright, such as `2026 Jane Doe`, or None for the maintainer and
            the year of the version of RoboSC.

    Raises:
        ValueError: One of them is wrong; says which.
    """

    maintainer: str = "Maintainer"
    email: str = "maintainer@example.org"
    license: str = "MIT"
    version: str | None = None
    copyright: str | None = None

    def __post_init__(self) -> None:
        given = {
            "the maintainer's name": self.maintainer,
            "the licence": self.license,
            "the copyright": self.copyright or self.maintainer,
        }
        for what, text in given.items():
            if not text.strip() or not text.isprintable() or len(text) > _MAXIMUM_TEXT:
                raise ValueError(f"{what} must be one line of at most {_MAXIMUM_TEXT} characters")
        if not _EMAIL.match(self.email) or len(self.email) > _MAXIMUM_TEXT:
            raise ValueError(f"the maintainer's e-mail address {self.email[:_MAXIMUM_TEXT]!a} is not an e-mail address")
        if self.version is not None and not _VERSION.match(self.version):
            raise ValueError("the version of the package must be three numbers, such as 1.0.0")
        if self.copyright is not None and not _COPYRIGHT.match(self.copyright):
            raise ValueError("the copyright must be years and a name, such as '2026 Jane Doe'")

    @property
    def holder(self) -> str:
        """Years and name of who holds the copyright."""
        return self.copyright or f"{YEAR} {self.maintainer}"

    def with_maintainer(self, text: str) -> "PackageMetadata":
        """Return the same with another maintainer.

        Args:
            text: Name and e-mail address, as `Jane Doe <jane@example.org>`.

        Raises:
            ValueError: It is not of that form.
        """
        found = _MAINTAINER.match(text)
        if found is None:
            raise ValueError("the maintainer must be written as 'Jane Doe <jane@example.org>'")
        return replace(self, maintainer=found[1], email=found[2])


class StateMessage(StrEnum):
    """Form in which a generated ROS 2 node publishes its state."""

    JSON = "json"
    """A text on the topic `state`; needs nothing else."""
    TYPED = "typed"
    """`robosc_msgs/msg/SupervisorState` on the topic `~/state`; that package has to be built."""
    BOTH = "both"


@dataclass(frozen=True, slots=True)
class GenerateOptions:
    """Choices of a user about generated files.

    Attributes:
        package: Name of the generated package, or None for one made from the robot's name.
        publish_state: True if a generated node publishes `/state` unless its parameters say otherwise.
        log_events: True if a generated node writes its event log unless its parameters say otherwise.
        supervised: The existing controller that a generated layer's launch file starts, or None to leave that to its
            arguments.
        metadata: Data of a generated ROS package about itself.
        state_message: Form of the state of a generated ROS 2 node, unless its parameters say otherwise.
    """

    package: str | None = None
    publish_state: bool = False
    log_events: bool = False
    supervised: SupervisedController | None = None
    metadata: PackageMetadata = PackageMetadata()
    state_message: StateMessage = StateMessage.JSON


@dataclass(frozen=True, slots=True)
class TargetInfo:
    """A target as users see it."""

    name: str
    description: str


GENERAL_ERRORS = frozenset({"conflicting-topic"})
"""Codes of the check's warnings that are errors wherever something is generated."""


class SupervisedSystem(Protocol):
    """Automata under their supervisor.

    Attributes:
        system: The automata.
        added: Conditions that the supervisor adds to events.
        initial: Condition on the initial states in which it lets the system begin; None if in all.
    """

    @property
    def system(self) -> System:
        """The automata."""

    @property
    def added(self) -> Sequence[AddedCondition]:
        """The conditions on events."""

    @property
    def initial(self) -> DecisionDiagram | None:
        """The condition on initial states."""


@dataclass(frozen=True, slots=True)
class Target:
    """A target: what it is, and its generator.

    Attributes:
        info: Name and description.
        generate: Makes the files; raises UnsupportedModelError for a model outside what it handles.
        generate_automata: The same for automata; None for a target that needs a model of a robot.
        errors: Codes of the check's warnings that are errors for this target.
    """

    info: TargetInfo
    generate: Callable[[Supervisor, GenerateOptions], GeneratedFiles]
    errors: frozenset[str] = GENERAL_ERRORS
    generate_automata: Callable[[SupervisedSystem, GenerateOptions], GeneratedFiles] | None = None


class UnknownTargetError(RoboscError, LookupError):
    """A target of that name does not exist."""


# Name, description and place of the built-in targets: listing them imports none.
_BUILT_IN: dict[str, tuple[str, str]] = {
    "c99": (
        "the supervisor and its executor as portable C99 without allocation",
        "robosc.targets.c99:TARGET",
    ),
    "cif": (
        "the synthesis problem and the controlled system in CIF, for Eclipse ESCET",
        "robosc.targets.cif:TARGET",
    ),
    "promela": (
        "the controlled system as a model for the model checker spin",
        "robosc.targets.promela:TARGET",
    ),
    "python": (
        "the supervisor and its executor as one Python file without any dependency",
        "robosc.targets.python:TARGET",
    ),
    "ros1": (
        "a complete ROS 1 package (catkin, rospy): controller or layer node, launch file, parameters",
        "robosc.targets.ros1:TARGET",
    ),
    "ros1-cpp": (
        "a complete ROS 1 package (catkin): a roscpp node around the supervisor in C99",
        "robosc.targets.ros1_cpp:TARGET",
    ),
    "ros2": (
        "a complete ROS 2 package (ament_python): controller or layer node, launch file, parameters",
        "robosc.targets.ros2:TARGET",
    ),
    "ros2-cpp": (
        "a complete ROS 2 package (ament_cmake): an rclcpp node around the supervisor in C99",
        "robosc.targets.ros2_cpp:TARGET",
    ),
    "ros2-msgs": (
        "the ROS 2 messages of ~/state (ament_cmake), the same for every model: state_message typed",
        "robosc.targets.ros2_msgs:TARGET",
    ),
}

_registered: dict[str, Target] = {}


def register(target: Target) -> None:
    """Make a target known to this process; one of the same name is replaced."""
    _registered[target.info.name] = target


def available_targets() -> tuple[TargetInfo, ...]:
    """Every target that can be generated, by name."""
    infos = {name: TargetInfo(name, description) for name, (description, _) in _BUILT_IN.items()}
    for entry in _offered():
        infos.setdefault(entry.name, TargetInfo(entry.name, f"plug-in {entry.value}"))
    infos.update((name, target.info) for name, target in _registered.items())
    return tuple(infos[name] for name in sorted(infos))


def require_target(name: str) -> None:
    """Do nothing if there is a target called `name`.

    Raises:
        UnknownTargetError: There is none; the message says what there is.
    """
    # The targets of other packages are looked up only for an unknown name: that reads the lists of all installed
    # packages.
    if name in _BUILT_IN or name in _registered:
        return
    names = [info.name for info in available_targets()]
    if name in names:
        return
    close = get_close_matches(name, names, n=1)
    hint = f"; did you mean '{close[0]}'?" if close else f"; there is {', '.join(names)}"
    raise UnknownTargetError(f"unknown target '{name}'{hint}")


def generate(supervisor: Supervisor, target: str, options: GenerateOptions | None = None) -> GeneratedFiles:
    """The files of a target for a supervisor.

    Raises:
        UnknownTargetError: There is no such target.
        UnsupportedModelError: The model is outside what the target handles.
    """
    require_target(target)
    return _load(target).generate(supervisor, options or GenerateOptions())


def generate_automata(
    supervised: SupervisedSystem, target: str, options: GenerateOptions | None = None
) -> GeneratedFiles:
    """The files of a target for automata under their supervisor.

    Raises:
        UnknownTargetError: There is no such target.
        UnsupportedModelError: It needs a model of a robot, or the automata are outside what it handles.
    """
    require_target(target)
    found = _load(target).generate_automata
    if found is None:
        raise UnsupportedModelError(
            f"the target {target} needs a model of a robot: automata have no messages; c99, cif and python take them"
        )
    return found(supervised, options or GenerateOptions())


def errors_for(target: str) -> frozenset[str]:
    """Codes of the check's warnings that are errors for a target.

    Raises:
        UnknownTargetError: There is no such target.
    """
    require_target(target)
    return _load(target).errors


def _offered() -> "EntryPoints":
    """The targets of other packages; what looks for them takes as long to load as a small synthesis takes."""
    from importlib.metadata import entry_points

    return entry_points(group=ENTRY_POINT_GROUP)


def _load(name: str) -> Target:
    """The target itself; imports it."""
    if name in _registered:
        return _registered[name]
    if name in _BUILT_IN:
        module, _, attribute = _BUILT_IN[name][1].partition(":")
        loaded = getattr(importlib.import_module(module), attribute)
    else:
        loaded = next(entry for entry in _offered() if entry.name == name).load()
    if not isinstance(loaded, Target):
        raise UnknownTargetError(f"the plug-in of target '{name}' is not a robosc.targets.registry.Target")
    return loaded
