"""Interfaces of one ROS distribution, with the definitions that were found for a model."""

import re
from collections.abc import Collection, Mapping

from robosc.interfaces.definitions import (
    INTERFACE_KINDS,
    TIMES,
    Field,
    MalformedDefinitionError,
    Part,
    parse_definition,
    ros_version_of,
)
from robosc.interfaces.distributions import Distribution

INDEX = "types.txt"
"""File of a package with the names of its interfaces, one a line, such as `msg/Bool`."""

_HEADER = "std_msgs/Header"
_OWN_TIMES = {
    name: Part({field: Field(field, kind) for field, kind in fields}, {})
    for name, fields in {
        "time": (("secs", "uint32"), ("nsecs", "uint32")),
        "duration": (("secs", "int32"), ("nsecs", "int32")),
    }.items()
}
"""Times of ROS 1 as its Python classes have them."""

_DERIVED = re.compile(r"(Action|ActionGoal|ActionResult|ActionFeedback|Goal|Result|Feedback)\Z")
"""Endings of the messages that ROS 1 generates from an action."""


class FoundInterfaces:
    """The definitions that were found for a model.

    Args:
        files: Texts by name, such as `std_msgs/msg/Bool.msg`, and indexes such as `std_msgs/types.txt`.

    Attributes:
        files: These texts.
        definitions: Parts by name, such as `std_msgs/msg/Bool`; None for a text that is no definition.
        versions: Version of ROS that alone knows a definition, by name; None where both might.
        indexes: Names of the interfaces of packages, such as `msg/Bool`.
    """

    def __init__(self, files: Mapping[str, str]) -> None:
        self.files = files
        self.definitions: dict[str, tuple[Part, ...] | None] = {}
        self.versions: dict[str, int | None] = {}
        self.indexes: dict[str, frozenset[str]] = {}
        for name, text in files.items():
            package, _, rest = name.partition("/")
            if rest == INDEX:
                self.indexes[package] = frozenset(text.split())
            elif name.endswith(tuple(f".{kind}" for kind in INTERFACE_KINDS)):
                self._read(name.rpartition(".")[0], package, text, f"{package}/msg/Header.msg" in files)

    def without(self, packages: Collection[str]) -> "FoundInterfaces":
        """Return what was found of other packages."""
        return FoundInterfaces(
            {name: text for name, text in self.files.items() if name.partition("/")[0] not in packages}
        )

    def _read(self, name: str, package: str, text: str, has_header: bool) -> None:
        try:
            parts = parse_definition(text, package)
        except MalformedDefinitionError:
            self.definitions[name] = None
            return
        self.definitions[name] = parts
        self.versions[name] = None if has_header and package != "std_msgs" else ros_version_of(parts, package)


class Catalogue:
    """Interfaces of a distribution; what was found wins over what comes with RoboSC, unless it is of the other ROS.

    A definition that might be of either ROS is taken for one of ROS 2 where ROS 1 has its own.

    Args:
        distribution: The distribution.
        found: The definitions that were found.
    """

    def __init__(self, distribution: Distribution, found: FoundInterfaces) -> None:
        self.distribution = distribution
        self._found = found
        self._shipped = distribution.definitions
        self._packages = {name.partition("/")[0] for name in self._shipped}

    def described(self, kind: str, package: str, type_: str) -> str:
        """An interface in words; of a definition that comes with RoboSC, its distribution is reported."""
        is_own = self._is_found(f"{package}/{kind}/{type_}")
        return f"{package}/{type_}" + ("" if is_own else f" of {self.distribution.title}")

    def described_package(self, package: str) -> str:
        """A package in words, as `described`."""
        is_own = package not in self._packages
        return package if is_own else f"{package} of {self.distribution.title}"

    def _is_found(self, name: str) -> bool:
        if name not in self._found.definitions:
            return False
        version = self._found.versions.get(name)
        if version is None:
            return self.distribution.version == 2 or name not in self._shipped
        return version == self.distribution.version

    def definition(self, kind: str, package: str, type_: str) -> tuple[Part, ...] | None:
        """The parts of an interface; None where it is not known."""
        if kind == "action" and self.distribution.version == 1:
            # `MoveBase` and `MoveBaseAction` both mean the action of that name.
            type_ = type_.removesuffix("Action")
        name = f"{package}/{kind}/{type_}"
        if self._is_found(name):
            return self._found.definitions[name]
        text = self._shipped.get(name)
        return None if text is None else parse_definition(text, package)

    def knows(self, package: str) -> bool:
        """Return True if it is known which interfaces a package has."""
        return package in self._packages or package in self._found.indexes

    def has(self, kind: str, package: str, type_: str) -> bool:
        """Return True if a package may have an interface."""
        if self.definition(kind, package, type_) is not None or f"{kind}/{type_}" in self._found.indexes.get(
            package, ()
        ):
            return True
        # A definition that cannot be read, or of the other ROS, says that there is one.
        if f"{package}/{kind}/{type_}" in self._found.definitions:
            return True
        action = _DERIVED.sub("", type_)
        return kind == "msg" and action != type_ and self.has("action", package, action)

    def types(self, kind: str, package: str) -> tuple[str, ...]:
        """The known interfaces of one kind of a package, sorted."""
        prefix = f"{package}/{kind}/"
        names = {
            name.removeprefix(prefix) for name in (*self._shipped, *self._found.definitions) if name.startswith(prefix)
        }
        names |= {
            name.removeprefix(f"{kind}/")
            for name in self._found.indexes.get(package, ())
            if name.startswith(f"{kind}/")
        }
        return tuple(sorted(names))

    def message(self, type_: str) -> Part | None:
        """The message that is the type of a field; None where it is not known."""
        if type_ in TIMES:
            if self.distribution.version == 1:
                return _OWN_TIMES[type_]
            type_ = f"builtin_interfaces/{type_.capitalize()}"
        package, _, name = self.resolved(type_).partition("/")
        parts = self.definition("msg", package, name)
        return parts[0] if parts else None

    def resolved(self, type_: str) -> str:
        """The type of a field as `package/Type`: in ROS 1, `Header` alone means the one of std_msgs."""
        package, _, name = type_.partition("/")
        is_header = name == "Header" and package != "std_msgs"
        return _HEADER if is_header and self.definition("msg", package, name) is None else type_

    def has_header(self, part: Part) -> bool:
        """Return True if a message has a header that can be stamped."""
        header = part.fields.get("header")
        return header is not None and header.array is None and self.resolved(header.type) == _HEADER


__all__ = ["INDEX", "Catalogue", "FoundInterfaces"]
