"""States reachable by events from some states, and states from which some states are reachable."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from robosc.automata.compile import State
from robosc.verification.symbolic.relations import Relation
from robosc.verification.symbolic.variables import Variables
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


class Reachability:
    """Reachable states, the states from which others are reachable, and runs.

    Args:
        variables: The variables.
        relations: The events that may happen.
    """

    def __init__(self, variables: Variables, relations: Sequence[Relation]) -> None:
        self._variables = variables
        level = {name: number for number, name in enumerate(variables.names)}

        def top(relation: Relation) -> int:
            return min((level[name] for name in relation.touched if name in level), default=len(level))

        # Events that work low in the diagrams come first, and what they can do is done before any other goes on.
        self._relations = sorted(relations, key=top, reverse=True)
        self._related = [
            [number for number, other in enumerate(self._relations) if other.touched & item.touched]
            for item in self._relations
        ]
        self._history: list[tuple[Any, Relation]] = []

    def reachable(self, states: Any) -> Any:
        """Every state that can be reached from some states."""
        self._history.clear()
        return self._closed(states, lambda item, found: item.image(self._variables, found), self._history)

    def reaching(self, states: Any) -> Any:
        """Every state from which some states can be reached."""
        return self._closed(states, lambda item, found: item.preimage(self._variables, found), [])

    def _closed(self, states: Any, step: Callable[[Relation, Any], Any], history: list[tuple[Any, Relation]]) -> Any:
        """`states` and all that steps add; `history` gets what there was before each step that added something."""
        waiting = [True] * len(self._relations)
        is_last_pass = False
        while True:
            number = next((number for number, waits in enumerate(waiting) if waits), None)
            if number is None:
                if is_last_pass:
                    return states
                # That only related events matter is a matter of speed: at last each is asked once more.
                waiting, is_last_pass = [True] * len(waiting), True
                continue
            waiting[number] = False
            relation = self._relations[number]
            grown = self._variables.work.count(states | step(relation, states))
            if grown != states:
                history.append((states, relation))
                states, is_last_pass = grown, False
                for other in self._related[number]:
                    waiting[other] = True

    def run(self, initial: Any, wanted: Any) -> Trace:
        """A run into one of some states that are reachable from the initial ones: a shortest one if that can be found.

        Only after `reachable` has been asked for with these initial states.
        """
        ordinary = self._variables.work
        self._variables.work = ordinary.again()
        try:
            return self._shortest_run(initial, wanted)
        except TooMuchWorkError:
            self._variables.work = ordinary.again()
            return self._any_run(wanted)
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

    def _any_run(self, wanted: Any) -> Trace:
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
            state = end = variables.a_state(self._history[0][0] & wanted if self._history else wanted)
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
