"""Identity of a caller that a trusted proxy forwards in headers, after it has checked a certificate or a JWT.

The proxy removes these headers from what callers send, and sets them itself. Whether it can be trusted is decided by
how it is connected, when the service begins to listen.
"""

import re
from functools import lru_cache
from typing import Any

from robosc_api.security.tokens import Entry, Quota, Scope

CALLER_HEADER = "x-robosc-caller"
"""Metadata key of the caller's name: one to 200 visible characters of ASCII, such as the subject of a JWT."""

SCOPES_HEADER = "x-robosc-scopes"
"""Metadata key of the caller's scopes, separated by spaces or commas; words that are no scopes of ours are ignored."""

_NAME = re.compile(r"[!-~]{1,200}\Z")
_SEPARATORS = re.compile(r"[ ,]+")


def forwarded_entry(metadata: Any) -> Entry | None:
    """Return the forwarded identity of a call; None: there is none, or more than one."""
    names: list[Any] = []
    scopes: list[Any] = []
    for key, value in metadata or ():
        if key == CALLER_HEADER:
            names.append(value)
        elif key == SCOPES_HEADER:
            scopes.append(value)
    # Several values are refused: a caller may have sent one of them.
    if len(names) != 1 or len(scopes) != 1 or not isinstance(scopes[0], str) or not isinstance(names[0], str):
        return None
    return _entry(names[0], scopes[0])


@lru_cache(maxsize=4096)
def _entry(name: str, scopes: str) -> Entry | None:
    if not _NAME.match(name):
        return None
    known = {str(scope) for scope in Scope}
    found = frozenset(Scope(word) for word in _SEPARATORS.split(scopes) if word in known)
    return Entry(name, found, "", Quota())
