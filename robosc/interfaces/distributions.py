"""Interface definitions of ROS distributions, which come with RoboSC: models are checked without an installed ROS.

A file of the folder `shipped` is a list of definitions. Each has its name, such as `std_msgs/msg/Bool`, and then its
lines, each after a blank. `deploy/collect_interfaces.py` writes the files.
"""

from collections.abc import Collection, Mapping
from functools import cache
from pkgutil import get_data

import msgspec


class Distribution(msgspec.Struct, frozen=True):
    """A ROS distribution.

    Attributes:
        title: Its name, e.g. `ROS 2 Jazzy`.
        version: 1 for ROS 1, 2 for ROS 2.
        file: File of its definitions, as far as they differ from those of `base`.
        python: Version of its Python.
        tests: Trials of nodes in Python on it, in words.
        is_tested: True if nodes in Python run on its own client library in the tests.
        has_stamped_velocities: True if its robots take TwistStamped, and Nav2 sends it, unless they are told otherwise.
        base: Distribution that it is compared with, or None.
    """

    title: str
    version: int
    file: str
    python: str
    tests: str
    is_tested: bool = False
    has_stamped_velocities: bool = False
    base: "Distribution | None" = None

    @property
    def codename(self) -> str:
        """Its name as `ROS_DISTRO` has it, e.g. `jazzy`."""
        return self.title.rpartition(" ")[2].lower()

    @property
    def definitions(self) -> Mapping[str, str]:
        """Texts of its definitions by name, e.g. `std_msgs/msg/Bool`."""
        return _definitions(self)


JAZZY = Distribution(
    "ROS 2 Jazzy",
    2,
    "ros2_jazzy.txt",
    python="3.12",
    tests="nodes run over Fast DDS; packages are built and tested with colcon",
    is_tested=True,
)
KILTED = Distribution(
    "ROS 2 Kilted",
    2,
    "ros2_kilted.txt",
    python="3.12",
    tests="nodes run over Fast DDS, with Kilted's `rclpy`; packages are built on Jazzy only",
    is_tested=True,
    has_stamped_velocities=True,
    base=JAZZY,
)
LYRICAL = Distribution(
    "ROS 2 Lyrical",
    2,
    "ros2_lyrical.txt",
    python="3.14",
    tests="nodes do not run with Lyrical's `rclpy`, which no package index has; what they use of `rclpy` beside its "
    "documented interface has tests of its own",
    has_stamped_velocities=True,
    base=JAZZY,
)
HUMBLE = Distribution(
    "ROS 2 Humble",
    2,
    "ros2_humble.txt",
    python="3.10",
    tests="nodes run under Python 3.10 with Jazzy's `rclpy`, not with Humble's",
    base=JAZZY,
)
NOETIC = Distribution(
    "ROS 1 Noetic",
    1,
    "ros1_noetic.txt",
    python="3.8",
    tests="nodes run with Debian's ROS 1, which is Noetic's; packages are built with catkin",
    is_tested=True,
    base=JAZZY,
)

DISTRIBUTIONS = (JAZZY, KILTED, LYRICAL, HUMBLE, NOETIC)
"""The distributions; of those of one version, the first is what findings speak of where none was chosen."""

CODENAMES = tuple(sorted(distribution.codename for distribution in DISTRIBUTIONS))
"""Their names as `ROS_DISTRO` has them, sorted."""


def distribution_of(codename: str) -> Distribution | None:
    """The distribution of a codename, e.g. `jazzy`; None where its definitions do not come with RoboSC."""
    return next((item for item in DISTRIBUTIONS if item.codename == codename), None)


def titles_of(distributions: Collection[Distribution]) -> str:
    """Distributions in words, as `ROS 2 Humble, Jazzy and Kilted`, given that there is one."""
    texts = []
    for version in (2, 1):
        names = sorted(item.codename.capitalize() for item in distributions if item.version == version)
        if names:
            texts.append(f"ROS {version} " + " and ".join(filter(None, (", ".join(names[:-1]), names[-1]))))
    return " and ".join(texts)


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
