"""The record of the target `ros1`: catkin and rospy, with a controller or a layer node."""

from robosc.errors import UnsupportedModelError
from robosc.model.structure import Communication
from robosc.targets.ros.middleware import Middleware
from robosc.targets.ros.runtime.parameters import USE_SIM_TIME
from robosc.targets.ros.topics import Topic
from robosc.targets.ros1.runtime.remapping import PARTS_OF_ACTIONS, remapped


def _require_names(found: tuple[Topic, ...], asked: tuple[Communication, ...]) -> None:
    """Do nothing if every identifier is a name in ROS 1, too, where none begins with an underscore."""
    for identifier in [topic.identifier for topic in found] + [item.identifier for item in asked]:
        if identifier.startswith("_"):
            raise UnsupportedModelError(
                f"the identifier {identifier!r} is not a name in ROS 1: it begins with an underscore"
            )


MIDDLEWARE = Middleware(
    target="ros1",
    package="robosc.targets.ros1",
    dependencies=("actionlib", "diagnostic_msgs", "rosgraph", "rospy", "std_msgs"),
    modules=("goals", "inbox", "message_types", "peers", "services", "timers"),
    files=("CMakeLists.txt", "test/run_tests.py", "{package}/program.py"),
    launch=".launch",
    remapped=remapped,
    require_names=_require_names,
    parts_of_actions=PARTS_OF_ACTIONS,
    # The parameter is one of the whole graph in ROS 1, read by the client library.
    without=frozenset({USE_SIM_TIME}),
    script="script.py.j2",
)
