"""
Names of a supervision layer.

`/x` on the robot's side is `/supervised/x` on the existing controller's.

A relative name stays relative, `x` and `supervised/x`, and is found in the namespace of the node,
unless there is a prefix.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Iterable
import json

BLOCKED = 'blocked'
"""Topic on which it is published what requests are held back, and why."""

SUPERVISED = 'supervised'


REASON_FIELDS = (
    'message',
    'error_msg',
    'error_string',
    'error_message',
    'status_message',
    'reason',
)
"""Fields of responses and results that are meant for people, each with a text."""


def blocked_text(identifier: str, why: str) -> str:
    """Return what is published about a request that is held back: JSON."""
    return json.dumps({'identifier': identifier, 'reason': why})


def with_reason(message: object, why: str) -> object:
    """Return a default response or result with a reason in the field for it, if it has one."""
    for name in REASON_FIELDS:
        if isinstance(getattr(message, name, None), str):
            setattr(message, name, why)
            break
    return message


def robots_name(prefix: str, identifier: str) -> str:
    """
    Return a name on the robot's side.

    :param prefix: Text that stands before every name; empty, or beginning with a slash.
    :param identifier: A name of the model, `/x` or `x`.
    """
    return prefix + '/' + identifier.lstrip('/') if prefix else identifier


def callers_name(prefix: str, identifier: str) -> str:
    """Return a name on the existing controller's side."""
    root = '/' if identifier.startswith('/') else ''
    name = identifier.lstrip('/')
    return robots_name(prefix, f'{root}{SUPERVISED}/{name}')


def old_and_new(identifiers: Iterable[str]) -> tuple[tuple[str, str], ...]:
    """List old and new names, without a prefix, that the existing controller has to use."""
    # A service may be called like a topic: one rule is for both.
    return tuple(
        dict.fromkeys((robots_name('', item), callers_name('', item)) for item in identifiers)
    )
