"""The controlled system as an explicit graph: plants, event conditions and a supervisor's added conditions."""

from collections.abc import Callable, Mapping

import msgspec

from robosc.automata.compile import State
from robosc.automata.semantics import Semantics, TooManyChoicesError
from robosc.errors import SynthesisCancelled

Added = Mapping[str, Callable[[State], bool]]
"""Conditions that a supervisor adds to events; nothing for events that are not in it."""

TRANSITIONS_PER_STATE = 20
"""Transitions for each allowed state beyond which a search is given up too: one wide integer has millions of them."""

STOP_INTERVAL = 64
"""States handled between two questions whether to stop."""


class ControlledGraph(msgspec.Struct, frozen=True):
    """Every state of the controlled system; a state's number is its place in `states`.

    Attributes:
        states: Reachable states, breadth-first, initial ones first.
        steps: For each state the events that can happen, by name, each with the numbers of the states
            that it can lead to, in the order of the states' values.
        parents: For each state the number of the state it was found from and the event; None for the
            initial ones. Following them back gives a shortest run.
    """

    states: tuple[State, ...]
    steps: tuple[tuple[tuple[str, tuple[int, ...]], ...], ...]
    parents: tuple[tuple[int, str] | None, ...]

    def trace(self, number: int) -> tuple[str, ...]:
        """Events of a shortest run from an initial state."""
        events: list[str] = []
        parent = self.parents[number]
        while parent is not None:
            before, event = parent
            events.append(event)
            parent = self.parents[before]
        return tuple(reversed(events))


def controlled_graph(
    semantics: Semantics,
    added: Added,
    *,
    limit: int,
    initial: Callable[[State], bool] = lambda state: True,
    should_stop: Callable[[], bool] = lambda: False,
) -> ControlledGraph | None:
    """The graph of the controlled system, the same for the same input.

    A controllable event happens where the plants, the ranges, its event conditions and its added condition
    allow it; an uncontrollable one where the plants do and what is added to it, if anything, holds.

    Args:
        semantics: The uncontrolled system.
        added: The supervisor's added conditions.
        initial: The initial states in which the supervisor lets the system begin.
        limit: Number of states, and of `TRANSITIONS_PER_STATE` transitions, beyond which to give up.
        should_stop: Asked now and then; once true, the work ends.

    Returns:
        The graph, or None if it is larger than `limit` allows.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    events = sorted(semantics.system.events, key=lambda event: event.name)
    try:
        states = [state for state in semantics.initial_states if initial(state)]
    except TooManyChoicesError:
        return None
    numbers = {state: number for number, state in enumerate(states)}
    parents: list[tuple[int, str] | None] = [None] * len(states)
    steps: list[tuple[tuple[str, tuple[int, ...]], ...]] = []
    transitions = 0
    while len(steps) < len(states):
        if len(steps) % STOP_INTERVAL == 0 and should_stop():
            raise SynthesisCancelled("the search of the controlled system was stopped")
        state = states[len(steps)]
        found: list[tuple[str, tuple[int, ...]]] = []
        for event in events:
            try:
                if event.is_controllable and not semantics.condition(state, event.name):
                    continue
                targets = semantics.targets(state, event.name)
            except TooManyChoicesError:
                return None
            condition = added.get(event.name)
            if not targets or (condition is not None and not condition(state)):
                continue
            transitions += len(targets)
            ordered = sorted(targets) if len(targets) > 1 else targets
            for target in ordered:
                if target not in numbers:
                    numbers[target] = len(states)
                    states.append(target)
                    parents.append((len(steps), event.name))
            found.append((event.name, tuple(numbers[target] for target in ordered)))
        steps.append(tuple(found))
        if len(states) > limit or transitions > TRANSITIONS_PER_STATE * limit:
            return None
    return ControlledGraph(tuple(states), tuple(steps), tuple(parents))
