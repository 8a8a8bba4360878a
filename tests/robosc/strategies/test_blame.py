"""Blame for goals that cannot be reached: against all sets of requirements, and in examples."""

from collections import Counter
from collections.abc import Callable
from random import Random

import msgspec
import pytest

from robosc.automata import ExecutableSystem
from robosc.certification import SynthesisOutcome, SynthesisProblem, make_supervisor, prepare
from robosc.certification.goals import GoalExplanation
from robosc.conditions.goals import assumption_text
from robosc.errors import Diagnostic, Severity, SynthesisCancelled
from robosc.model.structure import Deployment, Model
from robosc.strategies import GoalBlame, StrategyResult, blame_goals, synthesize_strategy
from robosc.strategies.blame import EFFORT, LEAST_EFFORT, without_needless
from robosc.synthesis import SynthesisStatus, synthesize
from support.goal_twin import LOST, Game, Item, game_of, winning_positions
from support.models import bundle_of
from support.random_goals import random_text

LIMIT = 2_000

PORTER = """robot Porter {
    component Door {
        incoming message open with type: none
        incoming message close with type: none
        outgoing message opened with type: none
        outgoing message closed with type: none
        behaviour {
            initial marked state shut { on request to open goto opening }
            state opening { on response from opened goto ajar }
            state ajar { on request to close goto closing }
            state closing { on response from closed goto shut }
        }
    }
    component Base {
        incoming message enter with type: none
        incoming message leave with type: none
        behaviour {
            initial marked state outside { on request to enter goto inside }
            marked state inside { on request to leave goto outside }
        }
    }
    requirement leave needs Base.inside
    requirement enter needs Door.ajar
    GOALS
}"""


def outcome_of(goals: str) -> SynthesisOutcome:
    return make_supervisor(bundle_of(PORTER.replace("GOALS", goals)))


def finding_of(goals: str) -> Diagnostic:
    return next(item for item in outcome_of(goals).diagnostics if item.code == "unreachable-goal")


def blame_of(goals: str, effort: int = EFFORT, least_effort: int = LEAST_EFFORT) -> GoalBlame:
    problem = prepare(bundle_of(PORTER.replace("GOALS", goals)), Deployment.CONTROLLER)
    assert isinstance(problem, SynthesisProblem)
    added = synthesize(problem.system.automata).added
    result = synthesize_strategy(problem.system, added)
    return blame_goals(problem.system, added, result, effort=effort, least_effort=least_effort)


# Against all sets


def _less(model: Model, kept: frozenset[int]) -> Model:
    count = len(model.requirements)
    return msgspec.structs.replace(
        model,
        requirements=tuple(item for place, item in enumerate(model.requirements) if place in kept),
        invariants=tuple(item for place, item in enumerate(model.invariants) if place + count in kept),
    )


def is_reached_explicitly(model: Model, kept: frozenset[int], result: StrategyResult) -> bool | None:
    """Decide by the explicit game whether goals are reached under some requirements; None if it is too large."""
    executable = ExecutableSystem(_less(model, kept), Deployment.CONTROLLER)
    made = synthesize(executable.automata)
    if made.status is SynthesisStatus.EMPTY:
        return False
    game = game_of(executable, made.added, LIMIT)
    if game is None or game.first == LOST:
        return None if game is None else False
    if result.is_hopeless:
        return game.can_meet_again_and_again(result.unreached)
    asked = game.asking(game.assumptions, [game.goals[item] for item in result.unreached])
    return game.first in winning_positions(asked)


def compare(seed: int, met: Counter[str]) -> None:
    problem = prepare(bundle_of(random_text(Random(seed))), Deployment.CONTROLLER)
    if not isinstance(problem, SynthesisProblem):
        return
    model, executable = problem.model, problem.system
    made = synthesize(executable.automata)
    if made.status is SynthesisStatus.EMPTY:
        return
    game = game_of(executable, made.added, LIMIT)
    result = synthesize_strategy(executable, made.added)
    if not result.unreached or game is None or game.first == LOST:
        return
    met["models"] += 1
    blame = blame_goals(executable, made.added, result)
    count = len(model.requirements)
    found = frozenset((*blame.requirements, *(item + count for item in blame.invariants)))
    assert blame.is_known, seed
    reached = is_reached_explicitly(model, found, result)
    if reached is None:
        return
    assert reached is False, seed
    for item in found:
        assert is_reached_explicitly(model, found - {item}, result) in (True, None), seed
    met["blamed" if found else "without requirements"] += 1
    met["several"] += len(found) > 1
    check_helpful(model, executable, game, result, blame, seed, met)
    check_nearest(game, result, blame, seed, met)


