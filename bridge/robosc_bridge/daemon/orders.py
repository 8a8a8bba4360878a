"""Pending orders of operators, stops on their way to the loop, and latched reasons, which hold until a reset."""

import logging
from collections import deque
from enum import StrEnum

from robosc_bridge.daemon.states import OperatorCommand, Order
from robosc_bridge.daemon.threads.reports import SafetyNotice
from robosc_bridge.safety import LATCHING, Reason, SafetyLayer

_log = logging.getLogger(__name__)

HALTS = frozenset({OperatorCommand.STOP, OperatorCommand.STANDBY, OperatorCommand.QUIT})
"""They take effect before the loop hears of them."""


class Until(StrEnum):
    """Condition that an order waits for."""

    STARTED = "started"
    RESTING = "resting"
    RESET = "reset"


def unanswered(why: str) -> None:
    """Ignore the answer to an order."""


class Orders:
    """Orders without an answer so far; used by the loop's thread, except for `halting`."""

    def __init__(self) -> None:
        self._open: list[tuple[Until, Order]] = []
        # Each end of a deque may be used by another thread, and by a signal handler.
        self._halting: deque[Order] = deque()

    def halting(self, order: Order) -> None:
        """Note that an order which stops is on its way to the loop; from any thread or signal handler."""
        self._halting.append(order)

    def arrived(self, order: Order) -> None:
        """Note that the loop has taken an order up."""
        if order.command in HALTS:
            self._halting.popleft()

    @property
    def is_halt_coming(self) -> bool:
        """True if an order that stops waits for the loop: it overrides all earlier orders."""
        return bool(self._halting)

    @property
    def is_stop_coming(self) -> bool:
        """True if one of these orders is an operator's stop, which holds until an operator ends it."""
        # Another thread may append meanwhile.
        return any(order.command is OperatorCommand.STOP for order in tuple(self._halting))

    def wait(self, until: Until, order: Order) -> None:
        """Keep an order that is answered later, when its condition holds."""
        self._open.append((until, order))

    def is_waiting(self, until: Until) -> bool:
        """Return True if an order waits for a condition."""
        return any(item is until for item, _ in self._open)

    def resolve(self, until: Until, why: str = "") -> None:
        """Answer the orders that wait for a condition: it holds, or `why` says that it never will."""
        settled = [order for item, order in self._open if item is until]
        self._open = [(item, order) for item, order in self._open if item is not until]
        for order in settled:
            answer(order, why)

    def close(self, why: str) -> None:
        """Answer every open order."""
        for until in Until:
            self.resolve(until, why)


def answer(order: Order, why: str) -> None:
    """Answer an order."""
    if why:
        _log.warning("%s%s: %s", order.command, f" ({order.by})" if order.by else "", why)
    try:
        order.answer(why)
    except Exception:  # The operator may have gone; the loop goes on.
        _log.exception("an answer could not be given")


# An operator's stop is no fault; a fault of the supervisor is reported separately.
_GRAVE = frozenset(LATCHING) - {Reason.OPERATOR_STOP, Reason.SUPERVISOR_FAULT}


class Latches:
    """Reasons that have latched, and their reset; used by the loop's thread.

    Args:
        safety: The safety layer.
        orders: Orders, which know whether a stop is on its way.

    Attributes:
        notice: Last notice of the safety layer.
    """

    def __init__(self, safety: SafetyLayer, orders: Orders) -> None:
        self.notice = SafetyNotice((), ())
        self._safety = safety
        self._orders = orders

    @property
    def latched(self) -> tuple[Reason, ...]:
        """Reasons that hold until a reset."""
        return tuple(reason for reason in self.notice.reasons if reason in _GRAVE)

    def held(self, *, is_stopped: bool) -> str:
        """Return all latched reasons, as sentences; empty: there is none.

        Args:
            is_stopped: True if the operator has stopped the robot, which may not have been reported yet.
        """
        reasons = [reason for reason in self.notice.reasons if reason in LATCHING]
        if is_stopped and Reason.OPERATOR_STOP not in reasons:
            reasons.append(Reason.OPERATOR_STOP)
        return " ".join(reasons)

    def release(self) -> str:
        """Reset the latched reasons of the safety layer; return why it refuses, or an empty text."""
        if self._orders.is_stop_coming:
            return str(Reason.OPERATOR_STOP)
        if remaining := self._safety.reset():
            wait = " The motors have not let go yet; try again in a moment." if self._safety.is_letting_go else ""
            return " ".join(remaining) + wait
        if self._orders.is_stop_coming:
            # It came between the two, and may have been forgotten with the others.
            self._safety.operator_stop()
            return str(Reason.OPERATOR_STOP)
        # The next notice comes with the next exchange only.
        reasons = tuple(reason for reason in self.notice.reasons if reason not in LATCHING)
        self.notice = SafetyNotice(reasons, self.notice.warnings)
        return ""
