"""Every target does what the reference executor does: the same runs, compared step by step."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from random import Random
from types import ModuleType

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.errors import UnsupportedModelError
from robosc.model.structure import MAXIMUM_VISITS, Deployment, Model
from robosc.supervisor import Supervisor
from robosc.targets import generate
from support.c99 import GCC
from support.effort import examples
from support.equivalence.c99_target import C99Target, c99_target
from support.equivalence.observation import Observation
from support.equivalence.python_targets import PythonTarget, generated_python, observe, reference
from support.equivalence.random_scenarios import random_scenario
from support.equivalence.recorded import FOLDER, read_recorded, recorded_text
from support.equivalence.scenario import Action, Scenario
from support.equivalence.targets import compare
from support.equivalence.worlds import WORLDS, live, robot_supervisor
from support.generated import load_module, loaded_file
from support.goal_porter import porter_supervisor
from support.missions import strategic
from support.models import model_of
from support.page_courier import messages, page_courier_supervisor
from support.random_controllers import random_controller, random_robot
from support.random_couriers import strategic_courier
from support.random_goals import strategic_controller
from support.random_limits import limited_controller, limited_robot
from support.random_supervisors import CERTIFICATE, random_supervisor
from support.random_travels import random_travels
from support.random_waiting import strategic_waiting
from support.rounds import long_detour_supervisor

ROBOTS = sorted(WORLDS)
needs_gcc = pytest.mark.skipif(GCC is None, reason="gcc is not installed")


def python_module(supervisor: Supervisor) -> ModuleType:
    return loaded_file(generate(supervisor, "python"))


def python_target(supervisor: Supervisor) -> PythonTarget:
    return generated_python(supervisor, python_module(supervisor))


def _some_supervisor(seed: int) -> Supervisor:
    """A random robot, of one kind or another."""
    match Random(seed).randrange(4):
        case 0:
            return msgspec.structs.replace(random_supervisor(seed), deployment=Deployment.CONTROLLER)
        case 1:
            return random_robot(seed)
        case 2:
            return random_travels(seed)
        case _:
            return random_controller(seed) or random_robot(seed)


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_reference_does_what_was_recorded(robot: str) -> None:
    """After a change that is meant: `python tests/equivalence/record.py`."""
    file = FOLDER / f"{robot}.jsonl"
    assert recorded_text(*live(robot)) == file.read_text(encoding="utf-8")
    scenario = read_recorded(robot)
    supervisor = robot_supervisor(robot)
    assert recorded_text(scenario, observe(supervisor, scenario)) == file.read_text(encoding="utf-8")


def test_the_recorded_runs_show_every_request() -> None:
    for robot in ROBOTS:
        text = (FOLDER / f"{robot}.jsonl").read_text(encoding="utf-8")
        for item in robot_supervisor(robot).model.communications:
            assert f'"{item.events[0]}"' in text, item.name


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_recorded_run_in_python(robot: str) -> None:
    """With a log and without."""
    supervisor = robot_supervisor(robot)
    scenario = read_recorded(robot)
    expected, module = observe(supervisor, scenario), python_module(supervisor)
    compare(generated_python(supervisor, module), scenario, expected)
    compare(generated_python(supervisor, module, has_log=False), scenario, expected)


@pytest.mark.parametrize("robot", ROBOTS)
def test_an_example_in_python(robot: str) -> None:
    supervisor = robot_supervisor(robot)
    module = python_module(supervisor)
    for seed in range(4):
        scenario = random_scenario(supervisor, seed, 150)
        compare(generated_python(supervisor, module), scenario, observe(supervisor, scenario))


@settings(max_examples=examples(40))
@given(st.integers(0, 2**32 - 1))
def test_random_robots_in_python(seed: int) -> None:
    """With a log, and without one: whole messages are taken then, with the same effect."""
    supervisor = _some_supervisor(seed)
    scenario = random_scenario(supervisor, seed, 60)
    expected = observe(supervisor, scenario)
    module = load_module(supervisor)
    compare(generated_python(supervisor, module), scenario, expected)
    compare(generated_python(supervisor, module, has_log=False), scenario, expected)
    compare(reference(supervisor, has_log=False), scenario, expected)


def _ends(observations: Sequence[Observation]) -> Counter[str]:
    """Count how the goals ended that were being cancelled, by the event and what came."""
    found: Counter[str] = Counter()
    asked: set[str] = set()
    for line in (line for item in observations for line in item.log):
        name, _, kind = line.get("event", "").rpartition(".")
        if line["kind"] == "cancelling" and "requirement" in line["why"]:
            asked.add(line["action"])
        elif line["kind"] == "event" and name in asked and kind in ("response", "error", "cancel"):
            asked.remove(name)
            found[f"{kind}: {line['data']}" if kind == "error" else kind] += 1
        elif line["kind"] == "event" and name in asked and kind == "feedback":
            found[kind] += 1
        elif line["kind"] == "cancel_overdue" or (line["kind"] == "fault" and "refused" in line["what"]):
            found[line["kind"]] += 1
        elif line["kind"] == "restart":
            asked.clear()
    return found


ENDS_OF_CANCELLED = (
    *("cancel", "response", "feedback", "cancel_overdue", "fault"),
    *(f"error: {why}" for why in ("cancelled", "aborted", "rejected", "lost")),
)
"""Fates of a goal that is being cancelled; that it takes too long is none."""


def test_goals_that_are_being_cancelled_in_python() -> None:
    found: Counter[str] = Counter()
    for seed in range(60):
        supervisor = random_travels(seed)
        scenario = random_scenario(supervisor, seed, 150)
        expected = observe(supervisor, scenario)
        compare(generated_python(supervisor, load_module(supervisor)), scenario, expected)
        found += _ends(expected)
    print(dict(found))
    assert {end for end in found if found[end]} == set(ENDS_OF_CANCELLED), found


@needs_gcc
@pytest.mark.parametrize("robot", ROBOTS)
def test_an_example_in_c(robot: str, tmp_path: Path) -> None:
    """The recorded run and a random one, of one program."""
    supervisor = robot_supervisor(robot)
    for scenario in (read_recorded(robot), random_scenario(supervisor, 7, 400)):
        compare(c99_target(supervisor, tmp_path), scenario, observe(supervisor, scenario))


def _limited(seed: int) -> Supervisor:
    """A random robot with limits, of one kind or another."""
    if seed % 2:
        return limited_controller(Random(seed))
    return limited_robot(
        msgspec.structs.replace(random_supervisor(seed), deployment=Deployment.CONTROLLER), Random(seed)
    )


@settings(max_examples=examples(40))
@given(st.integers(0, 2**32 - 1))
def test_limits_in_python(seed: int) -> None:
    supervisor = _limited(seed)
    scenario = random_scenario(supervisor, seed, 60)
    expected, module = observe(supervisor, scenario), load_module(supervisor)
    compare(generated_python(supervisor, module), scenario, expected)
    compare(generated_python(supervisor, module, has_log=False), scenario, expected)
    compare(reference(supervisor, has_log=False), scenario, expected)


@needs_gcc
@settings(max_examples=examples(6))
@given(st.integers(0, 2**32 - 1))
def test_limits_in_c(tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    supervisor = _limited(seed)
    scenario = random_scenario(supervisor, seed, 120)
    try:
        target = C99Target(supervisor, tmp_path_factory.mktemp("c"))
    except UnsupportedModelError:
        return  # The random models hold what C cannot keep, too: received texts.
    compare(target, scenario, observe(supervisor, scenario))


def test_the_random_limits_move_numbers() -> None:
    seen: Counter[str] = Counter()
    for seed in range(60):
        for item in observe(_limited(seed), random_scenario(_limited(seed), seed, 60)):
            seen.update(entry["kind"] for entry in item.log)
    assert seen["limited"] > 20, seen


@needs_gcc
@settings(max_examples=examples(6))
@given(st.integers(0, 2**32 - 1))
def test_random_robots_in_c(tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    supervisor = _some_supervisor(seed)
    scenario = random_scenario(supervisor, seed, 120)
    try:
        target = C99Target(supervisor, tmp_path_factory.mktemp("c"))
    except UnsupportedModelError:
        return  # The random models hold what C cannot keep, too: received texts.
    compare(target, scenario, observe(supervisor, scenario))


@needs_gcc
def test_goals_that_are_being_cancelled_in_c(tmp_path: Path) -> None:
    found: Counter[str] = Counter()
    for seed in range(8):
        supervisor = random_travels(seed)
        for number in range(4):
            scenario = random_scenario(supervisor, 8 * number + seed, 150)
            expected = observe(supervisor, scenario)
            compare(c99_target(supervisor, tmp_path / str(seed)), scenario, expected)
            found += _ends(expected)
    assert {end for end in found if found[end]} == set(ENDS_OF_CANCELLED), found


def _strategic(first: int) -> Iterator[tuple[Supervisor, Scenario]]:
    """Yield the porter and random robots whose strategies choose requests, with a run of each under its strategy."""
    porter = porter_supervisor()
    scenario = random_scenario(porter, first, 400)
    yield porter, replace(scenario, settings={**scenario.settings, "assumption_timeout_s": 0.25})
    for seed in range(first, first + 60):
        supervisor = strategic_controller(seed)
        if supervisor is not None and supervisor.strategy and any(supervisor.strategy.modes):
            yield supervisor, random_scenario(supervisor, seed, 80)


def _couriers(first: int) -> Iterator[tuple[Supervisor, Scenario]]:
    """Yield robots with detours, and random ones with missions, each with a run under its strategy."""
    yield long_detour_supervisor(), random_scenario(long_detour_supervisor(), first, 200)
    answered = [item for message in messages(first, 100) for item in (message, Action("tick"))]
    yield page_courier_supervisor(), Scenario(tuple(answered), {"assumption_timeout_s": 0.5})
    for seed in range(first, first + 60):
        supervisor = strategic_courier(seed)
        if supervisor is not None:
            yield supervisor, random_scenario(supervisor, seed, 80)


def _waiting(first: int) -> Iterator[tuple[Supervisor, Scenario]]:
    """Yield random robots that do something for other goals while they wait, each with a run under its strategy."""
    for seed in range(first, first + 60):
        supervisor = strategic_waiting(seed)
        modes = () if supervisor is None or supervisor.strategy is None else supervisor.strategy.modes
        if supervisor is not None and any(item.is_meanwhile for mode in modes for item in mode):
            yield supervisor, random_scenario(supervisor, seed, 80)


# Assumptions of the couriers that were reported as owed are rarely met again.
@pytest.mark.parametrize(
    ("robots", "least", "kinds"),
    [
        (_strategic, 50, ("reached", "approach", "owed", "met")),
        (_couriers, 300, ("reached", "approach", "owed")),
        (_waiting, 300, ("reached", "approach", "owed")),
    ],
)
def test_strategies_in_python(
    robots: Callable[[int], Iterator[tuple[Supervisor, Scenario]]], least: int, kinds: tuple[str, ...]
) -> None:
    requests, logged = 0, Counter[str]()
    for supervisor, scenario in robots(0):
        expected = observe(supervisor, scenario)
        compare(generated_python(supervisor, load_module(supervisor)), scenario, expected)
        requests += sum(len(item.issued) for item in expected)
        logged.update(line["kind"] for item in expected for line in item.log)
    assert requests > least and all(logged[kind] > 5 for kind in kinds), logged


@needs_gcc
def test_strategies_in_c(tmp_path: Path) -> None:
    requests, logged = 0, Counter[str]()
    for number, (supervisor, scenario) in enumerate(
        (*islice(_strategic(1_500), 4), *islice(_couriers(60), 7), *islice(_waiting(0), 3))
    ):
        expected = observe(supervisor, scenario)
        # Some with sanitizers, which take the compiler three times as long.
        options = () if number % 4 == 0 else ("-O0",)
        compare(C99Target(supervisor, tmp_path / str(number), *options), scenario, expected)
        requests += sum(len(item.issued) for item in expected)
        logged.update(line["kind"] for item in expected for line in item.log)
    assert requests > 30 and all(logged[kind] for kind in ("reached", "approach", "owed", "met")), logged


def _tour() -> Model:
    """Return a robot with a mission as long as one may be, and others whose visits may all be true at once.

    What is seen of it takes several words in C, with goals in the first of them and assumptions in a later one.
    """
    rooms = range(7)
    requests = "\n".join(f'incoming message go_{room} with identifier: "/go_{room}", type: none' for room in rooms)
    states = "\n".join(
        f"{'initial ' * (room == 0)}marked state r{room} {{ "
        + " ".join(f"on request to go_{other} goto r{other}" for other in rooms if other != room)
        + " }"
        for room in rooms
    )
    visits = " then ".join(f"Base.r{5 * number % 7}" for number in range(1, MAXIMUM_VISITS + 1))
    return model_of(f"""robot Tour {{
    component Base {{
        {requests}
        behaviour {{ {states} }}
    }}
    component Operator {{
        outgoing message work with identifier: "/work", type: boolean
        outgoing message call with identifier: "/call", type: boolean
        behaviour {{
            variable working: boolean
            variable calling: boolean
            on response from work do working := value
            on response from call do calling := value
            initial marked state present {{ }}
        }}
    }}
    mission rounds {{ visit {visits} }}
    mission work while Operator.working {{
        visit not Base.r1 then not Base.r2 then not Base.r3
        on Operator.calling from anywhere visit Base.r4 then not Base.r4 then not Base.r5
    }}
    goal once Base.r6
    assume always eventually Operator.working
    assume Operator.calling leads to Operator.working
}}""")


def _run_of_a_tour() -> tuple[Supervisor, Scenario, list[Observation]]:
    """Return the robot with a long mission and a run of it, in which it goes round."""
    supervisor = strategic(_tour())
    scenario = random_scenario(supervisor, 5, 250)
    expected = observe(supervisor, scenario)
    assert sum(len(item.issued) for item in expected) > 2 * MAXIMUM_VISITS
    return supervisor, scenario, expected


def test_a_long_mission_in_python() -> None:
    supervisor, scenario, expected = _run_of_a_tour()
    compare(python_target(supervisor), scenario, expected)


@needs_gcc
def test_a_long_mission_in_c(tmp_path: Path) -> None:
    supervisor, scenario, expected = _run_of_a_tour()
    compare(C99Target(supervisor, tmp_path), scenario, expected)


_ERRANDS = """robot Errands {
    datatype enum Charge from integer to { value < 2 -> low default -> enough }
    component Base {
        incoming message go with identifier: "/go", type: none
        incoming message back with identifier: "/back", type: none
        outgoing message arrived with identifier: "/arrived", type: none
        behaviour {
            variable trips: integer(0..3)
            initial marked state here { on request to go goto leaving }
            state leaving { on response from arrived do trips := if trips < 3 then trips + 1 else 0 goto there }
            marked state there { on request to back goto returning }
            state returning { on response from arrived goto here }
        }
    }
    component Battery {
        outgoing message battery with identifier: "/battery", type: Charge
        outgoing message plugged with identifier: "/plugged", type: boolean
        behaviour {
            variable charge: Charge = enough
            variable is_plugged: boolean
            on response from battery do charge := value
            on response from plugged do is_plugged := value
            initial marked state watched { }
        }
    }
    goal once Base.there
    goal once Base.trips = 2 and Battery.charge = low
    goal always eventually Base.here or Base.trips = 1
    goal Battery.is_plugged leads to Base.there
    goal Base.trips > 1 or Battery.charge = low leads to Base.here
    assume always eventually Battery.charge = enough
    assume always eventually Battery.charge = low
    assume Base.leaving leads to Base.there
    assume Base.returning leads to Base.here
}"""


@needs_gcc
def test_goals_of_all_forms_in_c(tmp_path: Path) -> None:
    """Conditions on one location, one enum, a truth value, a number, and several of them."""
    supervisor = strategic(model_of(_ERRANDS))
    scenario = random_scenario(supervisor, 7, 250)
    expected = observe(supervisor, scenario)
    lines = [line for item in expected for line in item.log]
    reached = Counter(line["aim"] for line in lines if line["kind"] == "reached")
    assert set(reached) >= {f"goal {number}" for number in range(1, 6)}, reached
    # A goal that was reached once stays so until a restart.
    assert reached["goal 1"] <= 1 + sum(line["kind"] == "restart" for line in lines) < reached["goal 5"]
    compare(C99Target(supervisor, tmp_path), scenario, expected)


TWO_WHEELS = """robot TwoWheels {
    interface twist use Vector3 from geometry_msgs
    datatype object Speed { x: double }
    component Button {
        outgoing message press with type: none
        behaviour { initial marked state up { on response from press goto down } marked state down { } }
    }
    component Left {
        incoming message left with identifier: "/left", type: Speed links twist
        behaviour { initial marked state idle { on request to left goto driving } marked state driving { } }
    }
    component Right {
        incoming message right with identifier: "/right", type: Speed links twist
        behaviour { initial marked state idle { on request to right goto driving } marked state driving { } }
    }
    requirement { left, right } needs Button.up
    provide left with { x: 1.0 }
    provide right with { x: 1.0 }
}"""


@needs_gcc
def test_what_is_released_together_goes_out_in_the_order_of_sending(tmp_path: Path) -> None:
    supervisor = Supervisor(model_of(TWO_WHEELS), Deployment.CONTROLLER, (), CERTIFICATE)
    settings = {"policy": "priority", "priority": ("right", "left"), "release_identifiers": ("/left", "/right")}
    tick = Action("tick")
    scenario = Scenario((tick, tick, tick, Action("message", "press"), tick), settings)
    seen = observe(supervisor, scenario)
    assert [name for kind, name, _ in seen[4].issued if kind == "default"] == ["/right", "/left"]
    compare(python_target(supervisor), scenario, seen)
    compare(C99Target(supervisor, tmp_path), scenario, seen)


def test_a_difference_is_told_in_one_line() -> None:
    supervisor = Supervisor(model_of(TWO_WHEELS), Deployment.CONTROLLER, (), CERTIFICATE)
    scenario = Scenario((Action("tick"), Action("message", "press")))
    seen = observe(supervisor, scenario)
    seen[2] = replace(seen[2], state={**(seen[2].state or {}), "Button": {"state": "up", "variables": {}}})
    with pytest.raises(AssertionError) as raised:
        compare(python_target(supervisor), scenario, seen)
    message = str(raised.value).splitlines()[0]
    what = '{"do": "message", "subject": "press"}'
    assert message == f'python, step 2, {what}: state differs: Button: state: expected "up", found "down"'
