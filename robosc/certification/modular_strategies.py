"""Strategies for the goals of large robots, from the modules that the goals are about alone.

A strategy of the smaller robot, of those modules, requests nothing of the others. It is taken only if it is found right
in the whole robot, by the check that every strategy is put to; else the whole robot is looked at.
"""

from collections.abc import Callable, Iterator, Sequence

import msgspec
from msgspec.structs import replace

from robosc.automata import ExecutableSystem
from robosc.automata.compile import subjects_read
from robosc.certification.strategies import GoalCheck
from robosc.expressions import Expression
from robosc.model.structure import Assumption, Goal, Mission, Model, Preference
from robosc.modular.partition import Module
from robosc.modular.robots import RobotSynthesis
from robosc.strategies import synthesize_strategy
from robosc.strategies.synthesize import StrategyResult
from robosc.supervisor import Strategy
from robosc.synthesis import EngineOptions, SynthesisProgress, SynthesisStatus, synthesize
from robosc.verification import CheckOutcome


class ModularStrategy(msgspec.Struct, frozen=True):
    """A strategy that was made for some modules, and found right in the whole robot.

    Attributes:
        found: Outcome of the synthesis in these modules.
        checked: Outcome of the check in the whole robot.
        modules: Numbers of the modules, from 1.
    """

    found: StrategyResult
    checked: GoalCheck
    modules: tuple[int, ...]

    @property
    def method(self) -> str:
        """Words about how it was made and checked."""
        numbers = f"module{'s' if len(self.modules) != 1 else ''} {', '.join(map(str, self.modules))}"
        return f"{self.checked.method}, with a strategy of {numbers}"


def strategy_in_modules(
    robot: RobotSynthesis,
    whole: ExecutableSystem,
    check: Callable[[Strategy], GoalCheck],
    *,
    engine: str | EngineOptions,
    should_stop: Callable[[], bool],
    on_progress: Callable[[SynthesisProgress], None],
) -> ModularStrategy | None:
    """Return a strategy from the modules that the goals are about; None if they are all, or none is found right.

    Args:
        robot: The robot in modules, with a supervisor.
        whole: The executable system of the robot.
        check: Check of a strategy in the whole robot.
        engine: Name of the engine for decision diagrams, or its options.
        should_stop: Function called before each step of the work; once it returns true, the work ends.
        on_progress: Function called with the progress of the work.
    """
    partition = robot.modular.partition
    touched = {subject.automaton for item in _expressions(whole.model) for subject in subjects_read(item)}
    numbers, union = list[int](), Module(frozenset(), frozenset())
    for number, item in enumerate(robot.modular.modules, start=1):
        if touched.intersection(item.automata):
            numbers.append(number)
            union |= item.module
    if not numbers or len(numbers) == len(robot.modular.modules):
        return None
    part = robot.robot.part(partition, union, partition.system_of(union))
    smaller = ExecutableSystem(_about_itself(part.model), whole.deployment)
    # The memory must be one of the whole robot.
    if any(place not in whole.obligations.places for place in smaller.obligations.places):
        return None
    made = synthesize(smaller.automata, engine=engine, should_stop=should_stop, on_progress=on_progress)
    if made.status is SynthesisStatus.EMPTY:
        return None
    found = synthesize_strategy(smaller, made.added, engine=engine, should_stop=should_stop, on_progress=on_progress)
    if found.strategy is None or found.preventable:
        return None
    checked = check(found.strategy)
    if checked.outcome is not CheckOutcome.PASSED:
        return None
    return ModularStrategy(found, checked, tuple(numbers))


def _expressions(model: Model) -> Iterator[Expression]:
    groups: tuple[Sequence[Goal | Assumption | Mission], ...] = (model.goals, model.assumptions, model.missions)
    for group in groups:
        for item in group:
            yield from item.expressions


def _about_itself(model: Model) -> Model:
    """The model of some modules without what is said of requests that are not in them."""
    names = {item.name for item in model.communications}

    def kept(item: Preference) -> Preference:
        return Preference(
            tuple(name for name in item.preferred if name in names),
            tuple(name for name in item.others if name in names),
        )

    preferences = (kept(item) for item in model.preferences)
    return replace(
        model,
        preferences=tuple(item for item in preferences if item.preferred and item.others),
        provides=tuple(item for item in model.provides if item.communication in names),
        limits=tuple(item for item in model.limits if item.communication in names),
    )
