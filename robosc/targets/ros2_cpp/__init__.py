"""The target `ros2-cpp`."""

from robosc.targets.registry import GENERAL_ERRORS, Target, TargetInfo
from robosc.targets.ros2_cpp.package import generate

TARGET = Target(
    TargetInfo("ros2-cpp", "a complete ROS 2 package (ament_cmake): an rclcpp node around the supervisor in C99"),
    generate,
    errors=GENERAL_ERRORS | {"invalid-identifier"},
)

__all__ = ["TARGET"]
