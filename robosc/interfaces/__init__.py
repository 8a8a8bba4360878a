"""ROS interfaces: reading of their definitions, and the definitions that come with RoboSC."""

from robosc.interfaces.definitions import (
    INTERFACE_KINDS,
    PRIMITIVES,
    TIMES,
    Array,
    Field,
    MalformedDefinitionError,
    Part,
    nested_types,
    parse_definition,
    ros_version_of,
)
from robosc.interfaces.distributions import DISTRIBUTIONS, Distribution, shipped_types

__all__ = [
    "DISTRIBUTIONS",
    "INTERFACE_KINDS",
    "PRIMITIVES",
    "TIMES",
    "Array",
    "Distribution",
    "Field",
    "MalformedDefinitionError",
    "Part",
    "nested_types",
    "parse_definition",
    "ros_version_of",
    "shipped_types",
]
