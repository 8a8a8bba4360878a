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
from robosc.interfaces.distributions import (
    CODENAMES,
    DISTRIBUTIONS,
    Distribution,
    distribution_of,
    shipped_types,
    titles_of,
)

__all__ = [
    "CODENAMES",
    "DISTRIBUTIONS",
    "INTERFACE_KINDS",
    "PRIMITIVES",
    "TIMES",
    "Array",
    "Distribution",
    "Field",
    "MalformedDefinitionError",
    "Part",
    "distribution_of",
    "nested_types",
    "parse_definition",
    "ros_version_of",
    "shipped_types",
    "titles_of",
]
