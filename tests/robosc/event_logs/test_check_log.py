"""The log check: nothing is wrong with what the reference executors log, and what is wrong is found."""

from collections import Counter
from pathlib import Path
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.event_logs import check_log
from robosc.execution.interpreter import InterpretedSystem
from robosc.supervisor import Supervisor
from support.effort import examples
from support.execution import Bench
from support.generated import example_supervisor
from support.random_controllers import random_controller, random_robot
from support.random_layers import random_layer
from support.random_logs import Entry, World, faults, mutated, read, walked
from support.random_supervisors import random_data, random_supervisor

STEPS = 50


def random_supervisor_of(dice: Random) -> Supervisor:
    """Return a supervisor of a controller, synthesized or not, or of a layer."""
    match dice.randrange(3):
        case 0:
            return random_layer(dice)
        case 1:
            return random_robot(dice.randrange(2**32))
    return random_controller(dice.randrange(2**32)) or random_layer(dice)


def random_log(seed: int) -> tuple[Random, Supervisor, list[Entry]]:
    dice = Random(seed)
    supervisor = random_supervisor_of(dice)
    return dice, supervisor, World(supervisor, dice).run(STEPS)


@settings(max_examples=examples(25))
@given(seed=st.integers(0, 2**32))
def test_logs_of_the_reference_executors_have_no_violation(seed: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    _, supervisor, entries = random_log(seed)
    found = check_log(read(tmp_path_factory.mktemp("log"), entries), supervisor)
    assert found.violations == ()
    assert found.has_passed is bool(found.events)
    assert found.events == sum(entry["kind"] == "event" for entry in entries)
    assert found.blocked == sum(entry["kind"] == "blocked" for entry in entries)
    assert list(faults(supervisor, entries)) == []


@settings(max_examples=examples(50))
@given(seed=st.integers(0, 2**32))
def test_a_mutated_log_is_found_where_the_interpreted_system_finds_it(
    seed: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    dice, supervisor, entries = random_log(seed)
    changed = mutated(dice, supervisor, entries)
    if changed is None:
        return
    found = check_log(read(tmp_path_factory.mktemp("log"), changed), supervisor)
    of_events = [item.line for item in found.violations if changed[item.line - 1]["kind"] == "event"]
    assert of_events[:1] == list(faults(supervisor, changed))


def test_the_random_logs_show_everything(tmp_path: Path) -> None:
    total: Counter[str] = Counter()
    for seed in range(80):
        dice, supervisor, entries = random_log(seed)
        total.update(entry["kind"] for entry in entries)
        total.update(entry["event"].rpartition(".")[2][:4] for entry in entries if entry["kind"] == "event")
        total.update(entry["why"] for entry in entries if entry["kind"] == "blocked")
        changed = mutated(dice, supervisor, entries)
        if changed is not None:
            total["wrong" if list(faults(supervisor, changed)) else "right"] += 1
    print(dict(total))
    kinds = "requ resp erro feed canc rese tau_ restart stop fault resume blocked unexpected wrong right".split()
    for what in (*kinds, "not allowed now", "stopped", "its last goal may still be under way"):
        assert total[what] >= 3, what


@settings(max_examples=examples(40))
@given(seed=st.integers(0, 2**32))
def test_variables_that_synthesis_leaves_out_are_followed_too(
    seed: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    supervisor = random_supervisor(seed)
    dice = Random(seed)
    entries = walked(supervisor, dice, 40, random_data)
    folder = tmp_path_factory.mktemp("log")
    found = check_log(read(folder, entries), supervisor)
    assert found.violations == ()
    stored = [
        (number, component.name, variable.name)
        for number, entry in enumerate(entries)
        for component in supervisor.model.components
        for variable in (component.behaviour.variables if component.behaviour else ())
        if not variable.is_synthesis and entry["event"].rpartition(".")[2] in ("request", "reset", "cancel", "error")
    ]
    if not stored:
        return
    # No data comes with these events: nothing but the expressions says what the variable is now.
    number, component_name, name = dice.choice(stored)
    variables = entries[number]["state"][component_name]["variables"]
    variables[name] = {"str": 7, "bool": "no"}.get(type(variables[name]).__name__, "other")
    lines = [item.line for item in check_log(read(folder, entries), supervisor).violations]
    assert lines[:1] == [number + 1]


def driven() -> list[Entry]:
    """Return a log of the navigation robot whose goal is being cancelled."""
    bench = Bench(InterpretedSystem(example_supervisor("navigation/navigation")))
    bench.tick()
    bench.executor.on_reply(1, {"success": True})
    bench.receive("/person/distance", 3.0)
    bench.tick()
    bench.receive("/person/distance", 0.5)
    return bench.log.entries


def log_of_the_drive(folder: Path, entries: list[Entry]) -> tuple[str, ...]:
    """Return what is wrong with a log of the navigation robot."""
    found = check_log(read(folder, entries), example_supervisor("navigation/navigation"))
    return tuple(item.sentence for item in found.violations)


def _cancelled(state: dict[str, Any]) -> Entry:
    after = {**state, "Navigator": {**state["Navigator"], "state": "ready"}}
    return {
        "time": 1.0,
        "kind": "event",
        "event": "navigate.cancel",
        "controllable": True,
        "data": None,
        "state": after,
    }


def test_a_log_in_which_a_cancel_is_an_event_when_it_has_happened(tmp_path: Path) -> None:
    entries = driven()
    asked = next(place for place, entry in enumerate(entries) if entry["kind"] == "cancelling")
    assert log_of_the_drive(tmp_path, [*entries, _cancelled(entries[asked - 1]["state"])]) == ()


def test_a_log_of_an_earlier_version_in_which_it_was_an_event_when_it_was_asked_for(tmp_path: Path) -> None:
    entries = [entry for entry in driven() if entry["kind"] != "cancelling"]
    late = {"time": 2.0, "kind": "unexpected", "event": "navigate.response"}
    assert log_of_the_drive(tmp_path, [*entries, _cancelled(entries[-1]["state"]), late]) == ()


def test_a_goal_that_never_was_cannot_be_cancelled(tmp_path: Path) -> None:
    wrong = [
        {"time": 0.0, "kind": "cancelling", "action": "navigate", "why": "stop"},
        {"time": 0.0, "kind": "cancel_overdue", "action": "fly", "asked_s": 5.0},
    ]
    never, unknown = log_of_the_drive(tmp_path, [*wrong, *driven()])
    assert never == "the cancel of a goal of navigate was asked for, but navigate.request never happened"
    assert unknown == "'fly' is not an action of the model"
