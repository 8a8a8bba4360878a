"""Runs that are stepped by hand: against the reference interpreter's own interface, and what is refused."""

import json
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any

import pytest

import robosc
from robosc.automata import to_automata
from robosc.automata.state import subjects
from robosc.controller_properties import StrategyRun
from robosc.event_logs import check_log, read_log
from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.protocol import MissingData
from robosc.pipeline.received_data import data_fields
from support.effort import seeds
from support.execution import unsupervised
from support.fitting_data import fitting, received
from support.lift import LIFT
from support.loaders import MODEL as LOADER
from support.models import EXAMPLES
from support.random_goals import strategic_controller
from support.random_supervisors import random_data, random_supervisor

STEPS = 40
EVENTS = """robot R {
    interface range use Range from sensor_msgs
    datatype enum Way from double to { value > 0.5 -> free  default -> blocked }
    datatype enum Word from string to { value = "free" -> taken  default -> free }
    datatype object Scan { front: Way  class: integer(0..3)  word: Word  rest: array(Way) }
    component Sensor {
        outgoing message scan with identifier: "/scan", type: Scan links range
        outgoing message level with identifier: "/level", type: integer(0..3)
        behaviour {
            variable front: Way = blocked
            variable back: Way = blocked
            variable word: Word = taken
            variable number: integer(0..3)
            on response from scan do
                front := value.front, number := value.class, word := value.word, back := value.rest[0]
            on response from level do number := value
            initial marked state sensing { }
        }
    }
    component Base {
        incoming message move with identifier: "/move", type: integer
        outgoing message bump with identifier: "/bump", type: none
    }
    requirement move needs Sensor.front = free and Sensor.number < 2
    provide move with Sensor.number + 1
}"""


@pytest.fixture(scope="module")
def supervisor() -> robosc.Supervisor:
    made = robosc.synthesize(robosc.load(text=EVENTS)).supervisor
    assert made is not None
    return made


@pytest.fixture
def run(supervisor: robosc.Supervisor) -> robosc.Run:
    return robosc.simulate(supervisor)


def without(data: Any, path: tuple[str, ...]) -> Any:
    """Data in which a part is left out."""
    if not path:
        return None
    kept = {**data, path[0]: without(data[path[0]], path[1:])}
    return kept if len(path) > 1 else {name: part for name, part in data.items() if name != path[0]}


@pytest.mark.random
@pytest.mark.parametrize("seed", seeds(25))
def test_what_is_required_is_what_the_interpreter_refuses_to_miss(seed: int) -> None:
    core = random_supervisor(seed)
    dice = Random(f"fields {seed}")
    twin = InterpretedSystem(core)
    for event in to_automata(core.model, core.deployment).events:
        for field in data_fields(core.model, event.name):
            data = fitting(dice, core.model, received(core.model, event.name), complete=True)
            twin.read(event.name, data)
            try:
                twin.read(event.name, without(data, field.path))
            except MissingData:
                assert field.is_required
            else:
                assert not field.is_required


