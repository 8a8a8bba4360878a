"""Synthesis of a strategy: what the controller does next, of what its supervisor allows, so that its goals come true.

The supervisor stays as it is: a strategy only chooses among the requests that it enables, or waits. In each mode one
goal or visit of a mission is approached; once it is true the next one in turn is. In this package a visit counts as a
goal: that the mission is not at it any more.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any

import msgspec
from msgspec.structs import replace

from robosc.automata import ExecutableSystem
from robosc.automata.goal_memory import holds
from robosc.strategies.arena import ControllerArena
from robosc.strategies.counter_strategy import CounterStage, CounterStrategy, oppose
from robosc.strategies.gr1 import Approach, Solution, approach_in_earnest, leading, solve
from robosc.strategies.meanwhile import Meanwhile
from robosc.strategies.modes import Modes, Requests
from robosc.strategies.preferences import preferred_order
from robosc.supervisor import AddedCondition, Choice, DecisionDiagram, Strategy
from robosc.synthesis.changes import changed_subjects
from robosc.synthesis.diagrams import extract
from robosc.synthesis.engines import EngineOptions
from robosc.synthesis.monitor import ProgressMonitor
from robosc.synthesis.nodes import count_models
from robosc.synthesis.result import SynthesisProgress
from robosc.synthesis.simplify import Simplifier
from robosc.synthesis.workspace import Workspace, workspace


class StrategyResult(msgspec.Struct, frozen=True):
    """Outcome of the synthesis of a strategy.

    Attributes:
        strategy: The strategy, or None where there is none.
        unreached: Numbers of goals and visits that cannot be reached together, a set of which none can be left out;
            empty where there is a strategy.
        is_hopeless: True if these goals cannot be reached even if the surroundings do all they can for it.
        preventable: Numbers of assumptions that the robot itself can keep from coming true, though nobody allows it.
        impossible: Numbers of assumptions that cannot come true together again and again, or not while the goals do,
            whatever both sides do; a set of which none can be left out.
        is_impossible_alone: True if they cannot even without the goals.
        idle: Numbers of goals that are true wherever the controller has its turn, so that nothing is done for them.
        never_made: Numbers of visits that no run makes, though the mission as a whole can go on for ever: it does not
            ask for them, or not while their condition can be true; empty where goals are not reached.
        unneeded: Numbers of assumptions without which the goals are reached just as well.
        positions: Number of positions of the game: stable states, each with every memory.
        winning: Number of those from which the goals can be reached.
        rounds: Rounds of the outermost fixed point.
    """

    strategy: Strategy | None
    unreached: tuple[int, ...]
    is_hopeless: bool
    preventable: tuple[int, ...]
    impossible: tuple[int, ...]
    is_impossible_alone: bool
    idle: tuple[int, ...]
    never_made: tuple[int, ...]
    unneeded: tuple[int, ...]
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
        executable: Executable system of the robot, with at least one goal or mission.
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
    owed = executable.obligations
    conditions = (*(item.condition for item in owed.aims), *(item.judged for item in owed.places))
    system = executable.remembering_automata
    followed = changed_subjects(system)
    with workspace(system, engine, should_stop, on_progress, conditions, followed) as place:
        allowed = [number for number, item in enumerate(executable.model.assumptions) if item.is_allowed]
        return StrategySynthesis(executable, added, place).result(allowed)


class StrategySynthesis:
    """One synthesis: its manager is its own."""

    def __init__(self, executable: ExecutableSystem, added: Sequence[AddedCondition], place: Workspace) -> None:
        owed = executable.obligations
        self._encoding = place.encoding
        self._manager = place.encoding.manager
        self._monitor: ProgressMonitor = place.monitor
        self._seconds = place.condition_seconds
        self.arena = ControllerArena(executable, added, owed, place.encoding, place.monitor)
        ordered = preferred_order(executable.requests, executable.model.preferences)
        self._requests = tuple(event for event in ordered if event in self.arena.requests)
        self._aims, self._tours = owed.aims, owed.tours
        self.goals = [self.arena.condition(item.condition) for item in owed.aims]
        self.assumptions = [self.arena.condition(item) for item in owed.assumptions]

    def result(self, allowed: Collection[int] = ()) -> StrategyResult:
        """Return the strategy, or the reason why there is none.

        Args:
            allowed: Numbers of the assumptions that the robot may keep from coming true.
        """
        solution = self._solution(range(len(self.assumptions)), range(len(self.goals)))
        is_won = self.arena.can_begin(solution.winning)
        unreached, impossible, is_alone = self._in_name_alone() if is_won else (self._unreached(), (), False)
        is_won = is_won and not unreached and not impossible
        preventable = self.preventable(allowed)
        unneeded = self._unneeded(solution) if is_won else ()
        reachable = self.arena.reachable_positions() if is_won else self.false
        near = {item: self._left_to_surroundings(self.assumptions[item]) for item in allowed} if is_won else {}
        if is_won:
            earnest = self._in_earnest(solution.winning, near)
            solution = replace(
                solution,
                approaches=tuple(earnest.get(item, steps) for item, steps in enumerate(solution.approaches)),
            )
            # Visits that are not interrupted may need more, though interruptions would do.
            visits = [steps for number, steps in earnest.items() if self._aims[number].interruption is not None]
            unneeded = tuple(item for item in unneeded if not any(self._rely(steps, item) for steps in visits))
        return StrategyResult(
            strategy=self._strategy(solution, near, reachable) if is_won and not preventable else None,
            unreached=unreached,
            is_hopeless=bool(unreached) and not self.can_be_reached(unreached),
            preventable=preventable,
            impossible=impossible,
            is_impossible_alone=is_alone,
            idle=self._idle(reachable) if is_won else (),
            never_made=self._never_made(reachable) if is_won else (),
            unneeded=unneeded,
            positions=self._count(self.arena.positions),
            winning=self._count(solution.winning),
            rounds=solution.rounds,
        )

    def sought(self, number: int) -> Any:
        """Return the predicate that a goal is true, or the condition of a visit, whatever was remembered before.

        Args:
            number: Number of the goal or visit.
        """
        visit = self._aims[number].visit
        if visit is None:
            return self.arena.whatever_was(self.goals[number])
        return self.arena.condition(holds(visit))

    @property
    def false(self) -> Any:
        """The predicate that is true nowhere."""
        return self._manager.false

    def diagram(self, predicate: Any) -> DecisionDiagram:
        """Return a predicate as a diagram over the state and the memory.

        Raises:
            UnsupportedModelError: It would be too large.
        """
        return extract(self._encoding, predicate)

    def counter(self, goals: Sequence[int]) -> CounterStrategy:
        """Return how the surroundings keep goals from coming true together, which cannot be reached.

        Args:
            goals: Numbers of the goals.

        Raises:
            UnsupportedModelError: It would be too large.
        """
        denied = [self.goals[item] for item in goals]
        positions = self.arena.positions
        lost = positions & ~self._solved(self.assumptions, denied).winning

        def is_enough(found: Any) -> bool:
            return not self.arena.can_begin(positions & ~found)

        stages = oppose(
            *(self.arena, self.assumptions, denied, lost, is_enough),
            false=self.false,
            check_stop=self._monitor.check_stop,
        )
        return CounterStrategy(
            tuple(
                CounterStage(
                    goals[stage.goal],
                    self.diagram(stage.positions),
                    tuple(tuple(map(self.diagram, layers)) for layers in stage.layers),
                )
                for stage in stages
            )
        )

    def _solution(self, assumptions: Iterable[int], goals: Iterable[int]) -> Solution:
        return self._solved([self.assumptions[item] for item in assumptions], [self.goals[item] for item in goals])

    def _solved(
        self,
        assumptions: Sequence[Any],
        goals: Sequence[Any],
        is_enough: Callable[[Any], bool] = lambda winning: True,
        before: Solution | None = None,
    ) -> Solution:
        stop, false = self._monitor.check_stop, self._manager.false
        return solve(self.arena, assumptions, goals, false=false, check_stop=stop, is_enough=is_enough, before=before)

    def is_won(self, assumptions: Iterable[int], goals: Iterable[int]) -> bool:
        """Return True if some goals can be reached under some assumptions."""
        owed, wanted = [self.assumptions[item] for item in assumptions], [self.goals[item] for item in goals]
        return self.arena.can_begin(self._solved(owed, wanted, self.arena.can_begin).winning)

    def _unreached(self) -> tuple[int, ...]:
        """Return a smallest set, by leaving out, of goals that cannot be reached together; later ones go first."""
        every = range(len(self.assumptions))
        return _fewest(range(len(self.goals)), lambda fewer: not self.is_won(every, fewer))

    def _in_name_alone(self) -> tuple[tuple[int, ...], tuple[int, ...], bool]:
        """Return what keeps goals from being reached otherwise than in name, because some assumption has to fail.

        Returns:
            Goals that cannot be reached together, even if both sides do all they can for it; assumptions that cannot
            come true together; and whether these cannot even without the goals. At most one set is not empty.
        """
        goals, assumptions = range(len(self.goals)), range(len(self.assumptions))
        if not assumptions or self.can_come_true(assumptions, goals):
            return (), (), False
        is_alone = not self.can_come_true(assumptions, ())
        if not is_alone and not self.can_be_reached(goals):
            return _fewest(goals, lambda fewer: not self.can_be_reached(fewer)), (), False
        others = () if is_alone else goals
        return (), _fewest(assumptions, lambda fewer: not self.can_come_true(fewer, others)), is_alone

    def _idle(self, reachable: Any) -> tuple[int, ...]:
        """Return the goals that are true in every position that can be reached.

        Args:
            reachable: The positions that can be reached.
        """
        goals = (number for number, item in enumerate(self._aims) if item.mission is None)
        return tuple(number for number in goals if reachable & ~self.goals[number] == self.false)

    def is_won_at_once(self, goals: Sequence[int]) -> bool:
        """Return True if goals could be reached if it counted that a request can make them true for a moment.

        Args:
            goals: Numbers of the goals.
        """
        wanted = [self.goals[item] | self.arena.turn(self.goals[item]) for item in goals]
        return self.arena.can_begin(self._solved(self.assumptions, wanted, self.arena.can_begin).winning)

    def can_be_reached(self, goals: Iterable[int]) -> bool:
        """Return True if both sides together can make goals true again and again."""
        return self.can_come_true((), goals)

    def can_come_true(self, assumptions: Iterable[int], goals: Iterable[int]) -> bool:
        """Return True if both sides together can make assumptions and goals true again and again.

        Args:
            assumptions: Numbers of the assumptions.
            goals: Numbers of the goals.
        """
        wanted = [*(self.assumptions[item] for item in assumptions), *(self.goals[item] for item in goals)]
        return self.arena.can_begin(self._possible(wanted))

    def _possible(self, wanted: Sequence[Any]) -> Any:
        """Return the positions from which both sides together can make conditions true again and again."""
        found = self.arena.positions
        before = None
        while found != before:
            before = found
            for item in wanted:
                found = leading(self.arena, found & item & self.arena.together(found), found, self._monitor.check_stop)
        return found

    def _unneeded(self, solution: Solution) -> tuple[int, ...]:
        """Return assumptions that can be left out together; of two that can replace each other, the later one.

        Args:
            solution: Solution under all of them.
        """
        kept = list(range(len(self.assumptions)))
        for place in reversed(range(len(self.assumptions))):
            fewer = [*kept[:place], *kept[place + 1 :]]
            relying = [number for number, steps in enumerate(solution.approaches) if self._rely(steps, place)]
            if not relying:
                kept, solution = fewer, _without(solution, place)
                continue
            # The goal that is looked at first relies on it, so that it is soon known to be needed.
            order = [*range(relying[-1] + 1, len(self.goals)), *range(relying[-1] + 1)]
            bound = _without(solution, place)
            bound = replace(bound, approaches=tuple(bound.approaches[number] for number in order))
            owed, wanted = [self.assumptions[item] for item in fewer], [self.goals[number] for number in order]
            found = self._solved(owed, wanted, self.arena.can_begin, bound)
            if self.arena.can_begin(found.winning):
                steps = dict(zip(order, found.approaches, strict=True))
                kept, solution = fewer, replace(found, approaches=tuple(steps[number] for number in sorted(steps)))
        return tuple(item for item in range(len(self.assumptions)) if item not in kept)

    def _rely(self, steps: Iterable[Approach], place: int) -> bool:
        """Return True if some step towards a goal needs that the controller can wait for the assumption in a place."""
        false = self._manager.false
        for step in steps:
            others = step.nearer
            for item in (*step.waiting[:place], *step.waiting[place + 1 :]):
                others = others | item
            if step.waiting[place] & ~others != false:
                return True
        return False

    def preventable(self, allowed: Collection[int]) -> tuple[int, ...]:
        """Return assumptions that the robot can make false for ever, in a state that it can get to.

        A robot that does so reaches its goals in name alone. Such assumptions are not well separated from the goals:
        U. Klein and A. Pnueli, "Revisiting synthesis of GR(1) specifications", HVC 2010, LNCS 6504, pp. 161-181. One by
        one is enough: if each can be made true from every state, so can all in turn.

        Where nobody can make an assumption true any more, as after a device has broken for good, the robot prevents
        nothing, unless its own request leads there.

        Args:
            allowed: Numbers of assumptions that are not looked at.
        """
        found = []
        for item, assumption in enumerate(self.assumptions):
            if item not in allowed:
                prevented = self._solved([assumption], [self._manager.false]).winning
                possible = self._possible([assumption])
                prevented = prevented | self.arena.turn(self.arena.positions & ~possible)
                if self._is_reachable(prevented & possible):
                    found.append(item)
        return tuple(found)

    def _is_reachable(self, predicate: Any) -> bool:
        """Return True if moves of both sides can lead from the first position into a predicate."""
        found = leading(self.arena, predicate, self.arena.positions, self._monitor.check_stop)
        return bool(self.arena.start & self.arena.arriving(found) != self._manager.false)

    def _count(self, predicate: Any) -> int:
        return count_models(self._manager, predicate, self._encoding.state_names)

    def _in_earnest(self, winning: Any, near: Mapping[int, Any]) -> dict[int, tuple[Approach, ...]]:
        """Return steps, by goal, that do without interruptions and without idle waiting, as far as they can.

        Args:
            winning: The positions from which the goals can be reached.
            near: For each assumption that the robot may keep from coming true, the positions from which the
                surroundings alone can make it true.
        """
        interruptions = [item.interruption for item in self._aims]
        return {
            number: approach_in_earnest(
                *(self.arena, self.assumptions, self.goals[number]),
                None if interruption is None else self.arena.condition(interruption),
                winning,
                false=self.false,
                near=near,
                check_stop=self._monitor.check_stop,
            )
            for number, interruption in enumerate(interruptions)
            if near or interruption is not None
        }

    def _never_made(self, reachable: Any) -> tuple[int, ...]:
        """Return the visits that neither side can bring about, though the supervisor allows all that it does.

        Args:
            reachable: The positions that can be reached.
        """
        tours = self._tours
        if not tours:
            return ()
        arrived, visits = self.arena.unobserved(reachable), []
        for tour in tours:
            here = [self.arena.condition(stage.here) for stage in tour.stages]
            passed = [self.arena.condition(stage.is_passed) for stage in tour.stages]
            within = arrived if tour.asked is None else arrived & self.arena.condition(tour.asked)
            # A tour begins at its first stage: what is passed in a second round was passed before.
            left, made = self.false, []
            for is_here, is_passed in zip(here, passed, strict=True):
                left = within & (is_here | left) & is_passed
                made.append(left != self.false)
            # An idle detour is a stage as well, and no visit.
            visits += made if tour.stays else made[1:]
        first = len(self._aims) - len(visits)
        return tuple(first + number for number, is_made in enumerate(visits) if not is_made)

    def _strategy(self, solution: Solution, near: Mapping[int, Any], reachable: Any) -> Strategy:
        """Return the strategy that a solution makes.

        Args:
            solution: The solution.
            near: For each assumption that the robot may keep from coming true, the positions from which the
                surroundings alone can make it true.
            reachable: The positions that can be reached.
        """
        simplifier = Simplifier(self._encoding, self._seconds)
        games = Modes(self.arena, self._aims, self._requests, near, self.false)
        modes = [games.mode(number, self.goals[number], steps) for number, steps in enumerate(solution.approaches)]
        # Assumptions that the strategy helps with come first where several can be waited for.
        awaited = (*near, *(item for item in range(len(self.assumptions)) if item not in near))
        own = [self._choices(mode.chosen, solution.winning & reachable & ~mode.goal, simplifier) for mode in modes]
        meanwhile = Meanwhile(self.arena, modes, [left for _, left in own], awaited, near, self.false)
        found = []
        for number, (choices, left) in enumerate(own):
            others, _ = self._choices(meanwhile.of(number), left, simplifier, is_meanwhile=True)
            found.append((*choices, *others))
        return Strategy(tuple(found))

    def _left_to_surroundings(self, assumption: Any) -> Any:
        """Return the positions from which the surroundings alone can make an assumption true."""
        found, before = assumption, None
        while found != before:
            before = found
            found = found | self.arena.responses(found)
        return found

    def _choices(
        self, chosen: Requests, care: Any, simplifier: Simplifier, *, is_meanwhile: bool = False
    ) -> tuple[tuple[Choice, ...], Any]:
        """Return requests, in order, each with the condition for choosing it, and the positions left.

        Args:
            chosen: For each request the positions in which it is chosen.
            care: Positions that count.
            simplifier: Simplifier of the conditions.
            is_meanwhile: True for requests that a mode takes along for others.
        """
        choices: list[Choice] = []
        for event in self._requests:
            if event in chosen and chosen[event] & care != self._manager.false:
                condition = simplifier.condition(chosen[event], care)
                if condition is None:
                    condition = extract(self._encoding, self._manager.true)
                choices.append(Choice(event, condition, is_meanwhile))
                care = care & ~chosen[event]
        return tuple(choices), care


def _fewest(items: Iterable[int], is_enough: Callable[[list[int]], bool]) -> tuple[int, ...]:
    """Return items that are enough, of which none can be left out; later ones are left out first.

    Args:
        items: Items that are enough together.
        is_enough: Function that decides whether some are.
    """
    kept = list(items)
    for item in reversed(list(kept)):
        fewer = [number for number in kept if number != item]
        if fewer and is_enough(fewer):
            kept = fewer
    return tuple(kept)


def _without(solution: Solution, place: int) -> Solution:
    """Return a solution without the assumption in a place."""
    approaches = (
        tuple(replace(item, waiting=(*item.waiting[:place], *item.waiting[place + 1 :])) for item in steps)
        for steps in solution.approaches
    )
    return replace(solution, approaches=tuple(approaches))
