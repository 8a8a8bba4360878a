"""The layer, a configuration, its schema and the page have the same numbers: they come from one place."""

import re
from dataclasses import fields, replace
from typing import Any

import pytest

from robosc_bridge import driver_registry
from robosc_bridge.assembly import KEYS, safety_limits
from robosc_bridge.configuration import ConfigurationError, parse
from robosc_bridge.configuration.structure import schema
from robosc_bridge.driver_registry import Driver, DriverFeatures, Kind, available_drivers, features_of, register
from robosc_bridge.safety import SCAN_TIMEOUTS_S, SafetyLimits
from robosc_bridge.safety.limits import BOUNDS, REVOLUTIONS, SCAN_TIMEOUT_S
from support.safety_numbers import BY_ROBOT, PAGE, shipped, table

OF_SCHEMA = schema()["$defs"]["Safety"]["properties"]
# Beside those of the layer: the share of damaged frames is the scanner's thread's.
OTHERS = {"bad_frames_share"}
# Numbers that must be changed with a key, so that it still goes together with the others.
TOGETHER = {
    "angular_acceleration_rad_s2": {"angular_deceleration_rad_s2"},
    "linear_acceleration_m_s2": {"linear_deceleration_m_s2"},
}
BARE = "robot: burger\ndrive: {driver: opencr, port: /a}\nscanner: {driver: lds02, port: /b}\n"


def bounds_of(key: str) -> dict[str, Any]:
    """The bounds of a key in the schema."""
    entry = OF_SCHEMA[key]
    (found,) = [item for item in entry.get("anyOf", [entry]) if item.get("type") != "null"]
    return dict(found)


def chosen(key: str, value: object) -> SafetyLimits:
    text = f"{BARE}execution: {{period_s: 0.001}}\nsafety: {{{key}: {str(value).lower()}}}\n"
    return safety_limits(parse(text.encode(), "test.yaml").configuration)


def test_every_key_is_a_number_of_the_layer() -> None:
    assert {*KEYS.values(), *filter(None, BY_ROBOT.values()), *OTHERS} == set(OF_SCHEMA)
    assert {*KEYS, *BY_ROBOT} <= {each.name for each in fields(SafetyLimits)}


@pytest.mark.parametrize("name", [each.name for each in fields(SafetyLimits) if each.name not in BY_ROBOT])
def test_what_ships_is_the_layers_default(name: str) -> None:
    assert getattr(shipped("dynamixel"), name) == getattr(SafetyLimits, name)


@pytest.mark.parametrize(
    ("name", "key"), [*KEYS.items(), ("scan_timeout_s", "scan_timeout_s"), ("battery_stop_v", "battery_stop_v")]
)
def test_a_key_changes_its_number_alone(name: str, key: str) -> None:
    value: Any = not getattr(shipped(), name) if name.startswith("is_") else bounds_of(key)["maximum"]
    if name == "battery_stop_v":
        value = 10.0
    plain, found = shipped(execution="{period_s: 0.001}"), chosen(key, value)
    assert getattr(found, name) == value != getattr(plain, name)
    changed = {each.name for each in fields(SafetyLimits) if getattr(found, each.name) != getattr(plain, each.name)}
    assert changed - TOGETHER.get(name, set()) == {name}


NUMBERS = [(name, key) for name, key in {**KEYS, **BY_ROBOT}.items() if key and not name.startswith("is_")]


@pytest.mark.parametrize(("name", "key"), NUMBERS)
def test_a_schema_has_the_bounds_of_the_layer(name: str, key: str) -> None:
    bounds, found = BOUNDS[name], bounds_of(key)
    assert found.get("minimum") == bounds.least
    assert found.get("exclusiveMinimum") == (0 if bounds.least is None else None)
    assert found["maximum"] == bounds.most


@pytest.mark.parametrize(("name", "key"), NUMBERS)
def test_what_the_schema_takes_the_layer_takes_and_what_not_not(name: str, key: str) -> None:
    found = bounds_of(key)
    for value in (found["maximum"], found.get("minimum", 1e-6)):
        # A pair that would contradict itself says nothing about one of the two.
        if key not in ("battery_warning_v", "battery_stop_v"):
            chosen(key, value)
    for value in (found["maximum"] * 1.001, found.get("minimum", 0) - 1e-6):
        with pytest.raises(ConfigurationError, match=rf"safety\.{key}: is "):
            chosen(key, value)
        with pytest.raises(ValueError, match=rf"\b{name} must be "):
            changes: dict[str, Any] = {name: value}
            replace(shipped(), **changes)


