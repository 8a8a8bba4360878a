"""Filter of the kernel that keeps new connections of some hosts away from a listening socket.

A host that floods a server connects again as soon as its connections are closed, and gRPC takes what it sends before
the next look. The filter is a program of classic BPF (socket(7), `SO_ATTACH_FILTER`, which needs no privileges). It
drops only packets that ask for a new connection (SYN without ACK): the other end asks again, by itself, after a second,
and later less often. So a connection is late, and does not fail, if its host is soon let in again; present connections
of the host go on.
"""

import contextlib
import ctypes
import ipaddress
import socket
import struct
from collections.abc import Iterable

_ATTACH = getattr(socket, "SO_ATTACH_FILTER", 26)
_DETACH = getattr(socket, "SO_DETACH_FILTER", 27)

_MOST_HOSTS = 256
"""Hosts in one filter; the kernel takes 4,096 instructions."""

_INSTRUCTION = struct.Struct("=HBBI")

# Instructions of linux/bpf_common.h and linux/filter.h.
_LOAD_WORD, _LOAD_BYTE, _AND, _SHIFT_RIGHT, _IF_EQUAL, _RETURN = 0x20, 0x30, 0x54, 0x74, 0x15, 0x06
_NETWORK_HEADER = 0xFFF00000
"""Offset of the IP header (`SKF_NET_OFF`); that of the TCP header is 0."""

_TCP_FLAGS_AT, _SYN, _SYN_ACK = 13, 0x02, 0x12
_SOURCE_AT = {4: 12, 6: 8}
_ALL, _NONE = 0xFFFFFFFF, 0

type _Program = list[tuple[int, int, int, int]]


def drop_new_connections(listener: socket.socket, hosts: Iterable[str]) -> None:
    """Drop attempts of some hosts to connect, instead of those dropped before; without hosts: of none.

    Args:
        listener: A listening TCP socket.
        hosts: Addresses; other words are ignored.

    Raises:
        OSError: The kernel refuses the filter.
    """
    addresses = []
    for host in hosts:
        with contextlib.suppress(ValueError):
            addresses.append(ipaddress.ip_address(host))
    if not addresses:
        # Without a filter, the kernel has none to remove.
        with contextlib.suppress(FileNotFoundError):
            listener.setsockopt(socket.SOL_SOCKET, _DETACH, 0)
        return
    program = _program(addresses[-_MOST_HOSTS:])
    code = ctypes.create_string_buffer(b"".join(_INSTRUCTION.pack(*step) for step in program))
    listener.setsockopt(socket.SOL_SOCKET, _ATTACH, struct.pack("@HP", len(program), ctypes.addressof(code)))


def _program(addresses: list[ipaddress.IPv4Address | ipaddress.IPv6Address]) -> _Program:
    """Return a program that drops the first packet of a connection from an address."""
    program: _Program = [
        (_LOAD_BYTE, 0, 0, _TCP_FLAGS_AT),
        (_AND, 0, 0, _SYN_ACK),
        (_IF_EQUAL, 1, 0, _SYN),
        (_RETURN, 0, 0, _ALL),
    ]
    for address in addresses:
        words = struct.unpack(f">{len(address.packed) // 4}I", address.packed)
        # Jumps over the rest of this address, if the version of IP or a word differs.
        rest = 2 * len(words) + 1
        program += [(_LOAD_BYTE, 0, 0, _NETWORK_HEADER), (_SHIFT_RIGHT, 0, 0, 4)]
        program.append((_IF_EQUAL, 0, rest, address.version))
        for number, word in enumerate(words):
            rest -= 2
            program.append((_LOAD_WORD, 0, 0, _NETWORK_HEADER + _SOURCE_AT[address.version] + 4 * number))
            program.append((_IF_EQUAL, 0, rest, word))
        program.append((_RETURN, 0, 0, _NONE))
    program.append((_RETURN, 0, 0, _ALL))
    return program
