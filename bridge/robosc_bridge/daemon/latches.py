"""Latched reasons of the safety layer, as the loop knows them: they hold until a reset or a resume."""

from robosc_bridge.daemon.orders import Orders
from robosc_bridge.daemon.reports import SafetyNotice
from robosc_bridge.safety import LATCHING, Reason, SafetyLayer

# An operator's stop is no fault; what is wrong with the supervisor is told by itself.
_GRAVE = frozenset(LATCHING) - {Reason.OPERATOR_STOP, Reason.SUPERVISOR_FAULT}


class Latches:
    """Reasons that have latched, and how they are forgotten; used by the loop's thread.

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
        """Those that only a reset ends."""
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
        """Let the safety layer forget all of them; why it does not."""
        if self._orders.is_stop_coming:
            return str(Reason.OPERATOR_STOP)
        remaining = self._safety.reset()
        if remaining:
            return " ".join(remaining)
        if self._orders.is_stop_coming:
            # It came between the two, and may have been forgotten with the others.
            self._safety.operator_stop()
            return str(Reason.OPERATOR_STOP)
        # The next notice comes with the next exchange only.
        reasons = tuple(reason for reason in self.notice.reasons if reason not in LATCHING)
        self.notice = SafetyNotice(reasons, self.notice.warnings)
        return ""
