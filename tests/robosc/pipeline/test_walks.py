"""Undo, redo and walks by chance: against runs that begin anew, the replay of logs, and a slow search for findings."""

import io
import itertools
from random import Random
from typing import Any

import pytest

import robosc
from robosc.errors import UnsupportedModelError
from robosc.event_logs import check_log
from robosc.event_logs.reading import read_log_stream
from robosc.event_logs.replay import Replay
from robosc.model.structure import Deployment
from robosc.pipeline.received_data import NO_DATA
from robosc.pipeline.saved_runs import event_log
from robosc.pipeline.walking import WalkFindingKind
from robosc.supervisor import Supervisor
from support.effort import seeds
from support.random_supervisors import random_supervisor

STEPS = 15


def again(supervisor: Supervisor, steps: Any) -> robosc.Run:
    """A run that begins anew and takes the same events: the obvious twin of undo and redo."""
    run = robosc.simulate(supervisor)
    for step in steps:
        run.step(step.event, *(() if step.given is NO_DATA else (step.given,)))
    return run


def standing(run: robosc.Run) -> tuple[Any, ...]:
    return str(run.state), run.enabled, run.possible, run.is_marked, [str(step) for step in run.history]


@pytest.mark.random
@pytest.mark.parametrize("seed", seeds(12))
def test_undo_and_redo_lead_where_a_run_that_begins_anew_leads(seed: int) -> None:
    core, dice = random_supervisor(seed), Random(f"undo {seed}")
    run = robosc.simulate(core)
    past: list[robosc.Step] = []
    future: list[robosc.Step] = []
    for number in range(STEPS):
        match dice.randrange(4):
            case 0:
                step = run.undo()
                assert step == (past[-1] if past else None)
                if step is not None:
                    future.append(past.pop())
            case 1:
                step = run.redo()
                assert step == (future[-1] if future else None)
                if step is not None:
                    past.append(future.pop())
            case _:
                taken = run.walk(1, number)
                past += taken
                if taken:
                    future.clear()
        assert standing(run) == standing(again(core, past))
        assert list(run.undone) == list(reversed(future))


def leaves_range(run: robosc.Run, event: str, given: object = NO_DATA) -> bool:
    """Return True if an event would take a synthesis variable out of its range, which synthesis does not let be."""
    system, reading = run._system, None if given is NO_DATA else run._reading(event, given)
    successor = system._successor(system._events[event], {}.get if reading is None else reading.values.get)
    return successor is not None and successor.leaves_range


@pytest.mark.random
@pytest.mark.parametrize("seed", seeds(20))
def test_whatever_is_walked_the_check_of_logs_accepts(seed: int) -> None:
    core = random_supervisor(seed)
    run = robosc.simulate(core)
    taken = run.walk(STEPS, seed)
    assert run.history == taken
    assert [str(step) for step in robosc.simulate(core).walk(STEPS, seed)] == [str(step) for step in taken]
    if len(taken) < STEPS:
        waiting = {name for name in run.possible if not name.endswith(".request")}
        assert not waiting
    right = robosc.simulate(core)
    for step in taken:
        # These supervisors are not synthesized: what synthesis would have prevented ends what can be compared.
        if leaves_range(right, step.event, step.given):
            break
        right.step(step.event, *(() if step.given is NO_DATA else (step.given,)))
    try:
        found = check_log(read_log_stream(io.BytesIO(event_log(right).encode()), "log"), core)
    except UnsupportedModelError:
        return
    assert (found.violations, found.events) == ((), len(right))


