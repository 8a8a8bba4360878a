"""Parsing of addresses, and detection of loopback addresses."""

import ipaddress
import re
import socket
from urllib.parse import unquote

_ADDRESS = re.compile(r"(?:\[([0-9A-Fa-f:.%]+)\]|([A-Za-z0-9._-]+)):([0-9]{1,5})\Z")

_HOST = re.compile(r"(?:\[[0-9A-Fa-f:.%]+\]|(?![0-9]+\Z)[A-Za-z0-9._-]+)\Z")

UNIX = "unix:"
"""Beginning of the address of a Unix socket, in gRPC's words; its path follows."""

SYNTHESIS_PORT, BRIDGE_PORT = 50051, 50061
"""Ports of a synthesis server and of a bridge, where an address names none."""


def with_port(address: str, port: int) -> str:
    """`HOST:PORT` of the address of a service, which is that or `HOST` alone.

    Args:
        address: The address; an IPv6 address is in brackets.
        port: Port that it has where it names none.

    Raises:
        ValueError: It is no such address.
    """
    if _HOST.match(address):
        return f"{address}:{port}"
    try:
        is_usable = split_address(address)[1] > 0
    except ValueError:
        is_usable = False
    if not is_usable:
        raise ValueError(f"neither HOST nor HOST:PORT: '{address}'")
    return address


def split_address(address: str) -> tuple[str, int]:
    """Host and port of `HOST:PORT`, an IPv6 address in brackets.

    Raises:
        ValueError: It is none.
    """
    match = _ADDRESS.match(address)
    if not match or int(match[3]) > 65535:
        raise ValueError(f"not HOST:PORT: '{address}'")
    return match[1] or match[2], int(match[3])


def joined(host: str, port: int) -> str:
    """`HOST:PORT`, with brackets around an IPv6 address."""
    return f"[{host.strip('[]')}]:{port}" if ":" in host else f"{host}:{port}"


def is_loopback_host(host: str) -> bool:
    """Return True if all addresses of a host name are on this machine; unknown names are not."""
    try:
        found = socket.getaddrinfo(host.strip("[]"), None, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        return False
    return bool(found) and all(_is_loopback(str(item[4][0])) for item in found)


def is_loopback_peer(peer: str) -> bool:
    """Return True if a caller is on this machine.

    The caller is in gRPC's words (`ipv4:127.0.0.1:4711`, `ipv6:[::1]:4711`, `unix:...`).
    """
    kind, _, rest = unquote(peer).partition(":")
    if kind == "unix":
        return True
    return kind in ("ipv4", "ipv6") and _is_loopback(rest.rpartition(":")[0].strip("[]"))


def _is_loopback(text: str) -> bool:
    try:
        address = ipaddress.ip_address(text.partition("%")[0])
    except ValueError:
        return False
    mapped = getattr(address, "ipv4_mapped", None)
    return (mapped or address).is_loopback
