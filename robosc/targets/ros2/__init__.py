"""The target `ros2`."""

from robosc.targets.registry import Target, TargetInfo
from robosc.targets.ros2.package import generate

TARGET = Target(
    TargetInfo("ros2", "a complete ROS 2 package (ament_python): controller node, launch file, parameters"), generate
)

__all__ = ["TARGET"]
