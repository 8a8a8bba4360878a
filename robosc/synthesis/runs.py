"""Shortest runs of the controlled system: onion rings outwards, one run back inwards.

Source: E. M. Clarke, O. Grumberg, K. L. McMillan and X. Zhao, "Efficient generation of counterexamples and witnesses
in symbolic model checking", DAC 1995, pp. 427-432 (rings of a breadth-first search; one state at a time on the way
back). A ring is what one more event reaches, so events cannot be chained as they are where only the set counts; of
many components that act by themselves the rings become far larger than the set is. Where that happens the search goes
on with chained events: runs beyond that point are still runs, though another may be shorter.
"""

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from robosc.automata.compile import State
from robosc.automata.state import subjects
from robosc.errors import InternalError
from robosc.synthesis.encoding import Bits, Encoding
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.nodes import cofactors, is_constant
from robosc.synthesis.transitions import Steps

MAXIMUM_EFFORT = 1_000_000
"""Nodes of all rings together, counted once for each event: up to about a second with the faster engine."""


@dataclass(frozen=True, slots=True)
class _Layer:
    """One step outwards.

    Attributes:
        reached: Every state found up to here.
        events: The events that can have led to those found last.
    """

    reached: Any
    events: Sequence[Steps]


@dataclass(frozen=True, slots=True)
class SystemRun:
    """A run of a system.

    Attributes:
        events: Its events.
        states: The states before, between and after them.
        is_shortest: True if it is known that no run is shorter.
    """

    events: tuple[str, ...]
    states: tuple[State, ...]
    is_shortest: bool


class ShortestRuns:
    """Runs from given states; layers are made as far as they are needed, once for all runs.

    Args:
        encoding: The variables.
        monitor: Monitor of the waiting caller.
        steps: The events, in the order in which equally short runs are preferred.
        possible: For each event the states in which it may happen, such as those of the controlled system.
        start: States in which runs begin.
    """

    def __init__(
        self,
        encoding: Encoding,
        monitor: ProgressMonitor,
        steps: Sequence[Steps],
        possible: Mapping[str, Any],
        start: Any,
    ) -> None:
        self._encoding = encoding
        self._manager = encoding.manager
        self._monitor = monitor
        self._steps = steps
        self._possible = possible
        self._layers = [_Layer(start, ())]
        self._ring = self._layers[0].reached
        self._rounds = 0
        self._rings = 0
        self._effort = 0

    def trace_to(self, states: Any) -> tuple[str, ...]:
        """Events of a run to one of some reachable states; the same for every engine.

        No run is shorter, unless the rings up to there would take more than `MAXIMUM_EFFORT`.

        Raises:
            SynthesisCancelled: The work is to end.
        """
        run = self.run_to(states)
        if run is None:
            raise InternalError("a run is looked for to states that are not reachable")
        return run.events

    def run_to(self, states: Any) -> SystemRun | None:
        """A run to one of some states, with the states on it, or None where none leads there.

        It is the same for every engine, and as short as `trace_to` says.

        Raises:
            SynthesisCancelled: The work is to end.
        """
        while self._layers[-1].reached & states == self._manager.false:
            if not self._grow():
                return None
        number = self._first_layer(states)
        is_shortest = number <= self._rings
        state = self._one(self._layers[number].reached & states)
        events: list[str] = []
        visited = [decoded(self._encoding, state)]
        while number:
            event, sources = self._before(number, state)
            events.append(event)
            number = self._first_layer(sources)
            state = self._one(self._layers[number].reached & sources)
            visited.append(decoded(self._encoding, state))
        return SystemRun(tuple(reversed(events)), tuple(reversed(visited)), is_shortest)

    def _first_layer(self, states: Any) -> int:
        """Number of the first layer that has one of some states, which the last one has."""
        return bisect_left(
            range(len(self._layers)),
            True,
            key=lambda number: self._layers[number].reached & states != self._manager.false,
        )

    def _grow(self) -> bool:
        """One round outwards; whether it found more states."""
        self._effort += self._ring.dag_size * len(self._steps)
        before = self._layers[-1].reached
        if self._effort <= MAXIMUM_EFFORT:
            self._add_ring()
        else:
            self._add_chain()
        if self._layers[-1].reached == before:
            return False
        self._rounds += 1
        self._monitor.tell("shortest runs", self._rounds, self._layers[-1].reached)
        return True

    def _add_ring(self) -> None:
        """All states one event after the last ring's."""
        before = found = self._layers[-1].reached
        for steps in self._steps:
            found = found | self._image(steps, self._ring)
        self._ring = found & ~before
        self._layers.append(_Layer(found, self._steps))
        self._rings += 1

    def _add_chain(self) -> None:
        """A layer for each event, which works on what the ones before it have found."""
        for steps in self._steps:
            before = self._layers[-1].reached
            found = before | self._image(steps, before)
            if found != before:
                self._layers.append(_Layer(found, (steps,)))

    def _image(self, steps: Steps, states: Any) -> Any:
        self._monitor.check_stop()
        return steps.image(states & self._possible[steps.event.name])

    def _before(self, number: int, state: Any) -> tuple[str, Any]:
        """An event that leads to a state which a layer is the first to have, and states before that it leads from."""
        before = self._layers[number - 1].reached
        for steps in self._layers[number].events:
            self._monitor.check_stop()
            sources = before & self._possible[steps.event.name] & steps.some(state)
            if sources != self._manager.false:
                return steps.event.name, sources
        raise InternalError("a state of a layer has no predecessor in the layers before")

    def _one(self, states: Any) -> Any:
        """One of some states."""
        return one_of(self._encoding, states)


def one_of(encoding: Encoding, states: Any) -> Any:
    """One of some states: the one whose bits read as the lowest number, in the order of the variables."""
    manager = encoding.manager
    return encoding.all_of(
        manager.var(name) if value else ~manager.var(name)
        for name, value in reversed(_lowest(encoding, states).items())
    )


def decoded(encoding: Encoding, states: Any) -> State:
    """The values of the state that `one_of` chooses, in the order of `subjects`."""
    values = _lowest(encoding, states)

    def value(bits: Bits) -> int:
        index = 0
        for name in bits.names:
            index = 2 * index + values[name]
        return index

    chosen = (encoding.subjects[subject] for subject in subjects(encoding.system))
    return tuple(bits.domain[value(bits)] for bits in chosen)


def _lowest(encoding: Encoding, states: Any) -> dict[str, bool]:
    """The bits of the state with the lowest number."""
    values = dict.fromkeys(encoding.state_names, False)
    node = states
    while not is_constant(encoding.manager, node):
        low, high = cofactors(node)
        values[node.var] = low == encoding.manager.false
        node = high if values[node.var] else low
    return values