# Numbers that depend on the drive.


@pytest.mark.parametrize(("base", "is_off"), [("opencr", True), ("dynamixel", False), ("mavlink-rover", False)])
def test_after_an_operators_stop_a_board_with_own_controls_lets_go(base: str, is_off: bool) -> None:
    assert shipped(base).is_torque_off_on_operator_stop is is_off
    assert shipped(base).has_own_controls is is_off
    for value in (True, False):
        chosen = shipped(base, safety=f"{{torque_off_on_operator_stop: {str(value).lower()}}}")
        assert chosen.is_torque_off_on_operator_stop is value


@pytest.mark.parametrize(
    ("robot", "base", "chosen", "voltages_v"),
    [
        ("burger", "opencr", "", (11.5, 11.1)),
        ("waffle", "opencr", "", (11.5, 11.1)),
        ("burger", "dynamixel", "", (7.0, 6.5)),
        ("waffle", "dynamixel", "", (10.5, 10.0)),
        ("burger", "mavlink-rover", "", (None, None)),
        # Chosen numbers count, and a warning never comes after the end.
        ("burger", "dynamixel", "battery_stop_v: 9.9", (9.9, 9.9)),
        ("burger", "dynamixel", "battery_warning_v: 10.5, battery_stop_v: 9.9", (10.5, 9.9)),
        ("burger", "opencr", "battery_stop_v: 10.5", (11.5, 10.5)),
        ("burger", "mavlink-rover", "battery_warning_v: 7.4", (7.4, None)),
        ("burger", "mavlink-rover", "battery_stop_v: 7.0", (7.0, 7.0)),
    ],
)
def test_a_battery_is_that_of_the_drive(
    robot: str, base: str, chosen: str, voltages_v: tuple[float | None, float | None]
) -> None:
    text = BARE.replace("burger", robot).replace("opencr", base) + f"safety: {{{chosen}}}\n"
    found = safety_limits(parse(text.encode(), "test.yaml").configuration)
    assert (found.battery_warn_v, found.battery_stop_v) == voltages_v


def test_a_rover_is_given_more_time_to_follow() -> None:
    found = shipped("mavlink-rover")
    assert (found.astray_m_s, found.astray_s, found.torque_on_s) == (0.1, 2.0, 8.0)
    assert shipped("dynamixel").astray_s == SafetyLimits.astray_s


# The LiDAR.


@pytest.mark.parametrize("lidar", SCAN_TIMEOUTS_S)
def test_a_lidar_has_its_own_time_if_nothing_is_said(lidar: str) -> None:
    features = features_of(lidar, Kind.RANGE_SCANNER)
    assert features is not None and features.revolution_s is not None
    assert shipped(lidar=lidar).scan_timeout_s == SCAN_TIMEOUTS_S[lidar]
    assert SCAN_TIMEOUTS_S[lidar] == pytest.approx(REVOLUTIONS * features.revolution_s)
    assert shipped(lidar=lidar, safety="{scan_timeout_s: 0.7}").scan_timeout_s == 0.7


def test_every_lidar_that_is_built_in_has_its_time() -> None:
    rotating = {info.name for info in available_drivers(Kind.RANGE_SCANNER) if info.features is not None}
    assert rotating >= set(SCAN_TIMEOUTS_S)
    assert shipped(lidar="mavlink-rover").scan_timeout_s == SCAN_TIMEOUT_S


def test_a_lidar_of_a_plug_in_has_three_of_its_revolutions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driver_registry, "_registered", {})
    register(Driver(Kind.RANGE_SCANNER, "slow", "a slow one", dict, DriverFeatures(revolution_s=0.4)))
    assert shipped(lidar="slow").scan_timeout_s == pytest.approx(1.2)


# The page.


def test_the_table_of_the_page_is_that_of_the_numbers() -> None:
    assert f"\n\n{table()}\n" in PAGE, "write what support.safety_numbers.table() returns into it"


def test_the_times_of_the_lidars_are_on_the_page() -> None:
    rows = dict(re.findall(r"^\| `(lds\d\d)` \| ([\d.]+) s \|$", PAGE, re.MULTILINE))
    assert {name: float(time_s) for name, time_s in rows.items()} == SCAN_TIMEOUTS_S
