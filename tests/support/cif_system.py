"""The meaning of a CIF specification, state by state, and the way back to the model's own names.

Written down from CIF's definition and not from ours: synchronous composition of automata, alphabets from edges where
none is given, simultaneous updates that read the old state. Inputs can have any value at any time.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any

from support.cif_parser import Automaton, CifError, Edge, Type, parse
from support.cif_types import Function, Place, Scope, Typed, Values

MAXIMUM_VALUATIONS = 5_000


class TooManyValuationsError(Exception):
    """An event's inputs have too many values to go through them."""


@dataclass(frozen=True)
class _Arc:
    guard: Function
    updates: tuple[tuple[Place, Type, Typed], ...]
    target: str


@dataclass(frozen=True)
class Step:
    """Possible effect of an event in a state.

    Attributes:
        possible: True if every automaton with the event in its alphabet has an edge for it.
        leaves: True if an update can leave its variable's range.
        targets: The states that it can lead to.
    """

    possible: bool
    leaves: bool
    targets: tuple[dict[Place, Any], ...]


class CifSystem:
    """A specification that can be run.

    Args:
        text: Text of a file.

    Attributes:
        events: True for each event that is controllable, by `automaton.event`.
        initial: The initial state.

    Raises:
        CifError: The file is not well-formed.
    """

    def __init__(self, text: str) -> None:
        self.specification = parse(text)
        self.scope = Scope(self.specification)
        automata = self.specification.automata
        self.events = {f"{item.name}.{name}": kind for item in automata for name, kind in item.events}
        self._inputs = {(item.name, name): type_ for item in automata for name, type_ in item.inputs}
        self.initial: dict[Place, Any] = {}
        self.marked: dict[str, frozenset[str]] = {}
        self.alphabets: dict[str, frozenset[str]] = {}
        self._arcs: dict[tuple[str, str, str], list[_Arc]] = {}
        for automaton in automata:
            self._add(automaton)
        self.needs: dict[str, list[Function]] = {}
        self.invariants: list[Function] = []
        for name, node in self.specification.requirements:
            predicate = self.scope.predicate(node, None)
            if name is None:
                self.invariants.append(predicate)
            else:
                self.needs.setdefault(self.scope.event(name, None), []).append(predicate)

    def _add(self, automaton: Automaton) -> None:
        name = automaton.name
        initial = [location.name for location in automaton.locations if location.initial]
        if len(initial) != 1 or (len(automaton.locations) > 1 and not all(item.name for item in automaton.locations)):
            raise CifError(f"{name} needs one initial location, and names")
        self.initial[name, ""] = initial[0]
        self.marked[name] = frozenset(location.name for location in automaton.locations if location.marked)
        types = {variable: type_ for variable, type_, _ in automaton.variables}
        for variable, type_, node in automaton.variables:
            self.initial[name, variable] = self.scope.initial(node, type_, name)
        used = set[str]()
        for location in automaton.locations:
            for edge in location.edges:
                arc = self._arc(automaton, edge, location.name, types)
                for event in (self.scope.event(item, name) for item in edge.events):
                    used.add(event)
                    self._arcs.setdefault((name, location.name, event), []).append(arc)
                    for _, _, typed in arc.updates:
                        self._require_own_inputs(event, typed)
        given = automaton.alphabet
        self.alphabets[name] = frozenset(used if given is None else {self.scope.event(item, name) for item in given})
        if not used <= self.alphabets[name]:
            raise CifError(f"{name} has an edge for an event outside its alphabet")

    @staticmethod
    def _require_own_inputs(event: str, typed: Typed) -> None:
        for owner, name in typed.inputs:
            if owner != event.partition(".")[0]:
                raise CifError(f"{event} reads the data of another event: {owner}.{name}")

    def _arc(self, automaton: Automaton, edge: Edge, source: str, types: dict[str, Type]) -> _Arc:
        target = source if edge.target is None else edge.target
        if target not in {location.name for location in automaton.locations}:
            raise CifError(f"{automaton.name} has no location {target}")
        if len({variable for variable, _ in edge.updates}) < len(edge.updates):
            raise CifError("a variable is assigned twice")
        updates = []
        for variable, node in edge.updates:
            if variable not in types:
                raise CifError(f"{automaton.name} has no variable {variable}")
            typed = self.scope.update(node, types[variable], automaton.name)
            updates.append(((automaton.name, variable), types[variable], typed))
        return _Arc(self.scope.predicate(edge.guard, automaton.name), tuple(updates), target)

    def declared_names(self) -> set[str]:
        """Return all names, apart from the supervisor and its algebraic variables."""
        found = {name for enum, literals in self.specification.enums for name in (enum, *literals)}
        for item in self.specification.automata:
            if item.kind == "plant":
                inside = [name for part in (item.events, item.inputs, item.variables) for name, *_ in part]
                inside += [location.name for location in item.locations]
                found |= {item.name, *(f"{item.name}.{name}" for name in inside)}
        return found

    def step(self, state: Values, event: str) -> Step:
        """Return the possible effect of an event in a state.

        Raises:
            TooManyValuationsError: Its inputs have too many values.
        """
        participants = [name for name, alphabet in self.alphabets.items() if event in alphabet]
        choices = [
            [arc for arc in self._arcs.get((name, state[name, ""], event), ()) if arc.guard(state)]
            for name in participants
        ]
        if not participants or not all(choices):
            return Step(False, False, ())
        leaves = False
        targets: dict[tuple[tuple[Place, Any], ...], dict[Place, Any]] = {}
        for arcs in product(*choices):
            for values in self._valuations(arcs):
                full = {**state, **values}
                target: dict[Place, Any] = dict(state)
                target.update({(name, ""): arc.target for name, arc in zip(participants, arcs, strict=True)})
                written = {place: (typed.value(full), type_) for arc in arcs for place, type_, typed in arc.updates}
                if any(
                    type_.name == "int" and not type_.low <= value <= type_.high for value, type_ in written.values()
                ):
                    leaves = True
                    continue
                target.update({place: value for place, (value, _) in written.items()})
                targets[tuple(sorted(target.items()))] = target
        return Step(True, leaves, tuple(targets.values()))

    def _valuations(self, arcs: tuple[_Arc, ...]) -> Iterator[dict[Place, Any]]:
        read = sorted({place for arc in arcs for _, _, typed in arc.updates for place in typed.inputs})
        domains = [self._domain(self._inputs[place]) for place in read]
        if prod(map(len, domains)) > MAXIMUM_VALUATIONS:
            raise TooManyValuationsError
        for values in product(*domains):
            yield dict(zip(read, values, strict=True))

    def _domain(self, type_: Type) -> range | tuple[Any, ...]:
        match type_.name:
            case "bool":
                return (False, True)
            case "int":
                return range(type_.low, type_.high + 1)
            case enum:
                return self.scope.enums[enum]


