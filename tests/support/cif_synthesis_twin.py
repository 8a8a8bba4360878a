"""The slow twin of synthesis of CIF models: the controlled states, from the syntax tree and state by state."""

from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import Any

from support.cif_meaning import State
from support.cif_predicates_twin import Predicates

Key = tuple[tuple[str, Hashable], ...]


class Synthesis:
    """Synthesis within the states that runs of the plants reach.

    Args:
        twin: The model.
        events: Its events, and which are controllable.
        inputs: Its input variables, with their values.
    """

    def __init__(
        self, twin: Predicates, events: Mapping[str, bool], inputs: Mapping[str, Sequence[bool] | Sequence[int]]
    ) -> None:
        self._twin, self._events, self._inputs = twin, events, inputs
        self._open: dict[Key, list[set[Key]]] = {}
        """Return the states that each event leads to from a state, as far as nothing can prevent it."""
        self._allowed: dict[Key, list[set[Key]]] = {}
        """The same of what a supervisor may prevent, and requirements allow."""
        self._good: set[Key] = set()

    def controlled(self, initial: Iterable[State], *, limit: int) -> int | None:
        """Return how many states the controlled system has, or None if the plants reach more states than the limit."""
        begins = {_key(state) for state in initial}
        queue = sorted(begins)
        for key in queue:
            self._expand(key)
            for targets in (*self._open[key], *self._allowed[key]):
                queue += [target for target in sorted(targets) if target not in self._open and target not in queue]
            if len(queue) > limit:
                return None
        self._restrict()
        found = list(begins & self._good)
        for key in found:
            for targets in self._happens(key):
                found += targets.difference(found)
        return len(found)

    def _expand(self, key: Key) -> None:
        """Find what follows a state, and whether it is bad."""
        state, twin = dict(key), self._twin
        is_good = twin.holds("requirement", state)
        self._open[key], self._allowed[key] = [], []
        for event, is_controllable in self._events.items():
            if not twin.allows("plant", event, state):
                continue
            step = twin.meaning.step(state, event)
            targets = {_key(target) for target in step.targets if twin.holds("plant", target)}
            is_allowed = step.is_allowed and twin.allows("requirement", event, state)
            if is_controllable and is_allowed and targets and not step.leaves:
                self._allowed[key].append(targets)
            elif not is_controllable and (targets or step.leaves):
                is_good = is_good and is_allowed and not step.leaves
                self._open[key].append(targets)
        for name, values in self._inputs.items():
            others = [{**state, name: value} for value in values if value != state[name]]
            self._open[key].append({_key(target) for target in others if twin.holds("plant", target)})
        if is_good:
            self._good.add(key)

    def _happens(self, key: Key) -> list[set[Key]]:
        return [*self._open[key], *(targets for targets in self._allowed[key] if targets <= self._good)]

    def _restrict(self) -> None:
        """Leave the states from which nothing bad can follow, and something marked can."""
        marked = {key for key in self._open if self._twin.is_marked(dict(key))}
        before: set[Key] = set()
        while before != self._good:
            before = self._good
            self._good = {key for key in before if all(targets <= before for targets in self._open[key])}
            if self._good != before:
                continue
            reaching, size = self._good & marked, -1
            while len(reaching) != size:
                size = len(reaching)
                reaching |= {key for key in self._good if any(targets & reaching for targets in self._happens(key))}
            self._good = reaching


def _key(state: Mapping[str, Any]) -> Key:
    return tuple(sorted(state.items()))
