"""Shortest runs of the controlled system: onion rings outwards, one run back inwards.

Source: E. M. Clarke, O. Grumberg, K. L. McMillan and X. Zhao, "Efficient generation of counterexamples and witnesses
in symbolic model checking", DAC 1995, pp. 427-432 (rings of a breadth-first search; one state at a time on the way
back). A ring has the states that one more event reaches, so events cannot be chained as in the computation of a set.
For many independent components, the rings become far larger than the set. The search then continues with chained
events: its runs are still possible, but they may not be shortest.
"""

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from robosc.automata.compile import State
from robosc.errors import InternalError
from robosc.synthesis.encoding import Bits, Encoding
from robosc.synthesis.engines import Manager
from robosc.synthesis.image import Image
from robosc.synthesis.monitor import BoundedMonitor, ProgressMonitor
from robosc.synthesis.nodes import cofactors, implies, is_constant
from robosc.synthesis.transitions import Steps

MAXIMUM_EFFORT = 1_000_000
"""Nodes of all rings together, counted once for each event: up to about a second with the faster engine."""


class _Layer(msgspec.Struct, frozen=True):
    """One step outwards.

    Attributes:
        reached: Every state found up to here.
        events: The events that can have led to those found last.
    """

    reached: Any
    events: Sequence[Steps]


class SystemRun(msgspec.Struct, frozen=True):
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
        chained: Monitor of the nodes that chained events work on, one step each; None for no limit.
    """

    def __init__(
        self,
        encoding: Encoding,
        monitor: ProgressMonitor,
        steps: Sequence[Steps],
        possible: Mapping[str, Any],
        start: Any,
        chained: BoundedMonitor | None = None,
    ) -> None:
        self._encoding = encoding
        self._manager = encoding.manager
        self._monitor = monitor
        self._steps = steps
        self._possible = possible
        self._chained = chained
        self._images: dict[str, Image] = {}
        self._layers = [_Layer(start, ())]
        self._ring = self._layers[0].reached
        self._rounds = 0
        self._rings = 0
        self._effort = 0

    @property
    def reached(self) -> Any:
        """Every state found so far."""
        return self._layers[-1].reached

    def rings_meet(self, states: Any) -> bool | None:
        """Return whether runs lead to some states, None where the rings up to there take more than `MAXIMUM_EFFORT`.

        Raises:
            SynthesisCancelled: The work is to end.
        """
        while self.reached & states == self._manager.false:
            if self._effort + self._ring_effort() > MAXIMUM_EFFORT:
                return None
            if not self._grow():
                return False
        return True

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
            EffortSpentError: Chained events take more nodes than they may.
        """
        while self.reached & states == self._manager.false:
            if not self._grow():
                return None
        number, found = self._first_layer(states)
        is_shortest = number <= self._rings
        state, values = one_of(self._encoding, found)
        events: list[str] = []
        visited = [values]
        while number:
            event, sources = self._before(number, state)
            events.append(event)
            number, found = self._first_layer(sources)
            state, values = one_of(self._encoding, found)
            visited.append(values)
        return SystemRun(tuple(reversed(events)), tuple(reversed(visited)), is_shortest)

    def _first_layer(self, states: Any) -> tuple[int, Any]:
        """Number of the first layer that has some of the states, which the last one has, and those that it has."""
        return first_of(self._manager, [layer.reached for layer in self._layers], states)

    def _ring_effort(self) -> int:
        """Effort that the next ring takes."""
        return int(self._ring.dag_size) * len(self._steps)

    def _grow(self) -> bool:
        """One round outwards; whether it found more states."""
        self._effort += self._ring_effort()
        before = self.reached
        if self._effort <= MAXIMUM_EFFORT:
            self._add_ring()
        else:
            self._add_chain()
        if self.reached == before:
            return False
        self._rounds += 1
        self._monitor.report("shortest runs", self._rounds, self.reached)
        return True

    def _add_ring(self) -> None:
        """All states one event after the last ring's."""
        before = found = self.reached
        for steps in self._steps:
            found = found | self._image(steps, self._ring)
        self._ring = found & ~before
        self._layers.append(_Layer(found, self._steps))
        self._rings += 1

    def _add_chain(self) -> None:
        """A layer for each event, which works on what the ones before it have found."""
        for steps in self._steps:
            before = self.reached
            if self._chained is not None:
                self._chained.check_stop(before.dag_size)
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
            sources = self._backwards(steps)(state) & before
            if sources != self._manager.false:
                return steps.event.name, sources
        raise InternalError("a state of a layer has no predecessor in the layers before")

    def _backwards(self, steps: Steps) -> Image:
        """The image that leads from states to those before them in which an event may happen."""
        name = steps.event.name
        if name not in self._images:
            self._images[name] = steps.backwards(self._possible[name])
        return self._images[name]


def first_of(manager: Manager, layers: Sequence[Any], states: Any) -> tuple[int, Any]:
    """Number of the first of some layers that has some of the states, and those of them that it has.

    Args:
        manager: The manager of all predicates.
        layers: The layers, each of which has all states of the ones before it.
        states: The states, of which the last layer has some.
    """
    number = bisect_left(range(len(layers) - 1), True, key=lambda place: not implies(manager, states, ~layers[place]))
    return number, states & layers[number]


def one_of(encoding: Encoding, states: Any) -> tuple[Any, State]:
    """One of some states: the one whose bits read as the lowest number, in the order of the variables.

    Its values come with it, in the order of `subjects`.
    """
    values = _lowest(encoding, states)
    return encoding.manager.cube(values), _decoded(encoding, values)


def decoded(encoding: Encoding, states: Any) -> State:
    """The values of the state that `one_of` chooses, in the order of `subjects`."""
    return _decoded(encoding, _lowest(encoding, states))


def _decoded(encoding: Encoding, values: Mapping[str, bool]) -> State:
    def value(bits: Bits) -> int:
        index = 0
        for name in bits.names:
            index = 2 * index + values[name]
        return index

    return tuple(bits.domain[value(bits)] for bits in encoding.places)


def _lowest(encoding: Encoding, states: Any) -> dict[str, bool]:
    """The bits of the state with the lowest number."""
    values = dict.fromkeys(encoding.state_names, False)
    node = states
    while not is_constant(encoding.manager, node):
        low, high = cofactors(node)
        values[node.var] = low == encoding.manager.false
        node = high if values[node.var] else low
    return values
