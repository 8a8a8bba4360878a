"""Runs under a strategy, followed state by state: whether a run that a check reports misses its goal for ever."""

from collections.abc import Iterator
from itertools import combinations
from typing import Any

from robosc.controller_properties import Controller, MissedGoal, StrategyRun
from robosc.supervisor import Strategy, Supervisor
from support.goal_twin import components

Position = tuple[Any, Any, int]


class _Loop:
    def __init__(self, supervisor: Supervisor, strategy: Strategy) -> None:
        self.controller = Controller(supervisor.executable, supervisor.added)
        self.run = StrategyRun(supervisor.executable, strategy)

    def arrived(self, node: Any, memory: Any, mode: int, events: tuple[str, ...]) -> tuple[tuple[str, ...], Any]:
        """Return all events up to a position, and the position, or the state where silent steps begin for ever."""
        run = self.controller.run(node)
        if run.end is None:
            return events, node[0]
        return (*events, *run.events), (run.end, self.run.observed(run.end[0], memory), mode)

    def moves(self, position: Position) -> Iterator[tuple[tuple[str, ...], Any]]:
        """Yield the moves of the surroundings."""
        node, memory, mode = position
        for events, _, target in self.controller.moves(node):
            if events[0] not in self.controller.requests:
                # Events of one message that change nothing may be there or not.
                batch = next((item for item in self.controller.batches if events[0] in item), events)
                for count in range(1, len(batch) + 1):
                    for some in combinations(batch, count):
                        yield self.arrived(target, memory, mode, some)

    def turn(self, position: Position) -> tuple[tuple[str, ...], Any]:
        """Return the controller's turn, or the state in which its request is not enabled."""
        (state, held), memory, mode = position
        event, after = self.run.decided(state, memory, mode)
        if event is None:
            return (), ((state, held), memory, after)
        target = self.controller.after(state, event)
        if target is None:
            return (), state
        return self.arrived((target, self.controller.judged(target, held)), memory, after, (event,))


def fault_of(supervisor: Supervisor, strategy: Strategy, missed: MissedGoal) -> str:
    """Return what is wrong with a run that a check reports, or nothing."""
    loop = _Loop(supervisor, strategy)
    trace = missed.trace
    queue = [loop.arrived(loop.controller.start, loop.run.memory, 0, ())]
    seen: set[Any] = set()
    for events, position in queue:
        if trace[: len(events)] != events or (events, position) in seen:
            continue
        seen.add((events, position))
        is_position = isinstance(position[0], tuple)
        if events == trace and missed.goal is None and not is_position and position == missed.state:
            return ""
        if is_position:
            if events == trace and missed.goal == position[2] and position[0][0] == missed.state:
                return "" if _is_missed(loop, position) else "from there no fair cycle misses the goal"
            following = (*loop.moves(position), loop.turn(position))
            queue += [((*events, *more), target) for more, target in following]
    return "the run does not lead there"


def _is_missed(loop: _Loop, first: Position) -> bool:
    """Return True if a fair cycle that misses the goal of the mode can follow."""
    graph: dict[Position, set[Position]] = {}
    turns: dict[Position, Position] = {}
    queue = [first]
    for position in queue:
        if position in graph:
            continue
        graph[position] = {target for _, target in loop.moves(position)}
        (state, _), memory, mode = position
        if not loop.run.goals(state, memory)[mode]:
            turns[position] = loop.turn(position)[1]
            graph[position].add(turns[position])
        queue += graph[position]
    for group in components(list(graph), graph.__getitem__):
        inside = set(group)
        taken = [position for position in group if turns.get(position) in inside]
        owed = [loop.run.assumptions(position[0][0], position[1]) for position in taken]
        if owed and all(map(any, zip(*owed, strict=True))):
            return True
    return False
