"""Watch over the connections of a gRPC server, which closes those that cost more than their calls explain.

A header block of HTTP/2 that never ends (CONTINUATION flood, CERT/CC VU#421644), calls that are reset at once
(CVE-2023-44487), pings and settings without end: gRPC handles all of these below its handlers, so no limit on calls is
asked, and gRPC itself bounds neither their number nor the memory that they take. They have in common that bytes arrive
and no requests. The kernel counts the bytes of each connection (`tcpi_bytes_received` of tcp(7)), also under TLS, and
the handlers know which connections requests come from. A connection beyond that is ended by `shutdown`, upon which gRPC
frees what it held.

`Ledger` decides, without sockets and time; `ConnectionWatch` counts, in a thread of its own, and closes. Calls pay for
one entry in a set. Without the kernel's counts (outside of Linux), connections are only kept by gRPC's own limits.
"""

import contextlib
import ctypes
import ipaddress
import logging
import os
import socket
import stat
import struct
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from urllib.parse import unquote

from robosc_api.layers import Layer, behaviour_of, with_behaviour

_log = logging.getLogger(__name__)

_DESCRIPTORS = Path("/proc/self/fd")
_MEMORY = Path("/proc/self/statm")
_HEALTH = "/grpc.health."

_TCP_INFO = getattr(socket, "TCP_INFO", None)
_BYTES_RECEIVED = struct.Struct("=Q")
_BYTES_RECEIVED_AT = 128
"""Offset of `tcpi_bytes_received` in `struct tcp_info` of the kernel (since Linux 4.1)."""

LOOK_S = 0.05
"""Shortest time between two looks, in seconds."""

ALERT_LOOK_S = 0.01
"""The same after a flood."""

_TRIM_S = 1.0
"""Time between two returns of freed memory to the system, in seconds: the allocator keeps what a flood has taken."""

_SHARE = 0.02
"""Share of a core that looking may take; more connections are looked at less often, unless memory grows."""

_GROWTH_BYTES = 16 * 2**20
"""Growth of this process's memory that causes a look at once."""

_WARNING_S = 10.0
"""Time between two warnings about closed connections, in seconds."""

_TRIM = getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform == "linux" else None