def check_helpful(
    model: Model,
    executable: ExecutableSystem,
    game: Game,
    result: StrategyResult,
    blame: GoalBlame,
    seed: int,
    met: Counter[str],
) -> None:
    """Check that suggested assumptions make goals reachable, each is needed, and the robot cannot break them."""
    if not blame.helpful:
        met["no help"] += 1
        return
    added = synthesize(executable.automata).added
    old = len(model.assumptions)

    def tried(left_out: int | None) -> StrategyResult:
        more = tuple(item for place, item in enumerate(blame.helpful) if place != left_out)
        model_ = msgspec.structs.replace(model, assumptions=(*model.assumptions, *more))
        return synthesize_strategy(ExecutableSystem(model_, Deployment.CONTROLLER), added)

    better = tried(None)
    assert set(result.unreached).isdisjoint(better.unreached), seed
    assert all(item < old for item in better.preventable), seed
    if not better.unreached:
        for place in range(len(blame.helpful)):
            assert tried(place).unreached, seed
        met["helped"] += 1


def check_nearest(game: Game, result: StrategyResult, blame: GoalBlame, seed: int, met: Counter[str]) -> None:
    """Check that the nearest is said to be at a goal only where the goal can be true."""
    assert result.is_hopeless or blame.nearest is None, seed
    if blame.nearest is not None:
        goal = game.goals[blame.nearest.goal]
        assert isinstance(goal, Item)
        is_met = any(goal.condition(state) for (state, _), _ in game.choices)
        assert is_met is blame.nearest.is_reached, seed
        assert bool(blame.nearest.missing) is not blame.nearest.is_reached, seed
        met["reached once" if is_met else "nearer"] += 1


def test_random_robots_agree(record_property: Callable[[str, object], None]) -> None:
    met: Counter[str] = Counter()
    for seed in range(400):
        compare(seed, met)
    for name, count in sorted(met.items()):
        record_property(name, count)
    assert min(met["blamed"], met["without requirements"], met["no help"], met["helped"]) > 10, met
    assert min(met["several"], met["nearer"]) > 5 and met["reached once"], met


def test_leaving_out_need_not_be_monotone() -> None:
    wanted = {frozenset({0, 1, 2}), frozenset({0, 1}), frozenset({1, 2}), frozenset({2})}
    assert without_needless((0, 1, 2), wanted.__contains__) == (0, 1)
    assert without_needless((1, 2), wanted.__contains__) == (2,)
    assert without_needless((0, 1), lambda kept: True) == ()


# Examples


def test_one_requirement_is_to_blame_and_assumptions_that_help_are_named_exactly() -> None:
    goal = "goal always eventually Base.inside"
    blame = blame_of(goal)
    assert (blame.requirements, blame.invariants, blame.is_known) == ((1,), (), True)
    # Once it is inside it stays there.
    assert [assumption_text(item) for item in blame.helpful] == ["Door.opening leads to Door.ajar"]
    goal += " goal always eventually Base.outside and Door.shut"
    assert [assumption_text(item) for item in blame_of(goal).helpful] == [
        "Door.opening leads to Door.ajar",
        "Door.closing leads to Door.shut",
    ]
    found = finding_of(goal)
    assert found.message == (
        "the surroundings can keep this goal from coming true, for ever: one requirement alone is enough for that"
    )
    assert [item.message for item in found.related] == ["this requirement is to blame"]
    assert found.fix.startswith(
        "Write 'assume Door.opening leads to Door.ajar' and 'assume Door.closing leads to Door.shut'"
    )
    obeyed = f"{goal} assume Door.opening leads to Door.ajar assume Door.closing leads to Door.shut"
    assert outcome_of(obeyed).supervisor is not None


def test_requirements_that_exclude_a_goal_together_are_named_with_what_is_nearest() -> None:
    made = outcome_of("requirement always Base.outside or Door.shut goal once Base.inside")
    found = next(item for item in made.diagnostics if item.code == "unreachable-goal")
    assert found.message.endswith("2 requirements are enough for that, and each of them is needed")
    assert len(found.related) == 2
    assert "assume" not in found.fix
    why = made.explanation
    assert isinstance(why, GoalExplanation) and why.nearest is not None
    assert [item.kind for item in why.blamed] == ["requirement", "invariant"]
    assert str(why).splitlines()[-1].startswith("the nearest to goal once Base.inside")
    assert why.nearest.missing == ("enter.request",)
    assert why.nearest.events == ()


