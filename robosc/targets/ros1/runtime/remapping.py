"""
Remapping of names on ROS 1, for a program that needs other names.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Iterable

from robosc.targets.ros.runtime.supervised import old_and_new, robots_name

PARTS_OF_ACTIONS = ('goal', 'cancel', 'status', 'feedback', 'result')
"""The topics that an action is made of stand below its name."""


def remapped(
    messages_and_services: Iterable[str], actions: Iterable[str]
) -> tuple[tuple[str, str], ...]:
    """
    List old and new names, without a prefix, that the existing controller has to use.

    An action is no name of its own on ROS 1: each of its topics is named.
    """
    parts = (f'{action}/{part}' for action in actions for part in PARTS_OF_ACTIONS)
    return old_and_new([*messages_and_services, *parts])


def remapping_arguments(names: Iterable[tuple[str, str]], prefix: str) -> list[str]:
    """Return the arguments that make a program on ROS 1 use the new names."""
    return [f'{robots_name(prefix, old)}:={robots_name(prefix, new)}' for old, new in names]
