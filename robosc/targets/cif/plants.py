"""The plants of a synthesis problem as CIF automata, and the data plants that only observe."""

from collections.abc import Iterator, Sequence

from robosc.automata import System
from robosc.automata.structure import Assignment, Automaton, DiscreteVariable, Edge
from robosc.errors import UnsupportedModelError
from robosc.expressions import MAXIMUM_INTEGER, BooleanType, EnumType, IntegerType, Type, Value
from robosc.model.structure import Model
from robosc.targets.cif.expressions import Symbol, Translator
from robosc.targets.cif.names import data_plant, declared_events, shift
from robosc.targets.cif.numbers import Number, Term, comparison, fits, number_text, selected
from robosc.targets.cif.subjects import Place
from robosc.targets.cif.text import (
    TRUE,
    Level,
    Text,
    all_of,
    any_of,
    chosen,
    compared,
    escaped,
    implied,
    negated,
)
from robosc.targets.code.predicates import Predicate

MAXIMUM_DATA_EDGES = 100_000
"""Edges of one data plant beyond which it is refused: each statement has one from every other."""


class Plants:
    """Writes the plants of one synthesis problem down.

    Args:
        model: The model.
        system: Its plants and requirements.
        translator: Writes their expressions.
    """

    def __init__(self, model: Model, system: System, translator: Translator) -> None:
        self._model = model
        self._system = system
        self._translator = translator
        self._names = translator.reader.names
        self._types = {
            (item.name, variable.name): variable.type for item in system.automata for variable in item.variables
        }

    def enum_lines(self) -> Iterator[str]:
        """The enums."""
        for name, type_ in self._names.enum_types.items():
            literals = ", ".join(escaped(self._names.literals[name, value]) for value in type_.values)
            yield f"enum {escaped(self._names.enums[name])} = {literals};"

    def plant_lines(self, automaton: Automaton) -> Iterator[str]:
        """A plant."""
        yield f"plant automaton {escaped(self._names.plants[automaton.name])}:"
        for event in declared_events(self._system, self._names, automaton):
            word = "controllable" if event.is_controllable else "uncontrollable"
            yield f"  {word} {escaped(self._names.events[event.name])};"
        yield from self._alphabet_line(automaton)
        yield from self._input_lines(automaton)
        yield from (self._variable_line(automaton, variable) for variable in automaton.variables)
        for location in automaton.locations:
            yield from self._location_lines(automaton, location)
        yield "end"

    def _location_lines(self, automaton: Automaton, location: str) -> Iterator[str]:
        head = f"  location {escaped(self._names.locations[automaton.name, location])}"
        words = ["initial;"] * (location in automaton.initial) + ["marked;"] * (location in automaton.marked)
        edges = [edge for edge in automaton.edges if edge.source == location]
        if not words and not edges:
            yield f"{head};"
            return
        yield f"{head}:"
        if words:
            yield f"    {' '.join(words)}"
        yield from (f"    {line}" for line in self._edge_lines(automaton, edges))

    def data_plant_lines(self, communication: str) -> Iterator[str]:
        """The data plant of a communication: which of its data could be sent now.

        Raises:
            UnsupportedModelError: It has too many statements.
        """
        places = self._names.provides[communication]
        if len(places) ** 2 > MAXIMUM_DATA_EDGES:
            raise UnsupportedModelError(
                f"target cif: {communication} has {len(places) - 1} provide statements: too many for a data plant"
            )
        guards = self._data_guards(communication)
        yield f"plant automaton {escaped(self._names.plants[data_plant(communication)])}:"
        for _, event in places:
            yield f"  controllable {escaped(event)};"
        for place, (location, _) in enumerate(places):
            yield f"  location {escaped(location)}:"
            yield "    initial; marked;" if place == 0 else "    marked;"
            for other, (target, event) in enumerate(places):
                if other != place:
                    yield f"    edge {escaped(event)}{_when(guards[other])} goto {escaped(target)};"
        yield "end"

    def data_guard(self, communication: str, number: int) -> Text:
        """Return the condition that a provide statement of a communication, counted from 0, applies."""
        condition = self._model.provides_for(communication)[number].condition
        if condition is None:
            return TRUE
        place = Place(f"the condition of data for {communication}", data_plant(communication))
        return self._translator.predicate(condition, place).true

    def _data_guards(self, communication: str) -> list[Text]:
        count = len(self._model.provides_for(communication))
        guards = [self.data_guard(communication, number) for number in range(count)]
        return [all_of(negated(guard) for guard in guards), *guards]

    def _alphabet_line(self, automaton: Automaton) -> Iterator[str]:
        """The alphabet, if it has events that no edge has."""
        if automaton.alphabet != {edge.event for edge in automaton.edges}:
            events = [event.name for event in self._system.events if event.name in automaton.alphabet]
            yield f"  alphabet {', '.join(self._names.event_reference(name, automaton.name) for name in events)};"

    def _input_lines(self, automaton: Automaton) -> Iterator[str]:
        """The received data of a communication's events."""
        for item in self._system.inputs:
            if self._names.owner(item.event) == automaton.name:
                name = self._names.inputs[item.event, item.path]
                yield f"  input {self._type_text(item.type, f'the data of {item.event}')} {escaped(name)};"
        for presence in self._names.presences.values():
            if self._names.owner(presence.event) == automaton.name:
                yield f"  input int[0..{len(presence.indices)}] {escaped(presence.name)};"

    def _variable_line(self, automaton: Automaton, variable: DiscreteVariable) -> str:
        type_ = self._type_text(variable.type, f"{automaton.name}.{variable.name}")
        name = self._names.variables[automaton.name, variable.name]
        return f"  disc {type_} {escaped(name)} = {self.value_text(variable.type, variable.initial[0])};"

    def value_text(self, type_: Type, value: Value) -> str:
        """A value as CIF stores it."""
        match type_:
            case BooleanType():
                return "true" if value else "false"
            case EnumType(name=name):
                return self._translator.reader.literal(name, str(value)).text
            case _:
                return str(int(value) + shift(type_))

    def _type_text(self, type_: Type, what: str) -> str:
        match type_:
            case IntegerType(low=int(low), high=int(high)):
                moved = shift(type_)
                if high + moved > MAXIMUM_INTEGER:
                    raise UnsupportedModelError(
                        f"target cif: the range {low}..{high} of {what} exceeds 32 bits once it starts at 0, "
                        "as CIF synthesis wants it; make it smaller"
                    )
                return f"int[{low + moved}..{high + moved}]"
            case EnumType(name=name):
                return escaped(self._names.enums[name])
            case _:
                return "bool"

    def _edge_lines(self, automaton: Automaton, edges: Sequence[Edge]) -> Iterator[str]:
        """The edges of one location; events that do the same share a line."""
        found: dict[str, list[str]] = {}
        for edge in edges:
            event = self._names.event_reference(edge.event, automaton.name)
            found.setdefault(self._action(automaton, edge), []).append(event)
        for action, events in found.items():
            yield f"edge {', '.join(events)}{action};"

    def _action(self, automaton: Automaton, edge: Edge) -> str:
        """Guard, updates and target of an edge."""
        updates = ", ".join(self._update(automaton, edge, update) for update in edge.updates)
        target = escaped(self._names.locations[automaton.name, edge.target])
        return "".join(
            (
                _when(self.guard(automaton, edge)),
                f" do {updates}" if updates else "",
                f" goto {target}" if edge.target != edge.source else "",
            )
        )

    def guard(self, automaton: Automaton, edge: Edge, *, is_outside: bool = False) -> Text:
        """Return the condition that an edge of the current location can be taken."""
        place = Place(f"the guard of {edge.event}", None if is_outside else automaton.name)
        return self._translator.predicate(edge.guard, place).true

    def _update(self, automaton: Automaton, edge: Edge, update: Assignment) -> str:
        name = escaped(self._names.variables[automaton.name, update.variable])
        place = self._update_place(automaton, edge, update, automaton.name)
        old = Text(name)
        match self._translator.value(update.expression, place):
            case Predicate(true=true, is_known=True):
                value = true
            case Predicate(true=true, false=false):
                value = chosen([(true, TRUE), (false, Text("false"))], old)
            case Symbol(value=new, known=known):
                value = chosen([(known, new)], old)
            case Number() as number:
                value = _number_update(number, self._types[automaton.name, update.variable], old, place)
        return f"{name} := {value}"

    def range_condition(self, automaton: Automaton, edge: Edge) -> Text:
        """Return the condition that an edge leaves no variable's range, outside all automata.

        It is for events that carry no data.
        """
        found = []
        for update in edge.updates:
            type_ = self._types[automaton.name, update.variable]
            number = self._translator.value(update.expression, self._update_place(automaton, edge, update, None))
            if (
                isinstance(number, Number)
                and isinstance(type_, IntegerType)
                and type_.low is not None
                and type_.high is not None
            ):
                inside = all_of(
                    [
                        comparison(">=", number, Number((), type_.low)),
                        comparison("<=", number, Number((), type_.high)),
                    ]
                )
                found.append(inside if number.known == TRUE else any_of([negated(number.known), inside]))
        applies = all_of(
            [
                self._translator.reader.location(automaton.name, edge.source, Place("")),
                self.guard(automaton, edge, is_outside=True),
            ]
        )
        return implied(applies, all_of(found))

    @staticmethod
    def _update_place(automaton: Automaton, edge: Edge, update: Assignment, here: str | None) -> Place:
        return Place(f"the update of {automaton.name}.{update.variable} on {edge.event}", here, edge.event)