@pytest.mark.random
@pytest.mark.parametrize("seed", seeds(25))
def test_a_random_run_is_that_of_the_interpreter(seed: int) -> None:
    core = random_supervisor(seed)
    dice = Random(f"run {seed}")
    run, twin = robosc.simulate(core), InterpretedSystem(core)
    events = to_automata(core.model, core.deployment).events
    for _ in range(STEPS if events else 0):
        own = tuple(item.name for item in events if item.is_controllable and twin.enabled(item.name))
        assert run.enabled == own
        event = dice.choice(events)
        type_ = received(core.model, event.name)
        before, length = str(run.state), len(run)
        arguments: list[Any] = []
        if type_ is not None and dice.random() < 0.95:
            arguments = [fitting(dice, core.model, type_) if dice.random() < 0.7 else random_data(dice)]
        try:
            step = run.step(event.name, *arguments)
        except robosc.DataError:
            # A refused event has not happened; a robot would take whatever comes.
            assert (str(run.state), len(run)) == (before, length)
            continue
        except robosc.EventNotPossibleError:
            assert (str(run.state), len(run)) == (before, length)
            blocked = event.is_controllable and not twin.enabled(event.name)
            # Data that lacks a part is not read at all.
            with suppress(MissingData):
                assert blocked or twin.step(event.name, twin.read(event.name, *arguments or [None])) is None
            continue
        reading = twin.read(event.name, arguments[0] if arguments else None)
        is_request = event.name.endswith(".request")
        provided = twin.provide(event.name.partition(".")[0])[1] if is_request else None
        assert step.skipped == twin.step(event.name, reading)
        assert str(step.provided) == str(provided)
        assert str(dict(step.data)) == str(reading.data if type_ is not None else {})
        found = twin.state()
        assert run.state.components == {name: values["state"] for name, values in found.items()}
        assert str(run.state.variables) == str(
            {f"{name}.{key}": value for name, values in found.items() for key, value in values["variables"].items()}
        )
        calls = run.state.communications
        assert all(twin.location(name.rpartition(" ")[2]) == place for name, place in calls.items())


def test_a_run_step_by_step(run: robosc.Run) -> None:
    assert run.events == ("scan.response", "level.response", "move.request", "bump.response")
    assert not run.enabled
    step = run.step("scan.response", {"front": 0.7, "class": 1, "word": "any", "rest": [0.1, 0.9]})
    assert step.data["value.front"] == "free"
    assert run.state.variables == {
        "Sensor.front": "free",
        "Sensor.back": "blocked",
        "Sensor.word": "free",
        "Sensor.number": 1,
    }
    # An element that was not given is unknown, as it would be to the robot; what every message has must be given.
    assert run.step("scan.response", {"front": 0.7, "class": 1, "word": "any"}).skipped == ("Sensor.back",)
    with pytest.raises(robosc.DataError, match=r"'scan.response' cannot happen so: value.class is missing"):
        run.step("scan.response", {"front": 0.7, "word": "any"})
    with pytest.raises(robosc.DataError, match=r"'level.response' cannot happen so: value is missing, and cannot be"):
        run.step("level.response")
    assert run.enabled == ("move.request",)
    assert run.step("move.request").provided == 2
    run.step("level.response", 3)
    assert not run.enabled
    assert run.step("bump.response").data == {}
    assert [item.event for item in run.history] == [
        "scan.response",
        "scan.response",
        "move.request",
        "level.response",
        "bump.response",
    ]
    assert repr(run) == "<run of R: 5 steps; nothing is allowed>"
    assert str(run).splitlines()[3] == "   4  level.response (value = 3): Sensor.number = 3"
    assert "<td" in run._repr_html_()
    run.restart()
    assert (len(run), run.state.variables["Sensor.number"]) == (0, 0)


def test_values_of_enums_are_given_by_name_or_by_what_they_are_made_of(run: robosc.Run) -> None:
    rest = {"front": "free", "class": 0, "word": "any"}
    for given, expected in (("free", "free"), ("blocked", "blocked"), (0.51, "free"), (0, "blocked")):
        run.step("scan.response", **rest | {"front": given})
        assert run.state.variables["Sensor.front"] == expected
    # A text that is a value is that value, whatever the rules would make of it; another text goes by the rules.
    for word, expected in (("free", "free"), ("taken", "taken"), ("anything", "free")):
        run.step("scan.response", **rest | {"word": word})
        assert run.state.variables["Sensor.word"] == expected
    run.step("scan.response", **rest | {"rest": ("free", 0.1)})
    assert run.state.variables["Sensor.back"] == "free"


def test_a_value_outside_its_range_is_moved_into_it_and_reported(run: robosc.Run) -> None:
    step = run.step("level.response", 9)
    assert run.state.variables["Sensor.number"] == 3
    assert step.unknown == ("value is 9, outside 0..3",)