def test_a_goal_that_excludes_itself_has_no_requirement_to_blame_and_nothing_near() -> None:
    blame = blame_of("goal always eventually Base.inside and Base.outside")
    assert (blame.requirements, blame.invariants, blame.is_known, blame.nearest) == ((), (), True, None)
    assert finding_of("goal once Base.inside and Base.outside").message.endswith(
        "the behaviours exclude it, without any requirement"
    )


def test_a_state_that_is_reached_once_only_is_shown_as_the_nearest() -> None:
    goals = "goal always eventually Base.inside goal always eventually Base.outside"
    made = outcome_of(f"requirement leave needs Door.shut and Door.ajar {goals} assume Door.opening leads to Door.ajar")
    why = made.explanation
    assert isinstance(why, GoalExplanation) and why.is_hopeless and why.nearest is not None
    assert why.nearest.is_reached
    assert why.nearest.events == ("open.request", "opened.response", "enter.request")
    assert str(why.nearest).endswith("but not again and again together with the others")


def test_more_assumptions_than_are_tried_together_are_not_suggested(monkeypatch: pytest.MonkeyPatch) -> None:
    goals = "goal always eventually Base.inside goal always eventually Base.outside and Door.shut"
    assert len(blame_of(goals).helpful) == 2
    # The assumptions that are left help some goals at least.
    monkeypatch.setattr("robosc.strategies.blame.MAXIMUM_CANDIDATES", 1)
    assert len(blame_of(goals).helpful) == 1
    monkeypatch.setattr("robosc.strategies.blame.MAXIMUM_CANDIDATES", 0)
    assert blame_of(goals).helpful == ()
    assert finding_of(goals).fix.startswith("Assume what the surroundings do once the robot has done its part")


ASKING = """robot R {
    interface some_type use SomeType from some_package
    component Asker {
        service ask with request: none, response: none links some_type
        behaviour {
            initial marked state idle { on response from ask goto answered }
            marked state answered { on response from ask goto idle }
        }
    }
    goal always eventually Asker.answered
    goal always eventually Asker.idle
}"""


def test_an_assumption_that_the_robot_can_break_is_not_suggested() -> None:
    made = make_supervisor(bundle_of(ASKING))
    # It could be idle for ever by never asking.
    assert isinstance(made.explanation, GoalExplanation) and made.explanation.helpful == ()
    assume = "assume Asker.idle leads to Asker.answered assume Asker.answered leads to Asker.idle }"
    broken = make_supervisor(bundle_of(f"{ASKING.rstrip('}')}{assume}"))
    assert [item.code for item in broken.diagnostics if item.severity is Severity.ERROR] == [
        "preventable-assumption",
        "preventable-assumption",
    ]


SHELF = """robot Shelf {
    component Arm {
        incoming message place with type: none
        outgoing message taken with type: none
        behaviour {
            initial state empty { on request to place goto placed }
            marked state placed { on response from taken goto empty }
        }
    }
    goal always eventually Arm.placed
}"""


def test_what_the_surroundings_only_undo_is_said() -> None:
    """The arm places a thing, and somebody takes it before the controller's next turn."""

    def fix(text: str) -> str:
        (found,) = (item for item in make_supervisor(bundle_of(text)).diagnostics if item.severity is Severity.ERROR)
        return found.fix

    assert fix(SHELF).startswith("Name a state that only the robot leaves: a request makes this true")
    # Here nothing is placed without the surroundings.
    given = SHELF.replace("place goto placed", "place goto moving").replace(
        "marked state placed", "state moving { on response from taken goto placed } marked state placed"
    )
    assert not fix(given).startswith("Name a state")


def test_a_search_that_is_given_up_says_so() -> None:
    blame = blame_of("goal always eventually Base.inside", effort=0, least_effort=10)
    assert (blame.requirements, blame.is_known, blame.helpful) == ((), False, ())
    assert blame.counter is not None


def test_the_caller_can_end_the_search() -> None:
    problem = prepare(bundle_of(PORTER.replace("GOALS", "goal always eventually Base.inside")), Deployment.CONTROLLER)
    assert isinstance(problem, SynthesisProblem)
    added = synthesize(problem.system.automata).added
    result = synthesize_strategy(problem.system, added)
    for least in (0, 30, 100):
        asked = Counter[str]()

        def should_stop(least: int = least, asked: Counter[str] = asked) -> bool:
            asked["steps"] += 1
            return asked["steps"] > least

        with pytest.raises(SynthesisCancelled):
            blame_goals(problem.system, added, result, should_stop=should_stop)
