"""Variants of a problem without some of its constraints, over one set of Boolean variables.

The effect of an event depends on few constraints, so it is encoded once for each choice of the ranges that the event
could leave. Each condition is encoded once for all events and variants.
"""

from collections.abc import Iterable
from copy import copy
from typing import Any

from robosc.automata.state import Subject
from robosc.automata.structure import System
from robosc.explanation.constraints import RelaxableConstraint, without_marks, without_ranges
from robosc.synthesis.encoding import Encoding
from robosc.synthesis.expression_encoder import ExpressionEncoder
from robosc.synthesis.fixed_point import FixedPoint, Problem
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.transitions import Steps, transition_of


class Problems:
    """Variants of a problem without some of its constraints.

    Args:
        encoding: The variables.
        monitor: Monitor of the waiting caller.
    """

    def __init__(self, encoding: Encoding, monitor: ProgressMonitor) -> None:
        self._encoding = encoding
        self._monitor = monitor
        # Copies share the manager and its variables; only what their automata may do and have marked differs.
        self._variant = copy(encoding)
        self._encoder = ExpressionEncoder(encoding)
        self._events = {event.name: event for event in encoding.system.events}
        self._written = _written(encoding.system)
        self._base: dict[tuple[str, frozenset[RelaxableConstraint]], Steps] = {}
        self._conditions: dict[int, Any] = {}
        self._invariants: dict[int, Any] = {}
        self._on_event: dict[str, list[int]] = {}
        for place, item in enumerate(encoding.system.conditions):
            self._on_event.setdefault(item.event, []).append(place)

    def without(self, dropped: Iterable[RelaxableConstraint]) -> tuple[FixedPoint, Problem]:
        """The problem without some constraints, and its solver.

        Raises:
            SynthesisCancelled: The work is to end.
        """
        constraints = tuple(dropped)
        conditions = {place for item in constraints for place in item.conditions}
        invariants = {place for item in constraints for place in item.invariants}
        ranges = frozenset(item for item in constraints if item.range is not None)
        steps = tuple(
            self.steps(event, ranges).under(
                self._encoding.all_of(
                    self.condition(place) for place in self.conditions_on(event) if place not in conditions
                )
            )
            for event in self._events
        )
        kept = (place for place in range(len(self._encoding.system.invariants)) if place not in invariants)
        safe = self._encoding.all_of([self._encoding.valid_states(), *(self.invariant(place) for place in kept)])
        marked = copy(self._encoding)
        marked.system = without_marks(self._encoding.system, constraints)
        return FixedPoint(marked, self._monitor), Problem(steps, safe)

    def steps(self, event: str, ranges: Iterable[RelaxableConstraint] = ()) -> Steps:
        """Return the steps of an event without some ranges, under its event conditions."""
        mine = frozenset(item for item in ranges if item.range in self._written.get(event, ()))
        found = self._base.get((event, mine))
        if found is None:
            self._monitor.check_stop()
            self._variant.system = without_ranges(self._encoding.system, mine)
            transition = transition_of(self._variant, self._events[event])
            found = self._base[event, mine] = Steps(self._encoding, transition)
        return found

    def conditions_on(self, event: str) -> tuple[int, ...]:
        """Places of the conditions on an event."""
        return tuple(self._on_event.get(event, ()))

    def condition(self, place: int) -> Any:
        """Return the states where an event condition is true."""
        if place not in self._conditions:
            self._monitor.check_stop()
            self._conditions[place] = self._encoder.holds(self._encoding.system.conditions[place].condition)
        return self._conditions[place]

    def invariant(self, place: int) -> Any:
        """Return the states where an invariant is true."""
        if place not in self._invariants:
            self._monitor.check_stop()
            self._invariants[place] = self._encoder.holds(self._encoding.system.invariants[place])
        return self._invariants[place]

    def written_by(self, event: str, ranges: Iterable[RelaxableConstraint]) -> tuple[RelaxableConstraint, ...]:
        """The ranges that an event could leave."""
        return tuple(item for item in ranges if item.range in self._written.get(event, ()))


def _written(system: System) -> dict[str, frozenset[Subject]]:
    """The variables that each event updates."""
    found: dict[str, set[Subject]] = {}
    for automaton in system.automata:
        for edge in automaton.edges:
            places = (Subject(automaton.name, update.variable) for update in edge.updates)
            found.setdefault(edge.event, set()).update(places)
    return {event: frozenset(places) for event, places in found.items()}