@pytest.mark.random
@pytest.mark.parametrize("seed", seeds(20))
def test_there_is_a_reason_if_and_only_if_an_event_cannot_happen(seed: int) -> None:
    core = random_supervisor(seed)
    try:
        replay = Replay(core, core.deployment)
    except UnsupportedModelError:
        return
    run = robosc.simulate(core)
    for number in range(STEPS):
        assert run.blocked() == {event: run.reasons(event) for event in run.events if event not in run.possible}
        for event in run.events:
            if replay.is_controllable(event):
                can_happen = not replay.refusal(event)
                if can_happen and ".tau_" in event:
                    (target,) = replay._semantics.targets(replay.state, event)
                    can_happen = target != replay.state
            else:
                can_happen = replay.is_possible(event)
                if leaves_range(run, event):
                    continue
            why = run.reasons(event)
            assert (why == ()) is can_happen, (event, why)
            assert all(sentence and "\n" not in sentence for sentence in why)
        for step in run.walk(1, number):
            run.undo()
            if leaves_range(run, step.event, step.given):
                return
            run.redo()
            logged = {
                name: {"state": place, "variables": {}} for name, place in step.state.components.items()
            }  # Variables that are made of arrays cannot be known from a log.
            for name, value in step.state.variables.items():
                component, _, variable = name.partition(".")
                logged[component]["variables"][variable] = value  # type: ignore[index]
            replay.step(step.event, step.provided if step.is_controllable else dict(step.data), logged)


@pytest.mark.random
@pytest.mark.parametrize("seed", seeds(20))
def test_a_finding_is_what_a_slow_look_at_the_run_finds(seed: int) -> None:
    core = random_supervisor(seed)
    run = robosc.simulate(core)
    finding = run.walk_until_finding(STEPS, seed, {WalkFindingKind.DEADLOCK, WalkFindingKind.WAITING})
    found = []
    for count in range(len(run) + 1):
        twin = again(core, run.history[:count])
        is_marked = all(
            next(state for state in core.model.component(name).behaviour.states if state.name == place).is_marked  # type: ignore[union-attr]
            for name, place in twin.state.components.items()
        ) and set(twin.state.communications.values()) <= {"idle"}
        busy = {"waiting", "executing"} & set(twin.state.communications.values())
        if is_marked or any(twin.is_controllable(event) for event in twin.possible):
            continue
        if not twin.possible:
            found.append((WalkFindingKind.DEADLOCK, count))
        elif not busy:
            found.append((WalkFindingKind.WAITING, count))
    assert found == ([] if finding is None else [(finding.kind, finding.steps)])
    assert finding is None or finding.steps == len(run)


def supervisor_of(text: str, deployment: Deployment = Deployment.CONTROLLER) -> robosc.Supervisor:
    made = robosc.synthesize(robosc.load(text=text), robosc.SynthesisOptions(deployment=deployment))
    assert made.supervisor is not None, str(made.explanation)
    return made.supervisor


DOOR = """robot R {
    component Light {
        outgoing message seen with identifier: "/seen", type: integer(0..9)
        behaviour { variable n: integer(0..9) on response from seen do n := value initial marked state shining { } }
    }
    component Door {
        incoming message open with identifier: "/open", type: none
        incoming message shut with identifier: "/shut", type: none
        behaviour {
            initial marked state shutState { on request to open goto opened }
            state opened { on request to shut goto shutState }
        }
    }
    requirement shut needs Light.n > 8
}"""


def test_a_walk_reports_each_finding_once_and_goes_on() -> None:
    run = robosc.simulate(supervisor_of(DOOR))
    first = run.walk_until_finding(100, 3)
    reported = [first]
    while reported[-1] is not None and len(reported) < 50:
        reported.append(run.walk_until_finding(100, 3))
    texts = [str(item) for item in reported[:-1] if item is not None]
    assert reported[-1] is None
    waiting = [item for item in reported if item is not None and item.kind is WalkFindingKind.WAITING]
    (only,) = waiting
    assert "it can only wait for seen.response" in str(only)
    assert any(text.startswith("blocked at shut.request after ") and "Light.n is" in text for text in texts)
    run.restart()
    assert run.walk_until_finding(100, 3) == first


