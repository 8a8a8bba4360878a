"""Parts of a system that only requirements connect, and the parts that each requirement is about.

Automata that share an event are in one part, unless they only hear it: it is uncontrollable, and all but one of them
always accept it. Then each of them needs the part of the one that decides, and they need not know of each other.

Source: M. Goorden, J. van de Mortel-Fronczak, M. Reniers, W. Fokkink and J. Rooda, "Structuring multilevel
discrete-event systems with dependence structure matrices", IEEE TAC 65(4), 2020, pp. 1625-1639: product systems, and
the mapping of requirements to them.
"""

from collections import defaultdict
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from robosc.automata.check import SystemPlaces
from robosc.automata.compile import paths_read, subjects_read
from robosc.automata.structure import Automaton, Edge, Role, System
from robosc.expressions import TRUE, Expression
from robosc.expressions.tree import conjunction, conjuncts


@dataclass(frozen=True, slots=True)
class Demand:
    """Requirements that belong together, because one reads another.

    Attributes:
        parts: Parts that they are about.
        automata: Names of requirement automata.
        conditions: Places in `System.conditions`.
        invariants: Places in `System.invariants`.
        initial: Places among the conjuncts of `System.initial`.
        marker: Places among the conjuncts of `System.marker`.
    """

    parts: frozenset[int]
    automata: frozenset[str] = frozenset()
    conditions: frozenset[int] = frozenset()
    invariants: frozenset[int] = frozenset()
    initial: frozenset[int] = frozenset()
    marker: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True)
class Module:
    """Parts with the demands on them.

    Attributes:
        parts: Places in `Partition.parts`.
        demands: Places in `Partition.demands`.
    """

    parts: frozenset[int]
    demands: frozenset[int]

    def __or__(self, other: "Module") -> "Module":
        return Module(self.parts | other.parts, self.demands | other.demands)


@dataclass(frozen=True, slots=True)
class Partition:
    """A system in parts.

    Attributes:
        system: The system.
        parts: Names of the automata of each part: none reads another one, and two parts share no event but those that
            one of them, or another one that both need, decides alone.
        demands: The demands, each of which connects some parts, with those that they need.
        needs: For each part the parts that it needs, itself among them: those that decide on what it hears.
    """

    system: System
    parts: tuple[frozenset[str], ...]
    demands: tuple[Demand, ...]
    needs: tuple[frozenset[int], ...]

    def conditions_of(self, module: Module) -> tuple[int, ...]:
        """Places of a module's event conditions among those of the system."""
        return tuple(sorted(place for number in module.demands for place in self.demands[number].conditions))

    def invariants_of(self, module: Module) -> tuple[int, ...]:
        """Places of a module's invariants among those of the system."""
        return tuple(sorted(place for number in module.demands for place in self.demands[number].invariants))

    def system_of(self, module: Module) -> System:
        """The synthesis problem of a module."""
        return self.problem_of(module, SystemPlaces())[0]

    def problem_of(self, module: Module, places: SystemPlaces) -> tuple[System, SystemPlaces]:
        """The synthesis problem of a module, with the source locations of its parts, as far as they are known."""
        demands = [self.demands[place] for place in sorted(module.demands)]
        names = {name for place in module.parts for name in self.parts[place]}
        names |= {name for demand in demands for name in demand.automata}
        system = self.system
        automata = tuple(item for item in system.automata if item.name in names)
        events = {event for item in automata for event in item.alphabet}
        conditions, invariants = self.conditions_of(module), self.invariants_of(module)
        conditions = tuple(place for place in conditions if system.conditions[place].event in events)
        plant_conditions = [place for place, item in enumerate(system.plant_conditions) if item.event in events]
        problem = replace(
            system,
            events=tuple(item for item in system.events if item.name in events),
            automata=automata,
            inputs=tuple(item for item in system.inputs if item.event in events),
            conditions=tuple(system.conditions[place] for place in conditions),
            invariants=tuple(system.invariants[place] for place in invariants),
            initial=_chosen(system.initial, {place for demand in demands for place in demand.initial}),
            marker=_chosen(system.marker, {place for demand in demands for place in demand.marker}),
            plant_conditions=tuple(system.plant_conditions[place] for place in plant_conditions),
            plant_invariants=tuple(item for item in system.plant_invariants if _read(item) <= names),
        )
        return problem, SystemPlaces(
            places.automata,
            tuple(places.conditions[place] for place in conditions if places.conditions),
            tuple(places.invariants[place] for place in invariants if places.invariants),
            tuple(places.plant_conditions[place] for place in plant_conditions if places.plant_conditions),
        )


