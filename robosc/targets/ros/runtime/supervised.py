"""Names of a supervision layer: `/x` on the robot's side is `/supervised/x` on the existing controller's.

All of them are absolute, whatever the namespace of the node: the layer and the existing controller need not share one.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Iterable

BLOCKED = "/blocked"
"""Topic on which the identifiers of requests that are held back are published."""

SUPERVISED = "/supervised"


def robots_name(prefix: str, identifier: str) -> str:
    """Return a name on the robot's side.

    Args:
        prefix: Text that stands before every name; empty, or beginning with a slash.
        identifier: A name of the model, `/x` or `x`.
    """
    return prefix + "/" + identifier.lstrip("/")


def callers_name(prefix: str, identifier: str) -> str:
    """A name on the existing controller's side."""
    return robots_name(prefix + SUPERVISED, identifier)


def old_and_new(identifiers: Iterable[str]) -> tuple[tuple[str, str], ...]:
    """Old and new name, without a prefix, of what the existing controller has to call otherwise."""
    # A service may be called like a topic: one rule is for both.
    return tuple(dict.fromkeys((robots_name("", item), callers_name("", item)) for item in identifiers))
