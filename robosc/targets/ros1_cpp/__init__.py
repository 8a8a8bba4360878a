"""The target `ros1-cpp`."""

from functools import partial

from robosc.targets.cpp.package import generate_package
from robosc.targets.registry import Target, TargetInfo
from robosc.targets.ros.package import ROS1_CPP_ERRORS
from robosc.targets.ros1_cpp.package import MIDDLEWARE

TARGET = Target(
    TargetInfo("ros1-cpp", "a complete ROS 1 package (catkin): a roscpp node around the supervisor in C99"),
    partial(generate_package, MIDDLEWARE),
    errors=ROS1_CPP_ERRORS,
)

__all__ = ["TARGET"]
