"""Who calls: whom a token is for, else whom a certificate names, else where the call comes from."""

from dataclasses import dataclass
from typing import Any
from urllib.parse import unquote

import grpc.aio

from robosc_api.security import CALLER

_COMMON_NAME = "x509_common_name"
_CHARACTERS = 256


@dataclass(frozen=True, slots=True)
class Caller:
    """Who calls.

    Attributes:
        name: Tells callers apart.
        is_admin: Whether the jobs of others are this caller's, too.
    """

    name: str
    is_admin: bool = False


def caller_of(context: "grpc.aio.ServicerContext[Any, Any]") -> Caller:
    """The caller of the call under way."""
    token_name = CALLER.get()
    if token_name:
        return Caller(token_name)
    names = context.auth_context().get(_COMMON_NAME, ())
    for name in names:
        text = name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)
        return Caller(_clean(text))
    return Caller(_clean(_host_of(context.peer())))


def _host_of(peer: str) -> str:
    """The host of a peer as gRPC writes it: `ipv4:127.0.0.1:50210`, `ipv6:%5B::1%5D:50210`, `unix:`."""
    family, _, rest = unquote(peer).partition(":")
    if family not in {"ipv4", "ipv6"}:
        return family
    return rest.rpartition(":")[0].strip("[]")


def _clean(text: str) -> str:
    return "".join(character if character.isprintable() else "?" for character in text[:_CHARACTERS])
