"""Choices between edges that nobody controls, for front ends whose language does not allow them."""

from collections.abc import Callable
from dataclasses import dataclass

from robosc.automata.structure import System
from robosc.synthesis.engines import EngineOptions
from robosc.synthesis.transitions import choices
from robosc.synthesis.workspace import workspace


@dataclass(frozen=True, slots=True)
class ControllableChoice:
    """A location in which an automaton has several edges to take for a controllable event.

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


def controllable_choices(
    system: System, *, engine: str | EngineOptions = "auto", should_stop: Callable[[], bool] = lambda: False
) -> tuple[ControllableChoice, ...]:
    """The choices between edges of controllable events, in the system's order.

    Edges count that the guards of all automata and the ranges allow together in some state, reached or not; what plant
    conditions and invariants and requirements say of it does not.

    Args:
        system: The system.
        engine: Name of the engine for decision diagrams, or its options.
        should_stop: Function called before each step of the work with one event; once it returns true, the work ends.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        NodeLimitError: Diagrams became larger than the options allow.
        UnknownEngineError: There is no such engine.
        UnsupportedModelError: An expression computes with too many doubles.
    """
    found: list[ControllableChoice] = []
    with workspace(system, engine, should_stop, lambda progress: None) as place:
        for event in system.events:
            if event.is_controllable:
                place.monitor.check_stop()
                found += (ControllableChoice(event.name, *where) for where in choices(place.encoding, event))
    return tuple(found)
