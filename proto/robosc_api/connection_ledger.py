"""Ledger of the connections of a gRPC server, which decides whose are closed, without sockets and time.

Calls of admitted callers that end without a request, because gRPC refuses one that is too large or because a quota is
used up, bring bytes as well. They differ from calls that are reset in that they are answered: the bytes that a
connection has been sent (`tcpi_bytes_acked`) show how many of them were.

A host whose connections were closed connects again at once, and what it sends until the next look, gRPC takes: calls
that wait are handed to handlers, also when their connection has gone. So a host is barred for some seconds after some
floods.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

_ANSWER_BYTES = 50
"""Fewer bytes than any answer to a call takes: its status, in a frame of headers; one without a message takes 85."""

_REFUSED_BYTES = 96 * 2**10
"""Bytes that a call may bring whose request is refused: a window of HTTP/2, and headers."""

type Peer = tuple[str, int]
"""Address and port of the other end of a connection."""


class CloseReason(StrEnum):
    """Reason why a connection was closed, as a sentence; its name is that in metrics."""

    RESETS = "its calls are reset before their requests"
    BYTES = "it sends bytes and no requests"
    BYTES_TOGETHER = "connections together send too many bytes and no requests"
    SILENCE = "no request arrives on it"
    UNUSED = "there are too many connections, and it is not used"


class Traffic(NamedTuple):
    """Bytes that a connection has received and sent since it was made.

    Attributes:
        received: Bytes that the other end has sent.
        acknowledged: Bytes of this end that have arrived there.
    """

    received: int
    acknowledged: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class ConnectionLimits:
    """Limits on what a connection may cost.

    Attributes:
        connections: Number of connections; above three quarters of it, unused ones are closed.
        request_bytes: Bytes that one request may have, with its headers.
        unasked_bytes: Bytes that all connections together may have received since their last requests.
        slack_bytes: Bytes that a connection may receive besides requests.
        resets: Calls since its last request that a connection may end before they have a request or an answer.
        strikes: Connections of a host that are closed as floods within some ten seconds before the host is barred.
        newcomers: New connections without a request that a host may make at once before it is barred.
        newcomers_a_s: Rate at which they are forgotten.
        barred_s: Time for which a barred host can make no new connection, in seconds: its next attempt after that
            succeeds.
        slack_bytes_a_s: Rate at which received bytes are forgotten: pings of a long watch are no flood.
        first_request_s: Time for the first request of a connection, in seconds.
        suspicion_s: Time for which a flood makes other connections of its host suspect, in seconds: those without a
            request may then receive only the slack.
    """

    connections: int = 4096
    request_bytes: int = 4 * 2**20
    unasked_bytes: int = 96 * 2**20
    slack_bytes: int = 256 * 2**10
    resets: int = 2000
    strikes: int = 3
    newcomers: int = 500
    newcomers_a_s: float = 100.0
    barred_s: float = 5.0
    slack_bytes_a_s: float = 4096.0
    first_request_s: float = 30.0
    suspicion_s: float = 60.0


@dataclass(frozen=True, slots=True)
class CallsSince[P]:
    """Calls of admitted callers since the last look, by connection.

    Attributes:
        asked: Connections on which requests have arrived.
        ended: Number of calls that have ended, or were refused.
        open: Number of open calls.
    """

    asked: frozenset[P] = frozenset()
    ended: Mapping[P, int] = field(default_factory=dict)
    open: Mapping[P, int] = field(default_factory=dict)


_STRIKES_A_S = 0.2
"""Rate at which strikes are forgotten."""


@dataclass(slots=True)
class _Host:
    """Conduct of a host.

    Attributes:
        strikes: Closed floods that are not forgotten.
        newcomers: New connections without a request that are not forgotten.
        barred_until_s: Time until which it is barred.
    """

    strikes: float = 0.0
    newcomers: float = 0.0
    barred_until_s: float = 0.0


@dataclass(slots=True)
class _Account:
    """Account of one connection.

    Attributes:
        since_s: Time at which it was first seen.
        explained: Bytes that its requests and the passing of time explain.
        asked_s: Time of its last request; None: there was none.
        unasked: Bytes beyond the explained ones.
        owed: Calls that have ended without a request since the last one, and were sent no answer so far.
        acknowledged: Bytes of the server that had arrived at the last look.
    """

    since_s: float
    explained: float
    asked_s: float | None = None
    unasked: float = 0.0
    owed: int = 0
    acknowledged: int = 0

    def explain(self, traffic: Traffic, ended: int, forgotten: float) -> None:
        """Explain what has arrived without a request.

        Args:
            traffic: Bytes since the connection was made.
            ended: Calls that have ended since the last look.
            forgotten: Bytes that the time since the last look explains.
        """
        self.owed += ended
        # Another connection may have got the same port meanwhile, and have been sent less.
        answered = min(self.owed, max(traffic.acknowledged - self.acknowledged, 0) // _ANSWER_BYTES)
        self.owed -= answered
        if answered and not self.owed:
            # A server that answers every call has taken all that came with them.
            self.explained = traffic.received
        else:
            self.explained = min(self.explained + forgotten + answered * _REFUSED_BYTES, traffic.received)


class Ledger:
    """Account of what connections have received and what requests explain of it.

    Args:
        limits: Limits of connections.
    """

    def __init__(self, limits: ConnectionLimits) -> None:
        self._limits = limits
        self._accounts: dict[Peer, _Account] = {}
        self._suspect_until_s: dict[str, float] = {}
        self._hosts: dict[str, _Host] = {}
        # Floods that were closed and have not gone yet: each is one strike.
        self._shut: set[Peer] = set()
        self._last_s: float | None = None

    def look(self, traffic: Mapping[Peer, Traffic], calls: CallsSince[Peer], now_s: float) -> dict[Peer, CloseReason]:
        """Return the connections to close, with the reason.

        Args:
            traffic: Bytes of each connection since it was made.
            calls: Calls since the last look.
            now_s: Current time, in seconds of a monotonic clock.
        """
        accounts = self._accounts
        passed_s = 0.0 if self._last_s is None else now_s - self._last_s
        forgotten = passed_s * self._limits.slack_bytes_a_s
        self._last_s = now_s
        self._forget(passed_s, now_s)
        self._shut &= traffic.keys()
        for gone in accounts.keys() - traffic.keys():
            del accounts[gone]
        open_calls = calls.open
        for peer, bytes_of_peer in traffic.items():
            account = accounts.get(peer)
            is_new = account is None
            if account is None:
                account = accounts[peer] = _Account(now_s, 0.0)
            if peer in calls.asked:
                account.asked_s, account.explained, account.owed = now_s, bytes_of_peer.received, 0
            else:
                account.explain(bytes_of_peer, calls.ended.get(peer, 0), 0.0 if is_new else forgotten)
                if is_new and peer not in self._shut:
                    self._hosts.setdefault(peer[0], _Host()).newcomers += 1
            account.unasked = bytes_of_peer.received - account.explained
            account.acknowledged = bytes_of_peer.acknowledged
        closed = self._flooding(open_calls, now_s) | self._silent(open_calls, now_s)
        closed |= self._unused(open_calls, closed)
        for host in self._hosts.values():
            if host.strikes >= self._limits.strikes or host.newcomers > self._limits.newcomers:
                host.barred_until_s = now_s + self._limits.barred_s
                host.strikes = host.newcomers = 0.0
        for peer in closed:
            del accounts[peer]
        return closed

    @property
    def is_alert(self) -> bool:
        """True if some host is suspect."""
        return bool(self._suspect_until_s)

    @property
    def barred(self) -> frozenset[str]:
        """Hosts that can make no new connections for now."""
        return frozenset(name for name, host in self._hosts.items() if host.barred_until_s)

    def _forget(self, passed_s: float, now_s: float) -> None:
        """Forget what hosts have done, by and by."""
        for name, host in list(self._hosts.items()):
            host.strikes = max(host.strikes - passed_s * _STRIKES_A_S, 0.0)
            host.newcomers = max(host.newcomers - passed_s * self._limits.newcomers_a_s, 0.0)
            if host.barred_until_s <= now_s:
                host.barred_until_s = 0.0
                if not host.strikes and not host.newcomers:
                    del self._hosts[name]

    def _flooding(self, open_calls: Mapping[Peer, int], now_s: float) -> dict[Peer, CloseReason]:
        """Connections that have received more than requests can have, the worst first."""
        limits, suspects = self._limits, self._suspect_until_s
        closed: dict[Peer, CloseReason] = {}
        for host in [host for host, until_s in suspects.items() if until_s <= now_s]:
            del suspects[host]
        total = 0.0
        for peer, account in self._accounts.items():
            total += account.unasked
            if account.owed > limits.resets:
                closed[peer] = CloseReason.RESETS
                total -= account.unasked
                continue
            if account.unasked <= limits.slack_bytes:
                continue
            # One request may be on its way before its call has begun.
            requests = open_calls.get(peer, 0) + (account.asked_s is not None or peer[0] not in suspects)
            if account.unasked > limits.slack_bytes + requests * limits.request_bytes:
                closed[peer] = CloseReason.BYTES
                total -= account.unasked
        if total > limits.unasked_bytes:
            for peer, account in sorted(self._accounts.items(), key=lambda item: -item[1].unasked):
                if peer not in closed:
                    closed[peer] = CloseReason.BYTES_TOGETHER
                    total -= account.unasked
                    if total <= limits.unasked_bytes / 2:
                        break
        for peer in closed:
            host = peer[0]
            suspects[host] = now_s + limits.suspicion_s
            if peer not in self._shut:
                self._shut.add(peer)
                self._hosts.setdefault(host, _Host()).strikes += 1
        return closed

    def _silent(self, open_calls: Mapping[Peer, int], now_s: float) -> dict[Peer, CloseReason]:
        """Connections on which no request has arrived in time."""
        latest_s = now_s - self._limits.first_request_s
        return {
            peer: CloseReason.SILENCE
            for peer, account in self._accounts.items()
            if account.asked_s is None and account.since_s <= latest_s and not open_calls.get(peer)
        }

    def _unused(self, open_calls: Mapping[Peer, int], closed: Mapping[Peer, str]) -> dict[Peer, CloseReason]:
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
        found: dict[Peer, CloseReason] = {}
        while unused and len(found) < excess:
            host = max(unused, key=lambda name: sizes[name])
            found[unused[host].pop()] = CloseReason.UNUSED
            sizes[host] -= 1
            if not unused[host]:
                del unused[host]
        return found

    def _use(self, peer: Peer) -> tuple[bool, float]:
        """Return the order of connections by their use, the least used one first."""
        account = self._accounts[peer]
        return (False, account.since_s) if account.asked_s is None else (True, account.asked_s)
