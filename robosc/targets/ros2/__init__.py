"""The target `ros2`."""

from functools import partial

from robosc.targets.registry import Target, TargetInfo
from robosc.targets.ros.middleware import generate_package
from robosc.targets.ros.package import ROS2_ERRORS
from robosc.targets.ros2.package import MIDDLEWARE

TARGET = Target(
    TargetInfo("ros2", "a complete ROS 2 package (ament_python): controller or layer node, launch file, parameters"),
    partial(generate_package, MIDDLEWARE),
    errors=ROS2_ERRORS,
)

__all__ = ["TARGET"]
