"""Automata in words: states, parts with their places, and why events cannot happen.

`Terms` has the words for automata of any origin, `ModelTerms` those for a robot's model, and `system_terms.SystemTerms`
those for automata that come from no model.
"""

from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence

from robosc.automata.compile import NO_DATA, State, compile_expression, subjects_read
from robosc.automata.plants import communication_plant_name
from robosc.automata.state import Subject, subject_type, subjects
from robosc.automata.structure import System
from robosc.conditions.requirements import invariant_text, requirement_text
from robosc.explanation.analysis import BlockingCause, BlockingCauseKind
from robosc.explanation.constraints import ConstraintKind, RelaxableConstraint
from robosc.explanation.notation import MAXIMUM_NAMES, cut, value_text
from robosc.explanation.parts import Part, StateValues
from robosc.expressions import TRUE, Expression, Type, Value, type_text
from robosc.expressions.text import automaton_text, expression_text
from robosc.model.places import Places
from robosc.model.structure import CommunicationKind, EventKind, Model, is_tau
from robosc.source import Location


class Terms(ABC):
    """The words of one system.

    Args:
        system: Its automata, all of them plants.
        constraints: Constraints that can be left out of its problem.
        whole_names: Names because of which texts write the names of automata in full; see `automaton_text`.

    Attributes:
        plants: Word for the plants.
        edge: Words for an edge, before its event.
    """

    plants: str
    edge = "transition on"

    def __init__(
        self, system: System, constraints: Sequence[RelaxableConstraint], whole_names: Collection[str]
    ) -> None:
        self._system = system
        self._constraints = tuple(constraints)
        self._whole_names = whole_names
        self._subjects = {subject: place for place, subject in enumerate(subjects(system))}
        self._by_condition = {place: item for item in constraints for place in item.conditions}
        self._by_invariant = {place: item for item in constraints for place in item.invariants}

    @property
    def constraints(self) -> tuple[RelaxableConstraint, ...]:
        """The constraints that can be left out of the problem."""
        return self._constraints

    # States

    @abstractmethod
    def state(self, state: State) -> StateValues:
        """A state, as `robosc explore` names it."""

    def _values_read(self, expression: Expression, state: State) -> str:
        """Return what a condition reads, with its values in a state; empty if it reads nothing."""
        read = sorted(subjects_read(expression), key=self._subjects.__getitem__)
        found = [self._value(subject, state[self._subjects[subject]]) for subject in read[:MAXIMUM_NAMES]]
        return ", ".join(found) + (", ..." if len(read) > MAXIMUM_NAMES else "")

    def _value(self, subject: Subject, value: Value) -> str:
        if subject.variable is None:
            return f"{self.automaton(subject.automaton)} is {value}"
        return f"{subject} is {value_text(value)}"

    def _read(self, expression: Expression, state: State) -> str:
        """Return the end of a sentence about a condition that is not true: why, and the values that it reads."""
        values = self._values_read(expression, state)
        is_unknown = compile_expression(expression, self._subjects)(state, NO_DATA) is None
        return (", for its value is unknown" if is_unknown else "") + (f": {values}" if values else "")

    def automaton(self, name: str) -> str:
        """Return the name of an automaton in a text."""
        return automaton_text(name, self._whole_names)

    def _text(self, expression: Expression) -> str:
        return expression_text(expression, self._whole_names)

    def _type_text(self, type_: Type) -> str:
        return type_text(type_)

    # Events

    @abstractmethod
    def is_own(self, event: str) -> bool:
        """Return True if the controller itself takes an event, without waiting for the environment."""

    @abstractmethod
    def is_silent(self, event: str) -> bool:
        """Return True if an event is never taken where it changes nothing."""

    # Parts

    def part(self, constraint: RelaxableConstraint) -> Part:
        """Return the part that a constraint is."""
        if constraint.range is not None:
            text = f"the range of {constraint.range}: {self._type_text(subject_type(self._system, constraint.range))}"
            location = self._variable_place(constraint.range)
        elif constraint.marking is not None:
            text, location = self._marking(constraint.marking)
        else:
            text, location = self._described(constraint)
        return Part(str(constraint.kind), cut(text), location)

    @abstractmethod
    def _described(self, item: RelaxableConstraint) -> tuple[str, Location | None]:
        """The text and the place of conditions, an invariant or the marker."""

    @abstractmethod
    def _variable_place(self, variable: Subject) -> Location | None: ...

    def _marking(self, automaton: str) -> tuple[str, Location | None]:
        """The text and the place of an automaton's marking."""
        marked = sorted(self._system.automaton(automaton).marked)
        shown = ", ".join(marked[:MAXIMUM_NAMES]) + (", ..." if len(marked) > MAXIMUM_NAMES else "")
        return f"that {automaton} gets to a marked state ({shown or 'none'})", self.automaton_part(automaton).location

    def condition_part(self, place: int) -> Part:
        """The part that an event condition comes from."""
        return self.part(self._by_condition[place])

    def invariant_part(self, place: int) -> Part:
        """The part that an invariant comes from."""
        return self.part(self._by_invariant[place])

    @abstractmethod
    def automaton_part(self, name: str) -> Part:
        """The part that an automaton stands for."""

    # Sentences

    def blocked(self, item: BlockingCause, state: State) -> tuple[str, Part | None]:
        """Return the reason why an event cannot happen in a state, and the part that is the cause."""
        match item.kind:
            case BlockingCauseKind.BEHAVIOUR:
                return self._behaviour(item, state)
            case BlockingCauseKind.RANGE if item.range is not None and item.range.range is not None:
                subject = item.range.range
                now = value_text(state[self._subjects[subject]])
                return f"it would take {subject}, which is {now}, out of its range", self.part(item.range)
            case BlockingCauseKind.REQUIREMENT if item.condition is not None:
                part = self.condition_part(item.condition)
                return f"'{part.text}' forbids it{self._forbidding(item.condition, state)}", part
            case _:
                return "synthesis forbids it, because of what can follow", None

    def _forbidding(self, place: int, state: State) -> str:
        """Return the end of a sentence about an event condition that is not true."""
        return self._read(self._system.conditions[place].condition, state)

    def _behaviour(self, item: BlockingCause, state: State) -> tuple[str, Part | None]:
        if item.automaton is not None:
            return self._without_edge(item.automaton, item.event, state), self.automaton_part(item.automaton)
        if item.plant_condition is not None:
            return self._impossible(item.plant_condition, state)
        if item.is_impossible:
            whose = "their invariants"
            if self._system.is_controlled:
                whose = "invariants of the supervisor" + " or their own" * bool(self._system.plant_invariants)
            return f"it would lead the {self.plants} only to what {whose} exclude", None
        return "no automaton has it in its alphabet", None

    def _impossible(self, place: int, state: State) -> tuple[str, Part | None]:
        """The sentence about a plant's event condition that is not true, and its part."""
        condition = self._system.plant_conditions[place].condition
        return f"'{cut(self._text(condition))}' is not true{self._read(condition, state)}", None

    def _without_edge(self, name: str, event: str, state: State) -> str:
        location = state[self._subjects[Subject(name)]]
        edges = [edge for edge in self._system.automaton(name).edges if edge.event == event and edge.source == location]
        where = self._where(name, str(location))
        if not edges:
            return f"{where} it has no {self.edge} {event}"
        guards = [cut(self._text(edge.guard)) for edge in edges if edge.guard != TRUE]
        return f"{where} {' and '.join(guards[:MAXIMUM_NAMES])} is not true"

    def _where(self, automaton: str, location: str) -> str:
        """Return the beginning of a sentence about a location of an automaton."""
        return f"{self.automaton(automaton)} is {location}, where"


