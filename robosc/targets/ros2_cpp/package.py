"""The record of the target `ros2-cpp`: ament_cmake, with an rclcpp node around a supervisor in C99."""

from collections.abc import Iterable

from robosc.model.structure import Interface
from robosc.targets.cpp.naming import file_name
from robosc.targets.cpp.package import Middleware
from robosc.targets.ros.layer import Renamed
from robosc.targets.ros.runtime.parameters import AUTOSTART, STATE_MESSAGE, USE_SIM_TIME
from robosc.targets.ros.runtime.supervised import old_and_new

_PARTS = {
    "goal": ("action", "::Goal"),
    "result": ("action", "::Result"),
    "feedback": ("action", "::Feedback"),
    "request": ("srv", "::Request"),
    "response": ("srv", "::Response"),
}
"""Folder and ending of each part of an action or a service."""


_OF_AN_ACTION = ("send_goal", "cancel_goal", "get_result", "feedback", "status")


def _remapped(messages_and_services: Iterable[str], actions: Iterable[str]) -> Renamed:
    parts = (f"{action}/_action/{part}" for action in actions for part in _OF_AN_ACTION)
    return old_and_new([*messages_and_services, *parts])


def _type_name(kind: str, type_: Interface) -> str:
    folder, ending = _PARTS.get(kind, (kind, ""))
    return f"::{type_.package}::{folder}::{type_.type}{ending}"


_STATE_MESSAGE = STATE_MESSAGE._replace(
    description=f"{STATE_MESSAGE.description} All but json needs a package generated with --state-message."
)
"""The parameter in C++, where messages are compiled in."""


MIDDLEWARE = Middleware(
    target="ros2-cpp",
    include=lambda kind, type_: f"{type_.package}/{kind}/{file_name(type_.type)}.hpp",
    type_name=_type_name,
    runtime=("ros2.hpp", "ros2_actions.hpp", "ros2_life.hpp", "ros2_peers.hpp"),
    module="robosc.targets.ros2_cpp",
    templates={
        "CMakeLists.txt": "CMakeLists.txt.j2",
        "README.md": "README.md.j2",
        "config/parameters.yaml": "parameters.yaml.j2",
        "launch/controller.launch.py": "controller.launch.py.j2",
        "package.xml": "package.xml.j2",
        "src/main.cpp": "main.cpp.j2",
        "src/node.cpp": "node.cpp.j2",
        "src/node.hpp": "node.hpp.j2",
        "test/test_recorded_run.cpp": "test_recorded_run.cpp.j2",
    },
    # Every ROS 2 node has it by itself.
    without=frozenset({USE_SIM_TIME}),
    parameters=(AUTOSTART, _STATE_MESSAGE),
    packages=("lifecycle_msgs", "rcl_interfaces"),
    of_a_layer=("ros2_callers.hpp",),
    launch=".launch.py",
    remapped=_remapped,
    python="robosc.targets.ros2",
    typed_state=Interface("SupervisorState", "robosc_msgs"),
)
