"""Independent parts of a system: automata that share no event, condition or invariant with the others.

The states of the whole are all combinations of those of its parts, and each event moves one part alone. So the whole is
safe, controllable, nonblocking and as permissive as can be exactly if each part is.
"""

from collections.abc import Callable, Iterable, Iterator

from robosc.automata.compile import subjects_read
from robosc.automata.structure import System
from robosc.expressions import TRUE, Expression


def independent_parts(system: System, together: Iterable[Iterable[str]] = ()) -> tuple[System, ...]:
    """The independent parts of a system, in the order of their first automata; the system itself if it has no others.

    Args:
        system: The system.
        together: Groups of events that are to stay in one part.
    """
    groups = _Groups(automaton.name for automaton in system.automata)
    for automaton in system.automata:
        groups.join([automaton.name, *map(_event, automaton.alphabet)])
        for edge in automaton.edges:
            groups.join([automaton.name, *_read(edge.guard)])
            for update in edge.updates:
                groups.join([automaton.name, *_read(update.expression)])
    for condition in (*system.conditions, *system.plant_conditions):
        groups.join([_event(condition.event), *_read(condition.condition)])
    for invariant in (*system.invariants, *system.plant_invariants, system.initial, system.marker):
        groups.join([*_read(invariant)])
    for events in together:
        groups.join([_event(event) for event in events])
    members: dict[str, list[str]] = {}
    for automaton in system.automata:
        members.setdefault(groups.of(automaton.name), []).append(automaton.name)
    placed = {groups.of(_event(event.name)) for event in system.events}
    placed |= {groups.of(name) for name in _constants(system, groups)}
    # An event, or an invariant, of no automaton is in no part: such systems are left whole.
    if len(members) < 2 or not placed <= members.keys():
        return (system,)
    return tuple(_parts(system, groups, members))


def _constants(system: System, groups: "_Groups") -> Iterator[str]:
    """A name that is in no part, for each condition on states that reads none."""
    for invariant in (*system.invariants, *system.plant_invariants, system.initial, system.marker):
        if invariant != TRUE and not subjects_read(invariant):
            yield "constant"


def _parts(system: System, groups: "_Groups", members: Iterable[str]) -> Iterator[System]:
    """The part of each group."""

    def by_event[T](items: Iterable[T], event_of: Callable[[T], str]) -> dict[str, list[T]]:
        return _grouped(items, lambda item: groups.of(_event(event_of(item))))

    def by_state(items: Iterable[Expression]) -> dict[str, list[Expression]]:
        # A condition that reads nothing is in no part.
        return _grouped(items, lambda item: next((groups.of(name) for name in _read(item)), ""))

    automata = _grouped(system.automata, lambda item: groups.of(item.name))
    events = by_event(system.events, lambda item: item.name)
    inputs = by_event(system.inputs, lambda item: item.event)
    conditions, plant_conditions = (
        by_event(items, lambda item: item.event) for items in (system.conditions, system.plant_conditions)
    )
    invariants, plant_invariants = map(by_state, (system.invariants, system.plant_invariants))
    initial, marker = by_state((system.initial,)), by_state((system.marker,))
    for group in members:
        yield System(
            name=system.name,
            events=tuple(events.get(group, ())),
            automata=tuple(automata.get(group, ())),
            inputs=tuple(inputs.get(group, ())),
            conditions=tuple(conditions.get(group, ())),
            invariants=tuple(invariants.get(group, ())),
            initial=system.initial if group in initial else TRUE,
            marker=system.marker if group in marker else TRUE,
            plant_conditions=tuple(plant_conditions.get(group, ())),
            plant_invariants=tuple(plant_invariants.get(group, ())),
        )


def _grouped[T](items: Iterable[T], group_of: Callable[[T], str]) -> dict[str, list[T]]:
    found: dict[str, list[T]] = {}
    for item in items:
        found.setdefault(group_of(item), []).append(item)
    return found


def _event(name: str) -> str:
    # No automaton's name begins with a blank.
    return f" {name}"


def _read(expression: Expression) -> set[str]:
    return {subject.automaton for subject in subjects_read(expression)}


class _Groups:
    """Disjoint sets of names, joined again and again.

    Source: R. E. Tarjan, "Efficiency of a good but not linear set union algorithm", Journal of the ACM 22(2), 1975,
    pp. 215-225.
    """

    def __init__(self, names: Iterable[str]) -> None:
        self._above = {name: name for name in names}

    def of(self, name: str) -> str:
        """The name that stands for the set of a name."""
        top = name
        while (above := self._above.setdefault(top, top)) != top:
            top = above
        while self._above[name] != top:
            self._above[name], name = top, self._above[name]
        return top

    def join(self, names: Iterable[str]) -> None:
        """Make one set of those of some names."""
        first: str | None = None
        for name in names:
            top = self.of(name)
            if first is None:
                first = top
            elif top != first:
                self._above[top] = first
