"""Automata that come from no model of a robot, such as a CIF model, in words."""

from collections.abc import Mapping, Sequence

from robosc.automata import System, SystemPlaces
from robosc.automata.compile import State
from robosc.automata.state import Subject, whole_names
from robosc.explanation.constraints import RelaxableConstraint
from robosc.explanation.parts import Part, StateValues
from robosc.explanation.terms import Terms
from robosc.expressions import Expression, Type, Unary
from robosc.expressions.text import cif_text, cif_type_text
from robosc.source import Location


class SystemTerms(Terms):
    """The words of automata.

    Args:
        system: The automata, with plants and conditions in place of requirement automata (see `requirement_automata`).
        constraints: Constraints that can be left out of the problem.
        requirements: Requirement automata, with the places of their conditions.
        places: Places of the parts in a file, as far as they are known.
    """

    plants = "plants"
    edge = "edge for"

    def __init__(
        self,
        system: System,
        constraints: Sequence[RelaxableConstraint],
        requirements: Mapping[str, tuple[int, ...]],
        places: SystemPlaces,
    ) -> None:
        super().__init__(system, constraints, whole_names(system))
        self._requirements = frozenset(requirements)
        self._watching = {place: name for name, conditions in requirements.items() for place in conditions}
        self._places = places
        self._required = "supervisor" if system.is_controlled else "requirement"

    def _text(self, expression: Expression) -> str:
        return cif_text(expression)

    def _type_text(self, type_: Type) -> str:
        return cif_type_text(type_)

    def state(self, state: State) -> StateValues:
        """A state: the location of each automaton with several locations, and the value of each variable."""
        values = dict(zip(self._subjects, state, strict=True))
        return StateValues(
            components={
                self.automaton(item.name): str(values[Subject(item.name)])
                for item in self._system.automata
                if len(item.locations) > 1
            },
            variables={str(subject): value for subject, value in values.items() if subject.variable is not None},
            communications={},
        )

    def is_own(self, event: str) -> bool:
        """Return True for a controllable event."""
        return self._system.event(event).is_controllable

    def is_silent(self, event: str) -> bool:
        """Return False: automata have no silent steps."""
        return False

    def _described(self, item: RelaxableConstraint) -> tuple[str, Location | None]:
        if item.is_marker:
            return f"that a marked state is one with {self._text(self._system.marker)}", None
        if item.invariants:
            (place,) = item.invariants
            text = f"{self._required} invariant {self._text(self._system.invariants[place])}"
            return text, _at(self._places.invariants, place)
        first = item.conditions[0]
        if first in self._watching:
            return f"{self._required} {self._watching[first]}", self._places.automata.get(self._watching[first])
        events = [self._system.conditions[place].event for place in item.conditions]
        text = self._condition(events, self._system.conditions[first].condition)
        return f"{self._required} {text}", _at(self._places.conditions, first)

    def _condition(self, events: Sequence[str], condition: Expression) -> str:
        shown = events[0] if len(events) == 1 else f"{{{', '.join(events)}}}"
        match condition:
            case Unary(operator="not", operand=Unary(operator="holds", operand=disabling)):
                return f"{self._text(disabling)} disables {shown}"
            case _:
                return f"{shown} needs {self._text(condition)}"

    def _variable_place(self, variable: Subject) -> Location | None:
        return self._places.automata.get(variable.automaton)

    def automaton_part(self, name: str) -> Part:
        """The automaton."""
        kind = self._required if name in self._requirements else "plant"
        return Part(kind, self.automaton(name), self._places.automata.get(name))

    def _where(self, automaton: str, location: str) -> str:
        # The only location mostly has no name.
        if len(self._system.automaton(automaton).locations) == 1:
            return f"in {self.automaton(automaton)}"
        return super()._where(automaton, location)

    def _forbidding(self, place: int, state: State) -> str:
        if place in self._watching:
            return f": {self._without_edge(self._watching[place], self._system.conditions[place].event, state)}"
        return super()._forbidding(place, state)

    def _impossible(self, place: int, state: State) -> tuple[str, Part | None]:
        item = self._system.plant_conditions[place]
        text = f"plant {self._condition([item.event], item.condition)}"
        part = Part("condition", text, _at(self._places.plant_conditions, place))
        return f"'{text}' does not allow it{self._read(item.condition, state)}", part


def _at(places: Sequence[Location], place: int) -> Location | None:
    return places[place] if place < len(places) else None
