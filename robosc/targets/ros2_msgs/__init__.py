"""The target `ros2-msgs`."""

from robosc.targets.registry import Target, TargetInfo
from robosc.targets.ros2_msgs.package import generate_package

TARGET = Target(
    TargetInfo(
        "ros2-msgs", "the ROS 2 messages of ~/state (ament_cmake), the same for every model: state_message typed"
    ),
    generate_package,
)

__all__ = ["TARGET"]
