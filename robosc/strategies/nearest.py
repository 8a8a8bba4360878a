"""The nearest to a goal that can be reached, where the goal itself cannot be, whatever the surroundings do."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import msgspec

from robosc.automata import ExecutableSystem
from robosc.automata.compile import State
from robosc.automata.semantics import Semantics, TooManyChoicesError
from robosc.automata.state import subjects
from robosc.controller_properties.controller import Controller, Node
from robosc.controller_properties.search import STOP_INTERVAL
from robosc.errors import SynthesisCancelled
from robosc.expressions import Value
from robosc.strategies.synthesize import StrategySynthesis
from robosc.supervisor import AddedCondition, DecisionDiagram
from robosc.supervisor.predicates import state_predicate

LIMIT = 20_000
"""Positions beyond which the search is given up."""


class Nearest(msgspec.Struct, frozen=True):
    """The nearest to a goal.

    Attributes:
        goal: Number of the goal.
        is_reached: True if the goal is true there: it can be reached, but not again and again, or not with the others.
        events: Events of the controller and its surroundings that lead there, as few moves as possible.
        state: State there, by component, service and action; variables by `Component.variable`.
        missing: Events by which the behaviours alone would lead on to the goal; the first of them is not allowed.
            Empty if the goal is true.
    """

    goal: int
    is_reached: bool
    events: tuple[str, ...]
    state: Mapping[str, Value]
    missing: tuple[str, ...]


def nearest_to(
    synthesis: StrategySynthesis,
    goals: Sequence[int],
    executable: ExecutableSystem,
    added: Sequence[AddedCondition],
    should_stop: Callable[[], bool],
    limit: int = LIMIT,
) -> Nearest | None:
    """Return the nearest to the first goal that is never true, or to the first goal.

    Args:
        synthesis: Synthesis of the strategy.
        goals: Numbers of goals that cannot be reached together, even if the surroundings do all they can.
        executable: Executable system of the robot.
        added: The conditions that its supervisor adds.
        should_stop: Function called now and then; once it returns true, the work ends.
        limit: Positions beyond which the search is given up.

    Returns:
        The nearest; None if the behaviours alone lead nowhere nearer, or if the search was given up.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        UnsupportedModelError: A predicate would be too large.
    """
    goal, rings = _rings(synthesis, goals)
    if not rings:
        return None
    system = executable.remembering_automata
    memory = (False,) * len(executable.obligations.places)
    near = [state_predicate(system, ring) for ring in rings]

    def is_in(ring: int, state: State) -> bool:
        return near[ring]((*state, "only", *memory))

    within = [partial(is_in, number) for number in range(len(near))]

    controller = Controller(executable, added)
    try:
        found = _run_to(controller, within[-1], should_stop, limit)
        if found is None:
            return None
        state, events = found
        missing = _onwards(Semantics(controller.system), state, within)
    except TooManyChoicesError:
        return None
    names = [str(subject) for subject in subjects(controller.system)]
    several = {item.name for item in controller.system.automata if len(item.locations) > 1}
    shown = {
        name: value
        for name, subject, value in zip(names, subjects(controller.system), state, strict=True)
        if subject.variable is not None or subject.automaton in several
    }
    return Nearest(goal, len(rings) == 1, events, shown, missing)


def _rings(synthesis: StrategySynthesis, goals: Sequence[int]) -> tuple[int, list[DecisionDiagram]]:
    """Return a goal and predicates around it: where it is true, then from where the behaviours alone lead there.

    The last one is the first that the controlled system can get to; none if there is none.
    """
    arena = synthesis.arena
    found: tuple[int, list[Any]] | None = None
    for goal in goals:
        rings = [synthesis.sought(goal)]
        if rings[0] & arena.positions == synthesis.false:
            while rings[-1] & arena.positions == synthesis.false:
                wider = rings[-1] | arena.behaviours(rings[-1])
                if wider == rings[-1]:
                    return goal, []
                rings.append(wider)
            return goal, [synthesis.diagram(item) for item in rings]
        found = found or (goal, rings)
    goal, rings = found or (goals[0], [])
    return goal, [synthesis.diagram(item) for item in rings]


def _run_to(
    controller: Controller, is_near: Callable[[State], bool], should_stop: Callable[[], bool], limit: int
) -> tuple[State, tuple[str, ...]] | None:
    """Return a stable state that is near, with the events to it, fewest moves first; None beyond a limit."""
    start = controller.run(controller.start)
    if start.end is None:
        return None
    parents: dict[Node, tuple[Node | None, tuple[str, ...]]] = {start.end: (None, start.events)}
    queue = [start.end]
    for place, node in enumerate(queue):
        if place % STOP_INTERVAL == 0 and should_stop():
            raise SynthesisCancelled("the search for the nearest to a goal was stopped")
        if is_near(node[0]):
            events: list[str] = []
            before: Node | None = node
            while before is not None:
                before, more = parents[before]
                events[:0] = more
            return node[0], tuple(events)
        if place >= limit:
            return None
        for event, _, target in controller.moves(node):
            run = controller.run(target)
            if run.end is not None and run.end not in parents:
                parents[run.end] = node, (*event, *run.events)
                queue.append(run.end)
    return None


def _onwards(semantics: Semantics, state: State, rings: Sequence[Callable[[State], bool]]) -> tuple[str, ...]:
    """Return events of the behaviours alone that lead from the last ring to the first."""
    events: list[str] = []
    names = [event.name for event in semantics.system.events]
    for is_nearer in reversed(rings[:-1]):
        if is_nearer(state):
            continue
        steps = ((name, target) for name in names for target in semantics.targets(state, name))
        found = next((step for step in steps if is_nearer(step[1])), None)
        if found is None:
            return ()
        events.append(found[0])
        state = found[1]
    return tuple(events)
