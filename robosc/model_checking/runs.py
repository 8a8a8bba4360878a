"""Runs through sets of states: shortest paths, and lassos.

Source: E. M. Clarke, O. Grumberg, K. L. McMillan and X. Zhao, "Efficient generation of counterexamples and witnesses
in symbolic model checking", DAC 1995, pp. 427-432: rings of a breadth-first search, and one state at a time back. A
cycle is searched through one state; if that state is on no cycle, the search goes on from a later one. The paper takes
the state at the far end of the search. We take the nearest state with an infinite past and an infinite future, which is
on a cycle or between two, so that the way to the cycle stays short.
"""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from robosc.errors import InternalError
from robosc.model_checking.kripke import KripkeStructure, Move

MAXIMUM_EFFORT = 1_000_000
"""Nodes of all rings of a path together, counted once for each move; beyond it moves are chained, and the path may be
longer than it must be."""


@dataclass(frozen=True, slots=True)
class Path:
    """A way from one state to another.

    Attributes:
        states: Single states, as predicates; at least one.
        events: Event between each two states.
    """

    states: tuple[Any, ...]
    events: tuple[str | None, ...] = ()

    @property
    def end(self) -> Any:
        """The last state."""
        return self.states[-1]

    def then(self, other: "Path") -> "Path":
        """This path and one that begins where it ends."""
        return Path((*self.states, *other.states[1:]), (*self.events, *other.events))


@dataclass(frozen=True, slots=True)
class _Layer:
    """One step outwards: every state found up to here, and the moves that can have led to those found last."""

    reached: Any
    moves: Sequence[Move]


class Runs:
    """Finder of runs.

    Args:
        structure: Structure that runs go through.
    """

    def __init__(self, structure: KripkeStructure) -> None:
        self._structure = structure
        self._manager = structure.manager
        self._monitor = structure.monitor

    def path(self, start: Any, within: Any, goal: Any) -> Path:
        """A path from a single state to one of `goal`; every state before its last is one of `within`.

        No path is shorter, unless the rings up to there would take more than `MAXIMUM_EFFORT`.
        """
        found = self.search(start, within, goal)
        if found is None:
            raise InternalError("a run is looked for to states that are not reachable")
        return found

    def step(self, start: Any, goal: Any) -> Path:
        """A step from a single state to one of `goal`."""
        for move in self._structure.moves:
            found = move.image(start) & goal
            if found != self._manager.false:
                return Path((start, self._structure.one(found)), (move.event,))
        raise InternalError("a step is looked for to states that do not follow")

    def cycle(self, start: Any, within: Any) -> Path | None:
        """A shortest path of at least one step from a state of `within` back to itself, through such states only."""
        back = self.search(self._structure.after(start) & within, within, start)
        return None if back is None else self.step(start, back.states[0]).then(back)

    def lasso(self, start: Any, within: Any) -> tuple[Path, int]:
        """A path from a state through states of `within` that ends where it has been before, and the place of that.

        Args:
            start: A single state of `within`.
            within: States of which each has a successor among them.
        """
        path = Path((start,))
        while True:
            cycle = self.cycle(path.end, within)
            if cycle is not None:
                return path.then(cycle), len(path.states) - 1
            # A state that is on no cycle has no past among those that it leads to, so it is none of the next ones.
            path = path.then(self.path(path.end, within, self._with_past(path.end, within)))

    def _with_past(self, start: Any, within: Any) -> Any:
        """The states that `start` leads to and that have an endless past among these."""
        ahead = self._structure.after(start) & within
        while True:
            grown = ahead | (self._structure.after(ahead) & within)
            if grown == ahead:
                break
            ahead = grown
        return self._structure.lasting(ahead, self._structure.after, "cycles")

    def search(self, start: Any, within: Any, goal: Any) -> Path | None:
        """The same from one of several states, or None if there is no such path."""
        layers = [_Layer(start, ())]
        ring, effort, false = start, 0, self._manager.false
        while layers[-1].reached & goal == false:
            before = layers[-1].reached
            effort += ring.dag_size * len(self._structure.moves)
            if effort <= MAXIMUM_EFFORT:
                found = before | self._structure.after(ring & within)
                ring = found & ~before
                layers.append(_Layer(found, self._structure.moves))
            else:
                for move in self._structure.moves:
                    self._monitor.check_stop()
                    found = layers[-1].reached | move.image(layers[-1].reached & within)
                    if found != layers[-1].reached:
                        layers.append(_Layer(found, (move,)))
            if layers[-1].reached == before:
                return None
            self._monitor.report("runs", len(layers) - 1, layers[-1].reached)
        return self._back(layers, within, goal)

    def _back(self, layers: Sequence[_Layer], within: Any, goal: Any) -> Path:
        """One state at a time from the goal to the first layer."""
        number = self._first(layers, goal)
        states = [self._structure.one(layers[number].reached & goal)]
        events: list[str | None] = []
        while number:
            move, sources = self._before(layers, number, states[-1], within)
            number = self._first(layers, sources)
            states.append(self._structure.one(layers[number].reached & sources))
            events.append(move.event)
        return Path(tuple(reversed(states)), tuple(reversed(events)))

    def _first(self, layers: Sequence[_Layer], states: Any) -> int:
        """Number of the first layer that has one of some states, which the last one has."""
        false = self._manager.false
        return bisect_left(range(len(layers)), True, key=lambda number: layers[number].reached & states != false)

    def _before(self, layers: Sequence[_Layer], number: int, state: Any, within: Any) -> tuple[Move, Any]:
        """A move that leads to a state which a layer is the first to have, and the states that it leads there from."""
        for move in layers[number].moves:
            self._monitor.check_stop()
            sources = layers[number - 1].reached & within & move.sources(state)
            if sources != self._manager.false:
                return move, sources
        raise InternalError("a state of a layer has no predecessor in the layers before")
