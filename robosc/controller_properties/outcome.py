"""Findings about a controller: plain values."""

import msgspec

from robosc.automata.compile import State
from robosc.supervisor import ControllerProperties, PropertyResult


class Livelock(msgspec.Struct, frozen=True):
    """Silent steps that do not end.

    Attributes:
        trace: The events that lead into the cycle.
        cycle: The silent steps that repeat for ever.
    """

    trace: tuple[str, ...]
    cycle: tuple[str, ...]

    @property
    def size(self) -> tuple[int, int]:
        """Number of events to read: of the trace and of the cycle."""
        return len(self.trace), len(self.cycle)


class Order(msgspec.Struct, frozen=True):
    """Silent steps in one order.

    Attributes:
        events: The steps; if the order does not end, the steps before its cycle.
        cycle: The steps that repeat for ever; empty if the order ends.
        end: The stable state at the end, or None if the order does not end.
        asked: Actions whose cancel the executor has asked for at the end.
    """

    events: tuple[str, ...]
    cycle: tuple[str, ...]
    end: State | None
    asked: tuple[str, ...] = ()


class Conflict(msgspec.Struct, frozen=True):
    """Silent steps whose order matters.

    Attributes:
        trace: The events that lead to the state in which they are enabled.
        chosen: The order that the executor takes.
        other: Another order, with another outcome.
    """

    trace: tuple[str, ...]
    chosen: Order
    other: Order


class Blocking(msgspec.Struct, frozen=True):
    """A state from which no marked state can be reached under control.

    Attributes:
        trace: The events that lead there.
        states: This state and the stable states that can be reached from it.
    """

    trace: tuple[str, ...]
    states: tuple[State, ...]


class ForbiddenCancel(msgspec.Struct, frozen=True):
    """A cancel that the executor has asked for and that the supervisor forbids.

    Attributes:
        trace: The events that lead there.
        action: The action.
        event: Its cancel event.
        state: The state there.
        fallen: Numbers of the action's requirements, from 0, that do not hold there.
    """

    trace: tuple[str, ...]
    action: str
    event: str
    state: State
    fallen: tuple[int, ...]


class Properties(msgspec.Struct, frozen=True):
    """The properties of a controller.

    Attributes:
        finite_response: Result of checking that silent steps end.
        confluence: Result of checking that their order does not matter.
        nonblocking: Result of checking that a marked state stays reachable under control.
        method: Method of the check, in words.
        livelock: Reason why there is no finite response, or None.
        conflict: Reason why there is no confluence, or None.
        blocking: Reason why it is not nonblocking under control, or None.
        cancels: Result of checking that the supervisor allows every cancel that the executor asks for; None if it asks
            for none.
        forbidden: For each action whose cancel is forbidden somewhere, where that is so.
    """

    finite_response: PropertyResult
    confluence: PropertyResult
    nonblocking: PropertyResult
    method: str
    livelock: Livelock | None = None
    conflict: Conflict | None = None
    blocking: Blocking | None = None
    cancels: PropertyResult | None = None
    forbidden: tuple[ForbiddenCancel, ...] = ()

    def certified(self) -> ControllerProperties:
        """Return the properties that stand in a certificate."""
        return ControllerProperties(self.finite_response, self.confluence, self.nonblocking, self.method, self.cancels)
