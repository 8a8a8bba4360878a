"""Blame for goals that cannot be reached: requirements that exclude them, and assumptions that would help.

A requirement is left out by synthesizing the supervisor of the model without it, so that the effort is bounded. Fewer
requirements mostly leave the robot more to do, but not always: silent steps that a requirement holds back are taken
without it. So what the search by halves has found is tried item by item, too.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence

import msgspec

from robosc.automata import ExecutableSystem
from robosc.errors import NodeLimitError, SynthesisCancelled, UnsupportedModelError
from robosc.expressions import Binary, Expression, StateTest
from robosc.model.structure import Assumption, Behaviour, EventKind, GoalForm, Model, is_tau
from robosc.strategies.counter_strategy import CounterStrategy
from robosc.strategies.nearest import Nearest, nearest_to
from robosc.strategies.synthesize import StrategyResult, StrategySynthesis
from robosc.supervisor import AddedCondition
from robosc.synthesis import EngineOptions, SynthesisProgress, SynthesisStatus, synthesize
from robosc.synthesis.changes import changed_subjects
from robosc.synthesis.conflict import minimal_conflict
from robosc.synthesis.workspace import workspace

EFFORT = 30
"""Steps that the search may take, as a multiple of those that the counter-strategy has taken."""

LEAST_EFFORT = 50_000
"""Least limit of these steps."""

MAXIMUM_CANDIDATES = 10
"""Assumptions that are tried together, the likeliest first: each doubles the memory of the game."""


class GoalBlame(msgspec.Struct, frozen=True):
    """Blame for goals that cannot be reached together.

    Attributes:
        requirements: Numbers of the model's requirements that alone, without any others, exclude the goals.
        invariants: Numbers of its invariants that do so together with them.
        is_known: True if these are known, and each of them is needed; without any, the goals cannot be reached even
            without requirements. False if the search was given up, and none are listed.
        helpful: Assumptions with which the goals can be reached, none of which the robot itself can keep from coming
            true or can be left out; empty if none are known.
        is_undone: True if it would be enough that a request can make the goals true, which the surroundings can undo
            before the controller's next turn.
        counter: Counter-strategy of the surroundings, or None if it would be too large.
        nearest: The nearest to the goals that can be reached, where they cannot be reached even if the surroundings do
            all they can for it; else None.
    """

    requirements: tuple[int, ...]
    invariants: tuple[int, ...]
    is_known: bool
    helpful: tuple[Assumption, ...]
    is_undone: bool
    counter: CounterStrategy | None
    nearest: Nearest | None


class _Budget:
    """Count of steps, which ends the work at a limit; the waiting caller can end it as well."""

    def __init__(self, should_stop: Callable[[], bool]) -> None:
        self._should_stop = should_stop
        self.is_stopped = False
        self.steps = 0
        self.limit: int | None = None

    def should_stop(self) -> bool:
        self.steps += 1
        self.is_stopped = self.is_stopped or self._should_stop()
        return self.is_stopped or (self.limit is not None and self.steps > self.limit)

    def result_of[T](self, work: Callable[[], T]) -> T | None:
        """Return the result of some work, or None if it has outgrown a limit.

        Raises:
            SynthesisCancelled: The waiting caller has ended the work.
        """
        try:
            return work()
        except SynthesisCancelled:
            if self.is_stopped:
                raise
        except (NodeLimitError, UnsupportedModelError):
            pass
        return None


def blame_goals(
    executable: ExecutableSystem,
    added: Sequence[AddedCondition],
    result: StrategyResult,
    *,
    engine: str | EngineOptions = "auto",
    effort: int = EFFORT,
    least_effort: int = LEAST_EFFORT,
    should_stop: Callable[[], bool] = lambda: False,
    on_progress: Callable[[SynthesisProgress], None] = lambda progress: None,
) -> GoalBlame:
    """Find out what is to blame for goals that cannot be reached.

    Args:
        executable: Executable system of the robot.
        added: The conditions that its supervisor adds.
        result: Result of the synthesis of a strategy, with goals that are not reached.
        engine: Name of the engine for decision diagrams, or its options.
        effort: Steps of the search for requirements, and of that for assumptions, as a multiple of the steps that the
            counter-strategy takes.
        least_effort: Least limit of these steps.
        should_stop: Function called before each step of the work; once it returns true, the work ends.
        on_progress: Function called with the progress of the work.

    Raises:
        SynthesisCancelled: `should_stop` became true.
        UnknownEngineError: There is no such engine.
    """
    budget = _Budget(should_stop)
    trials = _Trials(executable, added, result, engine, budget.should_stop, on_progress)
    shown = budget.result_of(trials.shown)
    counter, nearest, is_undone = (None, None, False) if shown is None else shown
    size = max(least_effort, effort * budget.steps)
    budget.limit = budget.steps + size
    items = budget.result_of(trials.excluding)
    budget.limit = budget.steps + size
    helpful = () if result.is_hopeless else budget.result_of(trials.helpful) or ()
    count = len(executable.model.requirements)
    return GoalBlame(
        requirements=tuple(item for item in items or () if item < count),
        invariants=tuple(item - count for item in items or () if item >= count),
        is_known=items is not None,
        helpful=helpful,
        is_undone=is_undone,
        counter=counter,
        nearest=nearest,
    )


class _Trials(msgspec.Struct, frozen=True):
    """Syntheses of the model with less required, or more assumed.

    Attributes:
        executable: Executable system of the robot.
        added: The conditions that its supervisor adds.
        result: Result of the synthesis of its strategy.
        engine: Name of the engine for decision diagrams, or its options.
        should_stop: Function called before each step.
        on_progress: Function called with the progress of the work.
    """

    executable: ExecutableSystem
    added: Sequence[AddedCondition]
    result: StrategyResult
    engine: str | EngineOptions
    should_stop: Callable[[], bool]
    on_progress: Callable[[SynthesisProgress], None]

    def _synthesis_of[T](
        self, executable: ExecutableSystem, added: Sequence[AddedCondition], asked: Callable[[StrategySynthesis], T]
    ) -> T:
        system = executable.remembering_automata
        followed = changed_subjects(system)
        with workspace(system, self.engine, self.should_stop, self.on_progress, followed=followed) as place:
            return asked(StrategySynthesis(executable, added, place))

    def shown(self) -> tuple[CounterStrategy | None, Nearest | None, bool]:
        """Return the counter-strategy, the nearest that can be reached, and whether the surroundings only undo it."""
        unreached = self.result.unreached

        def asked(synthesis: StrategySynthesis) -> tuple[CounterStrategy | None, Nearest | None, bool]:
            nearest = None
            if self.result.is_hopeless:
                nearest = nearest_to(synthesis, unreached, self.executable, self.added, self.should_stop)
            # Goals that are reached in name alone need nothing to be done against them.
            if synthesis.is_won(range(len(synthesis.assumptions)), unreached):
                return None, nearest, False
            is_undone = not self.result.is_hopeless and synthesis.is_won_at_once(unreached)
            try:
                return synthesis.counter(unreached), nearest, is_undone
            except UnsupportedModelError:
                return None, nearest, is_undone

        return self._synthesis_of(self.executable, self.added, asked)

    # Requirements

    def excluding(self) -> tuple[int, ...]:
        """Return requirements that exclude the goals, a set of which none can be left out; invariants come after."""
        model = self.executable.model
        every = tuple(range(len(model.requirements) + len(model.invariants)))
        known: dict[frozenset[int], bool] = {frozenset(every): True}

        def is_excluded(kept: frozenset[int]) -> bool:
            if kept not in known:
                known[kept] = not self._is_reached_under(kept)
            return known[kept]

        found = minimal_conflict(every, is_excluded)
        if not is_excluded(frozenset(found)):
            found = every
        return without_needless(found, is_excluded)

    def _is_reached_under(self, kept: Collection[int]) -> bool:
        """Return True if the goals can be reached under some of the requirements alone."""
        model = self.executable.model
        count = len(model.requirements)
        less = msgspec.structs.replace(
            model,
            requirements=tuple(item for number, item in enumerate(model.requirements) if number in kept),
            invariants=tuple(item for number, item in enumerate(model.invariants) if number + count in kept),
        )
        executable = ExecutableSystem(less, self.executable.deployment)
        made = synthesize(
            executable.automata, engine=self.engine, should_stop=self.should_stop, on_progress=self.on_progress
        )
        if made.status is SynthesisStatus.EMPTY:
            return False
        return self._synthesis_of(executable, made.added, self._is_reached)

    def _is_reached(self, synthesis: StrategySynthesis) -> bool:
        # Hopeless goals are excluded where even the surroundings cannot help.
        if self.result.is_hopeless:
            return synthesis.can_be_reached(self.result.unreached)
        return synthesis.is_won(range(len(synthesis.assumptions)), self.result.unreached)

    # Assumptions

    def helpful(self) -> tuple[Assumption, ...]:
        """Return assumptions that help, the weakest first: where a state leads anywhere, then where it leads to."""
        states = tuple(_waiting_states(self.executable.model))
        weakest = [_answer(component, state, targets) for component, state, targets in states]
        exact = [_answer(component, state, [one]) for component, state, targets in states for one in targets]
        for candidates in (weakest, exact) if exact != weakest else (weakest,):
            found = self._helpful_of(candidates[:MAXIMUM_CANDIDATES]) if candidates else ()
            if found:
                return found
        return ()

    def _helpful_of(self, candidates: Sequence[Assumption]) -> tuple[Assumption, ...]:
        model = self.executable.model
        more = msgspec.structs.replace(model, assumptions=(*model.assumptions, *candidates))
        count = len(model.assumptions)

        def asked(synthesis: StrategySynthesis) -> tuple[Assumption, ...]:
            broken = set(synthesis.preventable(range(count)))
            fitting = [item for item in range(count, count + len(candidates)) if item not in broken]
            for goals in (range(len(synthesis.goals)), self.result.unreached):

                def is_enough(kept: frozenset[int], goals: Sequence[int] = goals) -> bool:
                    assumed = (*range(count), *sorted(kept))
                    return synthesis.is_won(assumed, goals) and synthesis.can_come_true(assumed, goals)

                if is_enough(frozenset(fitting)):
                    return tuple(candidates[item - count] for item in without_needless(fitting, is_enough))
            return ()

        return self._synthesis_of(ExecutableSystem(more, self.executable.deployment), self.added, asked)


def without_needless(things: Iterable[int], is_enough: Callable[[frozenset[int]], bool]) -> tuple[int, ...]:
    """Return things that are enough, a set of which none can be left out; later ones are left out first.

    Args:
        things: Things that are enough together.
        is_enough: Function that decides whether some are; it need not be monotone.
    """
    kept, before = list(things), None
    while kept != before:
        before = list(kept)
        for item in reversed(before):
            fewer = frozenset(kept) - {item}
            if is_enough(fewer):
                kept.remove(item)
    return tuple(kept)


def _answer(component: str, state: str, targets: Sequence[str]) -> Assumption:
    condition: Expression = StateTest(component, targets[0])
    for target in targets[1:]:
        condition = Binary("or", condition, StateTest(component, target))
    return Assumption(GoalForm.LEADS_TO, condition, StateTest(component, state))


def _waiting_states(model: Model) -> Iterator[tuple[str, str, list[str]]]:
    """Yield the states in which the robot waits for its surroundings, with their components and what they lead to.

    Those of which the robot's own doing leads out do not count. The likeliest come first: states that are not marked,
    in which the robot has begun something.
    """
    found = []
    for component in model.components:
        for state in component.behaviour.states if component.behaviour else ():
            targets = _targets(component.behaviour, state.name) if component.behaviour else []
            if targets:
                found.append((state.is_marked, component.name, state.name, targets))
    for _, name, state_name, targets in sorted(found, key=lambda item: item[0]):
        yield name, state_name, targets


def _targets(behaviour: Behaviour, state: str) -> list[str]:
    """Return the states that responses lead to from a state; none if something else leads out of it, too."""
    leaving = [item for item in behaviour.transitions if item.source in (None, state)]
    leaving = [item for item in leaving if item.target not in (None, state)]
    if not all(_is_answer(item.event) for item in leaving):
        return []
    return list(dict.fromkeys(item.target for item in leaving if item.target is not None))


def _is_answer(event: str) -> bool:
    return not is_tau(event) and event.rpartition(".")[2] in (EventKind.RESPONSE, EventKind.ERROR, EventKind.FEEDBACK)
