"""Nondeterministic choices between edges, for target languages without nondeterminism."""

from collections.abc import Callable

import msgspec

from robosc.automata.structure import System
from robosc.synthesis.engines import EngineOptions
from robosc.synthesis.transitions import choices
from robosc.synthesis.workspace import workspace


class EdgeChoice(msgspec.Struct, frozen=True):
    """A location in which an automaton has several edges to take for an event.

    Attributes:
        event: The event.
        automaton: The automaton.
        location: The location.
    """

    event: str
    automaton: str
    location: str

    def __str__(self) -> str:
        return f"{self.automaton}: {self.event} has several edges that can be taken in one state of {self.location}"


def edge_choices(
    system: System,
    *,
    is_controllable: bool | None = None,
    engine: str | EngineOptions = "auto",
    should_stop: Callable[[], bool] = lambda: False,
) -> tuple[EdgeChoice, ...]:
    """The choices between edges for one event, in the system's order.

    Edges count that the guards of all automata and the ranges allow together in some state, reached or not; what plant
    conditions and invariants and requirements say of it does not.

    Args:
        system: The system.
        is_controllable: True for the controllable events alone, False for the others; None for all.
        engine: Name of the engine for decision diagrams, or its options.
        should_stop: Function called before each step of the work with one event; once it returns true, the work ends.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        NodeLimitError: Diagrams became larger than the options allow.
        UnknownEngineError: There is no such engine.
        UnsupportedModelError: An expression computes with too many doubles.
    """
    found: list[EdgeChoice] = []
    with workspace(system, engine, should_stop, lambda progress: None) as place:
        for event in system.events:
            if is_controllable in (None, event.is_controllable):
                place.monitor.check_stop()
                found += (EdgeChoice(event.name, *where) for where in choices(place.encoding, event))
    return tuple(found)
