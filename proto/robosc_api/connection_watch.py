"""Watch over the connections of a gRPC server, which closes those that cost more than their calls explain.

A header block of HTTP/2 that never ends (CONTINUATION flood, CERT/CC VU#421644), calls that are reset at once
(CVE-2023-44487), pings and settings without end: gRPC handles all of these below its handlers, so no limit on calls is
asked, and gRPC itself bounds neither their number nor the memory that they take. They have in common that bytes arrive
and no requests. The kernel counts the bytes of each connection (`tcpi_bytes_received` of tcp(7)), also under TLS, and
the handlers know which connections requests come from. A connection beyond that is ended by `shutdown`, upon which gRPC
frees what it held.

The kernel drops new connections of barred hosts (`connection_filter.py`).

`Ledger` (`connection_ledger.py`) decides, without sockets and time; `ConnectionWatch` counts, in a thread of its own,
and closes. Calls pay for two entries in tables. Without the kernel's counts (outside of Linux), connections are only
kept by gRPC's own limits.
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
from collections.abc import AsyncIterator, Callable, Iterator
from functools import lru_cache
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from urllib.parse import unquote

from robosc_api.calls import call_under_way, peer_of
from robosc_api.connection_filter import drop_new_connections
from robosc_api.connection_ledger import CallsSince, CloseReason, ConnectionLimits, Ledger, Peer, Traffic
from robosc_api.layers import Layer, behaviour_of, with_behaviour

_log = logging.getLogger(__name__)

_DESCRIPTORS = Path("/proc/self/fd")
_MEMORY = Path("/proc/self/statm")
_MEMORY_LINE_BYTES = 256
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
_HEALTH = "/grpc.health."

_TCP_INFO = getattr(socket, "TCP_INFO", None)
_BYTE_COUNTS = struct.Struct("=QQ")
_BYTE_COUNTS_AT = 120
"""Offset of `tcpi_bytes_acked` and `tcpi_bytes_received` in `struct tcp_info` of the kernel (since Linux 4.1)."""

MEMORY_LOOK_S = 0.05
"""Time between two looks at this process's memory, in seconds."""

LOOK_S = 0.1
"""Shortest time between two looks at connections while this process works, in seconds, unless memory grows."""

CALM_LOOK_S = 2.0
"""Shortest time between two looks while this process does next to nothing, in seconds."""

ALERT_LOOK_S = 0.01
"""The same after a flood."""

_TRIM_S = 1.0
"""Time between two returns of freed memory to the system, in seconds: the allocator keeps what a flood has taken."""

SHARE = 0.02
"""Share of a core that looking takes at most; more connections are looked at less often, unless memory grows."""

_GROWTH_BYTES = 16 * 2**20
"""Growth of this process's memory that causes a look at once."""

_BUSY_S = 0.02
"""Processor time of this process since the last look, in seconds, after which it is not calm: a flood takes some."""

_WARNING_S = 10.0
"""Time between two warnings about closed connections, in seconds."""

_NAMED_HOSTS = 5
"""Hosts that a log line names at most."""

_TRIM = getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform == "linux" else None


class Arrivals(Layer):
    """Layer that notes from which connections requests arrive.

    It stands inside the guard and the wait for requests, so that only requests of admitted callers count; it is never
    the outermost layer. Of a stream, each request counts, and not its beginning. Health checks need no token, and
    explain nothing; their open watches count as calls.
    """

    def __init__(self) -> None:
        super().__init__()
        self._arrived: set[str] = set()
        self._ended: Counter[str] = Counter()
        self._open: dict[str, int] = {}

    def wrap(self, inner: Any, method: str) -> Any:
        """Return a handler that notes the connection of each request."""
        if is_health_check(method):
            return inner
        behaviour = behaviour_of(inner)

        def noted(request: Any, context: Any) -> Any:
            self._arrived.add(peer_of(context))
            return behaviour(request, context)

        def noted_each(requests: Any, context: Any) -> Any:
            return behaviour(self._each(requests, peer_of(context)), context)

        return with_behaviour(inner, noted_each if inner.request_streaming else noted)

    async def _each(self, requests: AsyncIterator[Any], peer: str) -> AsyncIterator[Any]:
        async for request in requests:
            self._arrived.add(peer)
            yield request

    def begun(self, peer: str) -> None:
        """Note that a call of an admitted caller has begun on a connection, in gRPC's words for its other end."""
        self._open[peer] = self._open.get(peer, 0) + 1

    def ended(self, peer: str, *, is_check: bool = False) -> None:
        """Note that a call has ended on a connection.

        Args:
            peer: The other end of the connection, in gRPC's words.
            is_check: True for a health check.
        """
        if not is_check:
            self._ended[peer] += 1
        left = self._open[peer] - 1
        if left > 0:
            self._open[peer] = left
        else:
            del self._open[peer]

    def refused(self, peer: str) -> None:
        """Note that a call of an admitted caller, and no health check, was refused without its request."""
        self._ended[peer] += 1

    def take(self) -> CallsSince[str]:
        """Return the calls since the last time; from another thread."""
        arrived, self._arrived = self._arrived, set()
        ended, self._ended = self._ended, Counter()
        # Copies are made without another thread in between.
        return CallsSince(frozenset(arrived), dict(ended), dict(self._open))


