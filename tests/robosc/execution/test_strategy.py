"""The policy `strategy`: what the executor issues, against what the check of strategies says that it does."""

from collections import Counter
from random import Random
from unittest.mock import Mock

import pytest

from robosc.automata.state import subjects
from robosc.certification import make_supervisor
from robosc.controller_properties import StrategyRun
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.settings import Settings, SettingsError
from robosc.expressions import Value
from robosc.supervisor import Supervisor
from support.controller_twin import World
from support.execution import Bench
from support.missions import strategic
from support.models import bundle_of, model_of
from support.random_controllers import random_robot
from support.random_couriers import strategic_courier
from support.random_goals import strategic_controller
from support.random_waiting import strategic_waiting


def walk(supervisor: Supervisor, dice: Random, met: Counter[str]) -> None:
    world = World(supervisor, ())
    executor = world.bench.executor
    assert executor.settings.policy == "strategy"
    if world.is_endless:
        return
    run = StrategyRun(supervisor.executable, supervisor.strategy)  # type: ignore[arg-type]  # it has one
    system = supervisor.executable.executed_automata
    # Messages have one location, which the executor does not keep.
    places = [
        ((item.automaton, item.variable), system.automaton(item.automaton).locations[0]) for item in subjects(system)
    ]

    def state() -> tuple[Value, ...]:
        return tuple(world.system._state.get(place, only) for place, only in places)

    memory, mode = run.observed(state(), run.memory), 0
    for _ in range(25):
        request, mode = run.decided(state(), memory, mode)
        world.system.steps.clear()
        before = world.open_actions()
        executor.tick()
        issued = next((event for event, _, _ in world.system.steps if event.endswith(".request")), None)
        if request is not None and request.removesuffix(".request") in before:
            # A cancelled goal that is not known to have ended is waited for.
            assert issued is None
            met["waited for an end"] += 1
        else:
            assert issued == request
            met["requests" if issued else "waits"] += 1
        memory = run.observed(state(), memory)
        for _ in range(dice.choice((0, 1, 1, 2))):
            moves = [move for move, _ in world.moves() if move[0] != "request"]
            if moves:
                world.do(dice.choice(moves))
                if world.is_endless:
                    return
                memory = run.observed(state(), memory)


def test_the_executor_issues_what_the_strategy_chooses() -> None:
    met: Counter[str] = Counter()
    for seed in range(250):
        supervisor = strategic_controller(seed)
        if supervisor is not None:
            walk(supervisor, Random(seed), met)
            met["robots"] += 1
    assert met["robots"] > 120 and met["requests"] > 250 and met["waits"] > 1_000, met


def test_the_executor_issues_what_the_strategy_of_a_courier_chooses() -> None:
    met: Counter[str] = Counter()
    for seed in range(120):
        supervisor = strategic_courier(seed)
        if supervisor is not None:
            walk(supervisor, Random(seed), met)
            met["robots"] += 1
    assert met["robots"] > 60 and met["requests"] > 400 and met["waits"] > 400, met


def test_the_executor_issues_what_the_strategy_chooses_while_it_waits() -> None:
    met: Counter[str] = Counter()
    for seed in range(80):
        supervisor = strategic_waiting(seed)
        if supervisor is not None:
            assert supervisor.strategy
            met["meanwhile"] += any(item.is_meanwhile for mode in supervisor.strategy.modes for item in mode)
            walk(supervisor, Random(seed), met)
            met["robots"] += 1
    assert min(met["robots"], met["meanwhile"]) > 30 and min(met["requests"], met["waits"]) > 400, met


BUTTON = """robot Button {
    component Button {
        outgoing message press with identifier: "/press", type: none
        outgoing message release with identifier: "/release", type: none
        behaviour {
            initial marked state free { on response from press goto pressed }
            state pressed { on response from release goto free }
        }
    }
    goal always eventually Button.pressed
    assume always eventually Button.pressed
}"""


def test_what_is_over_before_the_turn_counts_in_the_progress_alone() -> None:
    outcome = make_supervisor(bundle_of(BUTTON))
    assert outcome.supervisor is not None
    executor = Bench(InterpretedSystem(outcome.supervisor)).executor

    def reached() -> tuple[int, str | None]:
        executor.tick()
        assert executor.progress is not None
        return executor.progress.aims[0].times, executor.progress.approached

    assert reached() == (0, "goal 1")
    executor.receive("/press", None)
    executor.receive("/release", None)
    assert reached() == (1, "goal 1")
    executor.receive("/press", None)
    assert reached() == (2, None)


