"""Strategies that somebody tampered with: the verifier finds each that may miss a goal, and passes the others."""

from collections import Counter

from msgspec.structs import replace

from robosc.certification.supervisor_file import verify_supervisor_file
from robosc.errors import InvalidSupervisorError
from robosc.supervisor import Strategy, Supervisor, decode, encode
from robosc.verification import CheckOutcome, Limits
from support.goal_porter import PORTER, porter_supervisor
from support.goal_twin import deciding, game_of, unfair_goal
from support.models import bundle_of
from support.mutants import change, strategy_mutants
from support.random_goals import strategic_controller

LIMITS = Limits.of(40_000)


def compare(supervisor: Supervisor, met: Counter[str]) -> None:
    """Judge every mutant of a strategy, as a file, like an explicit game does."""
    executable = supervisor.executable
    game = game_of(executable, supervisor.added, 3_000)
    assert game is not None
    for mutant in strategy_mutants(supervisor):
        try:
            read = decode(encode(change(supervisor, strategy=mutant.value)))
        except InvalidSupervisorError:
            met["refused"] += 1
            continue
        is_missed = unfair_goal(game, deciding(game, executable, mutant.value)) is not None
        found = verify_supervisor_file(read, None, LIMITS)
        assert found.outcomes()["goals"] == ("failed" if is_missed else "passed"), mutant.name
        assert ("goals" in {fault.check for fault in found.faults}) is is_missed, mutant.name
        met["missed" if is_missed else "harmless"] += 1


def test_every_mutant_of_the_porter_is_judged_rightly() -> None:
    met: Counter[str] = Counter()
    compare(porter_supervisor(), met)
    assert met["missed"] > 60 and met["harmless"] > 5, met


def test_mutants_of_random_strategies_are_judged_rightly() -> None:
    met: Counter[str] = Counter()
    for seed in range(24):
        supervisor = strategic_controller(seed)
        if supervisor is not None and supervisor.strategy and any(supervisor.strategy.modes):
            compare(supervisor, met)
    assert met["missed"] > 150 and met["harmless"] > 100, met


def test_a_file_whose_strategy_does_nothing_fails_with_a_run() -> None:
    idle = change(porter_supervisor(), strategy=Strategy(((), ())))
    found = verify_supervisor_file(idle, bundle_of(PORTER), LIMITS)
    certificate, goals = found.faults
    assert certificate.message == "it says 'goals: passed', which is false"
    assert goals.message.startswith("under the strategy goal 1 may never come true again")
    assert goals.trace == ("call.response",) and goals.state is not None
    assert goals.state.components["Caller"] == "waiting"
    # A certificate that claims no more than it can is truthful.
    modest = change(idle, certificate=change(idle.certificate, goals="not checked"))
    assert [fault.check for fault in verify_supervisor_file(modest, bundle_of(PORTER), LIMITS).faults] == ["goals"]


def test_too_many_positions_are_not_checked() -> None:
    found = verify_supervisor_file(porter_supervisor(), bundle_of(PORTER), replace(LIMITS, positions=10, work=1_000))
    assert found.goals is CheckOutcome.NOT_CHECKED
    assert (found.unchecked(), found.faults, found.has_passed) == (("goals",), (), False)
    assert found.notes == ("the certificate says 'passed' for what was not checked here: goals",)


def test_another_model_leaves_the_strategy_unchecked() -> None:
    found = verify_supervisor_file(
        porter_supervisor(), bundle_of(PORTER.replace("state opening", "marked state opening")), LIMITS
    )
    assert found.outcomes()["model"] == "failed"
    assert found.outcomes()["goals"] == "not checked"
