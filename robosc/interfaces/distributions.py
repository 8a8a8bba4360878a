"""Interface definitions of ROS distributions, which come with RoboSC: models are checked without an installed ROS.

A file of the folder `shipped` is a list of definitions. Each has its name, such as `std_msgs/msg/Bool`, and then its
lines, each after a blank. `deploy/collect_interfaces.py` writes the files.
"""

from collections.abc import Mapping
from functools import cache
from pkgutil import get_data

import msgspec


class Distribution(msgspec.Struct, frozen=True):
    """A ROS distribution.

    Attributes:
        title: Its name, e.g. `ROS 2 Jazzy`.
        version: 1 for ROS 1, 2 for ROS 2.
        file: File of its definitions, as far as they differ from those of `base`.
        base: Distribution that it is compared with, or None.
    """

    title: str
    version: int
    file: str
    base: "Distribution | None" = None

    @property
    def definitions(self) -> Mapping[str, str]:
        """Texts of its definitions by name, e.g. `std_msgs/msg/Bool`."""
        return _definitions(self)


JAZZY = Distribution("ROS 2 Jazzy", 2, "ros2_jazzy.txt")
KILTED = Distribution("ROS 2 Kilted", 2, "ros2_kilted.txt", JAZZY)
LYRICAL = Distribution("ROS 2 Lyrical", 2, "ros2_lyrical.txt", JAZZY)
HUMBLE = Distribution("ROS 2 Humble", 2, "ros2_humble.txt", JAZZY)
NOETIC = Distribution("ROS 1 Noetic", 1, "ros1_noetic.txt", JAZZY)

DISTRIBUTIONS = (JAZZY, KILTED, LYRICAL, HUMBLE, NOETIC)
"""The distributions; of those of one version, the first is what findings speak of."""


@cache
def _definitions(distribution: Distribution) -> Mapping[str, str]:
    # Not importlib.resources, whose readers load all that zip archives need.
    content = get_data(__package__, f"shipped/{distribution.file}") or b""
    return read_shipped(content.decode(), {} if distribution.base is None else distribution.base.definitions)


@cache
def shipped_types() -> Mapping[str, tuple[str, ...]]:
    """The types that come with RoboSC, of any distribution, by package; both sorted."""
    found: dict[str, set[str]] = {}
    for distribution in DISTRIBUTIONS:
        for name in distribution.definitions:
            package, _, type_ = name.split("/")
            found.setdefault(package, set()).add(type_)
    return {package: tuple(sorted(found[package])) for package in sorted(found)}


def read_shipped(text: str, base: Mapping[str, str]) -> dict[str, str]:
    """Return the definitions of a file by name.

    Args:
        text: The file's text.
        base: Definitions that it is based on.
    """
    found = dict(base)
    lines: dict[str, list[str]] = {}
    name = ""
    for line in text.splitlines():
        if line.startswith("-"):
            del found[line[1:]]
        elif line.startswith(" "):
            lines[name].append(line[1:])
        elif line and not line.startswith("#"):
            name = line
            lines[name] = []
    found.update((name, "\n".join(body)) for name, body in lines.items())
    return dict(sorted(found.items()))