BLOCKED = """robot Blocked {
    component Base {
        incoming message go with type: none
        behaviour { initial marked state here { } state there { on request to go } }
    }
    goal always eventually Base.here
}"""


def test_goals_are_noted_also_where_no_request_is_enabled(monkeypatch: pytest.MonkeyPatch) -> None:
    outcome = make_supervisor(bundle_of(BLOCKED))
    assert outcome.supervisor is not None
    system = InterpretedSystem(outcome.supervisor)
    bench = Bench(system)
    decisions = Mock(side_effect=system.choose)
    monkeypatch.setattr(system, "choose", decisions)
    bench.executor.tick()
    assert system.enabled_requests() == ()
    assert decisions.call_count == 1


def test_a_request_that_is_not_enabled_is_never_issued(monkeypatch: pytest.MonkeyPatch) -> None:
    outcome = make_supervisor(bundle_of(BLOCKED))
    assert outcome.supervisor is not None
    system = InterpretedSystem(outcome.supervisor)
    bench = Bench(system)
    monkeypatch.setattr(system, "choose", lambda: 0)
    assert bench.tick(2) == []
    assert (bench.events, bench.executor.counters.faults) == ([], 0)


WALKER = """robot Walker {
    interface walk use Walk from walking
    component Base {
        action move with request: none, response: none, feedback: none links walk
        behaviour {
            initial marked state start { on request to move goto moving }
            marked state moving {
                on response from move goto there
                on error from move goto start
                on cancel to move goto start
            }
            marked state there { }
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
    goal always eventually Base.there
    assume allow always eventually Base.there
}"""


def walker() -> Bench:
    bench = Bench(InterpretedSystem(strategic(model_of(WALKER))), action_timeout_s=1.0)
    assert bench.tick() == [("goal", "move", 1, None)]
    return bench


def test_a_goal_is_not_sent_again_before_the_cancelled_one_has_ended() -> None:
    bench = walker()
    bench.executor.on_goal_accepted(1)
    assert bench.receive("/near") == [("cancel", "move", 1)]
    assert bench.receive("/far") == []
    assert bench.tick(3) == []
    bench.executor.on_goal_ended(1, "cancelled")
    assert bench.tick() == [("goal", "move", 2, None)]


def test_a_goal_that_a_strategy_sends_has_a_timeout_from_then_on() -> None:
    bench = walker()
    bench.clock.advance(1.0)
    bench.executor.watch()
    assert bench.events[:2] == ["move.request", "move.error"]


def test_a_strategy_that_is_not_there_is_refused() -> None:
    with pytest.raises(SettingsError, match="'policy' is 'strategy', but the supervisor has none"):
        Bench(InterpretedSystem(random_robot(1)), policy="strategy")
    bench = Bench(InterpretedSystem(random_robot(1)))
    assert bench.executor.settings == Settings(policy="fair", release_identifiers=())


def test_another_policy_may_be_used_all_the_same() -> None:
    supervisor = next(found for seed in range(700) if (found := strategic_controller(seed)) is not None)
    assert Bench(InterpretedSystem(supervisor), policy="fair").executor.settings.policy == "fair"


def test_a_strategy_remembers_what_has_held_while_a_goal_runs_and_that_its_cancel_was_asked_for() -> None:
    # The base leaves its start by the request itself: that requirement never holds while the goal runs.
    text = WALKER.replace("    goal", "    requirement move needs Base.start\n    goal")
    supervisor = strategic(model_of(text))
    system = InterpretedSystem(supervisor)
    places = supervisor.executable.obligations.places[:3]
    assert [place.name for place in places] == [
        "requirement 1 of move was met",
        "requirement 2 of move was met",
        "the cancel of move was asked for",
    ]

    def remembered_after(*events: str) -> list[tuple[bool, ...]]:
        found = []
        for event in events:
            assert system.step(event) == ()
            assert system.is_stable() is (event != "move.error")
            system.observe()
            found.append(system.remembered()[1][:3])
        return found

    system.observe()
    nothing, held, asked = (False, False, False), (True, False, False), (False, False, True)
    assert remembered_after("move.request", "near.response", "far.response") == [held, asked, asked]
    assert remembered_after("move.cancel", "move.request", "near.response") == [nothing, held, asked]
    assert remembered_after("move.error", "move.reset") == [nothing, nothing]
