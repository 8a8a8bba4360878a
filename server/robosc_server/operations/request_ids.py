"""The id of the request that is being answered: the caller's, or one that is made here."""

import re
import secrets
from contextvars import ContextVar
from typing import Any

HEADER = "x-request-id"
"""Metadata that a caller may send, and that comes back behind the answer."""

REQUEST_ID: ContextVar[str] = ContextVar("request_id", default="")
"""Identifier of the call under way; empty: no call."""

_ID = re.compile(r"[A-Za-z0-9._:/+=@-]{1,128}\Z")


def request_id_of(metadata: Any) -> str:
    """The id in a call's metadata, or a new one: there is none, it is odd, or there are several."""
    found = None
    for key, value in metadata or ():
        if key == HEADER:
            if found is not None or not _ID.match(value):
                return secrets.token_hex(8)
            found = value
    return found or secrets.token_hex(8)
