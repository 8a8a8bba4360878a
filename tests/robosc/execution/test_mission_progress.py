"""Progress of missions: which visits are made, against the interpreter's account, and on a robot that makes rounds."""

import json
from collections import Counter
from typing import Any
from unittest.mock import patch

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.interpreter.missions import MissionOfSystem
from robosc.execution.runtime.clock import ManualClock
from robosc.execution.runtime.event_log import MemoryLog
from robosc.execution.runtime.progress import MissionStanding, Progress, ProgressAccount, mission_texts, standing_text
from robosc.execution.runtime.protocol import Aim, Description, MissionInfo
from robosc.execution.runtime.recorder import Recorder
from robosc.expressions import VariableRead
from robosc.model.structure import Detour, Mission
from robosc.pipeline.missions import visits_made
from support.effort import examples
from support.execution import Bench
from support.generated import load_module
from support.rounds import rounds_supervisor

NAMES = tuple(f"v{number}" for number in range(5))

conditions = st.sampled_from([VariableRead("C", name) for name in NAMES])
visits = st.lists(conditions, min_size=1, max_size=3).map(tuple)
detours = st.lists(st.builds(Detour, trigger=conditions, visits=visits), max_size=2).map(tuple)
missions = st.builds(
    Mission, name=st.sampled_from("ab"), visits=visits, condition=st.none() | conditions, detours=detours
)
states = st.fixed_dictionaries({("C", name): st.booleans() for name in NAMES})


def _aims(mission: Mission) -> list[Aim]:
    title = f"mission {mission.name}"
    tours = [(title, mission.visits)]
    tours += [(f"detour {number} of {title}", item.visits) for number, item in enumerate(mission.detours, start=1)]
    return [
        Aim(f"visit {number + 1} of {name}", "", mission.name)
        for name, places in tours
        for number in range(len(places))
    ]


class Touring:
    """A system with a goal, an assumption and two missions over states that the test gives."""

    mode = 0

    def __init__(self, given_missions: list[Mission]) -> None:
        self.missions = given_missions
        self.accounts = [MissionOfSystem(item) for item in given_missions]
        self.places = [item.start for item in self.accounts]
        aims, infos = [Aim("goal 1", "")], []
        for item in given_missions:
            infos.append(
                MissionInfo(item.name, len(aims), len(item.visits), tuple(len(it.visits) for it in item.detours))
            )
            aims += _aims(item)
        self.description = Description(
            "Touring", "controller", "", (), (), (), 0, True, tuple(aims), (Aim("assumption 1", ""),), tuple(infos)
        )
        self.state: dict[Any, Any] = {}

    def situation(self) -> Any:
        return tuple(self.state.items())

    def remembered(self) -> Any:
        return tuple(self.places)

    def recall(self, remembered: Any) -> None:
        self.places = list(remembered)

    def observe(self) -> tuple[bool, ...]:
        self.places = [item.after(place, self.state) for item, place in zip(self.accounts, self.places, strict=True)]
        pairs = list(zip(self.accounts, self.places, strict=True))
        wanted = [item for account, place in pairs for item in account.wanted(place, self.state)]
        here = [item for account, place in pairs for item in account.here(place)]
        return (True, *(not item for item in wanted), True, *here, *(place.is_round for place in self.places))


@settings(max_examples=examples(300))
@given(
    st.lists(missions, min_size=2, max_size=2, unique_by=lambda mission: mission.name),
    st.lists(states, min_size=1, max_size=12),
    st.sampled_from((2, 1000)),
)
def test_visits_are_made_as_the_interpreter_accounts_for_them(
    given_missions: list[Mission], run: list[Any], remembered: int
) -> None:
    """However many changes are remembered, each state comes again, so that most of them are known then."""
    with patch("robosc.execution.runtime.progress.MAXIMUM_CHANGES", remembered):
        _check_visits(given_missions, [*run, *run])


