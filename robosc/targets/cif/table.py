"""The comment table that maps CIF names back to the names of the model."""

from collections.abc import Iterator

from robosc.automata import System
from robosc.automata.structure import Automaton
from robosc.expressions import PathStep, Type
from robosc.model.structure import Model, Provide
from robosc.targets.cif.expression_words import data_words, expression_words
from robosc.targets.cif.names import Names, data_plant, declared_events, shift
from robosc.targets.cif.text import comment, escaped


def table_lines(model: Model, system: System, names: Names) -> Iterator[str]:
    """A line `//   CIF name = kind name` for everything that the files declare, columns aligned."""
    rows = [*_enum_rows(names)]
    for automaton in system.automata:
        rows += _automaton_rows(automaton, system, names)
    for communication in names.provided:
        rows += _data_rows(communication, model, names)
    width = max((len(name) for name, _ in rows), default=0)
    yield comment("CIF names, and what they stand for in the model:")
    yield from (comment(f"  {name.ljust(width)} = {meaning}") for name, meaning in rows)


def _enum_rows(names: Names) -> Iterator[tuple[str, str]]:
    for enum, type_ in names.enum_types.items():
        yield escaped(names.enums[enum]), f"enum {enum}"
        for value in type_.values:
            yield escaped(names.literals[enum, value]), f"value {enum}.{value}"


def _automaton_rows(automaton: Automaton, system: System, names: Names) -> Iterator[tuple[str, str]]:
    def reference(name: str) -> str:
        return names.reference(automaton.name, name, None)

    is_component = " " not in automaton.name
    yield escaped(names.plants[automaton.name]), f"component {automaton.name}" if is_component else automaton.name
    for event in declared_events(system, names, automaton):
        yield reference(names.events[event.name]), f"event {event.name}"
    for item in system.inputs:
        if names.owner(item.event) == automaton.name:
            read = f"data {item.event}{_steps(item.path)}"
            yield reference(names.inputs[item.event, item.path]), f"{read}{_less(item.type)}"
    for presence in names.presences.values():
        if names.owner(presence.event) == automaton.name:
            indices = ", ".join(map(str, presence.indices))
            read = f"{presence.event}{_steps(presence.array)}"
            yield reference(presence.name), f"length {read}, how many of the elements {indices} there are"
    for variable in automaton.variables:
        meaning = f"variable {automaton.name}.{variable.name}{_less(variable.type)}"
        yield reference(names.variables[automaton.name, variable.name]), meaning
    for location in automaton.locations:
        word = "state" if is_component else "location"
        yield reference(names.locations[automaton.name, location]), f"{word} {automaton.name}.{location}"


def _data_rows(communication: str, model: Model, names: Names) -> Iterator[tuple[str, str]]:
    plant = data_plant(communication)
    yield escaped(names.plants[plant]), f"data of {communication}"
    statements = ("no statement applies", *map(_statement, model.provides_for(communication)))
    for (location, event), meaning in zip(names.provides[communication], statements, strict=True):
        yield names.reference(plant, location, None), meaning
        yield names.reference(plant, event, None), f"choose {location}"


def _statement(provide: Provide) -> str:
    condition = "" if provide.condition is None else f" if {expression_words(provide.condition)}"
    return f"provide {data_words(provide.value)}{condition}"


def _steps(path: tuple[PathStep, ...]) -> str:
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)


def _less(type_: Type) -> str:
    """Return the words on getting a value back from the one that CIF stores."""
    return f", the value is {shift(type_)} less" if shift(type_) else ""
