"""The check of strategies on sets of positions: it agrees with the one position by position, damaged strategies too."""

from collections import Counter
from collections.abc import Callable
from functools import cache
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from robosc.automata.state import subjects
from robosc.certification import make_supervisor
from robosc.certification.strategies import verify_on_sets, verify_strategy
from robosc.certification.supervisor_file import verify_supervisor_file
from robosc.controller_properties import MissedGoal, check_strategy
from robosc.errors import SynthesisCancelled
from robosc.model.structure import Deployment
from robosc.supervisor import AddedCondition, Choice, DecisionDiagram, Strategy, Supervisor
from robosc.verification import CheckOutcome, Limits
from support.battery_readers import BATTERY_READERS
from support.effort import examples
from support.missions import strategic
from support.models import bundle_of, model_of
from support.mutants import change, strategy_mutants
from support.random_couriers import strategic_courier
from support.random_goals import strategic_controller
from support.rooms import rooms
from support.rounds import long_detour_supervisor
from support.strategy_runs import fault_of

WORK = 10**7
ON_SETS = Limits(0, 0, WORK)
TRUE, FALSE = DecisionDiagram((), 1), DecisionDiagram((), 0)


def compare(supervisor: Supervisor, strategy: Strategy, name: object, met: Counter[str], engine: str = "auto") -> None:
    """Compare the check on sets with that of each position, and follow the run that it reports."""
    executable, added = supervisor.executable, supervisor.added
    expected = check_strategy(executable, added, strategy)
    found, is_exact = verify_on_sets(executable, added, strategy, limit=WORK, engine=engine)
    assert is_exact and expected.result != "not checked"
    if any(any(item.passing) for item in executable.obligations.cancels):
        # More cancels are counted there than the executor asks for.
        assert found.outcome == expected.result or found.outcome is CheckOutcome.FAILED, name
        met["unseen cancels"] += 1
        return
    assert found.outcome == expected.result, name
    met[expected.result] += 1
    met["cancels"] += bool(executable.obligations.cancels)
    met["silent steps"] += any("tau" in event or ".reset" in event for event in executable.resets_and_taus)
    met["messages of several events"] += any(len(batch) > 1 for batch in executable.batches)
    met["memory"] += len(executable.obligations.places) > 2
    if found.fault is None:
        assert found.positions == expected.positions, name
        return
    fault = found.fault
    state = fault.state[: len(subjects(executable.executed_automata))]
    assert fault_of(supervisor, strategy, MissedGoal(fault.goal, fault.trace, state)) == "", name
    met["not enabled, or without end"] += fault.goal is None


def compare_random(
    make: Callable[[int], Supervisor | None], seed: int, met: Counter[str], engine: str = "auto"
) -> None:
    supervisor = make(seed)
    if supervisor is None or supervisor.strategy is None:
        return
    compare(supervisor, supervisor.strategy, (make.__name__, seed), met, engine)
    mutants = list(strategy_mutants(supervisor))
    for mutant in Random(seed).sample(mutants, min(3, len(mutants))):
        compare(supervisor, mutant.value, (make.__name__, seed, mutant.name), met, engine)


def test_random_strategies_are_judged_alike(record_property: Callable[[str, object], None]) -> None:
    met: Counter[str] = Counter()
    for seed in range(150):
        compare_random(strategic_controller, seed, met)
        compare_random(strategic_courier, seed, met)
    for name, count in sorted(met.items()):
        record_property(name, count)
    assert min(met["passed"], met["failed"]) > 150 and met["not enabled, or without end"] > 20, met
    assert min(met["silent steps"], met["messages of several events"], met["memory"]) > 20, met


@settings(max_examples=examples(60))
@given(st.integers(1_000, 10**6), st.booleans())
def test_other_random_strategies_are_judged_alike(seed: int, is_courier: bool) -> None:
    compare_random(strategic_courier if is_courier else strategic_controller, seed, Counter())


def test_engines_agree() -> None:
    met: Counter[str] = Counter()
    for seed in range(8):
        compare_random(strategic_controller, seed, met, "autoref")
        compare_random(strategic_courier, seed, met, "autoref")
    assert min(met["passed"], met["failed"]) > 5, met


# Kinds of damage, in a robot that has more positions than are looked at one by one


