"""Check of counter-strategies on explicit games: whatever the controller does, some goal is denied for ever.

The surroundings do what they have chosen, the controller all that it can. A cycle of this product is at fault if the
controller never has its turn on it, if it has but some assumption is true at none of these turns, or if each of the
goals is true at one of them.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from robosc.strategies.counter_strategy import CounterPlayer
from support.goal_twin import LOST, Game, Position, components

Vertex = tuple[Position, int]
"""A position, and the assumption that the surroundings bring about next."""


def fault_of_counter(
    game: Game, goals: Sequence[int], player: CounterPlayer, values: Callable[[Position], tuple[Any, ...]]
) -> str:
    """Return why a counter-strategy does not keep some of the goals from coming true; empty if it does.

    Args:
        game: The game.
        goals: Numbers of the goals that are not to come true together.
        player: Player of the counter-strategy.
        values: Function that returns a position as a state of the automata with their memory.
    """
    moves: dict[Vertex, set[Vertex]] = {}
    turns: dict[Vertex, set[Vertex]] = {}
    queue: list[Vertex] = [(game.first, 0)]
    for vertex in queue:
        if vertex in moves:
            continue
        position, aim = vertex
        targets = sorted(game.successors[position], key=repr)
        state = values(position)
        move = player.move(state, [None if item == LOST else values(item) for item in targets], aim)
        moves[vertex], turns[vertex] = set(), set()
        if move is None:
            after = player.aim_after(state, aim)
            reached = {position, *game.choices[position].values()} - {LOST}
            turns[vertex] = {(item, after) for item in reached}
        elif targets[move] != LOST:
            moves[vertex] = {(targets[move], aim)}
        queue += [*moves[vertex], *turns[vertex]]
    return _fault(game, goals, moves, turns)


def _fault(game: Game, goals: Sequence[int], moves: dict[Vertex, set[Vertex]], turns: dict[Vertex, set[Vertex]]) -> str:
    vertices = list(moves)

    def has_cycle(without: Callable[[Position], bool]) -> bool:
        """Return True if there is a cycle without the turns in some positions."""

        def after(vertex: Vertex) -> set[Vertex]:
            return moves[vertex] | (set() if without(vertex[0]) else turns[vertex])

        return any(len(found) > 1 or after(*found) & found for found in components(vertices, after))

    if has_cycle(lambda position: True):
        return "the controller has no turn any more"
    for number, item in enumerate(game.assumptions):
        if has_cycle(partial(game.holds, item=item)):
            return f"assumption {number} may never come true any more"
    for found in components(vertices, lambda vertex: moves[vertex] | turns[vertex]):
        met = [vertex[0] for vertex in found if turns[vertex] & found]
        if met and all(any(game.holds(position, game.goals[item]) for position in met) for item in goals):
            return "every goal may come true again and again"
    return ""