type Peer = tuple[str, int]
"""Address and port of the other end of a connection."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConnectionLimits:
    """Limits on what a connection may cost.

    Attributes:
        connections: Number of connections; above three quarters of it, unused ones are closed.
        request_bytes: Bytes that one request may have, with its headers.
        unasked_bytes: Bytes that all connections together may have received since their last requests.
        slack_bytes: Bytes that a connection may receive besides requests.
        slack_bytes_a_s: Rate at which received bytes are forgotten: pings of a long watch are no flood.
        first_request_s: Time for the first request of a connection, in seconds.
        suspicion_s: Time for which a flood makes other connections of its host suspect, in seconds: those without a
            request may then receive only the slack.
    """

    connections: int = 4096
    request_bytes: int = 4 * 2**20
    unasked_bytes: int = 96 * 2**20
    slack_bytes: int = 256 * 2**10
    slack_bytes_a_s: float = 4096.0
    first_request_s: float = 30.0
    suspicion_s: float = 60.0


@dataclass(slots=True)
class _Account:
    """Account of one connection.

    Attributes:
        since_s: Time at which it was first seen.
        explained: Bytes that its requests and the passing of time explain.
        asked_s: Time of its last request; None: there was none.
        unasked: Bytes beyond the explained ones.
    """

    since_s: float
    explained: float
    asked_s: float | None = None
    unasked: float = 0.0


class Ledger:
    """Account of what connections have received and what requests explain of it.

    Args:
        limits: Limits of connections.
    """

    def __init__(self, limits: ConnectionLimits) -> None:
        self._limits = limits
        self._accounts: dict[Peer, _Account] = {}
        self._suspect_until_s: dict[str, float] = {}
        self._last_s: float | None = None

    def look(
        self, received: Mapping[Peer, int], asked: Iterable[Peer], open_calls: Mapping[Peer, int], now_s: float
    ) -> dict[Peer, str]:
        """Return the connections to close, with the reason.

        Args:
            received: Bytes that each connection has received since it was made.
            asked: Connections on which requests have arrived since the last look.
            open_calls: Number of open calls of each connection.
            now_s: Current time, in seconds of a monotonic clock.
        """
        accounts = self._accounts
        forgotten = 0.0 if self._last_s is None else (now_s - self._last_s) * self._limits.slack_bytes_a_s
        self._last_s = now_s
        for gone in accounts.keys() - received.keys():
            del accounts[gone]
        asking = set(asked)
        for peer, total in received.items():
            account = accounts.get(peer)
            is_new = account is None
            if account is None:
                account = accounts[peer] = _Account(now_s, 0.0)
            if peer in asking:
                account.asked_s, account.explained = now_s, total
            elif not is_new:
                account.explained = min(account.explained + forgotten, total)
            account.unasked = total - account.explained
        closed = self._flooding(open_calls, now_s) | self._silent(open_calls, now_s)
        closed |= self._unused(open_calls, closed)
        for peer in closed:
            del accounts[peer]
        return closed

    @property
    def is_alert(self) -> bool:
        """True if some host is suspect."""
        return bool(self._suspect_until_s)

    def _flooding(self, open_calls: Mapping[Peer, int], now_s: float) -> dict[Peer, str]:
        """Connections that have received more than requests can have, the worst first."""
        limits, closed, suspects = self._limits, {}, self._suspect_until_s
        for host in [host for host, until_s in suspects.items() if until_s <= now_s]:
            del suspects[host]
        total = 0.0
        for peer, account in self._accounts.items():
            total += account.unasked
            if account.unasked <= limits.slack_bytes:
                continue
            # One request may be on its way before its call has begun.
            requests = open_calls.get(peer, 0) + (account.asked_s is not None or peer[0] not in suspects)
            if account.unasked > limits.slack_bytes + requests * limits.request_bytes:
                closed[peer] = "it sends bytes and no requests"
                total -= account.unasked
        if total > limits.unasked_bytes:
            for peer, account in sorted(self._accounts.items(), key=lambda item: -item[1].unasked):
                if peer not in closed:
                    closed[peer] = "connections together send too many bytes and no requests"
                    total -= account.unasked
                    if total <= limits.unasked_bytes / 2:
                        break
        for host, _ in closed:
            suspects[host] = now_s + limits.suspicion_s
        return closed

    def _silent(self, open_calls: Mapping[Peer, int], now_s: float) -> dict[Peer, str]:
        """Connections on which no request has arrived in time."""
        latest_s = now_s - self._limits.first_request_s
        return {
            peer: "no request arrives on it"
            for peer, account in self._accounts.items()
            if account.asked_s is None and account.since_s <= latest_s and not open_calls.get(peer)
        }

    def _unused(self, open_calls: Mapping[Peer, int], closed: Mapping[Peer, str]) -> dict[Peer, str]:
        """Connections that give way to others: of the hosts with the most, those without a call for the longest."""
        left = self._accounts.keys() - closed.keys()
        excess = len(left) - self._limits.connections * 3 // 4
        if excess <= 0:
            return {}
        by_host: dict[str, list[Peer]] = {}
        for peer in left:
            by_host.setdefault(peer[0], []).append(peer)
        sizes = Counter({host: len(peers) for host, peers in by_host.items()})
        unused: dict[str, list[Peer]] = {}
        for host, peers in by_host.items():
            free = sorted((peer for peer in peers if not open_calls.get(peer)), key=self._use, reverse=True)
            if free:
                unused[host] = free
        found: dict[Peer, str] = {}
        while unused and len(found) < excess:
            host = max(unused, key=lambda name: sizes[name])
            found[unused[host].pop()] = "there are too many connections, and it is not used"
            sizes[host] -= 1
            if not unused[host]:
                del unused[host]
        return found

    def _use(self, peer: Peer) -> tuple[bool, float]:
        """Return the order of connections by their use, the least used one first."""
        account = self._accounts[peer]
        return (False, account.since_s) if account.asked_s is None else (True, account.asked_s)


class Arrivals(Layer):
    """Layer that notes from which connections requests arrive.

    It stands inside the guard and the wait for requests, so that only requests of admitted callers count; it is never
    the outermost layer. Health checks need no token, and explain nothing; their open watches count as calls.
    """

    def __init__(self) -> None:
        super().__init__()
        self._arrived: set[str] = set()
        self._open: dict[str, int] = {}

    def wrap(self, inner: Any, method: str) -> Any:
        """Return a handler that notes the connection of each request."""
        behaviour = behaviour_of(inner)

        def noted(request: Any, context: Any) -> Any:
            self._arrived.add(context.peer())
            return behaviour(request, context)

        return inner if method.startswith(_HEALTH) else with_behaviour(inner, noted)

    def begun(self, peer: str) -> None:
        """Note that a call has begun on a connection, in gRPC's words for its other end."""
        self._open[peer] = self._open.get(peer, 0) + 1

    def ended(self, peer: str) -> None:
        """Note that a call has ended on a connection."""
        left = self._open[peer] - 1
        if left > 0:
            self._open[peer] = left
        else:
            del self._open[peer]

    def take(self) -> tuple[frozenset[str], dict[str, int]]:
        """Return the connections with requests since the last time, and the open calls; from another thread."""
        arrived, self._arrived = self._arrived, set()
        # Copies are made without another thread in between.
        return frozenset(arrived), dict(self._open)


