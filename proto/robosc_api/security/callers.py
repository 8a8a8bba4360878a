"""Who is behind the call under way."""

from contextvars import ContextVar

from robosc_api.security.tokens import Entry, Scope

CALLER: ContextVar[str] = ContextVar("caller", default="")
"""Whose token the call under way came with; empty: none was asked for."""

ENTRY: ContextVar[Entry | None] = ContextVar("entry", default=None)
"""The token itself, as it stands in the file."""


def is_admin() -> bool:
    """Whether the call under way came with a token for the scope `admin`."""
    entry = ENTRY.get()
    return entry is not None and Scope.ADMIN in entry.scopes
