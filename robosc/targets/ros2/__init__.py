"""The target `ros2`."""

from robosc.targets.registry import GENERAL_ERRORS, Target, TargetInfo
from robosc.targets.ros2.package import generate

TARGET = Target(
    TargetInfo("ros2", "a complete ROS 2 package (ament_python): controller or layer node, launch file, parameters"),
    generate,
    errors=GENERAL_ERRORS | {"invalid-identifier"},
)

__all__ = ["TARGET"]
