"""Supervisor synthesis on the explicit graph of reachable states: symbolic synthesis must give the same result.

The fixed point of Ramadge and Wonham, "Supervisory control of a class of discrete event processes",
SIAM J. Control and Optimization 25(1), 1987, pp. 206-230, in the alternating form of Ouedraogo, Kumar,
Malik and Akesson, "Nonblocking and safe control of discrete-event systems modeled as extended finite
automata", IEEE T-ASE 8(3), 2011, pp. 560-569, Algorithm 1.
"""

from collections.abc import Callable

import msgspec

from robosc.automata.compile import State
from robosc.automata.controlled import STOP_INTERVAL, TRANSITIONS_PER_STATE
from robosc.automata.semantics import Semantics, TooManyChoicesError
from robosc.automata.structure import System
from robosc.errors import SynthesisCancelled


class ExplicitSupervisor(msgspec.Struct, frozen=True):
    """The maximally permissive supervisor of a system.

    Attributes:
        is_empty: True if no supervisor exists: no initial state is good.
        explored: States that the plant can reach under the event conditions, without going on from bad ones.
        good: Those of them from which a supervisor can keep the system safe and nonblocking.
        allowed: State and controllable event, where the state is good and the event may happen.
        reachable: States of the controlled system; none if the supervisor is empty.
    """

    is_empty: bool
    explored: frozenset[State]
    good: frozenset[State]
    allowed: frozenset[tuple[State, str]]
    reachable: frozenset[State]

    def allows(self, state: State, event: str) -> bool:
        """Return True if a controllable event may happen in an explored state."""
        return (state, event) in self.allowed


class _Step(msgspec.Struct, frozen=True):
    """One event in one state, with every state that it can lead to (numbers)."""

    event: str
    is_controllable: bool
    targets: tuple[int, ...]


class _Graph(msgspec.Struct, frozen=True):
    """Explored states, the initial ones first, and their steps."""

    states: tuple[State, ...]
    initial_count: int
    steps: tuple[tuple[_Step, ...], ...]
    bad: frozenset[int]
    marked: frozenset[int]


def synthesize_explicit(
    system: System,
    *,
    limit: int,
    should_stop: Callable[[], bool] = lambda: False,
) -> ExplicitSupervisor | None:
    """The maximally permissive supervisor, by going through every reachable state.

    Args:
        system: Plants and event conditions.
        limit: Number of states, and of `TRANSITIONS_PER_STATE` transitions, beyond which to give up.
        should_stop: Asked now and then; once true, the work ends.

    Returns:
        The supervisor (which may be empty), or None if what is reachable is larger than `limit` allows.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    try:
        graph = _explore(system, limit, should_stop)
    except TooManyChoicesError:
        graph = None
    if graph is None:
        return None
    good = _good_states(graph, should_stop)
    reachable = _controlled_states(graph, good)
    return ExplicitSupervisor(
        is_empty=not _initial_states(graph, good),
        explored=frozenset(graph.states),
        good=frozenset(graph.states[number] for number in good),
        allowed=frozenset(
            (graph.states[number], step.event)
            for number in good
            for step in graph.steps[number]
            if step.is_controllable and good.issuperset(step.targets)
        ),
        reachable=frozenset(graph.states[number] for number in reachable),
    )


def _explore(system: System, limit: int, should_stop: Callable[[], bool]) -> _Graph | None:
    """The graph of the plant under the event conditions on controllable events; bad states are its ends."""
    semantics = Semantics(system)
    states = list(semantics.initial_states)
    numbers = {state: number for number, state in enumerate(states)}
    steps: list[tuple[_Step, ...]] = []
    bad = set[int]()
    transitions = 0
    while len(steps) < len(states):
        if len(steps) % STOP_INTERVAL == 0 and should_stop():
            raise SynthesisCancelled("explicit synthesis was stopped")
        state = states[len(steps)]
        if semantics.bad(state):
            bad.add(len(steps))
            steps.append(())
            continue
        found: list[_Step] = []
        for event in system.events:
            if event.is_controllable and not semantics.condition(state, event.name):
                continue
            targets = semantics.targets(state, event.name)
            transitions += len(targets)
            for target in targets:
                if target not in numbers:
                    numbers[target] = len(states)
                    states.append(target)
            if targets:
                found.append(_Step(event.name, event.is_controllable, tuple(numbers[target] for target in targets)))
        steps.append(tuple(found))
        if len(states) > limit or transitions > TRANSITIONS_PER_STATE * limit:
            return None
    marked = frozenset(number for number, state in enumerate(states) if semantics.is_marked(state))
    return _Graph(tuple(states), len(semantics.initial_states), tuple(steps), frozenset(bad), marked)


def _good_states(graph: _Graph, should_stop: Callable[[], bool]) -> set[int]:
    """The largest set of states without a bad one that is nonblocking and that no uncontrollable event leaves."""
    good = set(range(len(graph.states))) - graph.bad
    while True:
        if should_stop():
            raise SynthesisCancelled("explicit synthesis was stopped")
        nonblocking = _nonblocking_states(graph, good)
        controllable = _controllable_states(graph, nonblocking)
        if controllable == good:
            return good
        good = controllable


def _nonblocking_states(graph: _Graph, good: set[int]) -> set[int]:
    """The states of `good` from which a marked one is reached without leaving `good`."""
    predecessors: dict[int, list[int]] = {number: [] for number in good}
    for number in good:
        for step in graph.steps[number]:
            # A supervisor allows a controllable event as a whole or not at all.
            if step.is_controllable and not good.issuperset(step.targets):
                continue
            for target in step.targets:
                if target in good:
                    predecessors[target].append(number)
    # Written out in each part that walks backwards: verification shares nothing with what it checks.
    reached = graph.marked & good
    found, frontier = set(reached), list(reached)
    while frontier:
        for number in predecessors[frontier.pop()]:
            if number not in found:
                found.add(number)
                frontier.append(number)
    return found


def _controllable_states(graph: _Graph, good: set[int]) -> set[int]:
    """The states of `good` that no single uncontrollable event leaves."""
    return {
        number
        for number in good
        if all(step.is_controllable or good.issuperset(step.targets) for step in graph.steps[number])
    }


def _initial_states(graph: _Graph, good: set[int]) -> list[int]:
    """The initial states that a supervisor can begin in."""
    return [number for number in range(graph.initial_count) if number in good]


def _controlled_states(graph: _Graph, good: set[int]) -> set[int]:
    """Return the states reachable from initial states of `good` under the supervisor that keeps to it."""
    frontier = _initial_states(graph, good)
    found = set(frontier)
    while frontier:
        for step in graph.steps[frontier.pop()]:
            if good.issuperset(step.targets):
                frontier.extend(target for target in step.targets if target not in found)
                found.update(step.targets)
    return found
