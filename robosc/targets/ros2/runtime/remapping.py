"""
Remapping of names on ROS 2, for a program that needs other names.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Iterable

from robosc.targets.ros.runtime.supervised import old_and_new, robots_name

_OF_AN_ACTION = ('send_goal', 'cancel_goal', 'get_result', 'feedback', 'status')


def remapped(
    messages_and_services: Iterable[str], actions: Iterable[str]
) -> tuple[tuple[str, str], ...]:
    """
    List old and new names, without a prefix, that the existing controller has to use.

    ROS remaps the services and topics that an action is made of, and not the action, so each of
    them is named.
    """
    parts = (f'{action}/_action/{part}' for action in actions for part in _OF_AN_ACTION)
    return old_and_new([*messages_and_services, *parts])


def remapping_arguments(
    names: Iterable[tuple[str, str]], prefix: str, namespace: str = '/'
) -> list[str]:
    """
    Return the arguments that make a program on ROS 2 use the new names.

    :param names: Old and new name of each, without the prefix.
    :param prefix: Prefix of every name, or nothing.
    :param namespace: Namespace of the layer, in which the program has to be as well: relative
        names are found there.
    """
    rules = [f'{robots_name(prefix, old)}:={robots_name(prefix, new)}' for old, new in names]
    if namespace != '/':
        rules.append(f'__ns:={namespace}')
    return ['--ros-args', *(argument for rule in rules for argument in ('-r', rule))]
