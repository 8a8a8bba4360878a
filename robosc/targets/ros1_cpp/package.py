"""The record of the target `ros1-cpp`: catkin, with a roscpp node around a supervisor in C99."""

from collections.abc import Iterable

from robosc.model.structure import Interface
from robosc.targets.cpp.package import Middleware
from robosc.targets.ros.layer import Renamed
from robosc.targets.ros.runtime.parameters import USE_SIM_TIME
from robosc.targets.ros.runtime.supervised import old_and_new

_ENDINGS = {
    "action": "Action",
    "goal": "Goal",
    "result": "Result",
    "feedback": "Feedback",
    "request": "::Request",
    "response": "::Response",
}
"""Text after a type's name, by kind or part."""


_PARTS_OF_ACTIONS = ("goal", "cancel", "status", "feedback", "result")
"""Topics that an action is made of, below its name."""


def _remapped(messages_and_services: Iterable[str], actions: Iterable[str]) -> Renamed:
    parts = (f"{action}/{part}" for action in actions for part in _PARTS_OF_ACTIONS)
    return old_and_new([*messages_and_services, *parts])


def _ended(kind: str, type_: Interface) -> str:
    return type_.type + _ENDINGS.get(kind, "")


MIDDLEWARE = Middleware(
    target="ros1-cpp",
    include=lambda kind, type_: f"{type_.package}/{_ended(kind, type_)}.h",
    type_name=lambda kind, type_: f"::{type_.package}::{_ended(kind, type_)}",
    runtime=("ros1.hpp", "ros1_actions.hpp", "ros1_master.hpp"),
    module="robosc.targets.ros1_cpp",
    templates={
        "CMakeLists.txt": "CMakeLists.txt.j2",
        "README.md": "README.md.j2",
        "config/parameters.yaml": "parameters.yaml.j2",
        "launch/controller.launch": "controller.launch.j2",
        "package.xml": "package.xml.j2",
        "src/node.cpp": "node.cpp.j2",
    },
    of_a_layer=("ros1_callers.hpp",),
    launch=".launch",
    remapped=_remapped,
    parts_of_actions=_PARTS_OF_ACTIONS,
    python="robosc.targets.ros1",
    # The parameter is one of the whole graph in ROS 1, read by the client library.
    without=frozenset({USE_SIM_TIME}),
)
