"""The record of the target `ros2`: ament_python, with a controller or a layer node."""

from robosc.targets.ros.middleware import Middleware
from robosc.targets.ros.runtime.parameters import USE_SIM_TIME
from robosc.targets.ros2.runtime.lifecycle import AUTOSTART
from robosc.targets.ros2.runtime.remapping import remapped
from robosc.targets.ros2.runtime.state import STATE_MESSAGE

MIDDLEWARE = Middleware(
    target="ros2",
    package="robosc.targets.ros2",
    dependencies=(
        "ament_index_python",
        "diagnostic_msgs",
        "launch",
        "launch_ros",
        "lifecycle_msgs",
        "rcl_interfaces",
        "rclpy",
        "std_msgs",
    ),
    modules=("clients", "inquiry", "lifecycle", "node_time", "peers", "state"),
    files=(
        "setup.cfg",
        "test/test_copyright.py",
        "test/test_flake8.py",
        "test/test_pep257.py",
        "test/test_xmllint.py",
        "{package}/life.py",
        "{package}/spinner.py",
        "{package}/state_publisher.py",
    ),
    launch=".launch.py",
    remapped=remapped,
    parameters=(AUTOSTART, STATE_MESSAGE),
    typed_state=("robosc_msgs",),
    not_in_file=frozenset({USE_SIM_TIME}),
    markers=("resource/{package}",),
)
