"""A stand-in for `launch` and `launch_ros`, which are in no package index: it records what a launch file asks for."""

import importlib.util
import sys
import types
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any


class Recorded:
    """Stands for a class of `launch` or `launch_ros`: keeps what it was called with."""

    def __init__(self, *positional: Any, **named: Any) -> None:
        self.positional = positional
        self.named = named


_CLASSES = {
    "launch": ["LaunchDescription"],
    "launch.actions": ["DeclareLaunchArgument", "GroupAction", "IncludeLaunchDescription", "Shutdown"],
    "launch.conditions": ["IfCondition"],
    "launch.launch_description_sources": ["AnyLaunchDescriptionSource"],
    "launch.substitutions": [
        "AndSubstitution",
        "EqualsSubstitution",
        "LaunchConfiguration",
        "NotEqualsSubstitution",
        "PathJoinSubstitution",
    ],
    "launch_ros": [],
    "launch_ros.actions": ["LoadComposableNodes", "Node", "PushRosNamespace", "SetParameter", "SetRemap"],
    "launch_ros.descriptions": ["ComposableNode"],
    "launch_ros.parameter_descriptions": ["ParameterValue"],
    "launch_ros.substitutions": ["FindPackageShare"],
    "ament_index_python": [],
    "ament_index_python.packages": [],
}


@contextmanager
def recorded_launch(share: Path) -> Iterator[None]:
    """The modules that a launch file imports, recording.

    Args:
        share: The share folder of every package.
    """
    before = {name: sys.modules.get(name) for name in _CLASSES}
    for name, classes in _CLASSES.items():
        module = types.ModuleType(name)
        for item in classes:
            setattr(module, item, type(item, (Recorded,), {}))
        sys.modules[name] = module
    packages: Any = sys.modules["ament_index_python.packages"]
    packages.get_package_share_directory = lambda package: str(share)
    try:
        yield
    finally:
        for name, module_before in before.items():
            if module_before is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module_before


def launch_actions(file: Path, share: Path) -> dict[str, list[Recorded]]:
    """Return the actions in the description of a launch file, by the name of their class.

    Args:
        file: The launch file.
        share: The share folder of every package.
    """
    with recorded_launch(share):
        spec = importlib.util.spec_from_file_location("launch_file", file)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        (actions,) = module.generate_launch_description().positional
    found: dict[str, list[Recorded]] = {}
    for action in actions:
        found.setdefault(type(action).__name__, []).append(action)
    return found


def evaluated(item: Any, arguments: Mapping[str, str]) -> str:
    """Return the value of a substitution, given the launch file's arguments."""
    if isinstance(item, str):
        return item
    if isinstance(item, list | tuple):
        return "".join(evaluated(part, arguments) for part in item)
    first = item.positional[0]
    match type(item).__name__:
        case "LaunchConfiguration":
            return arguments[first] if first in arguments else evaluated(item.named["default"], arguments)
        case "EqualsSubstitution":
            return str(evaluated(first, arguments) == evaluated(item.positional[1], arguments)).lower()
        case "NotEqualsSubstitution":
            return str(evaluated(first, arguments) != evaluated(item.positional[1], arguments)).lower()
        case "AndSubstitution":
            return str(all(evaluated(part, arguments) == "true" for part in item.positional)).lower()
        case "PathJoinSubstitution":
            return "/".join(evaluated(part, arguments) for part in first)
        case "FindPackageShare":
            return f"share of {evaluated(first, arguments)}"
    raise AssertionError(f"{type(item).__name__} is no substitution of a launch file that is known here")