class ConnectionWatch:
    """Thread that closes connections beyond the limits, inside the context.

    Args:
        port: Port on which the server listens.
        limits: Limits of connections.
        arrivals: Layer of the server.
        clock: Seconds of a monotonic clock.
    """

    def __init__(
        self, port: int, limits: ConnectionLimits, arrivals: Arrivals, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._ledger = Ledger(limits)
        self._sockets = _Sockets(port)
        self._arrivals = arrivals
        self._clock = clock
        self._warned_s = float("-inf")
        self._unreported: Counter[str] = Counter()
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name="connection watch", daemon=True)
        self.closed: Counter[str] = Counter()

    def __enter__(self) -> Self:
        if can_watch():
            self._thread.start()
        else:
            _log.warning("connections are not watched on this system: put a proxy in front of the server")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end.set()
        if self._thread.is_alive():
            self._thread.join()

    def look(self) -> None:
        """Look at all connections once, and close those beyond the limits."""
        arrived, open_calls = self._arrivals.take()
        received = self._sockets.received()
        now_s = self._clock()
        closed = self._ledger.look(
            received,
            (peer for peer in map(peer_of, arrived) if peer is not None),
            {peer: count for text, count in open_calls.items() if (peer := peer_of(text)) is not None},
            now_s,
        )
        for peer, reason in closed.items():
            if self._sockets.close(peer):
                self.closed[reason] += 1
                self._unreported[reason] += 1
        if self._unreported and now_s - self._warned_s >= _WARNING_S:
            self._warned_s = now_s
            for reason, count in self._unreported.items():
                _log.warning("closed connections: %d: %s; the last one: %s", count, reason, next(iter(closed), ""))
            self._unreported.clear()

    def _run(self) -> None:
        due_s = trimmed_s = 0.0
        memory = _resident_bytes()
        while not self._end.wait(ALERT_LOOK_S if self._ledger.is_alert else LOOK_S):
            now_s, taken = self._clock(), _resident_bytes()
            if now_s < due_s and taken < memory + _GROWTH_BYTES:
                continue
            memory = taken
            if self._ledger.is_alert and now_s >= trimmed_s + _TRIM_S:
                trimmed_s = now_s
                _return_freed_memory()
            used_s = time.thread_time()
            try:
                self.look()
            except Exception:
                # A watch that ends would leave the server open without a word.
                _log.exception("watching the connections failed")
            due_s = now_s + (time.thread_time() - used_s) / _SHARE