def _number_update(number: Number, type_: Type, old: Text, place: Place) -> Text:
    """The new value of an integer variable, as CIF stores it.

    CIF refuses an assignment whose range has nothing in common with the variable's: that it always fails is a matter of
    synthesis. Naming the variable widens the range of the expression, not its value.
    """
    stored = Number(number.terms, number.constant + shift(type_))
    assert isinstance(type_, IntegerType)  # noqa: S101 - the check has typed it
    highest = int(type_.high or 0) + shift(type_)
    if _is_outside(number, type_):
        return chosen([(number.known, _too_great(old, highest))], old)
    if not fits(stored):
        raise UnsupportedModelError(
            f"target cif: {place.what} exceeds 32 bits; make the ranges of what it reads smaller"
        )
    if number.known != TRUE:
        stored = selected(number.known, stored, Number((Term(old, 0, highest),)), TRUE)
    return number_text(stored)


def _too_great(old: Text, highest: int) -> Text:
    """A value beyond a variable's range, from 0, of which CIF does not know that it always is."""
    if highest == 0:
        return chosen([(compared(old.text, "=", "0"), Text("1"))], old)
    more = Text(f"{old} + 1", Level.SUM)
    return chosen([(compared(old.text, "<", str(highest)), Text(str(highest + 1)))], more)


def _is_outside(number: Number, type_: Type) -> bool:
    """Return True if a number is always outside a range."""
    low, high = number.bounds
    return isinstance(type_, IntegerType) and (
        (type_.low is not None and high < type_.low) or (type_.high is not None and low > type_.high)
    )


def _when(guard: Text) -> str:
    return "" if guard == TRUE else f" when {guard}"
