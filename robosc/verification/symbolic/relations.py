"""Effects of events, as relations between the state before and the state after."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from robosc.automata.compile import Carried
from robosc.automata.decision import Decision
from robosc.automata.semantics import plant_invariants_on
from robosc.automata.state import Subject, subject_type
from robosc.automata.structure import Assignment, Automaton, Edge, Event, Role
from robosc.expressions import BooleanType, Expression, IntegerType, Value
from robosc.verification.symbolic.expressions import Expressions
from robosc.verification.symbolic.linear import Cases
from robosc.verification.symbolic.variables import Digits, Variables, after, cofactors


@dataclass(frozen=True, slots=True)
class Relation:
    """One event of the controlled system.

    Attributes:
        event: The event.
        enabled: States in which the plants enable it, with a step that keeps the plant invariants, and, for a
            controllable one, every range is kept.
        allowed: States in which the supervisor lets it happen; all states where nothing is added.
        guard: States in which it can happen in the controlled system: enabled, allowed and, for a controllable event,
            its conditions true.
        bad: States that it makes bad: an uncontrollable event that can happen against its conditions, or leave a
            range.
        steps: State before and state after, for the places that it may change; the others stay as they are.
        names: The variables of these places.
        touched: The variables that `guard` and `steps` depend on.
    """

    event: Event
    enabled: Any
    allowed: Any
    guard: Any
    bad: Any
    steps: Any
    names: tuple[str, ...]
    touched: frozenset[str]

    def image(self, variables: Variables, states: Any) -> Any:
        """Return the states that the event leads to from some states."""
        return variables.work.count(self.successors(variables, states))

    def preimage(self, variables: Variables, states: Any) -> Any:
        """From where the event can lead to some states."""
        return variables.work.count(self.predecessors(variables, states))

    def successors(self, variables: Variables, states: Any) -> Any:
        """Return the states that the event leads to from some states; the work is not counted."""
        found = variables.without(self.names, states & self.guard & self.steps)
        return variables.renamed({after(name): name for name in self.names}, found)

    def predecessors(self, variables: Variables, states: Any) -> Any:
        """From where the event can lead to some states; the work is not counted."""
        found = self.steps & variables.renamed({name: after(name) for name in self.names}, states)
        return self.guard & variables.without([after(name) for name in self.names], found)


@dataclass(frozen=True, slots=True)
class _Part:
    """Effect of one automaton at an event; predicates over the state before, the data and the state after.

    A monitor has nothing against any event.
    """

    possible: Any
    leaves_range: Any
    steps: Any


class Relations:
    """The relations of a system's events.

    Args:
        variables: The variables.
        added: The conditions that a supervisor adds.
    """

    def __init__(self, variables: Variables, added: dict[str, Decision]) -> None:
        self._variables = variables
        self._added = added
        self._plain = Expressions(variables)
        system = variables.system
        self._automata = _by_event((event, item) for item in system.automata for event in item.alphabet)
        self._conditions = _by_event((item.event, item.condition) for item in system.conditions)
        self._plant_conditions = _by_event((item.event, item.condition) for item in system.plant_conditions)
        self._data = _by_event(
            (event, name)
            for (event, _), digits in variables.data.items()
            for name in (*digits.names, *([] if digits.known is None else [digits.known]))
        )

    def holds(self, conditions: Iterable[Expression]) -> Any:
        """Return the predicate that conditions are all true."""
        return self._variables.all_of(self._plain.truth(condition).true for condition in conditions)

    def truth(self, condition: Expression) -> Any:
        """Return the predicate that a condition is true."""
        return self._plain.truth(condition).true

    def relation(self, event: Event, options: Iterable[Carried] | None = None) -> Relation:
        """The relation of an event.

        Args:
            event: The event.
            options: Data that it can carry, each as the values of some paths, None where one is unknown; None: any.
        """
        variables, manager = self._variables, self._variables.manager
        automata = self._automata.get(event.name, [])
        places = sorted(place for item in automata for place in self._changed(item, event.name))
        plants = [self._part(item, event.name, set(places)) for item in automata if item.role is Role.PLANT]
        watching = [self._part(item, event.name, set(places)) for item in automata if item.role is Role.REQUIREMENT]
        parts = [*plants, *watching]
        able = self.holds(self._plant_conditions.get(event.name, ())) if automata else manager.false
        possible = variables.all_of([able, *(part.possible for part in plants)])
        data = variables.possible_data(event.name)
        if options is not None:
            data = data & variables.any_of(variables.carried(event.name, item) for item in options)
        names_of_data = self._data.get(event.name, [])
        leaving = variables.any_of(part.leaves_range for part in parts) & data
        steps = data & able
        for part in parts:
            steps = variables.work.count(steps & part.steps)
        if names_of_data:
            leaving, steps = variables.without(names_of_data, leaving), variables.without(names_of_data, steps)
        leaving = possible & leaving
        names = tuple(name for place in places for name in variables.places[place].names)
        if lasting := plant_invariants_on(variables.system, event.name):
            kept = variables.renamed({name: after(name) for name in names}, self.holds(lasting))
            steps = variables.work.count(steps & kept)
            possible = possible & (leaving | variables.without([after(name) for name in names], steps))
        # A requirement that has no edge for the event is against it, and stays as it is.
        conditions = variables.all_of(
            [self.holds(self._conditions.get(event.name, ())), *(part.possible for part in watching)]
        )
        added = self._added.get(event.name)
        allowed = manager.true if added is None else variables.work.count(variables.decision(added))
        enabled = possible & ~leaving if event.is_controllable else possible
        guard = enabled & conditions & allowed if event.is_controllable else enabled & allowed
        return Relation(
            event=event,
            enabled=enabled,
            allowed=allowed,
            guard=variables.work.count(guard),
            bad=manager.false if event.is_controllable else (possible & ~conditions) | leaving,
            steps=variables.work.count(steps),
            names=names,
            touched=_support(manager, guard, steps),
        )

    def _changed(self, automaton: Automaton, event: str) -> set[int]:
        """The places that an automaton may change at an event."""
        found = set[int]()
        for edge in automaton.edges:
            if edge.event == event:
                if edge.source != edge.target:
                    found.add(self._variables.place_of[Subject(automaton.name)])
                found |= {self._variables.place_of[Subject(automaton.name, item.variable)] for item in edge.updates}
        return found

    def _part(self, automaton: Automaton, event: str, changed: set[int]) -> _Part:
        variables = self._variables
        possible = leaves_range = steps = variables.manager.false
        own = self._changed(automaton, event) & changed
        for edge in automaton.edges:
            if edge.event == event:
                taken = variables.in_location(automaton.name, edge.source) & self.holds([edge.guard])
                possible = possible | taken
                leaving, updated = self._edge(automaton, edge, own)
                leaves_range = leaves_range | (taken & leaving)
                steps = variables.work.count(steps | (taken & updated))
        is_monitor = event in automaton.monitors
        if is_monitor or automaton.role is Role.REQUIREMENT:
            stays = variables.all_of(variables.unchanged(place) for place in sorted(own))
            steps = variables.work.count(steps | (~possible & stays))
        return _Part(variables.manager.true if is_monitor else possible, leaves_range, steps)

    def _edge(self, automaton: Automaton, edge: Edge, changed: set[int]) -> tuple[Any, Any]:
        """Return the predicate that the updates of an edge leave a range, and the effect of the edge.

        The effect is what the edge makes of the places that may change.
        """
        variables = self._variables
        leaving, updated = variables.manager.false, variables.manager.true
        location = variables.place_of[Subject(automaton.name)]
        expressions = Expressions(variables, edge.event)
        left = set(changed)
        if location in left:
            left.remove(location)
            updated = variables.has_value(variables.places[location].after(), edge.target)
        for update in edge.updates:
            left.discard(variables.place_of[Subject(automaton.name, update.variable)])
            beyond, result = self._update(automaton, update, expressions)
            leaving, updated = leaving | beyond, updated & result
        for place in sorted(left):
            updated = updated & variables.unchanged(place)
        return leaving, updated

    def _update(self, automaton: Automaton, update: Assignment, expressions: Expressions) -> tuple[Any, Any]:
        """Return the predicate that an update leaves its range, and the effect on its variable elsewhere."""
        variables, manager = self._variables, self._variables.manager
        subject = Subject(automaton.name, update.variable)
        place = variables.place_of[subject]
        digits, kept = variables.places[place].after(), variables.unchanged(place)
        type_ = subject_type(variables.system, subject)
        if isinstance(type_, BooleanType):
            truth = expressions.truth(update.expression)
            known = truth.true | truth.false
            made = (truth.true & variables.has_value(digits, True)) | (truth.false & variables.has_value(digits, False))
            return manager.false, made | (~known & kept)

        whole = expressions.integer(update.expression, update.expression) if isinstance(type_, IntegerType) else None
        if whole is not None:
            return self._written(expressions, whole, digits, kept)

        def in_range(value: Value) -> bool:
            # Only integers can leave their range in the meaning of systems.
            return not isinstance(type_, IntegerType) or value in digits.values

        def result(value: Value | None) -> Any:
            if value is None:
                return kept
            return variables.has_value(digits, value) if in_range(value) else manager.false

        table = expressions.table(update.expression)
        beyond = table.where(lambda value: manager.true if value is not None and not in_range(value) else manager.false)
        return beyond, table.where(result)

    def _written(self, expressions: Expressions, whole: Cases, digits: Digits, kept: Any) -> tuple[Any, Any]:
        """Return the predicate that a linear form of an integer leaves a range, and the effect on its variable.

        The effect is what is made of the variable elsewhere.
        """
        variables = self._variables
        beyond, result, known = variables.manager.false, variables.manager.false, variables.manager.false
        for where, form in whole:
            inside = expressions.between(form, int(digits.values[0]), int(digits.values[-1]))
            beyond = beyond | (where & ~inside)
            result = variables.work.count(result | (where & inside & expressions.equal(form, digits)))
            known = known | where
        return beyond, result | (~known & kept)


def _by_event[T](pairs: Iterable[tuple[str, T]]) -> dict[str, list[T]]:
    found: dict[str, list[T]] = {}
    for event, item in pairs:
        found.setdefault(event, []).append(item)
    return found


def _support(manager: Any, *predicates: Any) -> frozenset[str]:
    """The variables that some predicates depend on."""
    found: set[str] = set()
    seen: set[Any] = set()
    stack = list(predicates)
    while stack:
        node = stack.pop()
        if node not in (manager.true, manager.false) and node not in seen:
            seen.add(node)
            found.add(node.var)
            stack.extend(cofactors(node))
    return frozenset(found)
