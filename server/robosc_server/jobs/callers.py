"""Owners of the jobs that a caller sees."""

from dataclasses import dataclass
from typing import Any

from robosc_api import security


@dataclass(frozen=True, slots=True)
class Caller:
    """Caller of the server.

    Attributes:
        name: Name that tells callers apart.
        is_admin: True if the jobs of others count as this caller's, too.
    """

    name: str
    is_admin: bool = False


def caller_of(context: Any) -> Caller:
    """Return the caller of the call under way."""
    # A certificate may name anybody, in any characters; a database takes no NUL.
    name = "".join(character if character.isprintable() else "?" for character in security.caller_of(context))
    return Caller(name, security.is_admin())
