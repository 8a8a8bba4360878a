"""The target `ros1`."""

from robosc.targets.registry import GENERAL_ERRORS, Target, TargetInfo
from robosc.targets.ros1.package import generate

TARGET = Target(
    TargetInfo("ros1", "a complete ROS 1 package (catkin, rospy): controller or layer node, launch file, parameters"),
    generate,
    errors=GENERAL_ERRORS | {"invalid-identifier"},
)

__all__ = ["TARGET"]