@pytest.mark.parametrize(
    ("event", "data", "fields", "error", "message"),
    [
        ("scan.respons", [], {}, robosc.UnknownEventError, "'scan.respons'; did you mean 'scan.response'?"),
        ("xyz", [], {}, robosc.UnknownEventError, "'xyz'; there are scan.response, level.response, move.request, "),
        ("move.request", [], {}, robosc.EventNotPossibleError, "(Sensor.front is blocked); nothing is allowed"),
        ("bump.response", [1], {}, robosc.DataError, "'bump.response' carries no data, and was given 1"),
        ("bump.response", [], {"x": 1}, robosc.DataError, "'bump.response' carries no data, and was given {'x': 1}"),
        ("level.response", ["many"], {}, robosc.DataError, "is 'many', and must be integer(0..3)"),
        ("level.response", [True], {}, robosc.DataError, "is True, and must be integer(0..3)"),
        ("level.response", [], {"value": 1}, robosc.DataError, "is {'value': 1}, and must be integer(0..3)"),
        ("scan.response", [3], {}, robosc.DataError, "is 3, and must be Scan with front, class, word, rest"),
        ("scan.response", [{}], {"front": 1.0}, robosc.DataError, "given either as one value or as keywords"),
        ("scan.response", [], {"frnt": 1.0}, robosc.DataError, "no property 'frnt'; did you mean 'front'?"),
        ("scan.response", [], {"zzz": 1.0}, robosc.DataError, "no property 'zzz'; there are front, class, word, rest"),
        ("scan.response", [], {"front": "fre"}, robosc.DataError, "is 'fre', which is not Way; did you mean 'free'?"),
        ("scan.response", [], {"front": []}, robosc.DataError, "is [], and must be double, or one of free, blocked"),
        ("scan.response", [], {"rest": "free"}, robosc.DataError, "value.rest of 'scan.response' is 'free', and must"),
        ("scan.response", [], {"rest": 3}, robosc.DataError, "value.rest of 'scan.response' is 3, and must be"),
        ("scan.response", [], {"rest": ["no"]}, robosc.DataError, "value.rest[0] of 'scan.response' is 'no', which is"),
    ],
)
def test_what_cannot_be_is_one_clear_error_and_changes_nothing(
    run: robosc.Run, event: str, data: list[Any], fields: dict[str, Any], error: type[Exception], message: str
) -> None:
    before = run.state
    with pytest.raises(error) as caught:
        run.step(event, *data, **fields)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, KeyError if error is robosc.UnknownEventError else ValueError)
    assert (run.state, run.history) == (before, ())


def test_an_event_that_the_state_cannot_accept_says_where_it_is() -> None:
    run = robosc.simulate(_navigation())
    for event, why in {
        "navigate.feedback": "cannot happen now: navigate is in idle, not in executing; allowed are",
        "navigate.reset": "is not allowed now: navigate is in idle, not in ready or failed",
        "Localisation.tau_1": "is not allowed now: ",
    }.items():
        with pytest.raises(robosc.EventNotPossibleError, match=f"'{event}' {why}"):
            run.step(event)


def test_a_supervisor_may_be_a_file_or_its_bytes(supervisor: robosc.Supervisor, tmp_path: Any) -> None:
    file = supervisor.write(tmp_path / "r.rsup")
    for given in (file, str(file), file.read_bytes()):
        assert robosc.simulate(given).enabled == ()
    with pytest.raises(robosc.InvalidSupervisorError):
        robosc.simulate(b"{}")
    with pytest.raises(TypeError, match="not NoneType: no supervisor was made, print the result to see why"):
        robosc.simulate(None)  # type: ignore[call-overload]


def _navigation() -> robosc.Supervisor:
    made = robosc.synthesize(EXAMPLES / "navigation" / "navigation.rscd").supervisor
    assert made is not None
    return made


