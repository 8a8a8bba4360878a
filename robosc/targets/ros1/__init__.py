"""The target `ros1`."""

from functools import partial

from robosc.targets.registry import Target, TargetInfo
from robosc.targets.ros.middleware import generate_package
from robosc.targets.ros.package import ROS1_ERRORS
from robosc.targets.ros1.package import MIDDLEWARE

TARGET = Target(
    TargetInfo("ros1", "a complete ROS 1 package (catkin, rospy): controller or layer node, launch file, parameters"),
    partial(generate_package, MIDDLEWARE),
    errors=ROS1_ERRORS,
)

__all__ = ["TARGET"]
