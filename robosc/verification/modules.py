"""Check of a supervisor on parts of the system that are small enough to be searched one by one, where the whole is not.

A module is some of the automata, with the requirements on them alone. The others can only make its behaviour smaller if
they never prevent an uncontrollable event of it. Then two things about the whole follow from its modules:

- A supervisor of the whole allows nothing that the maximally permissive supervisor of a module forbids. So a supervisor
  that forbids an event only where that of some module does forbids no more than it must.
- A module without the rest, in which an event may happen wherever the rest could let it, reaches all that it reaches in
  the whole. So the whole is safe if no module reaches a bad state, and each requirement is on some module.

That the modules together are nonblocking does not follow: that is for a search of the whole.

Source: M. de Queiroz and J. Cury, "Modular supervisory control of large scale discrete event systems", WODES 2000,
pp. 103-110: local supervisors, of the automata that each requirement is about.
"""

from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import replace

import msgspec

from robosc.automata.compile import State, subjects_read
from robosc.automata.controlled import TRANSITIONS_PER_STATE
from robosc.automata.decision import Decision
from robosc.automata.semantics import Semantics, TooManyChoicesError
from robosc.automata.state import subjects
from robosc.automata.structure import Automaton, Edge, Role, System
from robosc.errors import SynthesisCancelled
from robosc.expressions import TRUE, Expression
from robosc.verification.explicit_check import CheckOutcome
from robosc.verification.explicit_synthesis import ExplicitSupervisor, synthesize_explicit


class ModulesVerification(msgspec.Struct, frozen=True):
    """Outcome of a check module by module: what is not shown so is not checked.

    Attributes:
        safe: No reachable bad state.
        maximally_permissive: Nothing more is disabled than needed.
        method: Description of what was done, in one line.
    """

    safe: CheckOutcome
    maximally_permissive: CheckOutcome
    method: str


def verify_modules(
    system: System,
    added: Mapping[str, Decision],
    modules: Sequence[Collection[str]],
    *,
    limit: int,
    should_stop: Callable[[], bool] = lambda: False,
) -> ModulesVerification:
    """Check a supervisor module by module.

    Args:
        system: Plants and event conditions.
        added: For each event to which the supervisor adds a condition, that condition over states of the system.
        modules: Names of the automata of each module; which they are decides only what can be shown.
        limit: States of all modules together, and steps for each of these, beyond which nothing is shown.
        should_stop: Function called now and then; once it returns true, the work ends.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    alone = _Parts(system)
    parts = [alone.of(frozenset(names)) for names in modules]
    known = [part for part in parts if part is not None]
    check = _Check(system, added, known, limit, should_stop)
    reason = "some depend on automata that are not in them" if len(known) < len(parts) else ""
    safe = False if reason else check.is_safe()
    permissive = False if reason or check.is_spent else check.is_permissive()
    if check.is_spent:
        reason = f"more than {limit} states, or very many steps"
    passed = [name for name, holds in (("safe", safe), ("maximally permissive", permissive)) if holds]
    count = f"{len(parts)} module{'s' if len(parts) != 1 else ''}"
    method = f"{' and '.join(passed) or 'nothing'} by explicit search of {count}{f' ({reason})' if reason else ''}"
    return ModulesVerification(_outcome(safe), _outcome(permissive), method)


def _outcome(holds: bool) -> CheckOutcome:
    return CheckOutcome.PASSED if holds else CheckOutcome.NOT_CHECKED


class _Parts:
    """Automata of a system that can be looked at alone."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._automata = {item.name: item for item in system.automata}
        self._takers: dict[str, list[Automaton]] = {}
        for automaton in system.automata:
            for event in automaton.alphabet:
                self._takers.setdefault(event, []).append(automaton)
        self._free = {event.name for event in system.events if not event.is_controllable}
        self._conditions = [(item, _read(item.condition)) for item in system.conditions]
        self._invariants = [(item, _read(item)) for item in system.invariants]
        self._is_plain = (
            not (system.plant_conditions or system.plant_invariants)
            and system.initial == TRUE == system.marker
            and all(item.role is Role.PLANT for item in system.automata)
        )

    def of(self, names: Set[str]) -> System | None:
        """The system of some automata alone; None if the others could prevent an uncontrollable event of them."""
        if not self._is_plain or not names <= self._automata.keys():
            return None
        automata = [self._automata[name] for name in names]
        events = frozenset(event for item in automata for event in item.alphabet)
        read = {name for item in automata for edge in item.edges for name in _read_by(edge)}
        others = (
            (item, event) for event in events & self._free for item in self._takers[event] if item.name not in names
        )
        if not read <= names or not all(_accepts(item, event) for item, event in others):
            return None
        system = self._system
        return replace(
            system,
            events=tuple(item for item in system.events if item.name in events),
            automata=tuple(item for item in system.automata if item.name in names),
            inputs=tuple(item for item in system.inputs if item.event in events),
            conditions=tuple(item for item, read in self._conditions if item.event in events and read <= names),
            invariants=tuple(item for item, read in self._invariants if read <= names),
        )