@pytest.mark.random
@pytest.mark.parametrize("seed", seeds(40))
def test_what_the_strategy_chooses_in_a_random_run_is_what_its_check_says(seed: int) -> None:
    core = next(found for number in range(seed * 100, seed * 100 + 400) if (found := strategic_controller(number)))
    dice, run, met = Random(f"strategy {seed}"), robosc.simulate(core), 0
    assert core.strategy is not None and run.has_strategy
    twin = StrategyRun(core.executable, core.strategy)
    system = core.executable.executed_automata
    # Messages have one location, which the interpreter does not keep.
    places = [
        ((item.automaton, item.variable), system.automaton(item.automaton).locations[0]) for item in subjects(system)
    ]
    memory, mode, kept = twin.memory, 0, [(run.reached, run.chosen)]
    for number in range(30):
        state: tuple[Any, ...] = tuple(run._system._state.get(place, only) for place, only in places)
        if run._system.is_stable():
            memory = twin.observed(state, memory)
            chosen, mode = twin.decided(state, memory, mode)
            assert (run.chosen, run.reached) == (chosen, twin.goals(state, memory)[: len(core.model.goals)])
            met += 1
        else:
            assert run.chosen is None
        kept[number:] = [(run.reached, run.chosen)]
        taken = run.walk(1, dice.randrange(1000), strategy=dice.random() < 0.5)
        if not taken:
            break
        # Taken back and again, the memory of goals comes along.
        run.undo()
        assert (run.reached, run.chosen) == kept[number]
        run.redo()
    assert met
    while run.undo():
        assert (run.reached, run.chosen) == kept[len(run)]
    run.restart()
    assert (run.reached, run.chosen) == kept[0]


def test_a_walk_that_follows_the_strategy_requests_what_it_chooses_alone() -> None:
    # The way to waving is free, and no goal needs it.
    waving = LIFT.replace(
        "    component Base {\n", "    component Base {\n        incoming message wave with type: none\n"
    )
    run = robosc.simulate(robosc.synthesize(robosc.load(text=waving)).supervisor)  # type: ignore[arg-type]  # it is there
    assert set(run.enabled) == {"call.request", "wave.request"}
    run.walk(40, 1, strategy=True)
    assert [step.event for step in run.history if step.is_controllable] == ["call.request", "enter.request"]
    assert len(run) == 40 and "wave.request" in run.enabled
    run.restart()
    assert run.walk_until_finding(40, 1, {robosc.WalkFindingKind.BLOCKED}, strategy=True) is None
    assert "wave.request" not in {step.event for step in run.history}
    run.walk(40, 1)
    assert "wave.request" in {step.event for step in run.history}


def test_a_strategy_that_is_not_there_is_not_followed(run: robosc.Run) -> None:
    assert (run.has_strategy, run.chosen, run.reached) == (False, None, ())
    for walk in (run.walk, run.walk_until_finding):
        with pytest.raises(robosc.NoStrategyError, match="the supervisor of R has no strategy"):
            walk(3, strategy=True)
    assert len(run) == 0


def test_what_was_taken_back_is_not_remembered_of_goals() -> None:
    run = robosc.simulate(robosc.synthesize(robosc.load(text=LIFT)).supervisor)  # type: ignore[arg-type]  # there is one
    for event in ("call", "arrived", "enter"):
        run.step(run.event_called(event))
    assert (run.history[-1].reached, run.reached, run.chosen) == ((1,), (True,), None)
    run.undo()
    # Another event instead finds the goal as it was before.
    assert run.step("arrived.response").chosen == "enter.request"
    assert run.reached == (False,)
    run.undo()
    assert run.step("enter.request").reached == (1,)
    run.restart()
    assert run.step("arrived.response").chosen == "call.request"
    assert run.reached == (False,)


