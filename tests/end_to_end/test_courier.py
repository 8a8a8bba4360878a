"""The courier in its house: rounds, orders, a late door, one that never opens, a battery; on a clock of the tests."""

import math
from pathlib import Path

import pytest

from robosc_examples.house import House, Settings
from robosc_simulated import load_scene
from support.stepped_twin import SteppedTwin

LIMIT_S = 150.0
PLACES = {"kitchen": (1.5, 2.0), "office": (3.5, 0.0), "lab": (1.5, -2.0)}


def courier(folder: Path, **settings: float) -> SteppedTwin:
    return SteppedTwin("courier/courier", load_scene("rooms"), folder, house=House(Settings(**settings)))


def at(twin: SteppedTwin) -> object:
    return twin.state["Base"]["variables"]["at"]


def visits(twin: SteppedTwin, number: int) -> list[object]:
    """Let it come to so many rooms, or to its dock: where it came."""
    found: list[object] = []
    for _ in range(number):
        before = at(twin)
        twin.until(lambda: at(twin) != "hall" and at(twin) != before, "the next room", LIMIT_S)  # noqa: B023
        found.append(at(twin))
        twin.until(lambda: at(twin) == "hall" or at(twin) == "dock", "the way back", LIMIT_S)
    return found


def test_it_makes_its_rounds_for_ever(tmp_path: Path) -> None:
    with courier(tmp_path, drain_v_s=0.0) as twin:
        found = visits(twin, 9)
        motion, wrong = twin.finish()
    assert wrong == ()
    assert motion.samples[-1].collisions == 0
    assert found == ["kitchen", "office", "lab"] * 3


@pytest.mark.parametrize("room", ["kitchen", "lab"])
def test_an_order_is_answered_before_the_rounds_go_on(tmp_path: Path, room: str) -> None:
    with courier(tmp_path, drain_v_s=0.0) as twin:
        assert visits(twin, 1) == ["kitchen"]
        twin.receive("/order", room)
        twin.receive("/order", "office")  # An order does not count while another one waits.
        twin.until(lambda: at(twin) != "hall", "the next room", LIMIT_S)
        assert at(twin) == room
        twin.until(lambda: twin.state["Tray"]["state"] == "offered", "the tray", LIMIT_S)
        assert math.dist(twin.place, PLACES[room]) < 0.2
        assert twin.is_standing
        place = twin.place
        twin.go_on(4.0)
        assert twin.place == place
        twin.until(lambda: twin.state["Caller"]["state"] == "quiet", "the caller to be served")
        twin.until(lambda: at(twin) == "hall", "the way back", LIMIT_S)
        # The round goes on where it was.
        assert visits(twin, 2) == ["office", "lab"]


def test_an_order_to_nowhere_changes_nothing(tmp_path: Path) -> None:
    with courier(tmp_path) as twin:
        twin.receive("/order", "moon")
        assert twin.state["Caller"]["state"] == "quiet"


def test_a_low_battery_leads_to_the_dock_until_it_is_full(tmp_path: Path) -> None:
    with courier(tmp_path, drain_v_s=0.02) as twin:
        twin.until(lambda: bool(twin.state["Battery"]["variables"]["low"]), "a low battery", LIMIT_S)
        twin.until(lambda: twin.state["Dock"]["state"] == "docked", "the dock", 2 * LIMIT_S)
        twin.stand("the robot to charge")
        twin.until(lambda: not twin.state["Battery"]["variables"]["low"], "a full battery", LIMIT_S)
        assert twin.house.battery_v > 12.2
        twin.drive(0.5, "the robot to go on")


@pytest.mark.parametrize("opens_after_s", [1.0, 30.0])
def test_a_late_door_delays_it(tmp_path: Path, opens_after_s: float) -> None:
    with courier(tmp_path, drain_v_s=0.0, opens_after_s=opens_after_s) as twin:
        twin.until(lambda: twin.state["Door"]["state"] == "opening", "the door to be told", 2 * LIMIT_S)
        told_s = twin.now_s
        twin.until(lambda: twin.place[1] < -1.0, "the robot to go through the door", LIMIT_S)
        assert twin.now_s > told_s + opens_after_s
        motion, wrong = twin.finish()
    assert wrong == ()
    assert motion.samples[-1].collisions == 0


def test_before_a_door_that_never_opens_it_waits_and_says_so(tmp_path: Path) -> None:
    with courier(tmp_path, drain_v_s=0.0, opens_after_s=math.inf) as twin:
        twin.until(lambda: twin.state["Door"]["state"] == "opening", "the door to be told", 2 * LIMIT_S)
        # It may still turn towards the door.
        twin.go_on(10.0)
        place = twin.place
        twin.go_on(120.0)
        assert twin.place == place
        assert twin.is_standing
        (rounds,) = twin.missions
        assert rounds.visit == 2
        # Once it opens after all, the robot goes on.
        twin.house.is_door_open = True
        twin.receive("/door/opened")
        twin.until(lambda: at(twin) == "lab", "the lab", LIMIT_S)
        motion, wrong = twin.finish()
    assert wrong == ()
    assert motion.samples[-1].collisions == 0