def _read(expression: Expression) -> frozenset[str]:
    return frozenset(subject.automaton for subject in subjects_read(expression))


def _read_by(edge: Edge) -> frozenset[str]:
    return _read(edge.guard).union(*(_read(update.expression) for update in edge.updates))


def _accepts(automaton: Automaton, event: str) -> bool:
    """Return True if an automaton can always take an event."""
    free = {edge.source for edge in automaton.edges if edge.event == event and edge.guard == TRUE}
    return event in automaton.monitors or free.issuperset(automaton.locations)


class _Check:
    """The check of one supervisor.

    Attributes:
        is_spent: True once the limit is reached.
    """

    def __init__(
        self,
        system: System,
        added: Mapping[str, Decision],
        parts: Sequence[System],
        limit: int,
        should_stop: Callable[[], bool],
    ) -> None:
        self._system = system
        self._added = added
        self._parts = parts
        self._left = limit
        self._steps = TRANSITIONS_PER_STATE * limit
        self._should_stop = should_stop
        self._places = {subject: place for place, subject in enumerate(subjects(system))}
        self.is_spent = False

    def _spend(self, states: int, steps: int = 0) -> None:
        self._left -= states
        self._steps -= steps
        self.is_spent = self.is_spent or self._left < 0 or self._steps < 0

    def _places_of(self, part: System) -> tuple[int, ...]:
        """The places in a state of the whole of those in a state of a part."""
        return tuple(self._places[subject] for subject in subjects(part))

    # Safe

    def is_safe(self) -> bool:
        """Return True if no module reaches a bad state, and each requirement is on some module."""
        return self._is_covered() and all(self._never_bad(part) for part in self._parts)

    def _is_covered(self) -> bool:
        invariants = {item for part in self._parts for item in part.invariants}
        automata = {item.name for part in self._parts for item in part.automata}
        conditions = {(item.event, item.condition) for part in self._parts for item in part.conditions}
        free = {event.name for event in self._system.events if not event.is_controllable}
        kept = ((item.event, item.condition) for item in self._system.conditions if item.event in free)
        return (
            invariants.issuperset(self._system.invariants)
            and automata.issuperset(item.name for item in self._system.automata)
            # Those on controllable events are kept wherever these happen.
            and conditions.issuperset(kept)
        )

    def _never_bad(self, part: System) -> bool:
        semantics, places = Semantics(part), self._places_of(part)
        may = {event.name: _May(self._added[event.name], places) for event in part.events if event.name in self._added}
        try:
            waiting = deque(semantics.initial_states)
            found = set(waiting)
            while waiting:
                if self._should_stop():
                    raise SynthesisCancelled("the check of modules was stopped")
                state = waiting.popleft()
                self._spend(1)
                if self.is_spent or semantics.bad(state):
                    return False
                for target in self._following(semantics, may, state):
                    if target not in found:
                        found.add(target)
                        waiting.append(target)
        except TooManyChoicesError:
            return False
        return True

    def _following(self, semantics: Semantics, may: Mapping[str, "_May"], state: State) -> Iterator[State]:
        """The states that follow one of a part, as far as the supervisor could let events happen."""
        for event in semantics.system.events:
            if event.name in may and not may[event.name](state):
                continue
            if not event.is_controllable or semantics.condition(state, event.name):
                targets = semantics.targets(state, event.name)
                self._spend(0, len(targets))
                yield from targets

    # Permissive

    def is_permissive(self) -> bool:
        """Return True if the supervisor forbids an event only where that of some module does."""
        made: list[tuple[System, ExplicitSupervisor]] = []
        for part in self._parts:
            found = synthesize_explicit(part, limit=max(self._left, 0), should_stop=self._should_stop)
            self._spend(self._left + 1 if found is None else len(found.explored))
            if found is None or self.is_spent:
                return False
            made.append((part, found))
        by_event: dict[str, list[tuple[tuple[int, ...], list[State]]]] = {name: [] for name in self._added}
        for part, found in made:
            places = self._places_of(part)
            allowed: dict[str, list[State]] = {event.name: [] for event in part.events if event.name in by_event}
            for state, event in found.allowed:
                if event in allowed and state in found.reachable:
                    allowed[event].append(state)
            for event, states in allowed.items():
                by_event[event].append((places, states))
        return all(self._forbids_no_more(self._added[event], allowed) for event, allowed in by_event.items())

    def _forbids_no_more(self, added: Decision, allowed: Sequence[tuple[tuple[int, ...], list[State]]]) -> bool:
        """Return True if wherever a condition is false, some module has no state left in which the event is allowed.

        Args:
            added: The condition.
            allowed: For each module the places of its states in the whole, and those in which it allows the event.
        """
        where = [{place: number for number, place in enumerate(places)} for places, _ in allowed]
        users: dict[int, list[int]] = {}
        for module, places in enumerate(where):
            for place in places:
                users.setdefault(place, []).append(module)
        if any(not states for _, states in allowed):
            return True
        # Nodes with, for each module, the states that the branches so far leave.
        waiting: list[tuple[int, list[list[State]]]] = [(added.root, [states for _, states in allowed])]
        while waiting:
            if self._should_stop():
                raise SynthesisCancelled("the check of modules was stopped")
            number, left = waiting.pop()
            if number == 1:
                continue
            if number == 0:
                return False
            node = added.nodes[number - 2]
            index, mine = added.indices[node.place], users.get(node.place, [])
            for child in sorted(set(node.children)):
                kept = list(left)
                for module in mine:
                    at = where[module][node.place]
                    kept[module] = [state for state in left[module] if node.child(index(state[at])) == child]
                    self._spend(0, len(left[module]))
                if self.is_spent:
                    return False
                if all(kept[module] for module in mine):
                    waiting.append((child, kept))
        return True


class _May:
    """A condition over states of the whole, in those of a part: true if it may be true, whatever the rest is.

    Args:
        decision: The condition.
        places: The places in a state of the whole of those in a state of the part.
    """

    def __init__(self, decision: Decision, places: Iterable[int]) -> None:
        self._decision = decision
        read = decision.places()
        self._known = {place: number for number, place in enumerate(places) if place in read}
        self._found: dict[tuple[object, ...], bool] = {}

    def __call__(self, state: State) -> bool:
        key = tuple(state[number] for number in self._known.values())
        if key not in self._found:
            self._found[key] = self._may(state)
        return self._found[key]

    def _may(self, state: State) -> bool:
        decision, waiting = self._decision, [self._decision.root]
        seen = set(waiting)
        while waiting:
            number = waiting.pop()
            if number == 1:
                return True
            if number == 0:
                continue
            node = decision.nodes[number - 2]
            at = self._known.get(node.place)
            children = node.children if at is None else (node.child(decision.indices[node.place](state[at])),)
            for child in children:
                if child not in seen:
                    seen.add(child)
                    waiting.append(child)
        return False
