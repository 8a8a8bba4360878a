"""Check that the parts of a system fit together; a front end may run it before it passes a system on."""

from collections.abc import Iterable, Iterator, Mapping

import msgspec
from msgspec.structs import replace

from robosc.automata.structure import Automaton, Edge, System
from robosc.errors import Diagnostic, InvalidExpressionError, InvalidSystemError
from robosc.expressions import BooleanType, EnumType, Expression, IntegerType, PathStep, Type, is_finite, type_text
from robosc.expressions.inference import Scope, has_type, is_assignable
from robosc.expressions.tree import levels
from robosc.recursion import allow_depth
from robosc.source import Location

MAXIMUM_LEVELS = 5_000
"""Operators that may stand in each other in one expression, as those of a long list that is joined one by one do."""

_FRAMES_PER_LEVEL = 6
"""Python frames that the greediest walk through expressions has open for each level."""


class SystemPlaces(msgspec.Struct, frozen=True):
    """Places of the parts of a system in the files that it was read from; of parts that no file has, none.

    Attributes:
        automata: Place of each automaton, by its name.
        conditions: Places of `System.conditions`, in their order.
        invariants: Places of `System.invariants`.
        plant_conditions: Places of `System.plant_conditions`.
        events: Place of the declaration of each event, by its name.
    """

    automata: Mapping[str, Location] = msgspec.field(default_factory=dict)
    conditions: tuple[Location, ...] = ()
    invariants: tuple[Location, ...] = ()
    plant_conditions: tuple[Location, ...] = ()
    events: Mapping[str, Location] = msgspec.field(default_factory=dict)


class CheckedSystem(msgspec.Struct, frozen=True):
    """Outcome of checking a file in which a front end finds automata.

    Attributes:
        system: The automata; None if there are errors.
        diagnostics: Every finding, sorted by place.
        places: Places of the parts of the automata.
    """

    system: System | None
    diagnostics: tuple[Diagnostic, ...]
    places: SystemPlaces = msgspec.field(default_factory=SystemPlaces)


def check_system(system: System) -> None:
    """Do nothing if every part of a system fits every other, and let Python walk through its expressions.

    Raises:
        InvalidSystemError: Some do not; one line for each.
    """
    depths = [(levels(expression), place) for expression, place in _expressions(system)]
    problems = [
        f"{place}: it is nested {depth} operators deep, and at most {MAXIMUM_LEVELS} are possible: give parts of it to "
        "conditions or invariants of their own, or keep them in variables"
        for depth, place in depths
        if depth > MAXIMUM_LEVELS
    ]
    if problems:
        raise InvalidSystemError("\n".join(f"{system.name}: {problem}" for problem in problems))
    allow_depth(max(depth for depth, _ in depths), _FRAMES_PER_LEVEL)
    problems = list(dict.fromkeys(_Checker(system).problems()))
    if problems:
        raise InvalidSystemError("\n".join(f"{system.name}: {problem}" for problem in problems))


def _expressions(system: System) -> Iterator[tuple[Expression, str]]:
    """Yield the expressions of a system, each with its place in words."""
    for automaton in system.automata:
        for edge in automaton.edges:
            place = f"{automaton.name}: {edge.source} -{edge.event}-> {edge.target}"
            yield edge.guard, f"{place}: the guard"
            yield from ((update.expression, f"{place}: {update.variable}") for update in edge.updates)
    for condition in (*system.conditions, *system.plant_conditions):
        yield condition.condition, f"a condition on {condition.event}"
    for what, invariants in (("invariant", system.invariants), ("plant invariant", system.plant_invariants)):
        yield from ((invariant, f"{what} {number}") for number, invariant in enumerate(invariants, start=1))
    yield system.initial, "the initial condition"
    yield system.marker, "the marker condition"