_ROW = re.compile(r"^//   (\S+) += (\w+) (.*)$", re.MULTILINE)


class Table:
    """Meaning of a file's names, as its comments say.

    Attributes:
        automata: The model's name of each automaton; `data m` for a data plant.
        events: The model's name of each event.
        literals: The value that each enum literal stands for.
        names: Every name that the table explains.
    """

    def __init__(self, text: str) -> None:
        self.names = {written.replace("$", "") for written, _, _ in _ROW.findall(text)}
        self.automata: dict[str, str] = {}
        self.events: dict[str, str] = {}
        self.literals: dict[str, str] = {}
        self.locations: dict[Place, str] = {}
        self.variables: dict[Place, tuple[str, int]] = {}
        for written, kind, meaning in _ROW.findall(text):
            name = written.replace("$", "")
            owner, _, local = name.partition(".")
            match kind:
                case "component":
                    self.automata[name] = meaning
                case "message" | "service" | "action":
                    self.automata[name] = f"{kind} {meaning}"
                case "data" if not local:
                    self.automata[name] = f"data {meaning.removeprefix('of ')}"
                case "event":
                    self.events[name] = meaning
                case "value":
                    self.literals[name] = meaning.rpartition(".")[2]
                case "state" | "location":
                    self.locations[owner, local] = meaning.rpartition(".")[2]
                case "variable":
                    variable, _, less = meaning.partition(", the value is ")
                    self.variables[owner, local] = variable.rpartition(".")[2], int(less.removesuffix(" less") or 0)

    def state(self, values: Values) -> dict[tuple[str, str | None], Any]:
        """A state in the model's names, without data plants and supervisor."""
        found: dict[tuple[str, str | None], Any] = {}
        for (owner, name), value in values.items():
            automaton = self.automata.get(owner, "data ")
            if automaton.startswith("data "):
                continue
            if not name:
                found[automaton, None] = self.locations[owner, value]
                continue
            variable, less = self.variables[owner, name]
            is_number = isinstance(value, int) and not isinstance(value, bool)
            found[automaton, variable] = value - less if is_number else self.literals.get(value, value)
        return found
