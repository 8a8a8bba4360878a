"""Reactive problems of generalized reactivity of rank 1 in their usual form, and games of them for our solver.

Variables are Boolean. The surroundings choose their next values as their moves allow; then the system sees these and
chooses its own. Source: R. Bloem, B. Jobstmann, N. Piterman, A. Pnueli and Y. Sa'ar, "Synthesis of reactive(1)
designs", Journal of Computer and System Sciences 78(3), 2012, pp. 911-938.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from robosc.strategies.gr1 import Solution, solve
from robosc.synthesis.engines import Manager
from robosc.synthesis.nodes import met, renamed


def primed(name: str) -> str:
    """Return the name of a variable's next value."""
    return f"{name}'"


@dataclass(frozen=True)
class ReactiveProblem:
    r"""A problem: formulas are in the notation of TLA+, with `~`, `/\`, `\/`, `=>` and `<=>`.

    Attributes:
        order: All variables, in an order that suits decision diagrams.
        inputs: Those that the surroundings choose.
        start_inputs: Conditions on the first inputs.
        start: Conditions on the first position.
        input_moves: Conditions on a position and the next inputs.
        moves: Conditions on a position and the next one.
        assumptions: Predicates that the surroundings make true again and again.
        goals: Predicates that the system is to make true again and again.
    """

    order: tuple[str, ...]
    inputs: tuple[str, ...]
    start_inputs: tuple[str, ...]
    start: tuple[str, ...]
    input_moves: tuple[str, ...]
    moves: tuple[str, ...]
    assumptions: tuple[str, ...]
    goals: tuple[str, ...]

    @property
    def outputs(self) -> tuple[str, ...]:
        """The variables that the system chooses."""
        return tuple(name for name in self.order if name not in self.inputs)

    def declare(self, manager: Manager) -> None:
        """Add the variables to a manager, each with its next value below it."""
        manager.declare(*(item for name in self.order for item in (name, primed(name))))


class SynchronousArena:
    """Game in rounds: the turn of the system is a whole round, and the surroundings never move alone.

    Args:
        problem: The problem.
        manager: Manager that has its variables.
    """

    def __init__(self, problem: ReactiveProblem, manager: Any) -> None:
        self.positions = manager.true
        self._manager = manager
        self._next: Mapping[str, str] = {name: primed(name) for name in problem.order}
        self._next_inputs = [primed(name) for name in problem.inputs]
        self._next_outputs = [primed(name) for name in problem.outputs]
        self._input_moves = conjunction(manager, problem.input_moves)
        self._moves = conjunction(manager, problem.moves)

    def surroundings(self, predicate: Any) -> Any:
        """Return all positions: the surroundings have no move of their own."""
        return self.positions

    def turn(self, predicate: Any) -> Any:
        """Return the positions in which the system has an answer to all next inputs that leads into a predicate."""
        following = renamed(self._manager, self._next, predicate)
        answered = met(self._manager, self._next_outputs, self._moves, following)
        return ~met(self._manager, self._next_inputs, self._input_moves, ~answered)


def conjunction(manager: Any, formulas: Iterable[str]) -> Any:
    """Return the predicate that all formulas are true."""
    found = manager.true
    for formula in formulas:
        found = found & manager.add_expr(formula)
    return found


@dataclass(frozen=True)
class ReactiveGame:
    """A problem in a manager that has its variables.

    Attributes:
        arena: Its rounds.
        assumptions: Its assumptions.
        goals: Its goals.
    """

    problem: ReactiveProblem
    manager: Any
    arena: SynchronousArena
    assumptions: list[Any]
    goals: list[Any]


def game_of(problem: ReactiveProblem, manager: Any) -> ReactiveGame:
    """Return the game of a problem, in a manager that has its variables."""
    assumptions, goals = ([manager.add_expr(item) for item in items] for items in (problem.assumptions, problem.goals))
    return ReactiveGame(problem, manager, SynchronousArena(problem, manager), assumptions, goals)


def solution_of(game: ReactiveGame) -> Solution:
    """Return the winning positions of a game, and how they are won."""
    return solve(game.arena, game.assumptions, game.goals, false=game.manager.false)


def is_realizable(game: ReactiveGame, winning: Any) -> bool:
    """Return True if the system can begin in a winning position, whatever inputs it begins with."""
    manager, problem = game.manager, game.problem
    start = conjunction(manager, problem.start) & winning
    lost = conjunction(manager, problem.start_inputs) & ~manager.exist(problem.outputs, start)
    return bool(lost == manager.false)
