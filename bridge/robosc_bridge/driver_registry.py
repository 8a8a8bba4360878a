"""The registry of drivers: found by kind and name, with what their devices have, and imported when they are used.

Built-in drivers are listed here; an installed distribution adds its own through the entry-point group
`robosc_bridge.devices` (name = driver, value = `module:attribute` of a `Driver`), a program through `register`. A
configuration is checked against the features without the code of devices: so this module imports none, and `make` of a
plug-in should import its modules only when it is called.
"""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from enum import StrEnum
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any, cast

from robosc_bridge.errors import BridgeError

if TYPE_CHECKING:
    from robosc_bridge.devices.interface import DriveBase, RangeScanner

ENTRY_POINT_GROUP = "robosc_bridge.devices"


class Kind(StrEnum):
    """Kind of device that a driver is for."""

    DRIVE_BASE = "drive base"
    RANGE_SCANNER = "range scanner"


PANEL = ("button_1", "button_2", "bumper_1", "bumper_2")
"""Buttons of an OpenCR board: the bumpers are the one in front and the one behind."""


PACK_3S_V = (11.5, 11.1)
"""Warning and end of a lithium pack of three cells in series, the battery of a TurtleBot3: 3.83 V and 3.7 V a cell.

Its board beeps at 11.1 V, too."""


@dataclass(frozen=True, slots=True)
class DriverFeatures:
    """Features of a device, beside those that all of its kind have.

    Attributes:
        buttons: Names in its readings; those of bumpers are `bumper_1` (in front) and `bumper_2` (behind).
        has_imu: True if its readings report accelerations and yaw rates.
        needs_turtlebot3: True if its argument `robot` is a `devices.robots.Robot`, whose motors or board it drives;
            else it is a `devices.robots.Body`, and the robot may be any.
        knows_turtlebot3: True if its argument `robot` is a `devices.robots.Robot` for a TurtleBot3, and a `Body` for
            any other robot, of which its options say the rest.
        revolution_s: Time that a revolution of a range scanner takes, in seconds; None: that is not known.
        torque_on_s: Time within which the motors report torque after it was switched on, in seconds; None: the
            safety layer's own limit.
        astray_s: Longest time that a wheel may be off its goal, in seconds; None: the safety layer's own limit.
        astray_m_s: Difference from its goal up to which a wheel is not off it, in m/s; None: the safety layer's own.
        battery_v: Voltages at and below which a person is warned and the robot stops, for the battery pack that the
            device is made for; None: they follow from its motors, or from what the device reports.
        has_own_controls: True if the device has controls of its own that move the wheels while torque is on, such as
            buttons of a board; an operator's stop switches torque off then, unless the configuration forbids that.
    """

    buttons: tuple[str, ...] = ()
    has_imu: bool = False
    needs_turtlebot3: bool = False
    knows_turtlebot3: bool = False
    revolution_s: float | None = None
    torque_on_s: float | None = None
    astray_s: float | None = None
    astray_m_s: float | None = None
    battery_v: tuple[float, float] | None = None
    has_own_controls: bool = False

    @property
    def has_bumpers(self) -> bool:
        """True if it reports any bumpers."""
        return any(name.startswith("bumper_") for name in self.buttons)


@dataclass(frozen=True, slots=True)
class Driver:
    """A driver: the device that it drives, and the way to make one.

    Attributes:
        kind: Kind of device; `make` returns a `DriveBase` or a `RangeScanner` accordingly.
        name: Name of the driver in configurations.
        description: One line for a person.
        make: Function that makes one, without opening anything. Its arguments are `path`, of a drive base `robot`,
            and the options of the configuration, which are the driver's own.
        features: Features of the device; None: not declared, so that everything in a configuration counts as present.
    """

    kind: Kind
    name: str
    description: str
    make: Callable[..., Any]
    features: DriverFeatures | None = None


@dataclass(frozen=True, slots=True)
class DriverInfo:
    """A driver as users see it."""

    name: str
    description: str
    features: DriverFeatures | None = None


class UnknownDriverError(BridgeError, LookupError):
    """A driver of that kind and name does not exist, or it cannot be used here."""