class CallsByConnection(Layer):
    """Layer that notes the open calls of each connection.

    It stands inside the guard and outside of all waits; it is never the outermost layer. A service with a limit on open
    calls notes them itself.

    Args:
        arrivals: Layer that is notified.
    """

    def __init__(self, arrivals: Arrivals) -> None:
        super().__init__()
        self._arrivals = arrivals

    def wrap(self, inner: Any, method: str) -> Any:
        """Return a handler that notes its calls."""
        behaviour, arrivals, is_check = behaviour_of(inner), self._arrivals, is_health_check(method)

        def noted(request: Any, context: Any) -> Any:
            peer = peer_of(context)
            arrivals.begun(peer)
            call_under_way().at_end.append(lambda: arrivals.ended(peer, is_check=is_check))
            return behaviour(request, context)

        return with_behaviour(inner, noted)


class LookPace:
    """Pace of the looks at connections: often while this process works, seldom while it is calm, at once as it grows.

    A look costs a few microseconds for each connection. A flood takes memory or processor time, so that a process that
    takes neither needs only the looks that close idle connections.

    Args:
        share: Share of a core that looking takes at most, unless memory grows.
    """

    def __init__(self, share: float) -> None:
        self._share = share
        self._begun_s = float("-inf")
        self._memory = 0
        self._took_s = 0.0
        self._processor_s = float("-inf")

    def is_due(self, now_s: float, memory: int, processor_s: float, *, is_alert: bool) -> bool:
        """Return True if a look has to begin now; `looked` then says what it took.

        Args:
            now_s: Current time, in seconds of a monotonic clock.
            memory: Resident memory of this process, in bytes.
            processor_s: Processor time that this process has used, in seconds.
            is_alert: True if a host is suspect.
        """
        is_calm = processor_s < self._processor_s + _BUSY_S
        least_s = 0.0 if is_alert else CALM_LOOK_S if is_calm else LOOK_S
        wait_s = max(self._took_s / self._share, least_s)
        if now_s < self._begun_s + wait_s and memory < self._memory + _GROWTH_BYTES:
            return False
        self._begun_s, self._memory = now_s, memory
        return True

    def looked(self, took_s: float, processor_s: float) -> None:
        """Note the end of a look.

        Args:
            took_s: Processor time that it took, in seconds.
            processor_s: Processor time that this process has used, in seconds.
        """
        self._took_s, self._processor_s = took_s, processor_s


def _bars_none(host: str) -> bool:
    """Return False for every host."""
    return False