def _check_visits(given_missions: list[Mission], run: list[Any]) -> None:
    system, clock, log = Touring(given_missions), ManualClock(), MemoryLog()
    recorder = Recorder(system, clock, log)  # type: ignore[arg-type]  # its state is not needed
    account = ProgressAccount(system, recorder, (), 0.0)  # type: ignore[arg-type]
    made = Counter[str]()
    assert account.at(0.0).missions == ()
    # The account need not ask the system in each state, so that its places are told by a twin.
    twin = Touring(given_missions)
    for number, state in enumerate(run):
        system.state = twin.state = state
        before = twin.places
        twin.observe()
        account.observe()
        # Visits that are true at the start are not counted, as with goals.
        if number:
            for mission, was, now in zip(given_missions, before, twin.places, strict=True):
                made.update(visits_made(mission, was, now))
        found = account.at(0.0)
        assert {item.name: item.times for item in found.aims} == {aim.name: made[aim.name] for aim in found.aims}
        assert [item[:3] for item in found.missions] == [
            (mission.name, place.visit + 1 if place.is_asked else 0, place.is_round)
            for mission, place in zip(given_missions, twin.places, strict=True)
        ]
        assert [item.detours for item in found.missions] == [
            tuple(0 if visit is None else visit + 1 for visit in place.detours) for place in twin.places
        ]
        for mission, place in zip(given_missions, twin.places, strict=True):
            own = [item.is_met for item in found.aims if item.name.endswith(f" of mission {mission.name}")]
            is_done = [place.is_asked and (place.is_round or it < place.visit) for it in range(len(mission.visits))]
            current = zip(mission.detours, place.detours, strict=True)
            is_done += [visit is not None and it < visit for item, visit in current for it in range(len(item.visits))]
            assert own == is_done
    assert Counter(line["aim"] for line in log.entries if line["kind"] == "reached") == made


def reached(bench: Bench) -> list[tuple[str, int]]:
    return [(line["aim"], line["count"]) for line in bench.log.entries if line["kind"] == "reached"]


def progress(bench: Bench) -> Progress:
    found = bench.executor.progress
    assert found is not None
    return found


def where(bench: Bench) -> str:
    return mission_texts(progress(bench))["mission rounds"]


@pytest.fixture(params=["interpreted", "generated"])
def robot(request: pytest.FixtureRequest) -> Bench:
    """Return the robot that makes rounds, interpreted or as generated code."""
    supervisor = rounds_supervisor()
    if request.param == "interpreted":
        return Bench(InterpretedSystem(supervisor))
    return Bench(load_module(supervisor).Supervisor())


def test_a_detour_and_the_end_of_a_mission_make_no_visit(robot: Bench) -> None:
    robot.tick()
    assert where(robot) == "not asked for; rounds made: 0"
    assert progress(robot).missions == (MissionStanding("rounds", 0, False, 0, (0,)),)
    robot.receive("/begin")
    robot.tick()
    assert reached(robot) == [("visit 1 of mission rounds", 1)]
    assert where(robot) == "at visit 2, Base.office; rounds made: 0"
    # A call makes no visit: the office is to be visited afterwards.
    robot.receive("/call")
    assert reached(robot) == [("visit 1 of mission rounds", 1)]
    assert where(robot) == ("at visit 2, Base.office; detour 1 under way, at visit 1, Base.hall; rounds made: 0")
    assert [item[2:5] for item in progress(robot).aims] == [(True, 1, None), (False, 0, None), (False, 0, 0.0)]
    robot.tick()
    assert reached(robot)[1:] == [("visit 1 of detour 1 of mission rounds", 1)]
    robot.tick()
    assert reached(robot)[2:] == [("visit 2 of mission rounds", 1)]
    assert where(robot) == "at visit 1, Base.kitchen; rounds made: 1"
    # Nor when the mission is not asked for any more.
    robot.receive("/end")
    robot.tick(3)
    assert len(reached(robot)) == 3
    assert where(robot) == "not asked for; rounds made: 1"
    assert not any(item.is_met or item.unmet_s is not None for item in progress(robot).aims)


def test_progress_is_plain_values_for_json(robot: Bench) -> None:
    robot.receive("/begin")
    robot.receive("/call")
    found = json.loads(json.dumps(progress(robot).plain()))
    assert found["missions"] == [{"name": "rounds", "visit": 1, "is_round": False, "rounds": 0, "detours": [1]}]
    assert found["aims"][0] == {
        "name": "visit 1 of mission rounds",
        "words": "Base.kitchen",
        "is_met": False,
        "times": 0,
        "unmet_s": None,
        "mission": "rounds",
    }
    assert [standing_text(item).split(",")[0] for item in progress(robot).aims] == [
        "not wanted now",
        "not wanted now",
        "wanted for 0 s",
    ]
