"""Identity of the caller of the current call."""

from collections.abc import Callable
from functools import lru_cache
from ipaddress import IPv4Address, ip_address, ip_network
from typing import Any
from urllib.parse import unquote

from robosc_api.calls import CALL, peer_of
from robosc_api.security.tokens import Scope

_NETWORK_BITS = 64


def caller_of(context: Any) -> str:
    """Return the name that distinguishes a caller: that of its token, else of its certificate, else of its host.

    Args:
        context: Context of the call under way.
    """
    return _known_or(context, _certificate_or_host)


def token_or_host_of(context: Any) -> str:
    """Return the name of a caller, without client certificates."""
    return _known_or(context, _host)


def token_name() -> str:
    """Return the name of the token of the call under way; empty: it came with none."""
    call = CALL.get()
    return "" if call is None or call.entry is None else call.entry.name


def is_admin() -> bool:
    """Return True if the call under way came with a token for the scope `admin`."""
    call = CALL.get()
    return call is not None and call.entry is not None and Scope.ADMIN in call.entry.scopes


@lru_cache(maxsize=4096)
def host_of(peer: str) -> str:
    """Return the host of a gRPC peer (`ipv4:127.0.0.1:4711`, `ipv6:[::1]:4711`); `unix` for a Unix socket."""
    kind, _, rest = unquote(peer).partition(":")
    return kind if kind.startswith("unix") else rest.rpartition(":")[0].strip("[]") or peer


@lru_cache(maxsize=4096)
def network_of(caller: str) -> str:
    """Return the name to which limits of a caller apply; for an IPv6 address, its network.

    A customer has 2^64 IPv6 addresses (RFC 6177); other names stay unchanged.
    """
    try:
        address = ip_address(caller.partition("%")[0])
    except ValueError:
        return caller
    if isinstance(address, IPv4Address) or address.ipv4_mapped or address.is_loopback:
        return caller
    return str(ip_network((address, _NETWORK_BITS), strict=False))


def _known_or(context: Any, find: Callable[[Any], str]) -> str:
    """Return the name of a caller, which is asked for once for each call."""
    call = CALL.get()
    if call is None:
        return find(context)
    if not call.caller:
        call.caller = find(context)
    return call.caller


def _certificate_or_host(context: Any) -> str:
    return _certificate_name(context) or _host(context)


def _host(context: Any) -> str:
    return host_of(peer_of(context))


def _certificate_name(context: Any) -> str:
    names = context.auth_context().get("x509_common_name") or ()
    return names[0].decode(errors="replace") if names else ""
