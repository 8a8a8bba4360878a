"""Lines over a network that are used like a `SerialLine`: a reader waits in `poll`, and nothing waits without a limit.

Addresses are written as MAVLink programs do:

    udpin:HOST:PORT     listen; answers go to the peer that was chosen among those that were heard
    udpout:HOST:PORT    send there, and hear what comes back
    tcp:HOST:PORT       connect to a server
"""

import contextlib
import errno
import select
import socket
import time

from robosc_bridge.errors import LineBusyError, LineDeniedError, LineError, LineLostError, LineMissingError
from robosc_bridge.host import NetworkPort
from robosc_bridge.transport.polled_line import PolledLine

SCHEMES = ("udpin", "udpout", "tcp")
_CONNECT_LIMIT_S = 1.0
_DATAGRAM = 65535


def is_network_address(address: str) -> bool:
    """Return True if an address is one of the kinds above, and not the path of a port."""
    return address.partition(":")[0] in SCHEMES


class NetworkLine(PolledLine, NetworkPort):
    """An open socket.

    Args:
        address: Address as above. The system looks up the name of a host, which may take long, but not an IP address.

    Attributes:
        path: The address.
        is_datagram: True if a read is one whole datagram.

    Raises:
        LineMissingError: No program serves there, or there is no such host.
        LineBusyError: Another program listens there.
        LineDeniedError: This user may not use the address.
        LineError: The address is invalid, or cannot be used.
    """

    def __init__(self, address: str) -> None:
        scheme, place = _parsed(address)
        self.is_datagram = scheme != "tcp"
        self._is_listening = scheme == "udpin"
        self._peer: tuple[str, int] | None = None
        self._sender: tuple[str, int] | None = None
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM if self.is_datagram else socket.SOCK_STREAM)
        try:
            self._socket.settimeout(_CONNECT_LIMIT_S)
            if self._is_listening:
                self._socket.bind(place)
            else:
                self._socket.connect(place)
            self._socket.setblocking(False)
            if not self.is_datagram:
                # A command to stop waits for nothing.
                self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except OSError as error:
            self._socket.close()
            raise _not_opened(address, error) from error
        super().__init__(address, self._socket.fileno())

    @property
    def port(self) -> int:
        """Port of its own end."""
        return int(self._socket.getsockname()[1])

    def read(self, limit_s: float) -> bytes:
        """Return the data that has come, after waiting for the first byte.

        Args:
            limit_s: Longest wait; 0: not at all.

        Returns:
            Empty if no data came in time, or `wake` was called.

        Raises:
            LineLostError: The connection is gone.
        """
        self._check_open()
        if not self._is_readable(limit_s):
            return b""
        try:
            data, self._sender = self._socket.recvfrom(_DATAGRAM)
        except (BlockingIOError, ConnectionRefusedError):
            # Refused for a datagram that was sent before: the peer does not listen yet.
            return b""
        except OSError as error:
            raise LineLostError(self.path, f"the connection is gone: {error.strerror}") from error
        if not data and not self.is_datagram:
            raise LineLostError(self.path, "the other end has closed the connection")
        return data

    @property
    def is_stranger(self) -> bool:
        """Return True if the last datagram came from another peer than the chosen one; only for `udpin`."""
        return self._is_listening and self._peer is not None and self._sender != self._peer

    def reply(self, data: bytes) -> None:
        """Send one datagram to the sender of the last one; only for `udpin`. It may get lost."""
        if self._is_listening and self._sender is not None:
            with contextlib.suppress(OSError):
                self._socket.sendto(data, self._sender)

    def answer_sender(self) -> None:
        """Choose the sender of the last datagram as the peer for writing; only for `udpin`."""
        self._peer = self._sender

    def write(self, data: bytes, limit_s: float = 0.1) -> None:
        """Send all of the data; without a peer, a listener drops it.

        Args:
            data: Data to send.
            limit_s: Longest wait for the line to take it.

        Raises:
            LineLostError: The connection is gone, or does not take what is written.
        """
        self._check_open()
        try:
            if self._is_listening:
                if self._peer is not None:
                    self._socket.sendto(data, self._peer)
            elif self.is_datagram:
                self._socket.send(data)
            else:
                self._write_stream(data, limit_s)
        except (BlockingIOError, ConnectionRefusedError) as error:
            # A datagram may be lost on any part of its way; a stream may not.
            if not self.is_datagram:
                raise LineLostError(self.path, "the connection is gone") from error
        except (OSError, ValueError) as error:
            # ValueError: it was closed meanwhile.
            raise LineLostError(self.path, f"nothing can be sent: {error}") from error

    def _write_stream(self, data: bytes, limit_s: float) -> None:
        left = memoryview(data)
        end_s = time.monotonic() + limit_s
        poll = select.poll()
        poll.register(self._socket.fileno(), select.POLLOUT)
        while left:
            if not poll.poll(max(end_s - time.monotonic(), 0.0) * 1000):
                raise LineLostError(self.path, "the connection takes no more bytes")
            with contextlib.suppress(BlockingIOError):
                left = left[self._socket.send(left) :]

    def _close_file(self) -> None:
        self._socket.close()


def _parsed(address: str) -> tuple[str, tuple[str, int]]:
    scheme, _, place = address.partition(":")
    host, _, port = place.rpartition(":")
    if scheme not in SCHEMES or not host or not port.isascii() or not port.isdecimal() or int(port) > 65535:
        raise LineError(address, f"this is not an address; it is written {'|'.join(SCHEMES)}:HOST:PORT")
    return scheme, (host, int(port))


def _not_opened(address: str, error: OSError) -> LineError:
    if isinstance(error, (ConnectionRefusedError, TimeoutError)):
        return LineMissingError(address, "no program listens there")
    if isinstance(error, socket.gaierror):
        return LineMissingError(address, "there is no such host")
    if isinstance(error, PermissionError):
        return LineDeniedError(address, "this user may not use this port")
    if error.errno in (errno.EADDRINUSE, errno.EADDRNOTAVAIL):
        return LineBusyError(address, "another program listens there, or it is not an address of this computer")
    return LineError(address, f"cannot be used: {error.strerror}")
