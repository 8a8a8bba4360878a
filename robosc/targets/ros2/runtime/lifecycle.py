"""The parameter that says who starts a node: it itself, or whoever manages it.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from typing import Any

from robosc.targets.ros.runtime.parameters import Parameter, ParameterError

AUTOSTART = Parameter(
    "autostart",
    True,
    "True if the node configures and activates itself at its start; if not, a lifecycle manager does so, and a fault "
    "leaves the node at rest until it is deactivated and activated again.",
)


def valid_autostart(value: Any) -> bool:
    """The parameter's value; raises ParameterError."""
    if not isinstance(value, bool):
        raise ParameterError(f"parameter '{AUTOSTART.name}' is {value!r}; it must be true or false")
    return value
