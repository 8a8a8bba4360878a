"""Synthesis of a strategy: what the controller does next, of what its supervisor allows, so that its goals come true.

The supervisor stays as it is: a strategy only chooses among the requests that it enables, or waits. In each mode one
goal is approached; once it is true the next one in turn is.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from robosc.automata import ExecutableSystem
from robosc.strategies.arena import ControllerArena
from robosc.strategies.gr1 import Solution, solve
from robosc.supervisor import AddedCondition, Choice, Strategy
from robosc.synthesis.diagrams import extract
from robosc.synthesis.engines import EngineOptions
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.nodes import count_models
from robosc.synthesis.result import SynthesisProgress
from robosc.synthesis.simplify import Simplifier
from robosc.synthesis.workspace import Workspace, workspace


@dataclass(frozen=True, slots=True)
class StrategyResult:
    """Outcome of the synthesis of a strategy.

    Attributes:
        strategy: The strategy, or None where the goals cannot be reached.
        positions: Number of positions of the game: stable states, each with every memory.
        winning: Number of those from which the goals can be reached.
        rounds: Rounds of the outermost fixed point.
    """

    strategy: Strategy | None
    positions: int
    winning: int
    rounds: int


def synthesize_strategy(
    executable: ExecutableSystem,
    added: Sequence[AddedCondition],
    *,
    engine: str | EngineOptions = "auto",
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[SynthesisProgress], None] = lambda progress: None,
) -> StrategyResult:
    """Synthesize a strategy that reaches every goal of a model while its assumptions come true.

    Args:
        executable: Executable system of the robot, with at least one goal.
        added: The conditions that its supervisor adds.
        engine: Name of the engine for decision diagrams, or its options.
        should_stop: Function called before each step of the work; once it returns true, the work ends.
        on_progress: Function called with the progress of the work.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        NodeLimitError: Diagrams became larger than the options allow.
        UnknownEngineError: There is no such engine.
        UnsupportedModelError: A condition would be too large.
    """
    with workspace(executable.remembering_automata, engine, should_stop, on_progress) as place:
        return StrategySynthesis(executable, added, place).result()


class StrategySynthesis:
    """One synthesis: its manager is its own."""

    def __init__(self, executable: ExecutableSystem, added: Sequence[AddedCondition], place: Workspace) -> None:
        owed = executable.obligations
        self._encoding = place.encoding
        self._manager = place.encoding.manager
        self._monitor: ProgressMonitor = place.monitor
        self._seconds = place.condition_seconds
        self.arena = ControllerArena(executable, added, owed.places, owed.cancels, place.encoding, place.monitor)
        self.goals = [self.arena.condition(item) for item in owed.goals]
        self.assumptions = [self.arena.condition(item) for item in owed.assumptions]

    def result(self) -> StrategyResult:
        """The strategy, or None where the surroundings can keep some goal from coming true."""
        arena, false = self.arena, self._manager.false
        solution = solve(arena, self.assumptions, self.goals, false=false, check_stop=self._monitor.check_stop)
        is_won = arena.start & ~arena.arriving(solution.winning) == false
        return StrategyResult(
            strategy=self._strategy(solution) if is_won else None,
            positions=self._count(arena.positions),
            winning=self._count(solution.winning),
            rounds=solution.rounds,
        )

    def _count(self, predicate: Any) -> int:
        return count_models(self._manager, predicate, self._encoding.state_names)

    def _strategy(self, solution: Solution) -> Strategy:
        simplifier = Simplifier(self._encoding, self._seconds)
        return Strategy(tuple(self._mode(solution, number, simplifier) for number in range(len(self.goals))))

    def _mode(self, solution: Solution, number: int, simplifier: Simplifier) -> tuple[Choice, ...]:
        """Return the requests that approach a goal, in order, each with the condition for choosing it."""
        chosen: dict[str, Any] = {}
        decided = self.goals[number]
        for approach in solution.approaches[number]:
            here = approach.positions & ~approach.nearer
            for event in self.arena.requests:
                found = here & ~decided & self.arena.choice(event, approach.nearer)
                if found != self._manager.false:
                    chosen[event] = chosen.get(event, self._manager.false) | found
                    decided = decided | found
        care = solution.winning & ~self.goals[number]
        choices: list[Choice] = []
        for event in self.arena.requests:
            if event in chosen:
                condition = simplifier.condition(chosen[event], care)
                if condition is None:
                    condition = extract(self._encoding, self._manager.true)
                choices.append(Choice(event, condition))
                care = care & ~chosen[event]
        return tuple(choices)
