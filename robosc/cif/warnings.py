"""Parts of a CIF model without errors that are mostly meant otherwise, as CIF's own synthesis warns of them.

These are plants that read requirements, events that never happen, and states, initial states and marked states of which
there are none. A condition is taken to be impossible if it is false for all values of what it reads. Where those are
very many nothing is said: synthesis, which knows all states, reports the rest.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import product
from math import prod

import msgspec

from robosc.automata import Automaton, Role, System, SystemPlaces
from robosc.automata.compile import NO_DATA, compile_expression, subjects_read
from robosc.automata.state import Subject, initial_values, subjects
from robosc.cif import syntax
from robosc.cif.scopes import Entity, Scopes
from robosc.expressions import (
    FALSE,
    TRUE,
    Binary,
    Expression,
    StateTest,
    Value,
    VariableRead,
    conjuncts,
    domain,
    leaves,
)
from robosc.model.findings import Findings
from robosc.source import Location

_MAXIMUM_VALUES = 2_000
"""Combinations of values that are tried for what conditions read together."""

_MAXIMUM_TRIED = 100_000
"""Combinations that are tried for one model: some tenths of a second."""

_PREFIXES = {"c_": True, "u_": False, "e_": None}
"""Beginnings of names by CIF's convention, with the controllability of the events that have them."""


class Exclusion(msgspec.Struct, frozen=True):
    """An event that is allowed only where a condition is true."""

    event: Entity
    condition: Expression
    role: str
    at: Location


class Reading(msgspec.Struct, frozen=True):
    """A model that was read, with what its automata do not have.

    Attributes:
        system: Its automata.
        places: Their places.
        exclusions: Event exclusions of plants and requirements.
        plant_reads: Expressions of plants, with the places where they read.
        plant_places: Places of the state invariants of plants.
        event_places: Place of the declaration of each event.
        scopes: Components, with all that they declare.
        open_channels: Channels that have nobody at one of their ends.
    """

    system: System
    places: SystemPlaces
    exclusions: Sequence[Exclusion]
    plant_reads: Sequence[tuple[Expression, Location]]
    plant_places: Sequence[Location]
    event_places: Mapping[str, Location]
    scopes: Scopes
    open_channels: Sequence[Entity]

    @property
    def automata(self) -> tuple[Automaton, ...]:
        """The automata, but for those of input variables."""
        inputs = {item.event for item in self.system.inputs}
        return tuple(item for item in self.system.automata if item.name not in inputs)

    def place(self, automaton: str) -> Location:
        """The place of an automaton."""
        return self.places.automata[automaton]


def warn(reading: Reading, findings: Findings) -> None:
    """Report what is mostly meant otherwise."""
    possible = _Possible(reading.system)
    _warn_of_reads(reading, findings)
    _warn_of_events(reading, possible, findings)
    _warn_of_states(reading, possible, findings)
    _warn_of_names(reading, findings)


class _Possible:
    """Finds out whether conditions can be true together, trying few values.

    Args:
        system: The automata.
    """

    def __init__(self, system: System) -> None:
        self._domains: dict[Subject, Sequence[Value]] = {}
        for item in system.automata:
            self._domains[Subject(item.name)] = item.locations
            for variable in item.variables:
                self._domains[Subject(item.name, variable.name)] = domain(variable.type)
        self._left = _MAXIMUM_TRIED
        self._initial = dict(zip(subjects(system), initial_values(system), strict=True))

    def anywhere(self, conditions: Iterable[Expression]) -> bool:
        """Return False if no values make all conditions true."""
        return self._can(conditions, self._domains)

    def initially(self, conditions: Iterable[Expression]) -> bool:
        """Return False if no values that the automata may begin with make all conditions true."""
        return self._can(conditions, self._initial)

    def _can(self, conditions: Iterable[Expression], domains: Mapping[Subject, Sequence[Value]]) -> bool:
        # Conditions that share nothing with the rest are possible or not by themselves.
        groups: list[tuple[set[Subject], list[Expression]]] = []
        for condition in (part for item in conditions for part in conjuncts(item)):
            read, together = set(subjects_read(condition)), [condition]
            apart = []
            for others, parts in groups:
                if read & others:
                    read |= others
                    together += parts
                else:
                    apart.append((others, parts))
            groups = [*apart, (read, together)]
        return all(self._is_possible(sorted(read, key=str), parts, domains) for read, parts in groups)

    def _is_possible(
        self, read: Sequence[Subject], parts: Sequence[Expression], domains: Mapping[Subject, Sequence[Value]]
    ) -> bool:
        values_of = [domains[subject] for subject in read]
        size = prod(map(len, values_of))
        if size > min(_MAXIMUM_VALUES, self._left):
            return True
        self._left -= size
        functions = [compile_expression(part, {item: place for place, item in enumerate(read)}) for part in parts]
        return any(all(function(values, NO_DATA) is True for function in functions) for values in product(*values_of))


