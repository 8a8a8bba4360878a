"""Runs against the surroundings: they deny a goal for ever, keep to their assumptions, and play by the rules."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

import robosc
from robosc.certification.goals import GoalExplanation
from robosc.pipeline.counter_run import CounterRun, NoCounterStrategyError
from robosc.strategies import CounterStrategy
from support.battery_readers import BATTERY_READERS
from support.random_goals import random_text

MODEL = """robot Porter {
    datatype enum Light from double to { value > 1.5 -> day  default -> night }
    datatype object Sample { lux: Light  number: integer(0..3)  parts: array(boolean) }
    interface sample use Sample from lab_msgs
    component Lamp {
        outgoing message seen with type: Sample links sample
        behaviour {
            variable light: Light = night
            variable number: integer(0..3)
            variable part: boolean
            on response from seen do light := value.lux, number := value.number, part := value.parts[1]
            initial marked state watching { }
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
    component Bell {
        incoming message ring with type: none
        behaviour {
            initial marked state still { on request to ring goto rung }
            marked state rung { on request to ring goto still }
        }
    }
    requirement enter needs Lamp.light = day and Lamp.number = 2
    requirement leave needs Lamp.part
    assume always eventually Lamp.light = day
    assume always eventually Lamp.number = 2
    assume always eventually Lamp.part
    goal always eventually Base.inside
    goal always eventually Base.outside
}
"""


DOOR = """robot Gate {
    component Door {
        incoming message open with type: none
        outgoing message opened with type: none
        behaviour {
            initial marked state shut { on request to open goto opening }
            state opening { on response from opened goto ajar }
            marked state ajar { }
        }
    }
    goal once Door.ajar
}
"""


def run_of(text: str) -> CounterRun:
    explanation = robosc.synthesize(robosc.load(text=text)).explanation
    assert isinstance(explanation, GoalExplanation)
    return CounterRun(explanation)


def turn(run: CounterRun, dice: Random) -> None:
    event = dice.choice([*run.enabled, None])
    if event is None:
        run.wait()
    else:
        run.step(event)


def keeps_to_the_rules(run: CounterRun, turns: int, dice: Random, stages: int) -> None:
    """Check that the denied goal is hardly ever true, and that assumptions come true in turn."""
    met = 0
    for _ in range(turns):
        met += run.denied is not None and run.reached[int(run.denied.removeprefix("goal ")) - 1]
        turn(run, dice)
    # A goal that is true at a turn is left behind with its stage.
    assert met <= stages
    for count in run.came_true:
        assert count >= turns // len(run.came_true) - 1


def test_assumptions_come_true_in_turn_with_data_that_brings_them_about() -> None:
    run = run_of(MODEL)
    keeps_to_the_rules(run, 60, Random(1), stages=1)
    sent = [step for step in run.history if run.actor(step.event) == "surroundings"]
    assert {item.event for item in sent} == {"seen.response"}
    assert {str(item.data["value.lux"]) for item in sent} == {"day", "night"}
    assert any(item.data["value.parts[1]"] for item in sent)
    # Both are never true together, so that nobody can enter.
    assert not any(step.event == "enter.request" for step in run.history)
    assert not any(
        step.state.variables["Lamp.light"] == "day" and step.state.variables["Lamp.number"] == 2 for step in run.history
    )


def test_assumptions_come_true_also_if_something_is_requested_at_each_turn() -> None:
    run = run_of(MODEL)
    for _ in range(12):
        run.step("ring.request")
    assert sum(run.came_true) >= 12 and min(run.came_true) >= 4


def test_random_robots_are_denied_a_goal(record_property: Callable[[str, object], None]) -> None:
    met: Counter[str] = Counter()
    for seed in range(150):
        explanation = robosc.synthesize(robosc.load(text=random_text(Random(seed)))).explanation
        if not isinstance(explanation, GoalExplanation):
            continue
        if explanation.counter is None:
            # An assumption has to fail, so that the surroundings need not deny anything.
            assert explanation.is_hopeless
            with pytest.raises(NoCounterStrategyError, match="the surroundings have no counter-strategy, or one that"):
                CounterRun(explanation)
            met["excused"] += 1
            continue
        run = CounterRun(explanation)
        keeps_to_the_rules(run, 40, Random(seed), len(explanation.counter.stages))
        met["played"] += 1
        met["surroundings moved"] += any(run.actor(step.event) == "surroundings" for step in run.history)
        met["requested"] += any(run.actor(step.event) == "you" for step in run.history)
    for name, count in sorted(met.items()):
        record_property(name, count)
    assert min(met["played"], met["requested"]) > 20 and met["surroundings moved"] > 5, met


PATROL = (
    """robot Patrol {
    interface battery use BatteryState from sensor_msgs
    datatype object Charge { percentage: double }
    datatype enum Level from Charge to { value.percentage < 0.2 -> low default -> good }
    datatype enum Reserve from Charge to { value.percentage < 0.3 -> small default -> large }
"""
    + BATTERY_READERS
    + """\
    component Base {
        incoming message dock with type: none
        incoming message leave with type: none
        behaviour {
            initial marked state away { on request to dock goto docked }
            marked state docked { on request to leave goto away }
        }
    }
    requirement dock needs Battery.level = good and Planner.reserve = small
    assume always eventually Battery.level = low
    goal always eventually Base.docked
    goal always eventually Base.away
}
"""
)


def test_what_several_components_read_in_a_message_comes_together() -> None:
    run = run_of(PATROL)
    met = set()
    for _ in range(6):
        run.wait()
        met.add((run.state.variables["Battery.level"], run.state.variables["Planner.reserve"]))
    assert run.came_true[0] > 0
    # A battery that is low for one component has a small reserve for the other.
    assert ("low", "small") in met and ("low", "large") not in met
    sent = [(step.event, step.data["value"]) for step in run.history]
    assert sent[:2] == [("level.response", "low"), ("reserve.response", "small")]


MISSION = """robot Porter {
    component Base {
        incoming message enter with type: none
        incoming message leave with type: none
        behaviour {
            initial marked state outside { on request to enter goto inside }
            marked state inside { on request to leave goto outside }
        }
    }
    component Door {
        incoming message open with type: none
        outgoing message opened with type: none
        behaviour {
            initial marked state shut { on request to open goto opening }
            state opening { on response from opened goto ajar }
            marked state ajar { }
        }
    }
    mission rounds { visit Base.inside then Door.ajar }
}
"""


def test_a_visit_is_denied_while_its_mission_goes_as_far_as_it_can() -> None:
    run = run_of(MISSION)
    assert [str(item) for item in run.missions] == ["rounds: at visit 1, Base.inside"]
    assert (run.denied, run.denied_next) == ("visit 1 of mission rounds", ("visit 2 of mission rounds",))
    assert run.step("enter.request").visits == ("visit 1 of mission rounds",)
    run.step("open.request")
    for _ in range(3):
        run.wait()
    assert run.denied == "visit 2 of mission rounds" and run.missions[0].visit == 2
    assert run.denied_next == ()
    assert run.state.components["Door"] == "opening"
    run.undo()
    run.undo()
    assert run.missions[0].visit == 1


VISITS = ("Base.inside", "Base.outside", "Door.opening", "Door.shut or Door.opening")


def test_another_visit_is_denied_only_if_it_was_announced(record_property: Callable[[str, object], None]) -> None:
    met: Counter[str] = Counter()
    for seed in range(30):
        dice = Random(seed)
        made = dice.sample(VISITS, dice.randint(1, 4))
        made.insert(dice.randint(0, len(made)), "Door.ajar")
        run = run_of(MISSION.replace("Base.inside then Door.ajar", " then ".join(made)))
        for _ in range(20):
            denied, following = run.denied, set(run.denied_next)
            turn(run, dice)
            if run.denied != denied:
                met["another denied"] += 1
                assert run.denied in following, (seed, run.denied)
            assert set(run.denied_next) <= following, (seed, run.denied_next)
        met["announced"] += bool(run_of(MISSION.replace("Base.inside then Door.ajar", " then ".join(made))).denied_next)
    for name, count in sorted(met.items()):
        record_property(name, count)
    assert met["another denied"] >= met["announced"] > 10, met


def test_what_is_taken_back_is_taken_again_with_all_that_followed() -> None:
    run = run_of(MODEL)
    run.walk(20, 4)
    assert run.enabled
    before = run.history, run.state, run.came_true
    run.step(run.enabled[0])
    after = run.history, run.state, run.came_true
    for _ in range(2):
        step = run.undo()
        assert step is not None and run.actor(step.event) == "you"
        assert (run.history, run.state, run.came_true) == before
        assert run.redo() is step
        assert (run.history, run.state, run.came_true) == after
    run.restart()
    assert run.undo() is None and run.came_true == (0, 0, 0)
    assert repr(run) == repr(run.again())


def test_only_requests_are_for_the_user_to_take() -> None:
    run = run_of(MODEL)
    with pytest.raises(robosc.EventNotPossibleError, match="the surroundings decide it"):
        run.step("seen.response")
    with pytest.raises(robosc.UnknownEventError):
        run.step("fly.request")
    with pytest.raises(robosc.NoStrategyError):
        run.walk(3, strategy=True)
    with pytest.raises(NoCounterStrategyError):
        run.walk_until_finding(3)
    assert set(run.blocked()) >= {"seen.response"}


def test_the_log_is_saved_and_no_test(tmp_path: Path) -> None:
    run = run_of(MODEL)
    run.walk(5)
    assert run.save(tmp_path / "run.jsonl").exists()
    with pytest.raises(robosc.FileAccessError):
        run.save(tmp_path / "test_run.py")


def test_a_counter_strategy_that_is_too_large_is_not_played() -> None:
    made = run_of(MODEL).explanation
    without = GoalExplanation(made.goals, False, (), True, (), None, False, made.supervisor, None)
    with pytest.raises(NoCounterStrategyError, match="too large"):
        CounterRun(without)


def test_an_explanation_of_a_server_is_not_played() -> None:
    with pytest.raises(NoCounterStrategyError, match="on this machine"):
        CounterRun(replace(run_of(MODEL).explanation, supervisor=None, counter=None))


def test_a_walk_that_gets_nowhere_ends() -> None:
    idle = GoalExplanation((), False, (), True, (), None, True, run_of(MODEL).supervisor, CounterStrategy(()))
    run = CounterRun(idle)
    assert (run.denied, run.denied_next) == (None, ())
    assert {step.event for step in run.walk(30)} == {"ring.request"}
    door = run_of(DOOR)
    assert [step.event for step in door.walk(100)] == ["open.request"]