class _Checker(msgspec.Struct, frozen=True):
    system: System

    def problems(self) -> Iterator[str]:
        """Yield a sentence for each fault, in the system's order."""
        system = self.system
        yield from _doubles("event", (event.name for event in system.events))
        yield from _doubles("automaton", (automaton.name for automaton in system.automata))
        events = {event.name for event in system.events}
        for automaton in system.automata:
            for problem in (*_shape(automaton, events), *_variables(automaton)):
                yield f"{automaton.name}: {problem}"
        yield from self._inputs(events)
        yield from self._types()
        scope = self._scope()
        for automaton in system.automata:
            for edge in automaton.edges:
                for problem in self._edge(scope, automaton, edge):
                    yield f"{automaton.name}: {edge.source} -{edge.event}-> {edge.target}: {problem}"
        for condition in (*system.conditions, *system.plant_conditions):
            if condition.event not in events:
                yield f"a condition is on the event {condition.event}, which there is not"
            yield from _condition(scope, condition.condition, f"a condition on {condition.event}")
        for invariant in (*system.invariants, *system.plant_invariants):
            yield from _condition(scope, invariant, "an invariant")
        yield from _condition(scope, system.initial, "the initial condition")
        yield from _condition(scope, system.marker, "the marker condition")

    def _inputs(self, events: set[str]) -> Iterator[str]:
        yield from _doubles("received datum", (f"{item.event} {_path(item.path)}" for item in self.system.inputs))
        for item in self.system.inputs:
            if item.event not in events:
                yield f"data is received with the event {item.event}, which there is not"
            if not is_finite(item.type):
                yield f"{item.event} {_path(item.path)}: {type_text(item.type)} has infinitely many values"

    def _types(self) -> Iterator[str]:
        named: dict[str, EnumType] = {}
        for type_ in self._all_types():
            match type_:
                case IntegerType(low=int(low), high=int(high)) if low > high:
                    yield f"{type_text(type_)} has no value"
                case EnumType(name=name, values=values):
                    yield from _doubles(f"enum {name} value", values)
                    if not values:
                        yield f"enum {name} has no value"
                    if named.setdefault(name, type_) != type_:
                        yield f"there are two of enum {name}, with other values"

    def _all_types(self) -> tuple[Type, ...]:
        variables = (variable.type for automaton in self.system.automata for variable in automaton.variables)
        return (*variables, *(item.type for item in self.system.inputs))

    def _scope(self) -> Scope:
        variables = {
            (automaton.name, variable.name): variable.type
            for automaton in self.system.automata
            for variable in automaton.variables
        }
        enums = {type_.name: type_ for type_ in self._all_types() if isinstance(type_, EnumType)}
        return Scope(
            variables=variables,
            states=frozenset((item.name, location) for item in self.system.automata for location in item.locations),
            enums=enums,
            enum_values={name: frozenset(type_.values) for name, type_ in enums.items()},
            objects={},
            has_whole_division=True,
        )

    def _edge(self, scope: Scope, automaton: Automaton, edge: Edge) -> Iterator[str]:
        for location in dict.fromkeys((edge.source, edge.target)):
            if location not in automaton.locations:
                yield f"there is no location {location}"
        if edge.event not in automaton.alphabet:
            yield f"{edge.event} is not in the alphabet"
        yield from _condition(scope, edge.guard, "the guard")
        yield from _doubles("assignment to", (update.variable for update in edge.updates))
        own = {variable.name: variable.type for variable in automaton.variables}
        received = {item.path: item.type for item in self.system.inputs if item.event == edge.event}
        receiving = replace(scope, data=received)
        for update in edge.updates:
            if update.variable not in own:
                yield f"there is no variable {update.variable} to assign to"
                continue
            try:
                found = receiving.infer(update.expression)
            except InvalidExpressionError as error:
                yield f"{update.variable}: {error}"
                continue
            if not is_assignable(found, own[update.variable]):
                yield f"{update.variable}: {type_text(found)} is not {type_text(own[update.variable])}"


def _shape(automaton: Automaton, events: set[str]) -> Iterator[str]:
    """Yield the faults in locations and alphabet."""
    yield from _doubles("location", automaton.locations)
    locations = set(automaton.locations)
    for what, names in (("initial", automaton.initial), ("marked", sorted(automaton.marked))):
        for name in names:
            if name not in locations:
                yield f"there is no location {name}, which is to be {what}"
    for event in sorted(automaton.alphabet - events):
        yield f"there is no event {event}, which is in the alphabet"
    for event in sorted(automaton.monitors - automaton.alphabet):
        yield f"{event} is monitored but is not in the alphabet"


def _variables(automaton: Automaton) -> Iterator[str]:
    yield from _doubles("variable", (variable.name for variable in automaton.variables))
    for variable in automaton.variables:
        if not is_finite(variable.type):
            yield f"{variable.name}: {type_text(variable.type)} has infinitely many values"
        if not variable.initial:
            yield f"{variable.name}: it has no value to begin with"
        for value in variable.initial:
            if not has_type(value, variable.type):
                yield f"{variable.name}: {value!r} is not {type_text(variable.type)}"


def _condition(scope: Scope, condition: Expression, what: str) -> Iterator[str]:
    try:
        found = scope.infer(condition)
    except InvalidExpressionError as error:
        yield f"{what}: {error}"
        return
    if not isinstance(found, BooleanType):
        yield f"{what}: {type_text(found)} is not a condition"


def _doubles(what: str, names: Iterable[str]) -> Iterator[str]:
    seen = set[str]()
    for name in names:
        if name in seen:
            yield f"there are two of {what} {name}"
        seen.add(name)


def _path(path: tuple[PathStep, ...]) -> str:
    return ".".join(("value", *map(str, path)))
