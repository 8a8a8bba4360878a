"""The target `ros1`."""

from functools import partial

from robosc.targets.registry import GENERAL_ERRORS, Target, TargetInfo
from robosc.targets.ros.middleware import generate_package
from robosc.targets.ros1.package import MIDDLEWARE

TARGET = Target(
    TargetInfo("ros1", "a complete ROS 1 package (catkin, rospy): controller or layer node, launch file, parameters"),
    partial(generate_package, MIDDLEWARE),
    errors=GENERAL_ERRORS | {"invalid-identifier"},
)

__all__ = ["TARGET"]
