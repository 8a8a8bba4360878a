"""States reachable by events from some states, and states from which some states are reachable."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from typing import Any

from robosc.automata.compile import State
from robosc.verification.symbolic.relations import Relation
from robosc.verification.symbolic.variables import Variables, cofactors
from robosc.verification.symbolic.work import TooMuchWorkError


@dataclass(frozen=True, slots=True)
class Trace:
    """A run into some states.

    Attributes:
        trace: Its events.
        state: The state that it ends in.
        is_shortest: True if there is certainly none shorter.
    """

    trace: tuple[str, ...]
    state: State
    is_shortest: bool


_TIMES = 20
"""Work that a run may take, in terms of that of a whole check, where a shortest one is too much."""

type _Step = Callable[[Relation, Variables, Any], Any]


class Reachability:
    """Reachable states, the states from which others are reachable, and runs.

    Args:
        variables: The variables.
        relations: The events that may happen.
    """

    def __init__(self, variables: Variables, relations: Sequence[Relation]) -> None:
        self._variables = variables
        level, own = variables.level, set(variables.names)
        self._footprints = {
            relation.event.name: own.intersection((*relation.touched, *relation.names)) for relation in relations
        }

        def top(relation: Relation) -> int:
            return min((level[name] for name in self._footprints[relation.event.name]), default=len(level))

        # Events that work low in the diagrams come first, and what they can do is done before any other goes on.
        self._relations = sorted(relations, key=top, reverse=True)
        self._history: list[tuple[Any, Relation]] = []

    def reachable(self, states: Any) -> Any:
        """Every state that can be reached from some states."""
        return _Saturation(self._variables, self._groups(), Relation.successors).of(states)

    def reaching(self, states: Any) -> Any:
        """Every state from which some states can be reached."""
        return _Saturation(self._variables, self._groups(), Relation.predecessors).of(states)

    def _groups(self) -> list["_Group"]:
        """The events that touch anything, by the highest variable that they touch; the highest ones first."""
        level, found = self._variables.level, dict[int, list[tuple[Relation, int]]]()
        for relation in self._relations:
            depths = [level[name] for name in self._footprints[relation.event.name]]
            if depths:
                found.setdefault(min(depths), []).append((relation, max(depths)))
        return sorted(found.items(), key=lambda group: group[0])

    def _grow(self, states: Any) -> None:
        """Find what events can reach one after the other, and remember what there was before each that added some."""
        self._history.clear()
        touching, writing = dict[str, list[int]](), dict[str, list[int]]()
        for number, relation in enumerate(self._relations):
            for name in self._footprints[relation.event.name]:
                touching.setdefault(name, []).append(number)
            for name in relation.names:
                writing.setdefault(name, []).append(number)
        waiting = list(range(len(self._relations)))
        waits = [True] * len(waiting)
        while waiting:
            number = heappop(waiting)
            waits[number] = False
            relation = self._relations[number]
            grown = self._variables.work.count(states | relation.image(self._variables, states))
            if grown == states:
                continue
            self._history.append((states, relation))
            states = grown
            # Others can do no more than before: they neither touch what it changes nor change what it touches.
            related = {other for name in relation.names for other in touching[name]}
            related.update(other for name in self._footprints[relation.event.name] for other in writing.get(name, ()))
            for other in related:
                if not waits[other]:
                    waits[other] = True
                    heappush(waiting, other)

    def run(self, initial: Any, wanted: Any) -> Trace:
        """A run into one of some states that are reachable from the initial ones: a shortest one if that can be found.

        Raises:
            TooMuchWorkError: Any run takes far more work than there may be.
        """
        ordinary = self._variables.work
        self._variables.work = ordinary.again()
        try:
            return self._shortest_run(initial, wanted)
        except TooMuchWorkError:
            # It is worth it: something is wrong.
            self._variables.work = ordinary.again(_TIMES)
            self._grow(initial)
            return self._any_run(initial, wanted)
        finally:
            self._variables.work = ordinary

    def _shortest_run(self, initial: Any, wanted: Any) -> Trace:
        false = self._variables.manager.false
        layers, seen = [initial], initial
        while layers[-1] & wanted == false:
            following = self._variables.any_of(item.image(self._variables, layers[-1]) for item in self._by_name())
            layers.append(self._variables.work.count(following & ~seen))
            seen = seen | following
        state = end = self._variables.a_state(layers[-1] & wanted)
        trace: list[str] = []
        for layer in reversed(layers[:-1]):
            for relation in self._by_name():
                before = relation.preimage(self._variables, self._variables.states([state])) & layer
                if before != false:
                    trace.append(relation.event.name)
                    state = self._variables.a_state(before)
                    break
        return Trace(tuple(reversed(trace)), end, True)

    def _any_run(self, initial: Any, wanted: Any) -> Trace:
        """A run along what the search has found, step by step."""
        variables, false = self._variables, self._variables.manager.false
        # The sets grow, so the first that the wanted states meet is found by halves.
        low, high = 0, len(self._history)
        while low < high:
            middle = (low + high) // 2
            if self._history[middle][0] & wanted != false:
                high = middle
            else:
                low = middle + 1
        trace: list[str] = []
        if low == 0:
            state = end = variables.a_state(initial & wanted)
            return Trace((), end, False)
        before, relation = self._history[low - 1]
        state = end = variables.a_state(relation.image(variables, before) & wanted)
        while True:
            here = variables.states([state])
            before, relation = self._history[low - 1]
            trace.append(relation.event.name)
            earlier = relation.preimage(variables, here) & before
            state = variables.a_state(earlier)
            here = variables.states([state])
            while low > 0 and self._history[low - 1][0] & here != false:
                low -= 1
            if low == 0:
                return Trace(tuple(reversed(trace)), end, False)

    def _by_name(self) -> list[Relation]:
        return sorted(self._relations, key=lambda item: item.event.name)


type _Group = tuple[int, list[tuple[Relation, int]]]
"""Level of the highest variable that events touch, with these events, each with the level of the lowest one."""


class _Saturation:
    """Closure of sets of states under the steps of events, in each part of a diagram by itself.

    What an event does not touch may stand above the part in which it works, and its work is done once for all that is
    above. The lower an event, the earlier it is done, and done again wherever one above it has added anything.

    Source: G. Ciardo, G. Luettgen and R. Siminiceanu, "Saturation: an efficient iteration strategy for symbolic
    state-space generation", TACAS 2001, LNCS 2031, pp. 328-342; here events are relations on any values.

    Args:
        variables: The variables.
        groups: The events, the highest ones first.
        step: The states that an event adds to some.
    """

    def __init__(self, variables: Variables, groups: Sequence[_Group], step: _Step) -> None:
        self._variables = variables
        self._groups = groups
        self._step = step
        self._known: dict[tuple[Any, int], Any] = {}

    def of(self, states: Any, number: int = 0) -> Any:
        """Return a part of a set of states closed under the events of a group, and of all lower ones.

        Args:
            states: The part: it begins at the group's level, or events of the group are the same for all of it.
            number: The group.
        """
        manager = self._variables.manager
        if number == len(self._groups) or states in (manager.true, manager.false):
            return states
        known = self._known.get((states, number))
        if known is None:
            known = self._known[states, number] = self._closed(states, number)
        return known

    def _closed(self, states: Any, number: int) -> Any:
        level, relations = self._groups[number]
        if states.level < level:
            low, high = cofactors(states)
            return self._variables.manager.ite(
                self._variables.manager.var(states.var), self.of(high, number), self.of(low, number)
            )
        states = self.of(states, number + 1)
        while True:
            # The results of all of them are passed down at once: a part with many events is gone through a few times.
            grown = states
            for relation, lowest in relations:
                led = self._variables.work.count_near(self._step(relation, self._variables, grown), lowest)
                grown = grown | led
            if grown == states:
                return states
            states = self.of(grown, number + 1)
