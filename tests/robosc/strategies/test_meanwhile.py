"""Requests that a strategy makes for other goals while one of them waits for the surroundings, by hand."""

import json

import msgspec
import pytest

import robosc
from robosc.conditions.goals import goals_in_words
from robosc.conditions.summary import strategy_lines, summary_json
from robosc.errors import InvalidSupervisorError
from robosc.execution.interpreter import InterpretedSystem
from robosc.supervisor import Choice, Strategy, Supervisor
from robosc.supervisor.validation import validate
from support.execution import Bench
from support.missions import strategic
from support.models import model_of

_COURIER = """robot Courier {
    component Tray {
        incoming message unlock with identifier: "/tray/unlock", type: none
        incoming message lock with identifier: "/tray/lock", type: none
        outgoing message unlocked with identifier: "/tray/unlocked", type: none
        behaviour {
            initial marked state locked { on request to unlock goto unlocking }
            state unlocking { on response from unlocked goto open }
            marked state open { on request to lock goto locked }
        }
    }
    component Base {
        incoming message to_dock with identifier: "/go/dock", type: none
        incoming message to_desk with identifier: "/go/desk", type: none
        behaviour {
            initial marked state at_desk { on request to to_dock goto at_dock }
            marked state at_dock { on request to to_desk goto at_desk }
        }
    }
    assume always eventually !Tray.unlocking
    §
}"""

ROUNDS = (
    "goal always eventually Tray.open",
    "goal always eventually Tray.locked",
    "goal always eventually Base.at_dock",
    "goal always eventually Base.at_desk",
)


def courier(*statements: str) -> Supervisor:
    """Return the supervisor of a courier with a slow tray, which drives between its desk and its dock."""
    return strategic(model_of(_COURIER.replace("§", "\n    ".join(statements))))


def meanwhile(supervisor: Supervisor) -> list[list[str]]:
    """Return for each goal and visit the requests for others."""
    return [[event for event, _, _ in goal.meanwhile] for goal in goals_in_words(supervisor)]


def test_the_courier_drives_to_its_dock_while_it_waits_for_its_tray() -> None:
    supervisor = courier(*ROUNDS)
    text = "\n".join(strategy_lines(supervisor))
    assert (
        """\
  for goal 1, always eventually Tray.open
    unlock.request   where not Tray.unlocking
    to_dock.request  meanwhile for others, where Base.at_desk
    nothing          otherwise
"""
        in text
    )
    bench = Bench(InterpretedSystem(supervisor))

    def sent(periods: int) -> list[str]:
        before = len(bench.middleware.sent)
        for _ in range(periods):
            bench.executor.tick()
        return [name for kind, name, *_ in bench.middleware.sent[before:] if kind == "publish"]

    # It does not drive on to its desk: that would undo what comes first.
    assert sent(4) == ["unlock", "to_dock"]
    bench.executor.receive("/tray/unlocked", None)
    assert sent(5) == ["lock", "to_desk", "unlock", "to_dock"]


def test_nothing_is_requested_that_makes_the_way_longer() -> None:
    assert meanwhile(courier("goal always eventually Tray.open and Base.at_desk", *ROUNDS[1:]))[0] == []
    # The goal whose turn is next would be farther away: from the dock it goes back to the desk.
    next_at_desk = courier(ROUNDS[0], "goal always eventually Tray.locked and Base.at_desk", ROUNDS[2])
    assert meanwhile(next_at_desk)[0] == ["to_desk.request"]
    later = meanwhile(courier(ROUNDS[0], ROUNDS[2], "goal always eventually Tray.locked and Base.at_desk"))[0]
    assert later == ["to_dock.request"]


def test_a_visit_that_waits_is_not_interrupted_by_the_robot_itself() -> None:
    mission = "mission trays {{ visit Tray.open then Tray.locked {} }}"
    plain = meanwhile(courier(ROUNDS[2], ROUNDS[3], mission.format("")))
    assert plain[2] == ["to_dock.request"]
    detour = mission.format("on Base.at_dock from anywhere visit Tray.open")
    assert meanwhile(courier(ROUNDS[2], ROUNDS[3], detour))[2] == []


def test_summaries_tell_them_apart_from_requests_for_the_goal_itself() -> None:
    supervisor = courier(*ROUNDS)
    found = json.loads(json.dumps(summary_json(supervisor)))["goals"][0]
    assert [item["event"] for item in found["choices"]] == ["unlock.request"]
    assert found["meanwhile"] == [{"event": "to_dock.request", "condition": "Base.at_desk"}]
    made = robosc.synthesize(robosc.load(text=_COURIER.replace("§", "\n    ".join(ROUNDS)))).supervisor
    assert made is not None
    goal = made.goals[0]
    assert [item.event for item in goal.meanwhile] == ["to_dock.request"]
    assert goal.rows() == [
        ("unlock.request", "where not Tray.unlocking"),
        ("to_dock.request", "meanwhile for others, where Base.at_desk"),
        ("nothing", "otherwise"),
    ]
    assert repr(goal) == "<always eventually Tray.open: requests unlock.request, to_dock.request>"


def test_a_strategy_with_them_in_a_wrong_order_is_refused() -> None:
    supervisor = courier(*ROUNDS)
    assert supervisor.strategy is not None
    first, *others = supervisor.strategy.modes
    validate(supervisor)

    def damaged(*choices: Choice) -> Supervisor:
        return msgspec.structs.replace(supervisor, strategy=Strategy((choices, *others)))

    with pytest.raises(InvalidSupervisorError, match=r"mode 1 of the strategy: .* for other goals, stands last"):
        validate(damaged(*reversed(first)))
    with pytest.raises(InvalidSupervisorError, match=r"mode 1 of the strategy: to_dock\.request stands twice"):
        validate(damaged(*first, first[-1]))
    # One request may be for the goal in some states and for others in other ones.
    validate(damaged(*first, msgspec.structs.replace(first[0], is_meanwhile=True)))