class ModelTerms(Terms):
    """The words of one model.

    Args:
        model: The model.
        places: Places of its parts.
        system: Its automata.
        constraints: Constraints that can be left out of its problem; requirements and invariants in the model's order.
    """

    plants = "behaviours"

    def __init__(
        self, model: Model, places: Places, system: System, constraints: Sequence[RelaxableConstraint]
    ) -> None:
        super().__init__(system, constraints, frozenset(item.name for item in model.components))
        self._model = model
        self._places = places
        self._communications = {communication_plant_name(item): item for item in model.communications}
        requirements = [item for item in constraints if item.kind is ConstraintKind.REQUIREMENT]
        self._requirements = {item: number for number, item in enumerate(requirements)}

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
                for name, item in self._communications.items()
                if item.kind in (CommunicationKind.SERVICE, CommunicationKind.ACTION)
            },
        )

    def is_own(self, event: str) -> bool:
        """Return True if the executor itself takes an event.

        It also takes an action's cancel itself, even in a layer, where the caller may cancel as well.
        """
        return self._system.event(event).is_controllable or event.endswith(f".{EventKind.CANCEL}")

    def is_silent(self, event: str) -> bool:
        """Return True for a silent step of a behaviour."""
        return is_tau(event)

    def _described(self, item: RelaxableConstraint) -> tuple[str, Location | None]:
        if item.kind is ConstraintKind.REQUIREMENT:
            number = self._requirements[item]
            text = requirement_text(self._model.requirements[number], self._whole_names)
            return text, self._places.requirements[number]
        if item.invariants:
            (place,) = item.invariants
            return invariant_text(self._model.invariants[place], self._whole_names), self._places.invariants[place]
        (place,) = item.conditions
        event = self._system.conditions[place].event
        name = event.rpartition(".")[0]
        return f"{event} only where a requirement on {name} does not hold", self._places.communications[name]

    def _variable_place(self, variable: Subject) -> Location:
        return self._places.variables[variable.automaton, variable.variable or ""]

    def _marking(self, automaton: str) -> tuple[str, Location | None]:
        if automaton in self._communications:
            location = self._places.communications[self._communications[automaton].name]
            return f"that {self.automaton(automaton)} gets back to idle", location
        return super()._marking(automaton)

    def automaton_part(self, name: str) -> Part:
        """The component or communication that an automaton stands for."""
        if name in self._communications:
            communication = self._communications[name].name
            return Part("communication", communication, self._places.communications[communication])
        return Part("component", name, self._places.components[name])