class ConnectionWatch:
    """Thread that closes connections beyond the limits, inside the context.

    Args:
        port: Port on which the server listens.
        limits: Limits of connections.
        arrivals: Layer of the server.
        share: Share of a core that looking takes at most.
        bars: Function that returns True for a host whose new connections may be kept away for a while after floods of
            it. They are then late.
        returns_memory: True to return the memory that floods have taken to the system at once. Meanwhile, threads of
            this process that need memory may have to wait.
        clock: Seconds of a monotonic clock.

    Attributes:
        closed: Number of closed connections, by reason, each of which is there.
        barred: Number of hosts whose new connections the kernel keeps away now.
        times_barred: Number of times that the kernel began to keep those of a host away.
    """

    def __init__(
        self,
        port: int,
        limits: ConnectionLimits,
        arrivals: Arrivals,
        *,
        share: float = SHARE,
        bars: Callable[[str], bool] = _bars_none,
        returns_memory: bool = True,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._ledger = Ledger(limits)
        self._sockets = _Sockets(port)
        self._arrivals = arrivals
        self._share = share
        self._bars = bars
        self._barred: frozenset[str] = frozenset()
        self._returns_memory = returns_memory
        self._clock = clock
        self._warned_s = self._failed_s = float("-inf")
        self._unreported: Counter[CloseReason] = Counter()
        self._last: dict[CloseReason, Peer] = {}
        self._failures = 0
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name="connection watch", daemon=True)
        self.closed: Counter[CloseReason] = Counter(dict.fromkeys(CloseReason, 0))
        self.barred = self.times_barred = 0

    def __enter__(self) -> Self:
        if can_watch():
            self._thread.start()
        else:
            _log.warning("connections are not watched on this system: put a proxy in front of the service")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end.set()
        if self._thread.is_alive():
            self._thread.join()
        if self._barred:
            self._bar(frozenset())

    def look(self) -> None:
        """Look at all connections once, and close those beyond the limits."""
        calls = _by_peer(self._arrivals.take())
        traffic = self._sockets.traffic()
        now_s = self._clock()
        closed = self._ledger.look(traffic, calls, now_s)
        for peer, reason in closed.items():
            if self._sockets.close(peer):
                self.closed[reason] += 1
                self._unreported[reason] += 1
                self._last[reason] = peer
        barred = frozenset(filter(self._bars, self._ledger.barred))
        if barred != self._barred:
            self._bar(barred)
        if self._unreported and now_s - self._warned_s >= _WARNING_S:
            self._warned_s = now_s
            for reason, count in self._unreported.items():
                host, port = self._last[reason]
                _log.warning("closed connections: %d: %s; the last one: %s port %d", count, reason, host, port)
            self._unreported.clear()

    def _bar(self, hosts: frozenset[str]) -> None:
        """Keep new connections of these hosts away, and of no others."""
        added = hosts - self._barred
        if added:
            _log.warning("after floods, new connections are late from %s", ", ".join(sorted(hosts)[:_NAMED_HOSTS]))
        self._barred = hosts
        if self._sockets.bar(hosts):
            self.barred = len(hosts)
            self.times_barred += len(added)
        else:
            self.barred = 0
            _log.warning("the kernel takes no filter of connections: hosts that flood connect again at once")

    def _run(self) -> None:
        pace = LookPace(self._share)
        trimmed_s = 0.0
        with _MEMORY.open("rb", buffering=0) as memory:
            while not self._end.wait(ALERT_LOOK_S if self._ledger.is_alert else MEMORY_LOOK_S):
                now_s, is_alert = self._clock(), self._ledger.is_alert
                if not pace.is_due(now_s, _resident_bytes(memory.fileno()), time.process_time(), is_alert=is_alert):
                    continue
                if self._returns_memory and is_alert and now_s >= trimmed_s + _TRIM_S:
                    trimmed_s = now_s
                    _return_freed_memory()
                used_s = time.thread_time()
                try:
                    self.look()
                except Exception:
                    # A watch that ends would leave the server open without a word.
                    self._report_failure()
                pace.looked(time.thread_time() - used_s, time.process_time())

    def _report_failure(self) -> None:
        """Log the error that is handled now, unless one was logged just now."""
        self._failures += 1
        now_s = self._clock()
        if now_s - self._failed_s >= _WARNING_S:
            self._failed_s = now_s
            _log.exception("watching the connections failed (%d times since the last such line)", self._failures)
            self._failures = 0


