"""Limit of Python's recursion depth: it is one limit for the whole interpreter, so all code raises it here."""

import sys

_FRAMES = 1000
"""Frames for everything but the walk itself: Python's own limit when it starts."""


def allow_depth(levels: int, frames_per_level: int) -> None:
    """Let Python walk recursively through trees or diagrams of so many levels.

    The limit is raised and never lowered: another thread may be deep in a tree of its own.

    Args:
        levels: Levels of the deepest tree.
        frames_per_level: Python frames that the greediest walk has open for each level.
    """
    needed = _FRAMES + frames_per_level * levels
    if sys.getrecursionlimit() < needed:
        sys.setrecursionlimit(needed)