def _chosen(condition: Expression, places: set[int]) -> Expression:
    return conjunction(*(item for place, item in enumerate(conjuncts(condition)) if place in places))


def _read(expression: Expression) -> frozenset[str]:
    """Names of the automata that an expression reads."""
    return frozenset(subject.automaton for subject in subjects_read(expression))


def _read_by(automaton: Automaton) -> frozenset[str]:
    """Names of the automata that an automaton's edges read."""
    return frozenset().union(*(_read(item) for edge in automaton.edges for item in _expressions(edge)))


def _expressions(edge: Edge) -> Iterator[Expression]:
    yield edge.guard
    yield from (update.expression for update in edge.updates)


class Groups[T: Hashable]:
    """Disjoint sets that grow together.

    Args:
        items: The members, each alone at first.
    """

    def __init__(self, items: Iterable[T]) -> None:
        self._above = {item: item for item in items}

    def first(self, item: T) -> T:
        """Return the member that represents the set of a member."""
        while self._above[item] != item:
            self._above[item] = self._above[self._above[item]]
            item = self._above[item]
        return item

    def join(self, items: Iterable[T]) -> None:
        """Merge the sets of some members."""
        first, *others = map(self.first, items)
        for other in others:
            self._above[self.first(other)] = self.first(first)

    def __iter__(self) -> Iterator[list[T]]:
        """The sets, in the order of their earliest members."""
        found: dict[T, list[T]] = {}
        for item in self._above:
            found.setdefault(self.first(item), []).append(item)
        return iter(found.values())


@dataclass(slots=True)
class _Element:
    """One requirement: its kind, the automata and events that it is about, and the events whose data it reads."""

    demand: Demand
    reads: frozenset[str] = frozenset()
    events: frozenset[str] = frozenset()
    data: frozenset[str] = frozenset()
    parts: set[int] = field(default_factory=set)


def partition(system: System) -> Partition:
    """Return the smallest possible parts of a system, and the demands on them."""
    plants = _Plants(system)
    place_of = {name: place for place, part in enumerate(plants.parts) for name in part}
    part_of = {event: place_of[name] for event, name in plants.owners.items()}
    needs = tuple(_needed(place, plants, place_of) for place in range(len(plants.parts)))
    elements = [
        *(
            _Element(
                Demand(frozenset(), automata=frozenset({item.name})),
                _read_by(item) | {item.name},
                item.alphabet,
                frozenset(edge.event for edge in item.edges if any(map(paths_read, _expressions(edge)))),
            )
            for item in system.automata
            if item.name not in plants.names
        ),
        *(
            _Element(Demand(frozenset(), conditions=frozenset({place})), _read(item.condition), frozenset({item.event}))
            for place, item in enumerate(system.conditions)
        ),
        *(
            _Element(Demand(frozenset(), invariants=frozenset({place})), _read(item))
            for place, item in enumerate(system.invariants)
        ),
        *(
            _Element(Demand(frozenset(), initial=frozenset({place})), _read(item))
            for place, item in enumerate(conjuncts(system.initial))
            if item != TRUE
        ),
        *(
            _Element(Demand(frozenset(), marker=frozenset({place})), _read(item))
            for place, item in enumerate(conjuncts(system.marker))
            if item != TRUE
        ),
    ]
    groups = Groups(range(len(elements)))
    # Elements about a requirement automaton, or an event of no part, belong together.
    first: dict[tuple[str, str], int] = {}
    for number, element in enumerate(elements):
        for kind, names, known in (("automaton", element.reads, place_of), ("event", element.events, part_of)):
            for name in names:
                if name in known:
                    element.parts.add(known[name])
                else:
                    groups.join((first.setdefault((kind, name), number), number))
        # Data that an event carries is the same for all that read it.
        for name in sorted(element.data):
            groups.join((first.setdefault(("data", name), number), number))
    demands = tuple(_joined([elements[number] for number in group], needs) for group in groups)
    return Partition(system, plants.parts, demands, needs)


def _needed(place: int, plants: "_Plants", place_of: Mapping[str, int]) -> frozenset[int]:
    """The parts that a part needs, those that these need, and so on."""
    found, waiting = {place}, [place]
    while waiting:
        for name in plants.parts[waiting.pop()]:
            for decider in plants.deciders.get(name, ()):
                if place_of[decider] not in found:
                    found.add(place_of[decider])
                    waiting.append(place_of[decider])
    return frozenset(found)


