"""Automata under their supervisor as code: its parts, and the statements that all languages share.

Each event becomes a function that reads the state before the event and writes the next one. If it returns false, the
event cannot happen, and the written values are discarded.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from itertools import product
from math import prod

from robosc.automata.compile import NO_DATA, Path, State, compile_expression, subjects_read
from robosc.automata.semantics import MAXIMUM_CHOICES, plant_invariants_on
from robosc.automata.state import Subject, initial_values, subject_type, subjects
from robosc.automata.structure import Automaton, Edge, Event, InputVariable, System, composed
from robosc.cif.typing import NAMELESS
from robosc.errors import UnsupportedModelError
from robosc.expressions import ITSELF, TRUE, Binary, EnumType, Expression, IntegerType, Type, Value, conjuncts
from robosc.expressions.text import cif_text
from robosc.supervisor import DecisionDiagram
from robosc.supervisor.predicates import state_predicate
from robosc.synthesis import edge_choices
from robosc.targets.acceptance import StaysInRange
from robosc.targets.code.conditions import Diagrams
from robosc.targets.code.expression_writer import ExpressionWriter
from robosc.targets.code.expressions import FALSE_CODE, TRUE_CODE, Code
from robosc.targets.code.statements import Assign, Block, Comment, If, Return, Statement, when
from robosc.targets.registry import SupervisedSystem


class ControlledAutomata:
    """Automata under their supervisor, of which code can be made: in each state an event leads to one other.

    Args:
        supervised: The automata and their supervisor.

    Attributes:
        system: The automata.
        roles: Role of each automaton, in a word.
        added: The added condition of each event that has one.
        initial: The condition on the initial states, or None.
        inputs: The input of each event that changes an input variable, by the name of both.
        events: The other events, but for those that can never happen because no automaton knows them.

    Raises:
        UnsupportedModelError: They leave open what happens, or an event carries data.
    """

    def __init__(self, supervised: SupervisedSystem) -> None:
        system = composed(supervised.system)
        _require_names(system)
        self.roles = {item.name: supervised.system.role_of(item) for item in supervised.system.automata}
        self.system = system = replace(system, automata=tuple(map(_merged, system.automata)))
        self.added: Mapping[str, DecisionDiagram] = {item.event: item.condition for item in supervised.added}
        self.initial = supervised.initial
        self.inputs = _inputs(system)
        known = frozenset[str]().union(*(item.alphabet for item in system.automata))
        self.events = tuple(item for item in system.events if item.name in known and item.name not in self.inputs)
        choice = next(iter(edge_choices(system)), None)
        if choice is not None:
            raise UnsupportedModelError(
                f"the event {choice.event} leads to several states from {choice.automaton}.{choice.location}; its "
                "guards must exclude each other"
            )

    @cached_property
    def first(self) -> Mapping[Subject, Value]:
        """The values that the system begins with; input variables begin with what they are.

        Raises:
            UnsupportedModelError: It may begin in several states, or in none.
        """
        open_places = [subject not in self._input_places for subject in subjects(self.system)]
        values = [
            found if is_open else found[:1] for found, is_open in zip(self._initial_values, open_places, strict=True)
        ]
        ways = prod(map(len, values))
        places = {subject: place for place, subject in enumerate(subjects(self.system))}
        tests = [
            compile_expression(item, places)
            for item in self.initial_conditions
            if not subjects_read(item) & self._input_places
        ]
        if self.initial is not None and not any(
            Subject(node.automaton, node.variable) in self._input_places for node in self.initial.nodes
        ):
            may_begin = state_predicate(self.system, self.initial)
            tests.append(lambda state, data: may_begin(state))
        found: list[State] = []
        if ways <= MAXIMUM_CHOICES:
            found = [state for state in product(*values) if all(test(state, NO_DATA) is True for test in tests)]
        if len(found) != 1:
            count = "too many states to count" if ways > MAXIMUM_CHOICES else f"{len(found)} states"
            raise UnsupportedModelError(
                f"{self.system.name} may begin in {count}, and code begins in one: give each variable one initial "
                "value and each automaton one initial location, or choose with --initial of robosc generate"
            )
        return dict(zip(subjects(self.system), found[0], strict=True))

    @property
    def initial_conditions(self) -> tuple[Expression, ...]:
        """The conditions on initial states that the model makes."""
        return tuple(item for item in (*conjuncts(self.system.initial), *self.system.plant_invariants) if item != TRUE)

    def has_location(self, automaton: str) -> bool:
        """Return True if an automaton has several locations, of which the state says which it is in."""
        return len(self.system.automaton(automaton).locations) > 1

    @cached_property
    def _initial_values(self) -> tuple[tuple[Value, ...], ...]:
        return initial_values(self.system)

    @cached_property
    def _input_places(self) -> frozenset[Subject]:
        return frozenset(Subject(name, self.input_variable(name)) for name in self.inputs)

    def input_variable(self, name: str) -> str:
        """The variable that holds the value of an input."""
        return self.system.automaton(name).variables[0].name


_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*")


def _require_names(system: System) -> None:
    """Do nothing if every name can stand in code, in a comment and in a table.

    Raises:
        UnsupportedModelError: One cannot.
    """
    names = [event.name for event in system.events]
    for automaton in system.automata:
        names += [automaton.name, *(item for item in automaton.locations if item != NAMELESS)]
        for variable in automaton.variables:
            names += [variable.name] if variable.name != ITSELF else []
            if isinstance(variable.type, EnumType):
                names += [variable.type.name, *variable.type.values]
    for name in names:
        if _NAME.fullmatch(name) is None:
            raise UnsupportedModelError(
                f"{name!a:.100} is neither an identifier nor identifiers with dots, as code needs"
            )


def _merged(automaton: Automaton) -> Automaton:
    """The automaton with one edge for those that do the same: which of them is taken does not matter."""
    guards: dict[Edge, Expression] = {}
    for edge in automaton.edges:
        does = replace(edge, guard=TRUE)
        guards[does] = Binary("or", guards[does], edge.guard) if does in guards else edge.guard
    return replace(automaton, edges=tuple(replace(edge, guard=guard) for edge, guard in guards.items()))


def _inputs(system: System) -> dict[str, InputVariable]:
    found = {item.event: item for item in system.inputs}
    variables = {item.name for item in system.automata if item.alphabet == {item.name} and len(item.variables) == 1}
    for name in found:
        if name not in variables:
            raise UnsupportedModelError(f"the event '{name}' carries data, and only that of an input variable has code")
    return found


class AutomataWriter(ABC):
    """Writes what events do, where the system may begin, and where it is marked.

    Args:
        automata: The automata.
        before: Writes expressions over the state before an event.
        after: Writes places of the state that the event leads to, and expressions over it.
        diagrams: Writes the supervisor's conditions over the state before an event.
    """

    def __init__(
        self, automata: ControlledAutomata, before: ExpressionWriter, after: ExpressionWriter, diagrams: Diagrams
    ) -> None:
        self._automata, self._system = automata, automata.system
        self._before, self._after, self._diagrams = before, after, diagrams

    @abstractmethod
    def _stored(self, type_: Type, value: Code) -> Code:
        """The value of an update as the place of a variable takes it."""

    def step(self, event: Event) -> Block:
        """The statements of an event: they end with true, or with false where it cannot happen."""
        found: list[Statement] = []
        conditions = [item.condition for item in self._system.plant_conditions if item.event == event.name]
        if event.is_controllable:
            conditions += [item.condition for item in self._system.conditions if item.event == event.name]
        for condition in conditions:
            found += self._required(cif_text(condition), self._before.truth(condition))
        if event.name in self._automata.added:
            found += self._required(*self._diagrams.added(self._automata.added[event.name]))
        for automaton in self._system.automata:
            if event.name in automaton.alphabet:
                found += self._part(automaton, event)
        for condition in plant_invariants_on(self._system, event.name):
            found += self._required(f"afterwards {cif_text(condition)}", self._after.truth(condition))
        return [*found, Return(TRUE_CODE)]

    def may_begin(self) -> Block:
        """The statements that say whether the system may begin in a state."""
        found: list[Statement] = []
        for condition in self._automata.initial_conditions:
            found += self._required(cif_text(condition), self._before.truth(condition))
        if self._automata.initial is not None:
            found += self._required(*self._diagrams.added(self._automata.initial))
        return [*found, Return(TRUE_CODE)]

    def is_marked(self) -> Block:
        """The statements that say whether a state is marked."""
        found: list[Statement] = []
        for automaton in self._system.automata:
            marked = tuple(item for item in automaton.locations if item in automaton.marked)
            if len(marked) < len(automaton.locations):
                is_in = self._before.in_one_of(automaton.name, marked) if marked else FALSE_CODE
                found += self._required(automaton.name, is_in)
        marker = self._system.marker
        return [*found, *self._required(cif_text(marker), self._before.truth(marker)), Return(TRUE_CODE)]

    def begin(self, constant: Callable[[Type, Value], Code]) -> Block:
        """The assignments of the first state, but for input variables.

        Args:
            constant: The code of a value of a type.
        """
        found: list[Statement] = []
        for automaton in self._system.automata:
            if automaton.name in self._automata.inputs:
                continue
            first = self._automata.first
            if self._automata.has_location(automaton.name):
                location = self._after.location_code(automaton.name, str(first[Subject(automaton.name)]))
                found.append(Assign(self._after.location_place(automaton.name), location))
            for item in automaton.variables:
                place = self._after.variable_place(automaton.name, item.name)
                found.append(Assign(place, constant(item.type, first[Subject(automaton.name, item.name)])))
        return found

    def _required(self, words: str, condition: Code) -> list[Statement]:
        """Return false where a condition does not hold."""
        _require_native(words, condition)
        if condition == TRUE_CODE:
            return []
        if condition == FALSE_CODE:
            return [Comment(f"never: {words}"), Return(FALSE_CODE)]
        return [Comment(words), when(self._before.negated(condition), Return(FALSE_CODE))]

    def _part(self, automaton: Automaton, event: Event) -> list[Statement]:
        """Let an automaton take its edge."""
        edges = [edge for edge in automaton.edges if edge.event == event.name]
        tests = [
            self._before.both(self._before.state_code(automaton.name, edge.source), self._before.truth(edge.guard))
            for edge in edges
        ]
        found: list[Statement] = []
        # No requirement blocks an uncontrollable event: the supervisor avoids every state in which it would.
        if event.name not in automaton.monitors:
            possible = FALSE_CODE
            for test in tests:
                possible = self._before.either(possible, test)
            found += self._required(f"{self._automata.roles[automaton.name]} {automaton.name}", possible)
            if possible == FALSE_CODE:
                return found
            if len(tests) == 1:
                return [*found, *self._edge(automaton, edges[0])]
        branches = [
            (test, body)
            for test, edge in zip(tests, edges, strict=True)
            if test != FALSE_CODE and (body := self._edge(automaton, edge))
        ]
        if any(test == TRUE_CODE for test, _ in branches):
            # Edges exclude each other, so it is the only one.
            return [*found, *(item for _, body in branches for item in body)]
        return [*found, If(branches)] if branches else found

    def _edge(self, automaton: Automaton, edge: Edge) -> list[Statement]:
        """Return what an edge does."""
        found: list[Statement] = []
        for update in edge.updates:
            type_ = subject_type(self._system, Subject(automaton.name, update.variable))
            place = f": {update.variable}" if update.variable != ITSELF else ""
            words = f"{automaton.name}{place} := {cif_text(update.expression)}"
            value = self._before.value(update.expression)
            _require_native(words, value)
            if isinstance(type_, IntegerType):
                stays = StaysInRange(automaton.name, None, update.expression, type_)
                found += self._required(words, self._before.condition(stays))
            found.append(
                Assign(self._after.variable_place(automaton.name, update.variable), self._stored(type_, value))
            )
        if edge.target != edge.source:
            target = self._after.location_place(automaton.name)
            found.append(Assign(target, self._after.location_code(automaton.name, edge.target)))
        return found


def _require_native(words: str, code: Code) -> None:
    """Do nothing if nothing in some code can leave 32 bits.

    Raises:
        UnsupportedModelError: Something can.
    """
    if not all(piece.is_known for piece in code.pieces()):
        raise UnsupportedModelError(f"a result may leave 32 bits, and has no code: {words}")


def always(code: Code) -> Callable[[Path], Code]:
    """Return a function that reads all received data as one code."""
    return lambda path: code