class _Sockets:
    """Accepted connections of this process on one port."""

    def __init__(self, port: int) -> None:
        self._port = port
        # By descriptor: inode, and the peer if it is a connection of the port.
        self._known: dict[int, tuple[int, Peer | None]] = {}
        self._by_peer: dict[Peer, int] = {}

    def received(self) -> dict[Peer, int]:
        """Return the bytes that each connection has received."""
        found: dict[Peer, int] = {}
        known: dict[int, tuple[int, Peer | None]] = {}
        by_peer: dict[Peer, int] = {}
        for descriptor in _descriptors():
            # Another thread may close it at any time, and another connection may get its number.
            with contextlib.suppress(OSError):
                inode = os.fstat(descriptor).st_ino
                before = self._known.get(descriptor)
                peer = before[1] if before is not None and before[0] == inode else self._peer(descriptor)
                known[descriptor] = inode, peer
                if peer is not None:
                    found[peer] = _bytes_received(descriptor)
                    by_peer[peer] = descriptor
        self._known, self._by_peer = known, by_peer
        return found

    def close(self, peer: Peer) -> bool:
        """Shut down a connection; False: it has gone."""
        descriptor = self._by_peer.get(peer)
        if descriptor is None:
            return False
        with contextlib.suppress(OSError):
            # A copy, which cannot become another connection between the check and the end.
            copy = socket.socket(fileno=os.dup(descriptor))
            with copy:
                if self._peer(copy.fileno()) == peer:
                    copy.shutdown(socket.SHUT_RDWR)
                    return True
        return False

    def _peer(self, descriptor: int) -> Peer | None:
        """Return the other end of a connection of our port; None: it is something else."""
        if not stat.S_ISSOCK(os.fstat(descriptor).st_mode):
            return None
        with _borrowed(descriptor) as line:
            if line.getsockopt(socket.SOL_SOCKET, socket.SO_DOMAIN) not in (socket.AF_INET, socket.AF_INET6):
                return None
        with contextlib.closing(socket.socket(fileno=os.dup(descriptor))) as copy:
            try:
                if copy.getsockname()[1] != self._port:
                    return None
                return _normal(*copy.getpeername()[:2])
            except OSError:
                return None  # It listens, or has gone.


def can_watch() -> bool:
    """Return True if the kernel counts the bytes of connections and shows this process's descriptors."""
    if _TCP_INFO is None or not _DESCRIPTORS.is_dir():
        return False
    with socket.socket() as probe:
        try:
            _bytes_received(probe.fileno())
        except (OSError, struct.error):
            return False
    return True


def peer_of(text: str) -> Peer | None:
    """Return the other end of a connection from gRPC's words for it; None: it is no TCP connection."""
    kind, _, rest = unquote(text).partition(":")
    host, _, port = rest.rpartition(":")
    if kind not in ("ipv4", "ipv6") or not port.isdecimal():
        return None
    return _normal(host.strip("[]"), int(port))


def _normal(host: str, port: int) -> Peer:
    """Return an address as one text, however a socket says it."""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return host, port
    return str(getattr(address, "ipv4_mapped", None) or address), port


def _descriptors() -> list[int]:
    return [int(name) for name in os.listdir(_DESCRIPTORS)]  # noqa: PTH208  # paths would take longer than the rest


@contextlib.contextmanager
def _borrowed(descriptor: int) -> Iterator[socket.socket]:
    """Yield a socket of a descriptor that somebody else closes."""
    line = socket.socket(socket.AF_INET, socket.SOCK_STREAM, 0, fileno=descriptor)
    try:
        yield line
    finally:
        line.detach()


def _bytes_received(descriptor: int) -> int:
    """Return the bytes that a TCP connection has received; raises OSError if it is none."""
    line = socket.socket(socket.AF_INET, socket.SOCK_STREAM, 0, fileno=descriptor)
    try:
        assert _TCP_INFO is not None  # noqa: S101  # `can_watch` has looked
        info = line.getsockopt(socket.IPPROTO_TCP, _TCP_INFO, _BYTES_RECEIVED_AT + _BYTES_RECEIVED.size)
    finally:
        line.detach()
    received: int = _BYTES_RECEIVED.unpack_from(info, _BYTES_RECEIVED_AT)[0]
    return received


def _return_freed_memory() -> None:
    """Return freed memory to the system, where the C library can (`malloc_trim` of glibc)."""
    if _TRIM is not None:
        _TRIM(0)


def _resident_bytes() -> int:
    try:
        return int(_MEMORY.read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return 0