class _Sockets:
    """Accepted connections of this process on one port."""

    def __init__(self, port: int) -> None:
        self._port = port
        # By descriptor: inode, and the peer if it is a connection of the port.
        self._known: dict[int, tuple[int, Peer | None]] = {}
        self._by_peer: dict[Peer, int] = {}

    def traffic(self) -> dict[Peer, Traffic]:
        """Return the bytes of each connection."""
        found: dict[Peer, Traffic] = {}
        known: dict[int, tuple[int, Peer | None]] = {}
        by_peer: dict[Peer, int] = {}
        for descriptor in _descriptors():
            try:
                inode = os.fstat(descriptor).st_ino
                before = self._known.get(descriptor)
                peer = before[1] if before is not None and before[0] == inode else self._peer(descriptor)
                known[descriptor] = inode, peer
                if peer is not None:
                    found[peer] = _traffic(descriptor)
                    by_peer[peer] = descriptor
            except OSError:
                # Another thread may close it at any time, and another connection may get its number.
                continue
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

    def bar(self, hosts: frozenset[str]) -> bool:
        """Keep new connections of these hosts away, and of no others; False: the kernel does not."""
        is_done = True
        for descriptor in _descriptors():
            try:
                if not stat.S_ISSOCK(os.fstat(descriptor).st_mode):
                    continue
                copy = socket.socket(fileno=os.dup(descriptor))
            except OSError:
                continue  # It has gone.
            with copy:
                if self._is_listener(copy):
                    try:
                        drop_new_connections(copy, hosts)
                    except OSError:
                        is_done = False
        return is_done

    def _is_listener(self, line: socket.socket) -> bool:
        return (
            line.family in (socket.AF_INET, socket.AF_INET6)
            and line.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN) == 1
            and line.getsockname()[1] == self._port
        )

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


def is_health_check(method: str) -> bool:
    """Return True if a method (`/package.Service/Method`) is one of health checks, which need no token."""
    return method.startswith(_HEALTH)


def can_watch() -> bool:
    """Return True if the kernel counts the bytes of connections and shows this process's descriptors."""
    if _TCP_INFO is None or not _DESCRIPTORS.is_dir():
        return False
    with socket.socket() as probe:
        try:
            _traffic(probe.fileno())
        except (OSError, struct.error):
            return False
    return True


@lru_cache(maxsize=8192)
def address_of(text: str) -> Peer | None:
    """Return the other end of a connection from gRPC's words for it; None: it is no TCP connection."""
    kind, _, rest = unquote(text).partition(":")
    host, _, port = rest.rpartition(":")
    if kind not in ("ipv4", "ipv6") or not port.isdecimal():
        return None
    return _normal(host.strip("[]"), int(port))


def _by_peer(calls: CallsSince[str]) -> CallsSince[Peer]:
    """Return calls by the other end of their connection, without those over other lines than TCP."""
    peers = {text: address_of(text) for text in {*calls.asked, *calls.ended, *calls.open}}
    ended, opened = (
        {peer: count for text, count in counts.items() if (peer := peers[text]) is not None}
        for counts in (calls.ended, calls.open)
    )
    return CallsSince(frozenset(peer for text in calls.asked if (peer := peers[text]) is not None), ended, opened)


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
    """Yield a socket of a descriptor that its owner closes."""
    line = socket.socket(socket.AF_INET, socket.SOCK_STREAM, 0, fileno=descriptor)
    try:
        yield line
    finally:
        line.detach()


def _traffic(descriptor: int) -> Traffic:
    """Return the bytes of a TCP connection; raises OSError if it is none."""
    line = socket.socket(socket.AF_INET, socket.SOCK_STREAM, 0, fileno=descriptor)
    try:
        assert _TCP_INFO is not None  # noqa: S101  # `can_watch` has looked
        info = line.getsockopt(socket.IPPROTO_TCP, _TCP_INFO, _BYTE_COUNTS_AT + _BYTE_COUNTS.size)
    finally:
        line.detach()
    acknowledged, received = _BYTE_COUNTS.unpack_from(info, _BYTE_COUNTS_AT)
    return Traffic(received, acknowledged)


def _return_freed_memory() -> None:
    """Return freed memory to the system, where the C library can (`malloc_trim` of glibc)."""
    if _TRIM is not None:
        _TRIM(0)


def _resident_bytes(descriptor: int) -> int:
    """Return the size of this process's memory, from an open file of it.

    Opening a file takes longer than all else of this, twenty times a second.
    """
    try:
        return int(os.pread(descriptor, _MEMORY_LINE_BYTES, 0).split()[1]) * _PAGE_BYTES
    except (OSError, ValueError, IndexError):
        return 0
