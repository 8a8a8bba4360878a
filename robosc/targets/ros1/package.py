"""The record of the target `ros1`: catkin and rospy, with a controller or a layer node."""

from robosc.errors import UnsupportedModelError
from robosc.model.structure import Communication, CommunicationKind, Deployment
from robosc.targets.ros.middleware import Middleware
from robosc.targets.ros.runtime.parameters import USE_SIM_TIME
from robosc.targets.ros.runtime.supervised import robots_name
from robosc.targets.ros.topics import Topic
from robosc.targets.ros1.runtime.remapping import PARTS_OF_ACTIONS, remapped


def _require_names(found: tuple[Topic, ...], asked: tuple[Communication, ...], deployment: Deployment) -> None:
    """Do nothing if every identifier is a name in ROS 1, too, where none begins with an underscore."""
    for identifier in [topic.identifier for topic in found] + [item.identifier for item in asked]:
        if identifier.startswith("_"):
            raise UnsupportedModelError(
                f"the identifier {identifier!r} is no name in ROS 1: it begins with an underscore"
            )
    if deployment is Deployment.LAYER:
        _require_own_topics(found, asked)


def _require_own_topics(found: tuple[Topic, ...], asked: tuple[Communication, ...]) -> None:
    """Do nothing if no topic is one of those that an action is made of: a layer has a server of its own there."""
    parts = {
        robots_name("", f"{item.identifier}/{part}"): item.name
        for item in asked
        if item.kind is CommunicationKind.ACTION
        for part in PARTS_OF_ACTIONS
    }
    for topic in found:
        action = parts.get(robots_name("", topic.identifier))
        if action is not None:
            raise UnsupportedModelError(
                f"the topic {topic.identifier} is a part of the action '{action}', which a supervision layer offers "
                "by itself"
            )


MIDDLEWARE = Middleware(
    target="ros1",
    package="robosc.targets.ros1",
    dependencies=("actionlib", "diagnostic_msgs", "rosgraph", "rospy", "std_msgs"),
    modules=("goals", "inbox", "services", "timers", "types"),
    files=("CMakeLists.txt", "test/run_tests.py", "{package}/program.py"),
    launch=".launch",
    remapped=remapped,
    require_names=_require_names,
    # In ROS 1 it is a parameter of the whole graph, read by the client library.
    without=frozenset({USE_SIM_TIME}),
    script="script.py.j2",
)
