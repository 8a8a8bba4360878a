"""A network of memory for a virtual host: datagrams and connections among its own threads, in order and without loss.

Addresses are written as for the real one: `udpin:HOST:PORT`, `udpout:HOST:PORT`, `tcp:HOST:PORT`. There is one machine,
so that the host in them says nothing.
"""

from collections import deque
from collections.abc import Callable

from robosc_bridge.errors import LineBusyError, LineLostError, LineMissingError
from robosc_bridge.host import NetworkPort

_FIRST_FREE = 49_152

type Wait = Callable[[Callable[[], bool], float], bool]
"""Lets others run until something holds, or for a time."""


class VirtualNetwork:
    """The ports that are in use.

    Args:
        wait: Of the host.
    """

    def __init__(self, wait: Wait) -> None:
        self.wait = wait
        self.datagrams: dict[int, _Datagrams] = {}
        self.servers: dict[int, VirtualServer] = {}
        self._next = _FIRST_FREE

    def open(self, address: str) -> NetworkPort:
        """Open a line.

        Raises:
            LineMissingError: The address has no server.
            LineBusyError: The port is in use.
        """
        scheme, port = address.partition(":")[0], int(address.rpartition(":")[2])
        if scheme == "tcp":
            if port not in self.servers:
                raise LineMissingError(address, "no program listens there")
            return self.servers[port].connect(address)
        return _Datagrams(self, address, port)

    def serve(self, port: int) -> "VirtualServer":
        """Return a server.

        Raises:
            LineBusyError: The port is in use.
        """
        return VirtualServer(self, self.free(port, self.servers))

    def free(self, port: int, used: "dict[int, _Datagrams] | dict[int, VirtualServer]") -> int:
        """Return that port, or any that is free for 0.

        Raises:
            LineBusyError: It is in use.
        """
        if port in used:
            raise LineBusyError(str(port), "another program listens there, or it is not an address of this computer")
        if port:
            return port
        self._next += 1
        return self._next


class _Datagrams(NetworkPort):
    """A socket for datagrams."""

    is_datagram = True

    def __init__(self, network: VirtualNetwork, address: str, port: int) -> None:
        self.path = address
        self.came: deque[tuple[int, bytes]] = deque()
        self._network = network
        self._is_listening = address.startswith("udpin:")
        self._port = network.free(port if self._is_listening else 0, network.datagrams)
        self._peer = None if self._is_listening else port
        self._sender: int | None = None
        self._is_woken = False
        self._is_open = True
        network.datagrams[self._port] = self

    @property
    def port(self) -> int:
        """Address of its own end."""
        return self._port

    @property
    def is_stranger(self) -> bool:
        """Return whether the last datagram came from elsewhere than where writing goes; only for who listens."""
        return self._is_listening and self._peer is not None and self._sender != self._peer

    def read(self, limit_s: float) -> bytes:
        """Return the next datagram, waiting for it.

        Raises:
            LineLostError: It is closed.
        """
        self._check_open()
        self._network.wait(lambda: bool(self.came) or self._is_woken or not self._is_open, limit_s)
        self._check_open()
        self._is_woken = False
        if not self.came:
            return b""
        self._sender, data = self.came.popleft()
        return data

    def reply(self, data: bytes) -> None:
        """Send one datagram to where the last one came from; only for who listens."""
        if self._is_listening and self._sender is not None:
            self._send(self._sender, data)

    def answer_sender(self) -> None:
        """From now on, what is written goes to where the last datagram came from; only for who listens."""
        if self._is_listening:
            self._peer = self._sender

    def write(self, data: bytes, limit_s: float = 0.1) -> None:
        """Send a datagram; it is lost without a listener.

        Raises:
            LineLostError: It is closed.
        """
        self._check_open()
        if self._peer is not None:
            self._send(self._peer, data)

    def wake(self) -> None:
        """Let a `read` that waits in another thread return."""
        self._is_woken = True

    def close(self) -> None:
        """Give it back; may be called again."""
        if self._is_open:
            self._is_open = False
            del self._network.datagrams[self._port]

    def _send(self, to: int, data: bytes) -> None:
        # A listener hears all senders; a sender hears the one that it sends to.
        end = self._network.datagrams.get(to)
        if end is not None and (end._is_listening or end._peer == self._port):
            end.came.append((self._port, data))

    def _check_open(self) -> None:
        if not self._is_open:
            raise LineLostError(self.path, "the line is closed")


class VirtualServer:
    """Takes connections until it is closed.

    Attributes:
        port: Its own.
    """

    def __init__(self, network: VirtualNetwork, port: int) -> None:
        self.port = port
        self._network = network
        self._waiting: deque[_Stream] = deque()
        network.servers[port] = self

    def connect(self, address: str) -> NetworkPort:
        """Return the caller's end of a new connection."""
        there, here = _Stream(self._network.wait, address), _Stream(self._network.wait, f"server:{self.port}")
        there.other, here.other = here, there
        self._waiting.append(here)
        return there

    def accept(self, limit_s: float) -> NetworkPort | None:
        """Return its own end of the next connection, waiting for it; None: none came in time."""
        self._network.wait(lambda: bool(self._waiting), limit_s)
        return self._waiting.popleft() if self._waiting else None

    def close(self) -> None:
        """Take no more."""
        self._network.servers.pop(self.port, None)


class _Stream(NetworkPort):
    """An end of a connection."""

    is_datagram = False
    is_stranger = False
    port = 0

    def __init__(self, wait: Wait, address: str) -> None:
        self.path = address
        self.other = self
        self.came = bytearray()
        self.is_open = True
        self._wait = wait
        self._is_woken = False

    def read(self, limit_s: float) -> bytes:
        """Return what has come, waiting for the first of it.

        Raises:
            LineLostError: The connection is gone.
        """
        self._check_open()
        self._wait(lambda: bool(self.came) or self._is_woken or not self.is_open or not self.other.is_open, limit_s)
        self._check_open()
        self._is_woken = False
        data = bytes(self.came)
        self.came.clear()
        if not data and not self.other.is_open:
            raise LineLostError(self.path, "the other end has closed the connection")
        return data

    def reply(self, data: bytes) -> None:
        """Do nothing: here are no datagrams."""

    def answer_sender(self) -> None:
        """Do nothing: there is one other end."""

    def write(self, data: bytes, limit_s: float = 0.1) -> None:
        """Send all of it.

        Raises:
            LineLostError: The connection is gone.
        """
        self._check_open()
        if not self.other.is_open:
            raise LineLostError(self.path, "the connection is gone")
        self.other.came += data

    def wake(self) -> None:
        """Let a `read` that waits in another thread return."""
        self._is_woken = True

    def close(self) -> None:
        """Give it back; may be called again."""
        self.is_open = False

    def _check_open(self) -> None:
        if not self.is_open:
            raise LineLostError(self.path, "the line is closed")
