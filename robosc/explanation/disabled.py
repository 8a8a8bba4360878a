"""Reasons why an event of automata cannot happen in a state, one sentence for each cause.

The reasons follow the definition of the controlled system (`robosc.automata.controlled`): a plant or a requirement
automaton has no edge whose guard is true, a condition on the event does not hold, an update would leave a variable's
range, every step violates a plant invariant, or the supervisor forbids the event. The last reason is reported only if
there is no other one: elsewhere the supervisor's condition has no meaning.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from robosc.automata import Automaton, Edge, EventCondition, Role, Semantics, System
from robosc.automata.compile import NO_DATA, State, compile_expression, paths_read, subjects_read
from robosc.automata.controlled import Added
from robosc.automata.decision import Decision
from robosc.automata.inputs import valuations
from robosc.automata.state import Subject, subject_type, subjects
from robosc.explanation.notation import MAXIMUM_NAMES, bracketed, cut, listed, value_text
from robosc.expressions import Expression, IntegerType, Unary
from robosc.expressions.text import cif_text


class Disabled:
    """Events of one controlled system that cannot happen.

    Args:
        system: The automata.
        added: The conditions that the supervisor adds to events, over states.
    """

    def __init__(self, system: System, added: Added) -> None:
        self._system = system
        self._added = added
        self._subjects = subjects(system)
        self._places = {subject: place for place, subject in enumerate(self._subjects)}
        # The plants as if they could be anything.
        self._free = Semantics(replace(system, plant_invariants=()))

    def reasons(self, state: State, event: str) -> tuple[str, ...]:
        """Return the reasons, at least one, why an event that cannot happen in a state cannot happen.

        Raises:
            KeyError: There is no such event.
        """
        is_controllable = self._system.event(event).is_controllable
        # Requirements do not hold back what the environment does.
        automata = [
            item
            for item in self._system.automata
            if event in item.alphabet and (is_controllable or item.role is Role.PLANT)
        ]
        found = [
            reason
            for item in automata
            if event not in item.monitors
            for reason in self._without_edge(item, state, event)
        ]
        if not any(event in item.alphabet for item in self._system.automata):
            found.append("no automaton has it in its alphabet")
        found += self._conditions(self._system.plant_conditions, state, event)
        if is_controllable:
            found += self._conditions(self._system.conditions, state, event)
        if not found:
            found += self._out_of_range(automata, state, event)
        if not found:
            found += self._against_invariants(state, event)
        if not found:
            found.append(f"the supervisor forbids it, because of what can follow{self._decided(state, event)}")
        return tuple(found[:MAXIMUM_NAMES])

    def _without_edge(self, automaton: Automaton, state: State, event: str) -> Iterator[str]:
        """Yield the reason why an automaton has no edge to take."""
        name = automaton.name if automaton.role is Role.PLANT else f"requirement {automaton.name}"
        edges = [edge for edge in automaton.edges if edge.event == event]
        here = self._from(edges, automaton, state)
        if not here:
            location = state[self._places[Subject(automaton.name)]]
            sources = tuple(dict.fromkeys(edge.source for edge in edges))
            yield f"{name} is in {location}, not in {listed(sources)}" if sources else f"{name} has no edge for it"
        elif not any(self._holds(edge.guard, state) for edge in here):
            for guard in dict.fromkeys(edge.guard for edge in here):
                yield f"{name}: {self._text(guard)} does not hold{self._values(guard, state)}"

    def _from(self, edges: list[Edge], automaton: Automaton, state: State) -> list[Edge]:
        return [edge for edge in edges if edge.source == state[self._places[Subject(automaton.name)]]]

    def _conditions(self, conditions: Iterable[EventCondition], state: State, event: str) -> Iterator[str]:
        for item in conditions:
            if item.event != event or self._holds(item.condition, state):
                continue
            match item.condition:
                case Unary(operator="not", operand=Unary(operator="holds", operand=disabling)):
                    yield f"{self._text(disabling)} disables it, and that holds{self._values(disabling, state)}"
                case condition:
                    yield f"it needs {self._text(condition)}, which does not hold{self._values(condition, state)}"

    def _out_of_range(self, automata: list[Automaton], state: State, event: str) -> Iterator[str]:
        """Yield the variables that could leave their ranges."""
        for automaton in automata:
            edges = [edge for edge in automaton.edges if edge.event == event]
            for edge in self._from(edges, automaton, state):
                for update in edge.updates if self._holds(edge.guard, state) else ():
                    subject = Subject(automaton.name, update.variable)
                    match subject_type(self._system, subject):
                        case IntegerType(low=int(low), high=int(high)):
                            if not self._stays(update.expression, state, event, low, high):
                                now = value_text(state[self._places[subject]])
                                yield f"it could take {subject}, which is {now}, out of its range {low}..{high}"

    def _against_invariants(self, state: State, event: str) -> Iterator[str]:
        """Yield the plant invariants that the steps of an event would violate, if each step violates one."""
        invariants = self._system.plant_invariants
        targets = self._free.targets(state, event) if invariants else ()
        broken = [[item for item in invariants if not self._holds(item, target)] for target in targets]
        if all(broken):
            for item in (item for item in invariants if any(item in items for items in broken)):
                whom = "the supervisor or the plants exclude" if self._system.is_controlled else "the plants cannot be"
                yield f"it leads only to what {whom}: there {self._text(item)} does not hold"

    def _stays(self, expression: Expression, state: State, event: str, low: int, high: int) -> bool:
        paths = set(paths_read(expression))
        inputs = [item for item in self._system.inputs if item.event == event and item.path in paths]
        function = compile_expression(expression, self._places)
        found = (function(state, data) for data in valuations(inputs))
        return all(value is None or low <= value <= high for value in found)  # type: ignore[operator]  # a number

    def _decided(self, state: State, event: str) -> str:
        """The values that the supervisor's condition reads, in brackets."""
        condition = self._added.get(event)
        if not isinstance(condition, Decision):
            return ""
        return bracketed([self._value_words(self._subjects[place], state) for place in condition.tested(state)])

    def _holds(self, condition: Expression, state: State) -> bool:
        return compile_expression(condition, self._places)(state, NO_DATA) is True

    def _text(self, expression: Expression) -> str:
        return cut(cif_text(expression))

    def _values(self, expression: Expression, state: State) -> str:
        read = sorted(subjects_read(expression), key=self._places.__getitem__)
        return bracketed([self._value_words(subject, state) for subject in read])

    def _value_words(self, subject: Subject, state: State) -> str:
        return f"{subject} is {cut(value_text(state[self._places[subject]]))}"
