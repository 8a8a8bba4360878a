"""Limits on open calls, in total and for each caller, watches included."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from robosc_api.calls import call_under_way, peer_of
from robosc_api.connection_watch import Arrivals, is_health_check
from robosc_api.layers import Layer, behaviour_of, with_behaviour
from robosc_api.security import caller_of, is_loopback_peer, network_of
from robosc_server.tasks.task import Reason, RefusedError

HEALTH_CALLS = 1000
"""Health checks that are open at once, from this machine and from elsewhere: they need no token, and so have slots of
their own."""

HEALTH_CALLS_PER_CALLER = 50
"""Enough for probes, and for channels that watch their server."""

_RETRY_S = 1.0


@dataclass(frozen=True, slots=True)
class CallLimits:
    """Limits on the calls that are open at once.

    Attributes:
        calls: Open calls of all callers.
        per_caller: Open calls of one caller, unless its token says otherwise.
    """

    calls: int
    per_caller: int


class OpenCalls(Layer):
    """Layer that counts open calls, and refuses calls beyond the limits.

    It stands inside the guard, which identifies the caller, and outside of all waits. It is never the outermost layer.

    Args:
        limits: Limits, health checks aside.
        identify: Function that returns the caller behind the call of a context.
        health: Limits of health checks.
        arrivals: Layer to which the connection of each open call is reported; None: none.
    """

    def __init__(
        self,
        limits: CallLimits,
        identify: Callable[[Any], str] = caller_of,
        health: CallLimits = CallLimits(HEALTH_CALLS, HEALTH_CALLS_PER_CALLER),
        arrivals: Arrivals | None = None,
    ) -> None:
        super().__init__()
        self._identify = identify
        by_connection = arrivals or Arrivals()
        self._slots = _CallSlots(limits, by_connection)
        self._health_slots = _CallSlots(health, by_connection, are_checks=True)
        # For monitoring on this machine, which other hosts cannot crowd out.
        self._own_health_slots = _CallSlots(health, by_connection, are_checks=True)

    @property
    def count(self) -> int:
        """Calls that are open, health checks aside."""
        return self._slots.taken

    def wrap(self, inner: Any, method: str) -> Any:
        """Return a handler that counts its open calls and refuses those beyond the limits."""
        behaviour = behaviour_of(inner)
        identify, slots = self._identify, self._slots

        # These are plain functions, which return the handler's coroutine: one more coroutine would delay every call.
        def counted(request: Any, context: Any) -> Any:
            slots.take(network_of(identify(context)), context)
            return behaviour(request, context)

        def counted_health_check(request: Any, context: Any) -> Any:
            is_own = is_loopback_peer(peer_of(context))
            slots = self._own_health_slots if is_own else self._health_slots
            slots.take(network_of(identify(context)), context)
            return behaviour(request, context)

        return with_behaviour(inner, counted_health_check if is_health_check(method) else counted)


class _CallSlots:
    """Places for the calls of some methods.

    Args:
        limits: Limits on the calls.
        arrivals: Layer that is notified of each call.
        are_checks: True if the calls are health checks.

    Attributes:
        taken: Number of slots that are taken.
    """

    def __init__(self, limits: CallLimits, arrivals: Arrivals, *, are_checks: bool = False) -> None:
        self._limits, self._arrivals, self._are_checks = limits, arrivals, are_checks
        self._by_caller: dict[str, int] = {}
        self.taken = 0

    def take(self, caller: str, context: Any) -> None:
        """Take a slot until the end of the call.

        Args:
            caller: Name of its caller.
            context: Context of the call.

        Raises:
            RefusedError: There is no slot for this caller; none is taken.
        """
        peer = peer_of(context)
        count = self._by_caller.get(caller, 0)
        call = call_under_way()
        entry = call.entry
        limit = self._limits.per_caller if entry is None or entry.quota.calls is None else entry.quota.calls
        if count >= limit:
            self._refused(peer)
            message = f"the caller has reached its limit of {limit} open calls, watches included; try again later"
            raise RefusedError(Reason.QUOTA_EXCEEDED, message, _RETRY_S)
        if self.taken >= self._limits.calls:
            self._refused(peer)
            raise RefusedError(
                Reason.SERVER_BUSY, "the server has reached its limit of open calls; try again later", _RETRY_S
            )
        self._by_caller[caller] = count + 1
        self.taken += 1
        # An unread response keeps the call open after the handler has returned.
        self._arrivals.begun(peer)
        call.at_end.append(partial(self._release, caller, peer))

    def _refused(self, peer: str) -> None:
        if not self._are_checks:
            self._arrivals.refused(peer)

    def _release(self, caller: str, peer: str) -> None:
        self._arrivals.ended(peer, is_check=self._are_checks)
        self.taken -= 1
        left = self._by_caller[caller] - 1
        if left:
            self._by_caller[caller] = left
        else:
            del self._by_caller[caller]
