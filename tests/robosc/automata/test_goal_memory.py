"""The memory of missions against an obvious twin that goes on step by step, and the aims that a model has."""

from collections.abc import Callable
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.automata import ExecutableSystem
from robosc.automata.compile import NO_DATA, compile_expression
from robosc.automata.goal_memory import MEMORY, AimKind, counted, journey
from robosc.automata.state import Subject
from robosc.expressions import Binary, Constant, Expression, StateTest, VariableRead
from robosc.expressions.text import expression_text
from robosc.expressions.tree import children
from robosc.model.structure import MAXIMUM_VISITS, Deployment, Detour, Mission, Model
from support.effort import examples
from support.mission_twin import MissionTwin, mission_twin
from support.models import model_of

NAMES = tuple(f"v{number}" for number in range(6))
VALUES = {"unknown": 0, "true": 1, "false": 4}

# Unknown where the variable is 0.
ATOMS = [Binary(">", Binary("/", Constant(2), VariableRead("C", name)), Constant(0.5)) for name in NAMES]

conditions = st.sampled_from(ATOMS)
visits = st.lists(conditions, min_size=1, max_size=4).map(tuple)
missions = st.builds(
    Mission,
    name=st.just("rounds"),
    visits=visits,
    condition=st.none() | conditions,
    detours=st.lists(st.builds(Detour, trigger=conditions, visits=visits), max_size=2).map(tuple),
)
states = st.fixed_dictionaries({name: st.sampled_from(sorted(VALUES.values())) for name in NAMES})


class Remembered:
    """A mission's memory as it is defined, over states that give each variable a value."""

    def __init__(self, mission: Mission) -> None:
        found = journey(mission, 0)
        self.aims, self.groups = found.aims, [tour.places for tour in found.tours]
        self.places = tuple(place for group in self.groups for place in group)
        subjects = [Subject("C", name) for name in NAMES] + [Subject(MEMORY, place.name) for place in self.places]
        numbers = {subject: number for number, subject in enumerate(subjects)}
        self._updates = {place.name: compile_expression(place.update, numbers) for place in self.places}
        self._aims = {aim.name: compile_expression(aim.condition, numbers) for aim in self.aims}
        self._here = [compile_expression(aim.here, numbers) for aim in self.aims if aim.here is not None]
        self._round = compile_expression(found.is_round, numbers)
        self.memory = dict.fromkeys(self._updates, False)

    def observe(self, state: dict[str, int]) -> None:
        whole = (*(state[name] for name in NAMES), *self.memory.values())
        after = {name: update(whole, NO_DATA) for name, update in self._updates.items()}
        assert set(after.values()) <= {True, False}
        self.memory = {name: value is True for name, value in after.items()}

    def places_of(self, state: dict[str, int]) -> tuple[list[Any], Any]:
        """Return for each visit whether the mission or detour is at it, and whether every visit of its own is true."""
        whole = (*(state[name] for name in NAMES), *self.memory.values())
        return [condition(whole, NO_DATA) for condition in self._here], self._round(whole, NO_DATA)

    def judged(self, state: dict[str, int]) -> dict[str, Any]:
        whole = (*(state[name] for name in NAMES), *self.memory.values())
        return {name: condition(whole, NO_DATA) for name, condition in self._aims.items()}


def twin_of(mission: Mission) -> MissionTwin:
    numbers = {Subject("C", name): number for number, name in enumerate(NAMES)}

    def test(condition: Expression) -> Callable[[dict[str, int]], bool]:
        function = compile_expression(condition, numbers)
        return lambda state: function(tuple(state[name] for name in NAMES), NO_DATA) is True

    return mission_twin(mission, test)


@settings(max_examples=examples(400))
@given(missions, st.lists(states, min_size=1, max_size=12))
def test_missions_are_where_the_twin_says(mission: Mission, run: list[dict[str, int]]) -> None:
    found, twin = Remembered(mission), twin_of(mission)
    mark = twin.start
    assert found.memory == twin.memory(mark)
    for state in run:
        found.observe(state)
        mark = twin.after(mark, state)
        assert found.memory == twin.memory(mark)
        assert found.judged(state) == {name: is_done(mark, state) for name, is_done in twin.aims()}
        assert all(sum(found.memory[place.name] for place in group) <= 1 for group in found.groups)
        is_asked, own = twin.asked(state), len(mission.visits)
        here = [is_asked and mark[0] == number for number in range(1, own + 1)]
        for at, detour in zip(mark[1:], mission.detours, strict=True):
            here += [at == number for number in range(1, len(detour.visits) + 1)]
        assert found.places_of(state) == (here, is_asked and all(visit(state) for visit in twin.visits))
        # A state that is observed twice has the same effect as one that is observed once.
        once = found.memory
        found.observe(state)
        assert found.memory == once


def run_of(mission: Mission, *true: str) -> list[str]:
    """Return what is true in the memory after each state; `true` has the digits of the variables that are true."""
    found, shown = Remembered(mission), []
    for digits in true:
        found.observe({name: VALUES["true" if name[1] in digits else "false"] for name in NAMES})
        shown.append(", ".join(name for name, is_true in found.memory.items() if is_true))
    return shown