@cache
def rooms_supervisor() -> Supervisor:
    made = make_supervisor(bundle_of(rooms(4)), verify_limit=4_000).supervisor
    assert made is not None
    return made


def with_mode(number: int, mode: tuple[Choice, ...]) -> Supervisor:
    supervisor = rooms_supervisor()
    assert supervisor.strategy is not None
    modes = supervisor.strategy.modes
    return change(supervisor, strategy=Strategy((*modes[:number], mode, *modes[number + 1 :])))


def choices(number: int) -> tuple[Choice, ...]:
    strategy = rooms_supervisor().strategy
    assert strategy is not None
    return strategy.modes[number]


DAMAGED: dict[str, Callable[[], Supervisor]] = {
    "another request": lambda: with_mode(
        1, tuple(change(item, event=item.event.replace("enter2", "enter3")) for item in choices(1))
    ),
    "a step is missing": lambda: with_mode(2, tuple(item for item in choices(2) if item.event != "leave.request")),
    "a mode does nothing": lambda: with_mode(3, ()),
    "it does not wait": lambda: with_mode(
        0, tuple(change(item, condition=TRUE) if item.event == "enter1.request" else item for item in choices(0))
    ),
    "it always waits": lambda: with_mode(0, (Choice("leave.request", FALSE),)),
    "modes of other goals": lambda: with_mode(0, choices(1)),
    "its supervisor forbids what it chooses": lambda: change(
        rooms_supervisor(), added=(AddedCondition("enter4.request", FALSE),)
    ),
}


@pytest.mark.parametrize("kind", DAMAGED)
def test_every_kind_of_damage_is_found(kind: str) -> None:
    damaged = DAMAGED[kind]()
    assert damaged.strategy is not None
    found = verify_strategy(damaged.executable, damaged.added, damaged.strategy, ON_SETS)
    assert (found.outcome, found.method) == (CheckOutcome.FAILED, "goals by symbolic search (more than 0 positions)")
    assert found.missed is not None
    assert fault_of(damaged, damaged.strategy, found.missed) == ""
    assert found.missed.goal == {"a mode does nothing": 3, "it always waits": 0}.get(kind)


def test_a_supervisor_says_how_its_strategy_was_checked() -> None:
    supervisor = rooms_supervisor()
    assert supervisor.certificate.goals == "passed"
    assert supervisor.certificate.method.endswith("; goals by symbolic search (more than 40 positions)")
    found = verify_supervisor_file(supervisor, bundle_of(rooms(4)), Limits.of(4_000))
    assert (found.has_passed, found.method) == (True, supervisor.certificate.method)
    few = verify_supervisor_file(supervisor, None, Limits.of(400_000))
    assert few.method.endswith("; goals position by position")
    damaged = verify_supervisor_file(DAMAGED["a mode does nothing"](), None, Limits.of(4_000))
    assert [fault.check for fault in damaged.faults] == ["certificate", "goals"]
    goals = damaged.faults[1]
    assert goals.message.startswith("under the strategy goal 4 may never come true again")
    assert goals.state is not None and goals.state.components["Caller4"] == "waiting"


def test_positions_are_looked_at_one_by_one_where_sets_are_too_much_work() -> None:
    supervisor = rooms_supervisor()
    assert supervisor.strategy is not None
    given = (supervisor.executable, supervisor.added, supervisor.strategy)
    limits = Limits(0, 0, 1_000, 20_000)
    assert verify_strategy(*given, limits).method == "goals position by position"
    few = verify_strategy(*given, replace(limits, positions=100))
    assert few.outcome is CheckOutcome.NOT_CHECKED
    assert few.method == (
        "goals not checked: more than 100 positions, and the symbolic search takes more than 1000 nodes"
    )
    damaged = DAMAGED["a mode does nothing"]().strategy
    assert damaged is not None
    found = verify_strategy(*given[:2], damaged, limits)
    assert (found.outcome, found.method) == (CheckOutcome.FAILED, "goals position by position")


def test_missions_are_looked_at_position_by_position_as_long_as_that_can_be() -> None:
    """No other search finds visits that are put off."""
    supervisor = long_detour_supervisor()
    assert supervisor.strategy is not None
    given = (supervisor.executable, supervisor.added, supervisor.strategy)
    count = check_strategy(*given).positions
    limits = replace(ON_SETS, positions=count)
    assert verify_strategy(*given, limits).method == "goals position by position"
    few = verify_strategy(*given, replace(limits, positions=count - 1))
    assert (few.outcome, few.missed) == (CheckOutcome.PASSED, None)
    assert few.method == f"goals by symbolic search (more than {count - 1} positions)"


