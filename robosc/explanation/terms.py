"""Automata in the model's words: states, parts with their places, and why events cannot happen."""

from collections.abc import Sequence

from robosc.automata.compile import NO_DATA, State, compile_expression, subjects_read
from robosc.automata.plants import communication_plant_name
from robosc.automata.state import Subject, subject_type, subjects
from robosc.automata.structure import System
from robosc.explanation.analysis import Hindrance, HindranceKind
from robosc.explanation.constraints import ConstraintKind, RelaxableConstraint
from robosc.explanation.explanations import Part, StateValues
from robosc.explanation.notation import requirement_text, value_text
from robosc.expressions import TRUE, Expression, Value, type_text
from robosc.expressions.text import automaton_text, expression_text
from robosc.model.places import Places
from robosc.model.structure import CommunicationKind, Model
from robosc.source import Location

MAXIMUM_TEXT = 300
"""Characters of a text of the model that are shown."""

MAXIMUM_NAMES = 8
"""Names, and values, that a sentence lists."""


class Terms:
    """The words of one model.

    Args:
        model: The model.
        places: Places of its parts.
        system: Its automata.
        constraints: Constraints that its problem could be without; requirements and invariants in the model's order.
    """

    def __init__(
        self, model: Model, places: Places, system: System, constraints: Sequence[RelaxableConstraint]
    ) -> None:
        self._model = model
        self._components = frozenset(item.name for item in model.components)
        self._places = places
        self._system = system
        self._constraints = tuple(constraints)
        self._subjects = {subject: place for place, subject in enumerate(subjects(system))}
        self._plants = {communication_plant_name(item): item for item in model.communications}
        requirements = [item for item in constraints if item.kind is ConstraintKind.REQUIREMENT]
        self._requirements = {item: number for number, item in enumerate(requirements)}
        self._by_condition = {place: item for item in constraints for place in item.conditions}
        self._by_invariant = {place: item for item in constraints for place in item.invariants}

    # States

    def state(self, state: State) -> StateValues:
        """A state, as `robosc explore` names it."""
        values = dict(zip(self._subjects, state, strict=True))
        return StateValues(
            components={
                item.name: str(values[Subject(item.name)]) for item in self._model.components if item.behaviour
            },
            variables={str(subject): value for subject, value in values.items() if subject.variable is not None},
            communications={
                self.automaton(name): str(values[Subject(name)])
                for name, item in self._plants.items()
                if item.kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION)
            },
        )

    def values_read(self, expression: Expression, state: State) -> str:
        """Return what a condition reads, with its values in a state; empty if it reads nothing."""
        read = sorted(subjects_read(expression), key=self._subjects.__getitem__)
        found = [self._value(subject, state[self._subjects[subject]]) for subject in read[:MAXIMUM_NAMES]]
        return ", ".join(found) + (", ..." if len(read) > MAXIMUM_NAMES else "")

    def _value(self, subject: Subject, value: Value) -> str:
        if subject.variable is None:
            return f"{self.automaton(subject.automaton)} is {value}"
        return f"{subject} is {value_text(value)}"

    def automaton(self, name: str) -> str:
        """Return the name of an automaton in the model."""
        return automaton_text(name, self._components)

    def _text(self, expression: Expression) -> str:
        return expression_text(expression, self._components)

    # Parts

    def part(self, constraint: RelaxableConstraint) -> Part:
        """Return the part of the model that a constraint is."""
        text, location = self._described(constraint)
        return Part(str(constraint.kind), _cut(text), location)

    def _described(self, item: RelaxableConstraint) -> tuple[str, Location]:
        if item.kind is ConstraintKind.REQUIREMENT:
            number = self._requirements[item]
            return requirement_text(self._model.requirements[number], self._components), self._places.requirements[
                number
            ]
        if item.invariants:
            (place,) = item.invariants
            invariant = self._model.invariants[place]
            word = "never" if invariant.is_never else "always"
            return f"requirement {word} {self._text(invariant.expression)}", self._places.invariants[place]
        if item.conditions:
            (place,) = item.conditions
            event = self._system.conditions[place].event
            name = event.rpartition(".")[0]
            return f"{event} only where a requirement on {name} does not hold", self._places.communications[name]
        if item.range is not None:
            component, variable = item.range.automaton, item.range.variable or ""
            text = f"the range of {item.range}: {type_text(subject_type(self._system, item.range))}"
            return text, self._places.variables[component, variable]
        return self._marking(str(item.marking))

    def _marking(self, automaton: str) -> tuple[str, Location]:
        if automaton in self._plants:
            location = self._places.communications[self._plants[automaton].name]
            return f"that {self.automaton(automaton)} gets back to idle", location
        marked = sorted(self._system.automaton(automaton).marked)
        shown = ", ".join(marked[:MAXIMUM_NAMES]) + (", ..." if len(marked) > MAXIMUM_NAMES else "")
        return f"that {automaton} gets to a marked state ({shown or 'none'})", self._places.components[automaton]

    def condition_part(self, place: int) -> Part:
        """The part of the model that brings an event condition."""
        return self.part(self._by_condition[place])

    def invariant_part(self, place: int) -> Part:
        """The part of the model that brings an invariant."""
        return self.part(self._by_invariant[place])

    def automaton_part(self, name: str) -> Part:
        """The component or communication that an automaton stands for."""
        if name in self._plants:
            communication = self._plants[name].name
            return Part("communication", communication, self._places.communications[communication])
        return Part("component", name, self._places.components[name])

    # Sentences

    def hindered(self, item: Hindrance, state: State) -> tuple[str, Part | None]:
        """Return the reason why an event cannot happen in a state, and the part of the model that is the cause."""
        match item.kind:
            case HindranceKind.BEHAVIOUR:
                name = str(item.automaton)
                return self._behaviour(name, item.event, state), self.automaton_part(name)
            case HindranceKind.RANGE if item.range is not None and item.range.range is not None:
                subject = item.range.range
                now = value_text(state[self._subjects[subject]])
                return f"it would take {subject}, which is {now}, out of its range", self.part(item.range)
            case HindranceKind.REQUIREMENT if item.condition is not None:
                part = self.condition_part(item.condition)
                condition = self._system.conditions[item.condition].condition
                values = self.values_read(condition, state)
                is_unknown = compile_expression(condition, self._subjects)(state, NO_DATA) is None
                why = ", for its value is unknown" if is_unknown else ""
                return f"'{part.text}' forbids it{why}" + (f": {values}" if values else ""), part
            case _:
                return "synthesis forbids it, because of what can follow", None

    def _behaviour(self, name: str, event: str, state: State) -> str:
        location = state[self._subjects[Subject(name)]]
        edges = [edge for edge in self._system.automaton(name).edges if edge.event == event and edge.source == location]
        where = f"{self.automaton(name)} is {location}"
        if not edges:
            return f"{where}, where it has no transition on {event}"
        guards = [_cut(self._text(edge.guard)) for edge in edges if edge.guard != TRUE]
        return f"{where}, where {' and '.join(guards[:MAXIMUM_NAMES])} is not true"


def _cut(text: str) -> str:
    return text if len(text) <= MAXIMUM_TEXT else text[: MAXIMUM_TEXT - 4] + " ..."
