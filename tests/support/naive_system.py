"""The definition of a system read naively: no compilation, no memory, all received data of an event at once."""

from collections.abc import Iterable, Iterator, Mapping
from itertools import product

from robosc.automata import Automaton, Edge, Role, System
from robosc.automata.compile import Carried, State
from robosc.automata.state import Subject, initial_values, subject_domain, subjects
from robosc.expressions import Expression, PathStep, Value, domain
from robosc.expressions.evaluate import evaluate
from robosc.supervisor import AddedCondition, DecisionDiagram
from robosc.supervisor.diagram import evaluate as evaluate_diagram

type Data = Mapping[tuple[PathStep, ...], Value | None]


class NaiveSystem:
    """A system, state by state; arrays among received data are called `scan`."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.subjects = subjects(system)

    def evaluate(self, expression: Expression, at: State, data: Data) -> object:
        values = dict(zip(self.subjects, at, strict=True))
        return evaluate(
            expression,
            lambda automaton, variable: values[Subject(automaton, variable)],
            lambda automaton: str(values[Subject(automaton)]),
            lambda path: data[path],
        )

    def decides(self, diagram: DecisionDiagram, at: State) -> bool:
        values = dict(zip(self.subjects, at, strict=True))

        def index(automaton: str, variable: str | None) -> int:
            subject = Subject(automaton, variable)
            return list(subject_domain(self.system, subject)).index(values[subject])

        return evaluate_diagram(diagram, index)

    def data(self, event: str) -> Iterator[Data]:
        inputs = [item for item in self.system.inputs if item.event == event]
        values = [[*domain(item.type), *([None] if item.may_be_unknown else [])] for item in inputs]
        for choice in product(*values):
            known = dict(zip((item.path for item in inputs), choice, strict=True))
            elements = sorted((path for path in known if path[:1] == ("scan",)), key=lambda path: path[1])
            unknown = [known[path] is None for path in elements]
            if unknown == sorted(unknown):
                yield known

    def true(self, conditions: Iterable[Expression], at: State) -> bool:
        """Return True if every one of some conditions is."""
        return all(self.evaluate(item, at, {}) is True for item in conditions)

    def edges(self, at: State, event: str) -> list[tuple[tuple[str, Edge], ...]]:
        """Edges that automata can take together; requirements and monitors without one stay."""
        taking_part = [item for item in self.system.automata if event in item.alphabet]
        able = (item.condition for item in self.system.plant_conditions if item.event == event)
        if not taking_part or not self.true(able, at):
            return []
        choices = [
            self._taken(item, at, event)
            for item in taking_part
            if (item.role is Role.PLANT and event not in item.monitors) or self._taken(item, at, event)
        ]
        return list(product(*choices))

    def meets(self, at: State, event: str) -> bool:
        """Return True if event conditions and requirement automata allow an event."""
        return self.true((item.condition for item in self.system.conditions if item.event == event), at) and all(
            self._taken(item, at, event)
            for item in self.system.automata
            if item.role is Role.REQUIREMENT and event in item.alphabet - item.monitors
        )

    def _taken(self, automaton: Automaton, at: State, event: str) -> list[tuple[str, Edge]]:
        values = dict(zip(self.subjects, at, strict=True))
        return [
            (automaton.name, arc)
            for arc in automaton.edges
            if arc.event == event and arc.source == values[Subject(automaton.name)]
            if self.evaluate(arc.guard, at, {}) is True
        ]

    def step(self, at: State, event: str, given: Carried = ()) -> tuple[frozenset[State], bool]:
        """Targets, and whether some choice leaves a range; of all data or of that in which some is given."""
        targets, leaves_range = set[State](), False
        for combination in self.edges(at, event):
            for data in self.data(event):
                if any(data[path] != value for path, value in given):
                    continue
                values = dict(zip(self.subjects, at, strict=True))
                in_range = True
                for name, arc in combination:
                    values[Subject(name)] = arc.target
                    for update in arc.updates:
                        value = self.evaluate(update.expression, at, data)
                        place = Subject(name, update.variable)
                        if value is not None:
                            in_range = in_range and value in subject_domain(self.system, place)
                            values[place] = value  # type: ignore[assignment]
                leaves_range = leaves_range or not in_range
                if in_range and self.true(self.system.plant_invariants, tuple(values.values())):
                    targets.add(tuple(values.values()))
        return frozenset(targets), leaves_range

    # Under a supervisor

    def beginnings(self, condition: DecisionDiagram | None) -> set[State]:
        """The initial states in which a supervisor lets the system begin."""
        conditions = (self.system.initial, *self.system.plant_invariants)
        return {
            state
            for state in product(*initial_values(self.system))
            if self.true(conditions, state) and (condition is None or self.decides(condition, state))
        }

    def controlled(self, at: State, event: str, added: Iterable[AddedCondition]) -> frozenset[State]:
        """Targets of an event under a supervisor; none where it cannot happen."""
        targets, leaves_range = self.step(at, event)
        if self.system.event(event).is_controllable and (leaves_range or not self.meets(at, event)):
            return frozenset()
        return (
            targets if all(self.decides(item.condition, at) for item in added if item.event == event) else frozenset()
        )

    def is_marked(self, at: State) -> bool:
        values = dict(zip(self.subjects, at, strict=True))
        is_there = all(values[Subject(item.name)] in item.marked for item in self.system.automata)
        return is_there and self.evaluate(self.system.marker, at, {}) is True
