"""Caller behind the call under way."""

from contextvars import ContextVar
from functools import lru_cache
from ipaddress import IPv4Address, ip_address, ip_network
from typing import Any
from urllib.parse import unquote

from robosc_api.security.tokens import Entry, Scope

_NETWORK_BITS = 64

CALLER: ContextVar[str] = ContextVar("caller", default="")
"""Name of the owner of the token that the call under way came with; empty: none was asked for."""

ENTRY: ContextVar[Entry | None] = ContextVar("entry", default=None)
"""The token itself, as it stands in the file."""


def caller_of(context: Any) -> str:
    """Return the name that tells a caller from others: its token's, else its certificate's, else its host.

    Args:
        context: Context of the call under way.
    """
    return CALLER.get() or _certificate_name(context) or host_of(context.peer())


def token_or_host_of(context: Any) -> str:
    """The same, where callers are asked for no certificate."""
    return CALLER.get() or host_of(context.peer())


def is_admin() -> bool:
    """Return True if the call under way came with a token for the scope `admin`."""
    entry = ENTRY.get()
    return entry is not None and Scope.ADMIN in entry.scopes


@lru_cache(maxsize=4096)
def host_of(peer: str) -> str:
    """The host of a caller in gRPC's words (`ipv4:127.0.0.1:4711`, `ipv6:[::1]:4711`); `unix` for a socket's file."""
    kind, _, rest = unquote(peer).partition(":")
    return kind if kind.startswith("unix") else rest.rpartition(":")[0].strip("[]") or peer


@lru_cache(maxsize=4096)
def network_of(caller: str) -> str:
    """Return the name by which a caller is bounded: the network of one customer if only its address is known.

    A holder of an IPv6 address has 2^64 of them (RFC 6177); other names stay as they are.
    """
    try:
        address = ip_address(caller.partition("%")[0])
    except ValueError:
        return caller
    if isinstance(address, IPv4Address) or address.ipv4_mapped or address.is_loopback:
        return caller
    return str(ip_network((address, _NETWORK_BITS), strict=False))


def _certificate_name(context: Any) -> str:
    names = context.auth_context().get("x509_common_name") or ()
    return names[0].decode(errors="replace") if names else ""