def test_a_check_is_stopped() -> None:
    supervisor = rooms_supervisor()
    assert supervisor.strategy is not None
    with pytest.raises(SynthesisCancelled):
        verify_strategy(supervisor.executable, supervisor.added, supervisor.strategy, ON_SETS, should_stop=lambda: True)


WALKER = """robot Walker {
    interface walk use Walk from walking
    component Base {
        action move with request: none, response: none, feedback: none links walk
        incoming message home with identifier: "/home", type: none
        behaviour {
            initial marked state start { on request to move goto moving }
            marked state moving {
                on response from move goto there
                on error from move goto start
                on cancel to move goto stopped
            }
            marked state there { on request to home goto start }
            marked state stopped { on request to home goto start }
        }
    }
    component Person {
        outgoing message near with identifier: "/near", type: none
        outgoing message far with identifier: "/far", type: none
        behaviour {
            initial marked state away { on response from near goto close }
            marked state close { on response from far goto away }
        }
    }
    requirement move needs Person.away
    requirement move needs Base.start
    goal always eventually Base.there
    goal always eventually Base.start
    assume allow always eventually Base.there
}"""


def test_the_executor_cancels_what_may_not_go_on() -> None:
    supervisor = strategic(model_of(WALKER))
    assert supervisor.strategy is not None and supervisor.executable.obligations.cancels
    met: Counter[str] = Counter()
    compare(supervisor, supervisor.strategy, "walker", met)
    for mutant in strategy_mutants(supervisor):
        compare(supervisor, mutant.value, mutant.name, met)
    assert min(met["passed"], met["failed"]) > 5, met


WATCH = (
    """robot Watch {
    interface battery use BatteryState from sensor_msgs
    datatype object Charge { percentage: double voltage: double }
    datatype enum Level from Charge to { value.percentage < 0.2 -> low default -> good }
    datatype enum Reserve from Charge to {
        value.voltage < 1.0 -> empty
        value.percentage < 0.2 -> small
        default -> large
    }
"""
    + BATTERY_READERS
    + """\
    component Base {
        incoming message dock with identifier: "/dock", type: none
        incoming message leave with identifier: "/leave", type: none
        behaviour {
            initial marked state away { on request to dock goto docked }
            marked state docked { on request to leave goto away }
        }
    }
    goal Battery.level = low leads to Base.docked or Battery.level = good
    goal always eventually Base.away or Battery.level = low or Planner.reserve = small
}"""
)


def test_an_event_that_may_not_happen_is_left_out_of_its_message() -> None:
    """Only where an unknown voltage keeps the reserve is it small beside a good battery."""
    supervisor = strategic(model_of(WATCH))
    assert supervisor.strategy is not None
    met: Counter[str] = Counter()
    compare(supervisor, supervisor.strategy, "watch", met)
    for mutant in strategy_mutants(supervisor):
        compare(supervisor, mutant.value, mutant.name, met)
    assert min(met["passed"], met["failed"]) > 2, met


SPINNING = """robot Spinner {
    component Base {
        outgoing message knock with identifier: "/knock", type: none
        incoming message rest with identifier: "/rest", type: none
        behaviour {
            initial marked state still { on response from knock goto left on request to rest goto still }
            marked state left { transition goto right }
            marked state right { transition goto left }
        }
    }
    goal always eventually Base.still
}"""


def test_silent_steps_without_an_end_are_found() -> None:
    model = model_of(SPINNING)
    supervisor = strategic(model_of(SPINNING.replace("goto left on", "goto still on")))
    spinning = Supervisor(model, Deployment.CONTROLLER, (), supervisor.certificate, supervisor.strategy)
    assert spinning.strategy is not None
    found = verify_strategy(spinning.executable, (), spinning.strategy, ON_SETS)
    assert found.outcome is CheckOutcome.FAILED and found.missed is not None
    assert (found.missed.goal, found.missed.trace) == (None, ("knock.response",))
    assert fault_of(spinning, spinning.strategy, found.missed) == ""
