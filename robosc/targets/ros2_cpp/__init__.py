"""The target `ros2-cpp`."""

from functools import partial

from robosc.targets.cpp.package import generate_package
from robosc.targets.registry import Target, TargetInfo
from robosc.targets.ros.package import ROS2_CPP_ERRORS
from robosc.targets.ros2_cpp.package import MIDDLEWARE

TARGET = Target(
    TargetInfo("ros2-cpp", "a complete ROS 2 package (ament_cmake): an rclcpp node around the supervisor in C99"),
    partial(generate_package, MIDDLEWARE),
    errors=ROS2_CPP_ERRORS,
)

__all__ = ["TARGET"]