def test_a_mission_goes_round() -> None:
    mission = Mission("m", (ATOMS[0], ATOMS[1], ATOMS[2]))
    second, third = ("mission m is at visit 2", "mission m is at visit 3")
    assert run_of(mission, "", "1", "0", "2", "1", "2") == ["", "", second, second, third, ""]
    # Several are passed in one state, but no more than one round.
    assert run_of(mission, "01", "012", "12", "20", "") == [third, third, "", second, second]


def test_a_mission_that_is_not_asked_for_begins_anew() -> None:
    mission = Mission("m", (ATOMS[0], ATOMS[1]), ATOMS[5], (Detour(ATOMS[3], (ATOMS[4],)),))
    second, detour = "mission m is at visit 2", "detour 1 of mission m is at visit 1"
    assert run_of(mission, "0", "05", "053", "35", "3", "5", "05") == [
        "",
        second,
        f"{second}, {detour}",
        f"{second}, {detour}",
        "",
        "",
        second,
    ]


def test_a_detour_begins_anywhere_and_ends_once_for_each_trigger() -> None:
    mission = Mission("m", (ATOMS[0], ATOMS[1]), None, (Detour(ATOMS[3], (ATOMS[4], ATOMS[5])),))
    second = "mission m is at visit 2"
    first_step, second_step = (f"detour 1 of mission m is at visit {number}" for number in (1, 2))
    # Meanwhile the mission goes on where its visits come true by themselves.
    assert run_of(mission, "3", "0", "04", "5", "345") == [
        first_step,
        f"{second}, {first_step}",
        f"{second}, {second_step}",
        second,
        second,
    ]
    # It begins again at once where its trigger is true still, or again.
    assert run_of(mission, "3", "34", "35", "45") == [first_step, second_step, first_step, ""]


def size(expression: Expression) -> int:
    return 1 + sum(map(size, children(expression)))


@pytest.mark.parametrize("count", [12, MAXIMUM_VISITS])
def test_a_mission_with_many_visits_stays_small(count: int) -> None:
    long = (ATOMS * 10)[:count]
    found = journey(Mission("m", tuple(long), ATOMS[0], (Detour(ATOMS[1], tuple(long)),)), 0)
    places = [place for tour in found.tours for place in tour.places]
    assert len(places) == 2 * count - 1 and len(found.aims) == 2 * count
    assert max(size(place.update) for place in places) < 30 * count
    assert max(size(aim.condition) for aim in found.aims) < 8 * count


ROBOT = """robot R {
    component Base {
        incoming message go with type: none
        behaviour { initial marked state here { on request to go goto there } marked state there { } }
    }
    goal once Base.there
    goal always eventually Base.here
}"""


@pytest.fixture
def model() -> Model:
    here, there = StateTest("Base", "here"), StateTest("Base", "there")
    missions = (
        Mission("rounds", (here, there), None, (Detour(there, (here, there)), Detour(here, (there,)))),
        Mission("still", (there,), here),
    )
    return msgspec.structs.replace(model_of(ROBOT), missions=missions)


def test_aims_are_the_goals_then_the_visits(model: Model) -> None:
    owed = ExecutableSystem(model, Deployment.CONTROLLER).obligations
    assert [(aim.name, aim.kind, aim.mission, aim.number) for aim in owed.aims] == [
        ("goal 1", AimKind.GOAL, None, 0),
        ("goal 2", AimKind.GOAL, None, 1),
        ("visit 1 of mission rounds", AimKind.VISIT, 0, 0),
        ("visit 2 of mission rounds", AimKind.VISIT, 0, 1),
        ("visit 1 of detour 1 of mission rounds", AimKind.DETOUR_VISIT, 0, 2),
        ("visit 2 of detour 1 of mission rounds", AimKind.DETOUR_VISIT, 0, 3),
        ("visit 1 of detour 2 of mission rounds", AimKind.DETOUR_VISIT, 0, 4),
        ("visit 1 of mission still", AimKind.VISIT, 1, 0),
    ]
    assert [aim.visit for aim in owed.aims[2:4]] == list(model.missions[0].visits)
    assert counted(owed.aims) == "2 goals and 6 visits"
    assert counted(owed.aims[:1]) == "1 goal" and counted(owed.aims[2:3]) == "1 visit"


def test_what_is_remembered_of_missions_reads_as_sentences(model: Model) -> None:
    owed = ExecutableSystem(model, Deployment.CONTROLLER).obligations
    assert [place.name for place in owed.places] == [
        "goal 1 was reached",
        "mission rounds is at visit 2",
        "detour 1 of mission rounds is at visit 1",
        "detour 1 of mission rounds is at visit 2",
        "detour 2 of mission rounds is at visit 1",
    ]
    assert expression_text(owed.aims[-2].condition) == "detour 2 of mission rounds is not at visit 1"
    # The verb is the last one, whatever the name of a mission.
    (place,) = journey(Mission("is", (ATOMS[0], ATOMS[1])), 0).tours[0].places
    assert expression_text(journey(Mission("is", (ATOMS[0],)), 0).aims[0].condition).startswith("holds(")
    named = journey(Mission("is", (ATOMS[0], ATOMS[1])), 0).aims[1].condition
    assert expression_text(named).startswith("mission is is not at visit 2 or ")
    assert expression_text(place.read) == "mission is is at visit 2"
