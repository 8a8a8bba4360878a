"""Drivers by kind and name: built in, registered, and of other distributions."""

import importlib.metadata
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

from robosc_bridge import driver_registry
from robosc_bridge.driver_registry import (
    PACK_3S_V,
    PANEL,
    Driver,
    DriverFeatures,
    DriverInfo,
    Kind,
    UnknownDriverError,
    available_drivers,
    features_of,
    make_drive_base,
    make_range_scanner,
    register,
)


class _Made:
    def __init__(self, **arguments: object) -> None:
        self.arguments = arguments


PLUG_IN = Driver(Kind.RANGE_SCANNER, "plug", "a scanner", _Made)


def _arguments(made: object) -> dict[str, object]:
    assert isinstance(made, _Made)
    return made.arguments


@pytest.fixture(autouse=True)
def _nothing_registered(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(driver_registry, "_registered", {})
    yield


def test_drive_bases_are_listed() -> None:
    infos = {info.name: info.description for info in available_drivers(Kind.DRIVE_BASE)}
    assert {"dynamixel", "opencr"} <= set(infos)
    assert "U2D2" in infos["dynamixel"]


def test_an_unknown_name_suggests_the_nearest_or_all() -> None:
    with pytest.raises(UnknownDriverError, match=r"unknown drive base 'open-cr'; did you mean 'opencr'\?"):
        make_drive_base("open-cr")
    with pytest.raises(UnknownDriverError, match=r"unknown drive base 'x'; there is .*dynamixel, .*opencr"):
        make_drive_base("x")


def test_a_registered_driver_is_made_with_its_arguments_and_under_its_kind_only() -> None:
    register(Driver(Kind.DRIVE_BASE, "cart", "a cart", _Made))
    assert DriverInfo("cart", "a cart") in available_drivers(Kind.DRIVE_BASE)
    assert DriverInfo("cart", "a cart") not in available_drivers(Kind.RANGE_SCANNER)
    assert _arguments(make_drive_base("cart", path="/dev/x")) == {"path": "/dev/x"}
    with pytest.raises(UnknownDriverError):
        make_range_scanner("cart")


def test_a_registered_driver_replaces_a_built_in_one() -> None:
    register(Driver(Kind.DRIVE_BASE, "opencr", "mine", _Made))
    assert DriverInfo("opencr", "mine") in available_drivers(Kind.DRIVE_BASE)
    assert _arguments(make_drive_base("opencr", a=1)) == {"a": 1}


def _entry(monkeypatch: pytest.MonkeyPatch, value: str) -> None:
    def entry_points(group: str, **wanted: Any) -> importlib.metadata.EntryPoints:
        assert group == "robosc_bridge.devices"
        found = importlib.metadata.EntryPoint("plug", value, group)
        return importlib.metadata.EntryPoints([found]).select(**wanted)

    monkeypatch.setattr(driver_registry, "entry_points", entry_points)


def test_a_plug_in_is_found_by_its_entry_point(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driver_registry, "PLUG_IN", PLUG_IN, raising=False)
    _entry(monkeypatch, "robosc_bridge.driver_registry:PLUG_IN")
    assert DriverInfo("plug", "a scanner") in available_drivers(Kind.RANGE_SCANNER)
    assert DriverInfo("plug", "a scanner") not in available_drivers(Kind.DRIVE_BASE)
    assert _arguments(make_range_scanner("plug", path="x")) == {"path": "x"}
    with pytest.raises(UnknownDriverError, match="unknown drive base 'plug'"):
        make_drive_base("plug")


def test_what_a_drive_base_has_is_declared_by_its_driver(monkeypatch: pytest.MonkeyPatch) -> None:
    assert features_of("opencr") == DriverFeatures(
        PANEL, has_imu=True, needs_turtlebot3=True, battery_v=PACK_3S_V, has_own_controls=True
    )
    assert features_of("dynamixel") == DriverFeatures(knows_turtlebot3=True)
    assert features_of("mavlink-rover") == DriverFeatures(has_imu=True, torque_on_s=8.0, astray_s=2.0, astray_m_s=0.1)
    assert features_of("plug") is None
    # A plug-in declares its own, or none.
    features = DriverFeatures(("button_9",))
    monkeypatch.setattr(
        driver_registry, "PLUG_IN", Driver(Kind.DRIVE_BASE, "plug", "a cart", _Made, features), raising=False
    )
    _entry(monkeypatch, "robosc_bridge.driver_registry:PLUG_IN")
    assert features_of("plug") == features
    assert DriverInfo("plug", "a cart", features) in available_drivers(Kind.DRIVE_BASE)
    register(Driver(Kind.DRIVE_BASE, "opencr", "mine", _Made))
    assert features_of("opencr") is None


def test_features_are_known_without_the_code_of_a_device() -> None:
    code = (
        "import sys; from robosc_bridge.driver_registry import Kind, available_drivers, features_of; "
        "features_of('opencr'); "
        "[available_drivers(kind) for kind in Kind]; sys.exit(any('devices' in name for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize(
    ("value", "problem"), [("json:dumps", "is not a .*Driver"), ("no.such.module:X", "cannot be imported: No module")]
)
def test_a_broken_plug_in_is_an_error_only_for_who_asks_for_it(
    monkeypatch: pytest.MonkeyPatch, value: str, problem: str
) -> None:
    _entry(monkeypatch, value)
    names = [info.name for info in available_drivers(Kind.DRIVE_BASE)]
    assert "opencr" in names
    assert "plug" not in names
    with pytest.raises(UnknownDriverError, match=f"the plug-in of driver 'plug' {problem}"):
        make_range_scanner("plug")
