"""Codes of the check's warnings and notes that are errors for packages of ROS: their nodes would not start."""

from robosc.targets.registry import GENERAL_ERRORS

_ALL = GENERAL_ERRORS | {
    "field-type-mismatch",
    "invalid-identifier",
    "no-header",
    "unknown-field",
    "unknown-ros-type",
}

ROS1_CPP_ERRORS = _ALL | {"ros2-only"}
"""Codes for ROS 1 in C++."""

ROS1_ERRORS = ROS1_CPP_ERRORS | {"cpp-only"}
"""Codes for ROS 1 in Python."""

ROS2_CPP_ERRORS = _ALL | {"ros1-only"}
"""Codes for ROS 2 in C++."""

ROS2_ERRORS = ROS2_CPP_ERRORS | {"cpp-only", "not-in-ros2-python"}
"""Codes for ROS 2 in Python."""
