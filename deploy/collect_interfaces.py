"""Collects the ROS interface definitions of a distribution into one of the files of `robosc/interfaces/shipped/`.

    collect_interfaces.py TITLE OUTPUT [--base FILE] FOLDER...

Each FOLDER holds ROS packages with `msg`, `srv` and `action` folders, as `share` of an installed ROS does; the first
one that has a package wins. Comments and default values are left out. With a base, only what differs from that file is
written, and `-NAME` for what it has and the packages here do not.
"""

import argparse
import re
from collections.abc import Iterable
from pathlib import Path

from robosc.interfaces.definitions import INTERFACE_KINDS, parse_definition
from robosc.interfaces.distributions import read_shipped

PACKAGES = tuple(
    "action_msgs actionlib actionlib_msgs builtin_interfaces control_msgs diagnostic_msgs geographic_msgs "
    "geometry_msgs lifecycle_msgs map_msgs move_base_msgs nav2_msgs nav_msgs opennav_docking_msgs rcl_interfaces "
    "rosgraph_msgs sensor_msgs service_msgs shape_msgs std_msgs std_srvs stereo_msgs tf2_msgs trajectory_msgs "
    "type_description_interfaces unique_identifier_msgs uuid_msgs visualization_msgs".split()
)
"""The packages that are collected, each whole or not at all."""

_DERIVED = re.compile(r"(Action|ActionGoal|ActionResult|ActionFeedback|Goal|Result|Feedback)\Z")
_HEAD = """\
# Interface definitions of {title}: fields and constants, without comments and default values.
# Made by deploy/collect_interfaces.py from the packages of that distribution, whose licences hold: the packages of
# ROS 2 are under the Apache License 2.0, those of ROS 1, control_msgs and geographic_msgs under the BSD License
# (copyright Willow Garage and the Open Source Robotics Foundation, for those two the authors that they name).
"""


def collected(folders: Iterable[Path]) -> dict[str, str]:
    """Return the definitions of some folders by name, e.g. `std_msgs/msg/Bool`."""
    found: dict[str, str] = {}
    for package in PACKAGES:
        home = next((folder / package for folder in folders if (folder / package).is_dir()), None)
        for kind in INTERFACE_KINDS if home else ():
            for file in sorted((home / kind).glob(f"*.{kind}")):  # type: ignore[operator]  # a path
                found[f"{package}/{kind}/{file.stem}"] = compact(file.read_text(encoding="utf-8"), package)
    actions = {name.replace("/action/", "/msg/") for name in found if "/action/" in name}
    # Messages generated from an action in ROS 1 are no interfaces that a model names.
    return {name: text for name, text in found.items() if _DERIVED.sub("", name) not in actions - {name}}


def compact(text: str, package: str) -> str:
    """Return a definition without comments and default values."""
    lines: list[str] = []
    for line in text.splitlines():
        first, *following = parse_definition(line, package)
        lines += ["---"] * len(following)
        lines += [f"{line.split()[0]} {name}={value}" for name, value in first.constants.items()]
        lines += [f"{field.type_text.removeprefix(f'{package}/')} {field.name}" for field in first.fields.values()]
    return "\n".join(lines)


def main() -> None:
    """Write the file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("title")
    parser.add_argument("output", type=Path)
    parser.add_argument("--base", type=Path)
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER")
    arguments = parser.parse_args()
    found = collected(arguments.folders)
    base = read_shipped(arguments.base.read_text(encoding="utf-8"), {}) if arguments.base else {}
    groups = {name.rpartition("/")[0] for name in found}
    packages = {name.partition("/")[0] for name in found}
    entries = {name: text for name, text in found.items() if base.get(name) != text}
    # A folder that lacks services as a whole says nothing about them.
    gone = [
        name
        for name in base
        if name not in found and (name.rpartition("/")[0] in groups or name.partition("/")[0] not in packages)
    ]
    text = _HEAD.format(title=arguments.title) + "".join(f"-{name}\n" for name in sorted(gone))
    for name in sorted(entries):
        text += f"{name}\n" + "".join(f" {line}\n" for line in entries[name].splitlines())
    arguments.output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