def _warn_of_reads(reading: Reading, findings: Findings) -> None:
    requirements = {item.name for item in reading.automata if item.role is Role.REQUIREMENT}
    for expression, at in reading.plant_reads:
        read = {leaf.component for leaf in leaves(expression) if isinstance(leaf, VariableRead | StateTest)}
        if names := sorted(read & requirements):
            message = f"a plant reads the state of the requirement '{names[0]}'"
            fix = "Make it a plant, or let a requirement say this."
            findings.warning("cif-plant-reads-requirement", message, at, fix)


# Events


def _warn_of_events(reading: Reading, possible: _Possible, findings: Findings) -> None:
    # An invariant about an event that is in no alphabet has a finding of its own.
    excluded = {item.event.name for item in reading.exclusions}
    unused: dict[Location, list[str]] = {}
    for event, at in reading.event_places.items():
        having = [item for item in reading.automata if event in item.alphabet]
        if having:
            _warn_of_event(event, at, having, reading, possible, findings)
        elif event not in excluded:
            unused.setdefault(at, []).append(event)
    for channel in reading.open_channels:
        message = f"'{channel.name}' never happens: nobody sends over it, or nobody receives from it"
        findings.warning("cif-event-never-happens", message, channel.at, "Add an automaton that does.")
    for at, events in unused.items():
        more = f" and {len(events) - 1} more" if len(events) > 1 else ""
        message = f"no automaton has '{events[0]}'{more} in its alphabet"
        findings.warning("cif-unused-event", message, at, "Remove it, or use it on an edge.")


def _warn_of_event(
    event: str, at: Location, having: list[Automaton], reading: Reading, possible: _Possible, findings: Findings
) -> None:
    """Report the first reason why an event never happens: an automaton, an exclusion, or several together."""

    def report(why: str, where: Location, fix: str) -> None:
        findings.warning("cif-event-never-happens", f"'{event}' never happens: {why}", where, fix)

    taking = [item for item in having if event not in item.monitors]
    impossible = [item for item in taking if not _may_take(item, event, possible)]
    for item in impossible:
        guards = [edge.guard for edge in item.edges if edge.event == event]
        why = "has no edge of it"
        if guards:
            never = "false" if all(guard == FALSE for guard in guards) else "never true"
            why = f"has only edges of it whose guards are {never}"
        fix = "Correct the guards." if guards else "Add an edge, or take the event out of the alphabet."
        report(f"'{item.name}' {why}", reading.place(item.name), fix)
    about = [item for item in reading.exclusions if item.event.name == event]
    alone = [item for item in about if not possible.anywhere([item.condition])]
    for exclusion in alone:
        report("this is true in no state, and it must be", exclusion.at, "Correct the condition.")
    if impossible or alone:
        return
    plants = [_guard(item, event) for item in taking if item.role is Role.PLANT]
    limits = [item.condition for item in about if item.role == "plant"]
    required = [_guard(item, event) for item in taking if item.role is not Role.PLANT]
    required += [item.condition for item in about if item.role != "plant"]
    by_invariants = "invariants of plants exclude it wherever the plants have edges of it"
    known: list[Expression] = []
    for conditions, why in (
        (plants, "in no state has each plant with this event an edge of it whose guard is true"),
        (limits, by_invariants),
        (reading.system.plant_invariants, by_invariants),
        (required, f"{_whose(reading)} forbid it wherever it is possible"),
    ):
        known += conditions
        # One condition alone is possible: that was found out before.
        if conditions and len(known) > 1 and not possible.anywhere(known):
            report(why, at, "Correct the conditions, or remove the event.")
            return


def _whose(reading: Reading) -> str:
    return "parts of the supervisor" if reading.system.is_controlled else "requirements"


def _may_take(automaton: Automaton, event: str, possible: _Possible) -> bool:
    guards = [edge.guard for edge in automaton.edges if edge.event == event]
    return TRUE in guards or possible.anywhere([_guard(automaton, event)])


def _guard(automaton: Automaton, event: str) -> Expression:
    """Return the condition under which an automaton has an edge for an event."""
    whole: Expression = FALSE
    for edge in automaton.edges:
        if edge.event != event or edge.guard == FALSE:
            continue
        guard = edge.guard
        if len(automaton.locations) > 1:
            here = StateTest(automaton.name, edge.source)
            guard = here if guard == TRUE else Binary("and", here, guard)
        whole = guard if whole == FALSE else Binary("or", whole, guard)
    return whole