# Description, place (`module:callable`) and features of the built-in drivers: listing them imports none.
_BUILT_IN: dict[Kind, dict[str, tuple[str, str, DriverFeatures | None]]] = {
    Kind.DRIVE_BASE: {
        "dynamixel": (
            "two Dynamixel X wheels of a TurtleBot3 or any other robot, on a U2D2 or another half-duplex adapter",
            "robosc_bridge.devices.dynamixel:DynamixelBase",
            DriverFeatures(knows_turtlebot3=True),
        ),
        "mavlink-rover": (
            "a MAVLink rover: ArduPilot Rover, driven in its mode GUIDED over a serial line, UDP or TCP",
            "robosc_bridge.devices.mavlink_drivers:make_rover",
            # Its mode and its arming show in a heartbeat each; there is one a second, of which two may be lost.
            # Its own control is as slow as its mass asks for, and its estimate of a standstill is not zero.
            DriverFeatures(has_imu=True, torque_on_s=8.0, astray_s=2.0, astray_m_s=0.1),
        ),
        "opencr": (
            "a stock TurtleBot3: its OpenCR board with the ROS 2 firmware",
            "robosc_bridge.devices.opencr:OpenCrBase",
            # Its firmware adds its two buttons and an RC-100 to what it is commanded.
            DriverFeatures(PANEL, has_imu=True, needs_turtlebot3=True, battery_v=PACK_3S_V, has_own_controls=True),
        ),
    },
    Kind.RANGE_SCANNER: {
        "lds01": (
            "the LiDAR LDS-01 (HLS-LFCD2): 0.12 to 3.5 m, 5 revolutions a second",
            "robosc_bridge.devices.lidar:make_lds01",
            DriverFeatures(revolution_s=0.2),
        ),
        "lds02": (
            "the LiDAR LDS-02 (LD08): 0.16 to 8 m, 6 revolutions a second",
            "robosc_bridge.devices.lidar:make_lds02",
            DriverFeatures(revolution_s=1 / 6),
        ),
        "lds03": (
            "the LiDAR LDS-03 (COIN-D4): 0.05 to 12 m, 10 revolutions a second",
            "robosc_bridge.devices.lidar:make_lds03",
            DriverFeatures(revolution_s=0.1),
        ),
        "mavlink-rover": (
            "the obstacles that a MAVLink rover reports, also on the line of its drive base",
            "robosc_bridge.devices.mavlink_drivers:make_obstacles",
            None,
        ),
    },
}

_registered: dict[tuple[Kind, str], Driver] = {}


def register(driver: Driver) -> None:
    """Make a driver known to this process; one of the same kind and name is replaced."""
    _registered[driver.kind, driver.name] = driver


def available_drivers(kind: Kind) -> tuple[DriverInfo, ...]:
    """Return every driver of a kind, by name; plug-ins are imported, and left out if their import fails."""
    infos: dict[str, DriverInfo] = {}
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        try:
            driver = _plug_in(entry.name, entry.load)
        except UnknownDriverError:
            continue
        if driver.kind is kind:
            infos[entry.name] = DriverInfo(entry.name, driver.description, driver.features)
    for name, (description, _, features) in _BUILT_IN[kind].items():
        infos[name] = DriverInfo(name, description, features)
    for (of, name), driver in _registered.items():
        if of is kind:
            infos[name] = DriverInfo(name, driver.description, driver.features)
    return tuple(infos[name] for name in sorted(infos))


def features_of(name: str, kind: Kind = Kind.DRIVE_BASE) -> DriverFeatures | None:
    """Return the features of a device; None: its driver does not say, or there is none of that name.

    A missing driver is reported elsewhere.
    """
    if (kind, name) not in _registered and name in _BUILT_IN[kind]:
        return _BUILT_IN[kind][name][2]
    try:
        return find_driver(kind, name).features
    except UnknownDriverError:
        return None


def find_driver(kind: Kind, name: str) -> Driver:
    """The driver itself; imports it.

    Raises:
        UnknownDriverError: There is none of that name; the message says what there is.
    """
    if (kind, name) in _registered:
        return _registered[kind, name]
    if name in _BUILT_IN[kind]:
        description, place, features = _BUILT_IN[kind][name]
        module, _, attribute = place.partition(":")
        return Driver(kind, name, description, getattr(importlib.import_module(module), attribute), features)
    for entry in entry_points(group=ENTRY_POINT_GROUP, name=name):
        driver = _plug_in(name, entry.load)
        if driver.kind is kind:
            return driver
    names = [info.name for info in available_drivers(kind)]
    close = get_close_matches(name, names, n=1)
    hint = f"; did you mean '{close[0]}'?" if close else f"; there is {', '.join(names) or 'none'}"
    raise UnknownDriverError(f"unknown {kind} '{name}'{hint}")


def make_drive_base(name: str, **arguments: Any) -> "DriveBase":
    """A drive base, not opened yet.

    Args:
        name: Of its driver.
        arguments: Of the driver.

    Raises:
        UnknownDriverError: There is none of that name; the message says what there is.
    """
    return cast("DriveBase", find_driver(Kind.DRIVE_BASE, name).make(**arguments))


def make_range_scanner(name: str, **arguments: Any) -> "RangeScanner":
    """A range scanner, not opened yet.

    Args:
        name: Of its driver.
        arguments: Of the driver.

    Raises:
        UnknownDriverError: There is none of that name; the message says what there is.
    """
    return cast("RangeScanner", find_driver(Kind.RANGE_SCANNER, name).make(**arguments))


def _plug_in(name: str, load: Callable[[], object]) -> Driver:
    try:
        loaded = load()
    except Exception as error:
        raise UnknownDriverError(f"the plug-in of driver '{name}' cannot be imported: {error}") from error
    if not isinstance(loaded, Driver):
        raise UnknownDriverError(f"the plug-in of driver '{name}' is not a robosc_bridge.driver_registry.Driver")
    return loaded