LEVELS = """robot Levels {
    datatype enum Low from integer to { value < 20 -> low default -> fine }
    datatype enum Third from integer to { value < 33 -> below default -> above }
    component Battery {
        outgoing message low with identifier: "/battery", type: Low
        outgoing message third with identifier: "/battery", type: Third
        behaviour {
            variable low: Low
            variable third: Third
            on response from low do low := value
            on response from third do third := value
            initial marked state read { }
        }
    }
    component Base {
        incoming message leave with identifier: "/leave", type: none
        behaviour {
            initial marked state docked { on request to leave goto out }
            marked state out { }
        }
    }
    requirement leave needs Battery.low = fine
    goal always eventually Base.out or Battery.third = below
}"""


def test_what_no_message_leads_to_gets_no_request_that_is_not_allowed() -> None:
    """A battery that is low and above a third of its charge: only events that come one by one lead there."""
    supervisor = robosc.synthesize(robosc.load(text=LEVELS)).supervisor
    assert supervisor is not None
    run = robosc.simulate(supervisor)
    chosen = [run.chosen]
    run.step("low.response", "low")
    chosen.append(run.chosen)
    assert run.enabled == ()
    run.undo()
    chosen.append(run.chosen)
    assert chosen == ["leave.request", None, "leave.request"]
    for seed in range(20):
        run.restart()
        run.walk(20, seed, strategy=True)


def loading() -> robosc.Run:
    """Return a run of the loader, which drives while its button is pressed."""
    made = robosc.synthesize(LOADER).supervisor
    assert made is not None
    run = robosc.simulate(made)
    run.step("travel.request")
    assert not run.cancelling
    step = run.step("stop.response", True)
    assert (step.cancelling, run.cancelling) == (("travel",), ("travel",))
    return run


@pytest.mark.parametrize("end", ["cancel", "response", "error"])
def test_the_world_chooses_how_a_cancelled_goal_ends(end: str) -> None:
    run = loading()
    assert "reach.request" not in run.enabled
    assert run.step("travel.feedback").cancelling == ()
    run.step("stop.response", False)
    run.step("stop.response", True)
    # It was asked for once, and is not taken back.
    assert list(run.cancelling) == ["travel"]
    run.step(f"travel.{end}")
    assert not run.cancelling
    if end != "cancel":
        run.step("travel.reset")
    assert "reach.request" in run.enabled
    while not run.cancelling:
        run.undo()
    assert [step.event for step in run.history][-1] == "stop.response"


def test_a_cancelled_goal_whose_requirements_hold_again_does_not_end_as_cancelled() -> None:
    run = loading()
    run.step("stop.response", False)
    assert list(run.cancelling) == ["travel"]
    assert "travel.cancel" not in run.enabled
    run.restart()
    assert not run.cancelling


def test_a_walk_cancels_only_what_an_executor_has_asked_to_cancel() -> None:
    made = robosc.synthesize(LOADER).supervisor
    assert made is not None
    cancels = 0
    for seed in range(20):
        run = robosc.simulate(made)
        asked: set[str] = set()
        for step in run.walk(200, seed):
            name, _, kind = step.event.rpartition(".")
            if kind == "cancel":
                assert name in asked
                cancels += 1
            if kind in ("cancel", "response", "error"):
                asked.discard(name)
            asked |= set(step.cancelling)
    assert cancels > 20


def test_a_walk_of_an_action_without_requirements_never_cancels_it() -> None:
    text = LOADER.read_text().replace("requirement travel needs !Button.is_pressed and Arm.folded", "")
    run = robosc.simulate(unsupervised(text))
    assert "travel.cancel" not in {step.event for step in run.walk(500, 1)}


def test_a_saved_run_says_what_was_asked_to_be_cancelled(tmp_path: Path) -> None:
    run = loading()
    run.step("travel.cancel")
    file = run.save(tmp_path / "run.jsonl")
    entries = [json.loads(line) for line in file.read_text().splitlines()]
    assert [entry.get("event", entry["kind"]) for entry in entries] == [
        *("travel.request", "stop.response", "cancelling", "travel.cancel")
    ]
    assert check_log(read_log(file), run.supervisor).violations == ()