# States


def _warn_of_states(reading: Reading, possible: _Possible, findings: Findings) -> None:
    """Report that there is no state, no initial one or no marked one."""
    if _warned_of_invariants(reading, possible, findings):
        return
    if why := _without_locations(reading, "initial", {item.name: item.initial for item in reading.automata}):
        for at, message in why:
            findings.warning("cif-no-initial-state", message, at, "Write 'initial;' in a location.")
    elif found := _excluded(reading, "initial", [reading.system.initial], possible.initially):
        at, message = found
        findings.warning("cif-no-initial-state", message, at, "Correct one of them.")
    if why := _without_locations(reading, "marked", {item.name: tuple(item.marked) for item in reading.automata}):
        for at, message in why:
            findings.warning("cif-no-marked-state", message, at, "Write 'marked;' in a location.")
        return
    located = [_in(item, item.marked) for item in reading.automata if len(item.marked) < len(item.locations)]
    if found := _excluded(reading, "marked", [*located, reading.system.marker], possible.anywhere):
        at, message = found
        findings.warning("cif-no-marked-state", message, at, "Correct one of them.")


def _without_locations(
    reading: Reading, word: str, locations: Mapping[str, Sequence[str]]
) -> list[tuple[Location, str]]:
    """Return the automata without an initial, or a marked, location, in words and with their places."""
    return [
        (reading.place(name), f"no state is {word}: '{name}' has no {word} location")
        for name, found in locations.items()
        if not found
    ]


def _excluded(
    reading: Reading, word: str, known: list[Expression], can: Callable[[Iterable[Expression]], bool]
) -> tuple[Location, str] | None:
    """Return the reason why predicates and invariants leave no initial, or marked, state, and its place; or None."""
    for more, why in (
        ([], f"the {word} predicates are never all true"),
        (reading.system.plant_invariants, f"the invariants of plants exclude each {word} state"),
        (reading.system.invariants, f"the invariants exclude each {word} state"),
    ):
        known += more
        if not can(known):
            return _first(reading, word), f"no state is {word}: {why}"
    return None


def _warned_of_invariants(reading: Reading, possible: _Possible, findings: Findings) -> bool:
    """Report that no state meets the invariants, and return True if so."""
    met: list[Expression] = []
    for words, conditions, places in (
        ("the state invariants of plants", reading.system.plant_invariants, reading.plant_places),
        ("all state invariants", reading.system.invariants, reading.places.invariants),
    ):
        alone = [at for item, at in zip(conditions, places, strict=True) if not possible.anywhere([item])]
        for at in alone:
            findings.warning("cif-no-state", "this invariant is true in no state", at, "Correct it.")
        met += conditions
        if alone:
            return True
        if conditions and not possible.anywhere(met):
            message = f"in no state are {words} true"
            findings.warning("cif-no-state", message, places[0], "Correct one of them.")
            return True
    return False


def _in(automaton: Automaton, locations: Iterable[str]) -> Expression:
    whole: Expression = FALSE
    for name in sorted(locations):
        test = StateTest(automaton.name, name)
        whole = test if whole == FALSE else Binary("or", whole, test)
    return whole


def _first(reading: Reading, word: str) -> Location:
    """Return the place of the first predicate of a word, in components or in their locations; else of an automaton."""
    for scope in reading.scopes.scopes():
        for item in scope.body:
            found = item.predicates if isinstance(item, syntax.LocationDeclaration) else (item,)
            for predicate in found:
                if isinstance(predicate, syntax.Predicates) and predicate.word == word and predicate.predicates:
                    return predicate.at
    return reading.place(reading.automata[0].name)


# Names


def _warn_of_names(reading: Reading, findings: Findings) -> None:
    """Note names that begin as those of events of another kind do."""
    seen = set[Location]()
    for scope in reading.scopes.scopes():
        for name, entry in scope.entries.items():
            if name[:2] not in _PREFIXES or name in scope.parameters:
                continue
            wanted = _PREFIXES[name[:2]]
            declared = entry.declaration if isinstance(entry, Entity) else None
            if isinstance(declared, syntax.Event) and declared.is_controllable is wanted:
                continue
            at = entry.at
            if at in seen:
                continue
            seen.add(at)
            kind = {True: "a controllable event", False: "an uncontrollable event", None: "an event of neither kind"}
            message = f"'{name}' is called like {kind[wanted]}, and is none"
            findings.note("cif-name-prefix", message, at, "Give it another name.")
