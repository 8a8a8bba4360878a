"""Floods of HTTP/2 frames (RFC 9113) from a caller without a token, each until its connection is cut off."""

import select
import socket
import struct
from collections.abc import Callable

from support.strangers import END_OF_HEADERS, HEADERS, RST_STREAM, frame, headers
from support.waiting import PATIENCE_S

MOST_BYTES = 512 * 2**20
"""Bytes after which a flood gives up: it is not cut off."""

_PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes([0, 0, 0, 4, 0, 0, 0, 0, 0])
_CONTINUATION = bytes([0, 0x40, 0, 9, 0, 0, 0, 0, 1]) + b"v" * 0x4000
# Header `x` with a value of 2 GB, of a stream whose header block does not end.
_BEGINNING = bytes([0, 0, 9, 1, 0, 0, 0, 0, 1]) + b"\x00\x01x\x7f\x80\xff\xff\xff\x07"
_CANCEL = struct.pack(">I", 8)


def endless_headers(port: int, between: Callable[[], object]) -> int:
    """Send a header block that does not end; return the bytes that were sent.

    Args:
        port: Port on this machine.
        between: Called after every 256 KiB.
    """
    return _flood(port, _BEGINNING, lambda number: _CONTINUATION * 16, between)


def resets(port: int, path: str, between: Callable[[], object]) -> int:
    """Begin calls and reset each at once; return the bytes that were sent.

    Args:
        port: Port on this machine.
        path: Method of the calls.
        between: Called after every 200 calls.
    """
    begun = headers(path, {})

    def chunk(number: int) -> bytes:
        streams = range(400 * number + 1, 400 * (number + 1), 2)
        return b"".join(
            frame(HEADERS, END_OF_HEADERS, stream, begun) + frame(RST_STREAM, 0, stream, _CANCEL) for stream in streams
        )

    return _flood(port, b"", chunk, between)


def _flood(port: int, beginning: bytes, chunk: Callable[[int], bytes], between: Callable[[], object]) -> int:
    """Send chunk after chunk."""
    sent = number = 0
    with socket.create_connection(("127.0.0.1", port)) as line:
        line.sendall(_PREFACE + beginning)
        while sent < MOST_BYTES and _is_sent(line, content := chunk(number)):
            sent, number = sent + len(content), number + 1
            between()
    return sent


def _is_sent(line: socket.socket, content: bytes) -> bool:
    """Send bytes, and drop what comes; False: the other end has ended the connection, and may take no bytes either."""
    line.setblocking(False)
    left = memoryview(content)
    try:
        while left:
            readable, writable, _ = select.select([line], [line], [], PATIENCE_S)
            if readable and not line.recv(2**16):
                return False
            if writable:
                left = left[line.send(left) :]
    except OSError:
        return False
    return True
