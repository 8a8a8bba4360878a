"""Pending orders of operators, and stops that are on their way to the loop."""

import logging
from collections import deque
from enum import StrEnum

from robosc_bridge.daemon.states import OperatorCommand, Order

_log = logging.getLogger(__name__)

HALTS = frozenset({OperatorCommand.STOP, OperatorCommand.STANDBY, OperatorCommand.QUIT})
"""They take effect before the loop hears of them."""


class Until(StrEnum):
    """Condition that an order waits for."""

    STARTED = "started"
    RESTING = "resting"
    RESET = "reset"


def unanswered(why: str) -> None:
    """For who does not want to know what became of an order."""


class Orders:
    """Orders without an answer so far; used by the loop's thread, but for `halting`."""

    def __init__(self) -> None:
        self._open: list[tuple[Until, Order]] = []
        # Each end of a deque may be used by another thread, and by a signal handler.
        self._halting: deque[Order] = deque()

    def halting(self, order: Order) -> None:
        """An order that stops is on its way to the loop; from any thread or signal handler."""
        self._halting.append(order)

    def arrived(self, order: Order) -> None:
        """The loop has taken an order up."""
        if order.command in HALTS:
            self._halting.popleft()

    @property
    def is_halt_coming(self) -> bool:
        """True if an order that stops has not been taken up by the loop yet: it wins over what came before it."""
        return bool(self._halting)

    @property
    def is_stop_coming(self) -> bool:
        """True if one of these orders is an operator's stop, which holds until an operator ends it."""
        # Another thread may append meanwhile.
        return any(order.command is OperatorCommand.STOP for order in tuple(self._halting))

    def wait(self, until: Until, order: Order) -> None:
        """An order is answered later."""
        self._open.append((until, order))

    def is_waiting(self, until: Until) -> bool:
        """Return True if an order waits for a condition."""
        return any(item is until for item, _ in self._open)

    def resolve(self, until: Until, why: str = "") -> None:
        """Answer the orders that wait for a condition: it is there, or a reason says why it never will be."""
        settled = [order for item, order in self._open if item is until]
        self._open = [(item, order) for item, order in self._open if item is not until]
        for order in settled:
            answer(order, why)

    def close(self, why: str) -> None:
        """Answer every open order."""
        for until in Until:
            self.resolve(until, why)


def answer(order: Order, why: str) -> None:
    """Answer an order: once only."""
    if why:
        _log.warning("%s%s: %s", order.command, f" ({order.by})" if order.by else "", why)
    try:
        order.answer(why)
    except Exception:  # Whoever asked has gone; the loop has not.
        _log.exception("an answer could not be given")