def _joined(elements: list[_Element], needs: Sequence[frozenset[int]]) -> Demand:
    demands = [element.demand for element in elements]
    places = frozenset(need for element in elements for place in element.parts for need in needs[place])
    return Demand(
        # A demand about no part, such as `marked false`, may be put to any.
        parts=places if places or not needs else needs[0],
        automata=frozenset().union(*(item.automata for item in demands)),
        conditions=frozenset().union(*(item.conditions for item in demands)),
        invariants=frozenset().union(*(item.invariants for item in demands)),
        initial=frozenset().union(*(item.initial for item in demands)),
        marker=frozenset().union(*(item.marker for item in demands)),
    )


class _Plants:
    """Plants, and the requirement automata that they read, in groups that share events or read each other.

    Attributes:
        names: Names of all automata.
        parts: The groups.
        owners: One automaton for each event that any automaton has; of those that only hear it the one that decides.
        deciders: For each automaton those that decide on events that it only hears.
    """

    def __init__(self, system: System) -> None:
        self._automata = {item.name: item for item in system.automata}
        conditions = [(item.event, _read(item.condition)) for item in system.plant_conditions]
        invariants = [_read(item) for item in system.plant_invariants]
        self.names = {item.name for item in system.automata if item.role is Role.PLANT}
        plain = {event for name in self.names for event in self._automata[name].alphabet}
        # A condition of plants on an event that no plant has can restrict requirement automata alone.
        restricted = {event for event, _ in conditions if event not in plain}
        waiting = [item.name for item in system.automata if item.alphabet & restricted]
        waiting += [name for _, names in conditions for name in names]
        waiting += [name for names in invariants for name in names]
        waiting += [name for plant in self.names for name in _read_by(self._automata[plant])]
        while waiting:
            name = waiting.pop()
            if name not in self.names:
                self.names.add(name)
                waiting += _read_by(self._automata[name])
        groups = Groups(item.name for item in system.automata if item.name in self.names)
        self.owners = self._heard(system)
        self.deciders: dict[str, set[str]] = {}
        heard = set(self.owners)
        for name in (item.name for item in system.automata if item.name in self.names):
            groups.join((name, *_read_by(self._automata[name])))
            for event in self._automata[name].alphabet:
                decider = self.owners.setdefault(event, name)
                if event in heard:
                    self.deciders.setdefault(name, set()).add(decider)
                else:
                    groups.join((name, decider))
        for event, names in conditions:
            owner = self.owners.get(event)
            if owner is not None or names:
                groups.join((*names, *(() if owner is None else (owner,))))
        for names in invariants:
            if names:
                groups.join(names)
        self.parts = tuple(frozenset(group) for group in groups)

    def _heard(self, system: System) -> dict[str, str]:
        """For each event that several plants share, and all but one only hear, the one that decides.

        It is uncontrollable, no requirement is about it, and at most one of them reads its data.
        """
        if system.plant_invariants:
            # They could prevent the event by what one of them does.
            return {}
        takers: dict[str, list[Automaton]] = defaultdict(list)
        for automaton in system.automata:
            for event in automaton.alphabet:
                takers[event].append(automaton)
        restricted = {item.event for item in (*system.conditions, *system.plant_conditions)}
        found: dict[str, str] = {}
        for event in (item.name for item in system.events if not item.is_controllable):
            automata = takers[event]
            if len(automata) < 2 or event in restricted or any(item.role is not Role.PLANT for item in automata):
                continue
            deciding = [item for item in automata if not _accepts(item, event)]
            reading = [item for item in automata if _reads_data(item, event)]
            if len(deciding) < 2 and len(reading) < 2:
                # The one that does least else, as the plant of a message.
                found[event] = min(deciding or automata, key=lambda item: len(item.alphabet)).name
        return found


def _accepts(automaton: Automaton, event: str) -> bool:
    """Return True if an automaton takes an event in every state."""
    free = {edge.source for edge in automaton.edges if edge.event == event and edge.guard == TRUE}
    return event in automaton.monitors or free.issuperset(automaton.locations)


def _reads_data(automaton: Automaton, event: str) -> bool:
    return any(any(map(paths_read, _expressions(edge))) for edge in automaton.edges if edge.event == event)