def test_only_the_kinds_that_are_asked_for_are_reported() -> None:
    run = robosc.simulate(supervisor_of(DOOR))
    found = run.walk_until_finding(100, 0, {WalkFindingKind.BLOCKED})
    assert found is not None
    assert found.kind is WalkFindingKind.BLOCKED
    # A request that is blocked has not happened.
    assert found.steps == len(run)
    assert robosc.simulate(supervisor_of(DOOR)).walk_until_finding(100, 0, {WalkFindingKind.UNKNOWN}) is None


def test_something_unknown_is_a_finding() -> None:
    text = """robot R {
        component S {
            outgoing message level with identifier: "/level", type: integer
            incoming message tell with identifier: "/tell", type: integer
            behaviour {
                variable n: integer
                on response from level do n := value + 2147483647
                initial marked state s { }
            }
        }
        provide tell with 3 + S.n
    }"""
    run = robosc.simulate(supervisor_of(text))
    found = run.walk_until_finding(200, 1)
    assert found is not None
    assert found.kind is WalkFindingKind.UNKNOWN
    assert "unknown" in str(found)
    run.restart()
    # A request whose data is unknown is not issued by chance; by hand it is, and says so.
    run.step("level.response", 0)
    found_at = [found.event for seed in range(20) if (found := run.walk_until_finding(1, seed)) is not None]
    assert "tell.request" in found_at
    assert "tell.request" not in [step.event for step in run.walk(20)]
    run.restart()
    run.step("level.response", 0)
    assert run.step("tell.request").unknown == ("what it sends is unknown, and an executor would not issue it",)


def test_nothing_is_requested_before_an_awaited_sensor_has_spoken() -> None:
    text = """robot R {
        component S { outgoing message seen with identifier: "/seen", type: none, max_age: 1.0 }
        component B { incoming message move with identifier: "/move", type: none }
    }"""
    for seed in range(20):
        events = [step.event for step in robosc.simulate(supervisor_of(text)).walk(10, seed)]
        assert events[0] == "seen.response"
    assert any(step.event == "move.request" for step in robosc.simulate(supervisor_of(text)).walk(10, 1))


def test_silent_steps_come_first() -> None:
    text = """robot R {
        component S {
            service ask with request: none, response: none links ask
            behaviour { initial marked state a { on request to ask goto b } state b { transition goto a } }
        }
        interface ask use Empty from std_srvs
    }"""
    run = robosc.simulate(supervisor_of(text))
    taken = run.walk(50, 2)
    pairs = [(step.event, after.event) for step, after in itertools.pairwise(taken) if step.event.startswith("ask.")]
    # Resets are the first of several silent steps.
    assert {("ask.request", "S.tau_1"), ("ask.response", "ask.reset"), ("ask.error", "ask.reset")} <= set(pairs)
    assert len(set(pairs)) == 4


def test_a_walk_ends_where_nothing_can_happen() -> None:
    text = """robot R { component S {
        incoming message go with identifier: "/go", type: none
        behaviour { initial marked state a { on request to go goto b } marked state b { } }
    } }"""
    run = robosc.simulate(supervisor_of(text))
    assert [step.event for step in run.walk(10)] == ["go.request"]
    assert run.walk(10) == ()
    assert run.walk_until_finding() is None
    assert (run.possible, run.undo() is not None, run.possible) == ((), True, ("go.request",))
    assert run.redo() is not None
    assert run.redo() is None
    run.restart()
    assert run.undo() is None


def test_an_event_is_found_by_the_name_of_its_communication() -> None:
    run = robosc.simulate(supervisor_of(DOOR))
    assert [run.event_called(name) for name in ("open", "seen", "open.request")] == [
        "open.request", "seen.response", "open.request"
    ]  # fmt: skip
    with pytest.raises(robosc.UnknownEventError, match="'opne'; did you mean 'open'"):
        run.event_called("opne")
    (field,) = run.data_fields("seen.response")
    assert (field.name, field.type, field.is_number, field.choices) == ("value", "integer(0..9)", True, ())
