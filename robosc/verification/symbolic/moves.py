"""Moves in the closed loop of a supervisor with its strategy, on sets of positions, and what comes after each.

A move is events one after the other. Then silent steps run to their end in the executor's order, and the memory takes
in the stable state.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from robosc.automata.compile import subjects_read
from robosc.automata.executable import ExecutableSystem
from robosc.automata.goal_memory import MEMORY, Place
from robosc.automata.state import Subject
from robosc.verification.symbolic.relations import Relation, Relations
from robosc.verification.symbolic.variables import Variables, after


@dataclass(frozen=True, slots=True)
class Part:
    """Event of a move.

    Attributes:
        relation: Effect of the event.
        passed_over: States in which it may as well not happen.
    """

    relation: Relation
    passed_over: Any


@dataclass(frozen=True, slots=True)
class Move:
    """Move of the surroundings, or a request: events one after the other.

    Attributes:
        parts: The events.
    """

    parts: tuple[Part, ...]

    def forward(self, variables: Variables, states: Any) -> Any:
        """Return the states that it leads to, before any silent step."""
        for part in self.parts:
            states = part.relation.image(variables, states) | (states & part.passed_over)
        return states

    def backward(self, variables: Variables, states: Any) -> Any:
        """Return the states from which it can lead to some states, before any silent step."""
        for part in reversed(self.parts):
            states = part.relation.preimage(variables, states) | (states & part.passed_over)
        return states

    def events(self, variables: Variables, before: Any, end: Any) -> tuple[str, ...]:
        """Return events that lead from a state to another one.

        Args:
            variables: The variables.
            before: The state before it.
            end: The state after it, before any silent step.
        """
        false = variables.manager.false
        sets = [before]
        for part in self.parts:
            sets.append(part.relation.image(variables, sets[-1]) | (sets[-1] & part.passed_over))
        found: list[str] = []
        for part, earlier in zip(reversed(self.parts), reversed(sets[:-1]), strict=True):
            origin = part.relation.preimage(variables, end) & earlier
            if origin != false:
                found.append(part.relation.event.name)
                end = variables.states([variables.a_state(origin)])
        return tuple(reversed(found))


@dataclass(frozen=True, slots=True)
class _Silent:
    """Silent step with the states in which it is the next one."""

    event: str
    relation: Relation


@dataclass(frozen=True, slots=True)
class _Cluster:
    """Places of the memory that are updated without reading any other place.

    Attributes:
        names: Their variables.
        steps: Their values before a stable state is observed and after it, with that state.
        updates: For each variable its next value.
    """

    names: tuple[str, ...]
    steps: Any
    updates: dict[str, Any]


class Arrival:
    """The way from the state after a move to a position: silent steps, then the memory takes in the stable state.

    Args:
        variables: Variables of the system with its memory.
        relations: Their relations.
        executable: Executable system of the robot.

    Attributes:
        unsettled: The states met so far in which a silent step is next.
    """

    def __init__(self, variables: Variables, relations: Relations, executable: ExecutableSystem) -> None:
        self._variables = variables
        self.unsettled = variables.manager.false
        self._stable = variables.manager.true
        self._silent = tuple(self._silent_steps(relations, executable))
        self._clusters = tuple(self._observing(relations, executable.obligations.places))

    def _silent_steps(self, relations: Relations, executable: ExecutableSystem) -> Iterator[_Silent]:
        variables, events = self._variables, {event.name: event for event in self._variables.system.events}
        for event in (item for item in executable.resets_and_taus if item in events):
            relation = relations.relation(events[event])
            # A reset or tau that would change nothing is not taken.
            here = variables.work.count(self._stable & moving(variables, relation).guard)
            if here != variables.manager.false:
                yield _Silent(event, replace(relation, guard=here))
                self._stable = variables.work.count(self._stable & ~here)

    def _observing(self, relations: Relations, places: Sequence[Place]) -> Iterator[_Cluster]:
        variables, manager = self._variables, self._variables.manager
        groups: list[tuple[set[str], list[Place]]] = []
        for place in places:
            read = {item.variable or "" for item in subjects_read(place.update) if item.automaton == MEMORY}
            read.add(place.name)
            touched = [group for group in groups if group[0] & read]
            groups = [group for group in groups if not group[0] & read]
            groups.append((read.union(*(group[0] for group in touched)), [*_flat(touched), place]))
        for _, members in groups:
            updates: dict[str, Any] = {}
            steps = manager.true
            for place in members:
                (name,) = variables.places[variables.place_of[Subject(MEMORY, place.name)]].names
                updates[name] = relations.truth(place.update)
                is_so = manager.var(after(name))
                steps = variables.work.count(steps & ((is_so & updates[name]) | (~is_so & ~updates[name])))
            yield _Cluster(tuple(updates), steps, updates)

    def forward(self, states: Any) -> Any:
        """Return the positions that some states end in."""
        false = self._variables.manager.false
        stable, fresh = states & self._stable, states & ~self._stable
        seen = fresh
        while fresh != false:
            led = self._variables.any_of(item.relation.image(self._variables, fresh) for item in self._silent)
            stable = stable | (led & self._stable)
            fresh = self._variables.work.count(led & ~self._stable & ~seen)
            seen = seen | fresh
        self.unsettled = self.unsettled | seen
        return self._observed(stable)

    def _observed(self, stable: Any) -> Any:
        manager = self._variables.manager
        for item in self._clusters:
            led = manager.exist(item.names, stable & item.steps)
            stable = self._variables.work.count(manager.let({after(name): name for name in item.names}, led))
        return stable

    def backward(self, positions: Any) -> Any:
        """Return the states that end in some positions, of those that were met."""
        found = positions
        for item in self._clusters:
            found = self._variables.work.count(self._variables.manager.let(item.updates, found))
        return self._before(found & self._stable)

    def _before(self, found: Any) -> Any:
        """Return some states with all of those that were met from which silent steps lead to them."""
        fresh = found
        while self._silent and fresh != self._variables.manager.false:
            led = self._variables.any_of(item.relation.preimage(self._variables, fresh) for item in self._silent)
            fresh = self._variables.work.count(led & self.unsettled & ~found)
            found = found | fresh
        return found

    def endless(self) -> Any:
        """Return the states that were met from which silent steps never end."""
        found, before = self.unsettled, None
        while found != before:
            before = found
            led = self._variables.any_of(item.relation.preimage(self._variables, found) for item in self._silent)
            found = self._variables.work.count(found & led)
        return found

    def events(self, state: Any) -> tuple[str, ...]:
        """Return the silent steps from a state, which come to an end."""
        found: list[str] = []
        while state & self._stable == self._variables.manager.false:
            for item in self._silent:
                led = item.relation.image(self._variables, state)
                if led != self._variables.manager.false:
                    found.append(item.event)
                    state = led
                    break
        return tuple(found)


def _flat(groups: Sequence[tuple[set[str], list[Place]]]) -> list[Place]:
    return [place for _, places in groups for place in places]


def moving(variables: Variables, relation: Relation) -> Relation:
    """Return an event where it changes the state, and only so far as it does."""
    manager = variables.manager
    same = manager.true
    for name in relation.names:
        same = same & manager.ite(manager.var(name), manager.var(after(name)), ~manager.var(after(name)))
    steps = variables.work.count(relation.steps & ~same)
    moved = manager.exist([after(name) for name in relation.names], steps) if relation.names else steps
    return replace(relation, steps=steps, guard=variables.work.count(relation.guard & moved))
