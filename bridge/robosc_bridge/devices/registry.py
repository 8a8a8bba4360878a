"""The registry of drivers: found by kind and name, imported when they are used.

Built-in drivers are listed here; an installed distribution adds its own through the entry-point group
`robosc_bridge.devices` (name = driver, value = `module:attribute` of a `Driver`), a program through `register`.
"""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from enum import StrEnum
from importlib.metadata import entry_points
from typing import Any, cast

from robosc_bridge.devices.interface import DriveBase, RangeScanner
from robosc_bridge.errors import BridgeError

ENTRY_POINT_GROUP = "robosc_bridge.devices"


class Kind(StrEnum):
    """What a driver is one of."""

    DRIVE_BASE = "drive base"
    RANGE_SCANNER = "range scanner"


@dataclass(frozen=True, slots=True)
class Driver:
    """A driver: what it drives, and how one is made.

    Attributes:
        kind: What it is one of; `make` returns a `DriveBase` or a `RangeScanner` accordingly.
        name: What it is asked for by.
        description: One line for a person.
        make: Makes one, without opening anything; its arguments are the driver's own.
    """

    kind: Kind
    name: str
    description: str
    make: Callable[..., Any]


@dataclass(frozen=True, slots=True)
class DriverInfo:
    """A driver as users see it."""

    name: str
    description: str


class UnknownDriverError(BridgeError, LookupError):
    """There is no driver of that kind and name, or it cannot be used here."""


# Description and place (`module:callable`) of the built-in drivers: listing them imports none.
_BUILT_IN: dict[Kind, dict[str, tuple[str, str]]] = {
    Kind.DRIVE_BASE: {
        "dynamixel": (
            "two Dynamixel X wheels (XL430-W250, XM430-W210) on a U2D2 or another half-duplex adapter",
            "robosc_bridge.devices.dynamixel:DynamixelBase",
        ),
        "mavlink-rover": (
            "a MAVLink rover: ArduPilot Rover, driven in its mode GUIDED over a serial line, UDP or TCP",
            "robosc_bridge.devices.mavlink_rover:MavlinkRover",
        ),
        "opencr": (
            "a stock TurtleBot3: its OpenCR board with the ROS 2 firmware",
            "robosc_bridge.devices.opencr:OpenCrBase",
        ),
    },
    Kind.RANGE_SCANNER: {
        "lds01": (
            "the LiDAR LDS-01 (HLS-LFCD2): 0.12 to 3.5 m, 5 turns a second",
            "robosc_bridge.devices.lidar:make_lds01",
        ),
        "lds02": ("the LiDAR LDS-02 (LD08): 0.16 to 8 m, 6 turns a second", "robosc_bridge.devices.lidar:make_lds02"),
        "lds03": (
            "the LiDAR LDS-03 (COIN-D4): 0.05 to 12 m, 10 turns a second",
            "robosc_bridge.devices.lidar:make_lds03",
        ),
        "mavlink-rover": (
            "the obstacles that a MAVLink rover tells of, also on the line of its drive base",
            "robosc_bridge.devices.mavlink_obstacles:MavlinkObstacles",
        ),
    },
}

_registered: dict[tuple[Kind, str], Driver] = {}


def register(driver: Driver) -> None:
    """Make a driver known to this process; one of the same kind and name is replaced."""
    _registered[driver.kind, driver.name] = driver


def available_drivers(kind: Kind) -> tuple[DriverInfo, ...]:
    """Every driver of a kind, by name; those of plug-ins are imported, and left out where they cannot be."""
    infos: dict[str, DriverInfo] = {}
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        try:
            driver = _plug_in(entry.name, entry.load)
        except UnknownDriverError:
            continue
        if driver.kind is kind:
            infos[entry.name] = DriverInfo(entry.name, driver.description)
    infos.update((name, DriverInfo(name, description)) for name, (description, _) in _BUILT_IN[kind].items())
    infos.update(
        (name, DriverInfo(name, driver.description)) for (of, name), driver in _registered.items() if of is kind
    )
    return tuple(infos[name] for name in sorted(infos))


def make_drive_base(name: str, **arguments: Any) -> DriveBase:
    """A drive base, not opened yet.

    Args:
        name: Of its driver.
        arguments: Of the driver.

    Raises:
        UnknownDriverError: There is none of that name; the message says what there is.
    """
    return cast(DriveBase, _driver(Kind.DRIVE_BASE, name).make(**arguments))


def make_range_scanner(name: str, **arguments: Any) -> RangeScanner:
    """A range scanner, not opened yet.

    Args:
        name: Of its driver.
        arguments: Of the driver.

    Raises:
        UnknownDriverError: There is none of that name; the message says what there is.
    """
    return cast(RangeScanner, _driver(Kind.RANGE_SCANNER, name).make(**arguments))


def _driver(kind: Kind, name: str) -> Driver:
    """The driver itself; imports it."""
    if (kind, name) in _registered:
        return _registered[kind, name]
    if name in _BUILT_IN[kind]:
        description, place = _BUILT_IN[kind][name]
        module, _, attribute = place.partition(":")
        return Driver(kind, name, description, getattr(importlib.import_module(module), attribute))
    for entry in entry_points(group=ENTRY_POINT_GROUP, name=name):
        driver = _plug_in(name, entry.load)
        if driver.kind is kind:
            return driver
    names = [info.name for info in available_drivers(kind)]
    close = get_close_matches(name, names, n=1)
    hint = f"; did you mean '{close[0]}'?" if close else f"; there is {', '.join(names) or 'none'}"
    raise UnknownDriverError(f"unknown {kind} '{name}'{hint}")


def _plug_in(name: str, load: Callable[[], object]) -> Driver:
    try:
        loaded = load()
    except Exception as error:
        raise UnknownDriverError(f"the plug-in of driver '{name}' cannot be imported: {error}") from error
    if not isinstance(loaded, Driver):
        raise UnknownDriverError(f"the plug-in of driver '{name}' is not a robosc_bridge.devices.registry.Driver")
    return loaded
