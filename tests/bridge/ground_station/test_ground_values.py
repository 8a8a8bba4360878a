"""Names and numbers of the model's states and variables."""

import math
from typing import Any

import pytest

from robosc_bridge.daemon.states import State
from robosc_bridge.ground_station.values import NamedValue, _short, named_values
from support.ground import PlayedDaemon


def _values() -> dict[str, NamedValue]:
    return {value.meaning: value for value in named_values(PlayedDaemon().operations.model)}


def test_names_are_short_unique_and_their_own() -> None:
    values = _values()
    assert {meaning: value.name for meaning, value in values.items()} == {
        "Lift": "Lift",
        "Lift.load": "Lift.load",
        "Lift.is_full": "Lift.i~a7l",
        "Lift.count": "Lift.count",
        "Lift.weight_of_all": "Lift.w~d5a",
        "LongishComponentName": "Longis~dj1",
    }
    assert all(len(value.name) <= 10 for value in values.values())


def test_names_that_would_be_the_same_are_not() -> None:
    taken: set[str] = set()
    for _ in range(5):
        taken.add(_short("LongishComponentName", taken))
    assert len(taken) == 5
    assert _short("sup_state", {"sup_state"}) != "sup_state"


@pytest.mark.parametrize(
    ("meaning", "component", "expected"),
    [
        ("Lift", {"state": "up", "variables": {}}, 1),
        ("Lift", {"state": "nowhere", "variables": {}}, None),
        ("Lift.load", {"state": "up", "variables": {"load": "light"}}, 1),
        ("Lift.load", {"state": "up", "variables": {"load": "purple"}}, None),
        ("Lift.load", {"state": "up", "variables": {}}, None),
        ("Lift.is_full", {"state": "up", "variables": {"is_full": True}}, 1),
        ("Lift.count", {"state": "up", "variables": {"count": 9}}, 9),
        ("Lift.count", {"state": "up", "variables": {"count": 2**31}}, None),
        ("Lift.count", {"state": "up", "variables": {"count": "9"}}, None),
        ("Lift.weight_of_all", {"state": "up", "variables": {"weight_of_all": 2.5}}, 2.5),
        ("Lift.weight_of_all", {"state": "up", "variables": {"weight_of_all": 3}}, 3.0),
        ("Lift.weight_of_all", {"state": "up", "variables": {"weight_of_all": -1e300}}, -math.inf),
    ],
)
def test_named_values_of_the_status(meaning: str, component: dict[str, Any], expected: float | None) -> None:
    value = _values()[meaning]
    found = value.number({"Lift": component})
    assert found == expected
    assert type(found) is type(expected)
    assert value.number({}) is None


def test_the_numbers_of_states_are_those_of_the_page() -> None:
    assert [str(state) for state in State] == ["starting", "standby", "running", "stopping", "fault", "over"]
