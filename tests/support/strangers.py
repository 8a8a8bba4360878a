"""Connections that speak HTTP/2 frame by frame (RFC 9113), for what no client of gRPC would do."""

import socket
import struct
import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

DATA, HEADERS, RST_STREAM, SETTINGS, PING = 0, 1, 3, 4, 6
ACKNOWLEDGED, END_OF_STREAM, END_OF_HEADERS = 1, 1, 4

PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
_PATIENCE_S = 30.0
_FRAME_BYTES = 16384


class Stranger:
    """A connection that answers pings, and otherwise says what a test says.

    Args:
        address: `HOST:PORT`.
        source: Address of this machine that it comes from; empty: any.
        settings: Settings of HTTP/2, by number.

    Attributes:
        is_open: True if the server has not ended it.
        frames: Kind, flags and content of the frames that came.
    """

    def __init__(self, address: str, source: str = "", settings: Mapping[int, int] | None = None) -> None:
        host, _, port = address.rpartition(":")
        # The thread that answers sends, too: a frame must not get into the middle of another one.
        self._sending = threading.Lock()
        self.line = socket.create_connection((host, int(port)), source_address=(source, 0))
        payload = b"".join(struct.pack(">HI", number, value) for number, value in (settings or {}).items())
        # At once: a server may end a connection that has begun and says nothing.
        self._send(PREFACE + frame(SETTINGS, 0, 0, payload))
        self.is_open = True
        self.frames: list[tuple[int, int, bytes]] = []
        self._thread = threading.Thread(target=self._answer)
        self._thread.start()

    def send(self, kind: int, flags: int, stream: int, content: bytes) -> None:
        """A frame; it is lost where the server has ended the connection."""
        self._send(frame(kind, flags, stream, content))

    def call(
        self, stream: int, path: str, metadata: Mapping[str, str] | None = None, flags: int = END_OF_HEADERS
    ) -> None:
        """Begin a call without a request.

        Args:
            stream: Its number, odd.
            path: Of its method.
            metadata: More than a call needs.
            flags: Of the frame.
        """
        self.send(HEADERS, flags, stream, headers(path, metadata or {}))

    def message(self, stream: int, content: bytes) -> None:
        """A message of a call, in as many frames as it needs."""
        data = b"\0" + struct.pack(">I", len(content)) + content
        for place in range(0, len(data), _FRAME_BYTES):
            self.send(DATA, 0, stream, data[place : place + _FRAME_BYTES])

    def has_received(self, words: bytes) -> bool:
        """Return True if headers or trailers that came hold some words."""
        return any(kind == HEADERS and words in content for kind, _, content in self.frames)

    @property
    def ended(self) -> int:
        """Number of calls that the server has ended."""
        return sum(kind == HEADERS and bool(flags & END_OF_STREAM) for kind, flags, _ in self.frames)

    def close(self) -> None:
        """End it."""
        with suppress(OSError):
            self.line.shutdown(socket.SHUT_RDWR)
        self._thread.join(_PATIENCE_S)
        self.line.close()

    def _send(self, content: bytes) -> None:
        with self._sending, suppress(ConnectionError):
            self.line.sendall(content)

    def _answer(self) -> None:
        data = b""
        with suppress(OSError):
            while more := self.line.recv(65536):
                data += more
                while len(data) >= 9 and len(data) >= 9 + int.from_bytes(data[:3]):
                    size, kind, flags = int.from_bytes(data[:3]), data[3], data[4]
                    content, data = data[9 : 9 + size], data[9 + size :]
                    self.frames.append((kind, flags, content))
                    if kind in (PING, SETTINGS) and not flags & ACKNOWLEDGED:
                        self.send(kind, ACKNOWLEDGED, 0, content if kind == PING else b"")
        self.is_open = False


def frame(kind: int, flags: int, stream: int, content: bytes) -> bytes:
    """Return a frame of HTTP/2."""
    return struct.pack(">I", len(content))[1:] + struct.pack(">BBI", kind, flags, stream) + content


@contextmanager
def strangers(address: str, count: int, **how: Any) -> Iterator[list[Stranger]]:
    """Open `count` connections of this kind; yield them.

    Args:
        address: `HOST:PORT`.
        count: Number of connections.
        **how: Arguments of each of them.
    """
    with ExitStack() as stack:
        made = []
        for _ in range(count):
            made.append(Stranger(address, **how))
            stack.callback(made[-1].close)
        yield made


def headers(path: str, metadata: Mapping[str, str]) -> bytes:
    """Return the headers of a call, in HPACK without indexing (RFC 7541, 6.2.2).

    Args:
        path: Path of its method.
        metadata: Metadata beyond what it needs, each name and value shorter than 127 bytes.
    """
    found = b""
    fields = {":method": "POST", ":scheme": "http", ":path": path, ":authority": "robot"}
    fields |= {"te": "trailers", "content-type": "application/grpc"}
    for name, value in (fields | dict(metadata)).items():
        found += b"\0" + bytes([len(name)]) + name.encode() + bytes([len(value)]) + value.encode()
    return found
