"""A first configuration for a robot and a model, with the obvious mappings; the user fills in the others."""

import json
import re
from collections.abc import Iterator
from textwrap import wrap
from typing import Literal

import msgspec

from robosc.expressions import type_text
from robosc.model.structure import Communication, CommunicationKind, Model
from robosc_bridge.configuration import channels as kinds
from robosc_bridge.configuration.channel_mapping import unsuitable_because
from robosc_bridge.configuration.channels import CHANNELS, Channel, channel_name
from robosc_bridge.configuration.reference import default_of, struct_of, summary
from robosc_bridge.configuration.structure import Configuration, Scanner, TurtleBot
from robosc_bridge.driver_registry import PANEL, DriverFeatures, features_of

DriveDriver = Literal["opencr", "dynamixel"]
ScannerDriver = Literal["lds01", "lds02", "lds03"]

PORTS: dict[str, str] = {
    "opencr": "/dev/ttyACM0",
    "dynamixel": "/dev/ttyUSB1",
    "lds01": "/dev/ttyUSB0",
    "lds02": "/dev/ttyUSB0",
    "lds03": "/dev/ttyUSB0",
}
"""Usual port of each device; the LiDAR's adapter is the first of its kind."""

UDEV_RULES = "60-robosc.rules"
UDEV_PORTS: dict[str, str] = {
    "opencr": "/dev/robosc-opencr",
    "dynamixel": "/dev/robosc-u2d2",
    "lds01": "/dev/robosc-lds",
    "lds02": "/dev/robosc-lds",
    "lds03": "/dev/robosc-lds",
}
"""Port of each device by the udev rules of deploy/udev, whatever the order of plugging in."""

_PLAIN_PATH = re.compile(r"/[A-Za-z0-9/._-]+")
_WIDTH = 110
_IN, _OUT = CommunicationKind.INCOMING_MESSAGE, CommunicationKind.OUTGOING_MESSAGE
_SKILLS = (CommunicationKind.SERVICE, CommunicationKind.ACTION)


def init(
    robot: TurtleBot,
    drive: DriveDriver,
    scanner: ScannerDriver,
    model: Model,
    *,
    drive_port: str | None = None,
    scanner_port: str | None = None,
    has_udev_names: bool = False,
) -> str:
    """Return the text of a configuration, with every setting and its meaning.

    An entry that cannot be guessed has no value there: such a file cannot be loaded, and the error lists the entry.

    Args:
        robot: The TurtleBot3.
        drive: Driver that reaches its wheels.
        scanner: Driver of its LiDAR.
        model: Model whose communications are to be mapped.
        drive_port: Port of the drive; None: the usual one.
        scanner_port: Port of the LiDAR; None: the usual one.
        has_udev_names: True if the usual ports are those of the udev rules.
    """
    ports = UDEV_PORTS if has_udev_names else PORTS
    lines = [
        f"# Configuration of the RoboSC bridge for {model.name}. All settings are shown.",
        "",
        f"robot: {robot}",
        "",
        *_device("drive", drive, drive_port or ports[drive]),
        *_device("scanner", scanner, scanner_port or ports[scanner]),
        *_sections(),
        "# What each communication of the model is mapped to.",
        *_channels(model, drive),
    ]
    return "\n".join(lines) + "\n"


def obvious_channel(model: Model, communication: Communication, drive: str) -> Channel | None:
    """Return the channel that a communication is meant for, by its identifier and its data; None: it is not clear."""
    for words, used, channel in _guesses(communication):
        is_meant = communication.kind in used and _last_words(communication.identifier) in words
        if is_meant and not unsuitable_because(model, communication, type(channel)):
            return channel if _has(features_of(drive) or DriverFeatures(), channel) else None
    return None


def _has(features: DriverFeatures, channel: Channel) -> bool:
    """Return True if a drive has the hardware that a channel is about."""
    match channel:
        case kinds.ButtonChannel(name=name):
            return name in features.buttons
        case kinds.BumperChannel():
            return features.has_bumpers
        case kinds.ImuChannel():
            return features.has_imu
    return True


def _last_words(identifier: str) -> str:
    """The part of an identifier that shows its purpose, without the robot's name before it."""
    parts = [part for part in identifier.split("/") if part]
    pair = "/".join(parts[-2:])
    return pair if parts[-2:-1] in (["line"], ["emergency_stop"]) else "".join(parts[-1:])


def _guesses(item: Communication) -> Iterator[tuple[set[str], tuple[CommunicationKind, ...], Channel]]:
    unit: Literal["degrees", "radians"] = (
        "degrees" if item.request is not None and type_text(item.request).startswith("integer") else "radians"
    )
    yield {"cmd_vel"}, (_IN,), kinds.DriveChannel()
    yield {"rotate", "rotate_left"}, (_IN, *_SKILLS), kinds.RotateChannel(unit=unit, direction="left")
    yield {"rotate_right"}, (_IN, *_SKILLS), kinds.RotateChannel(unit=unit, direction="right")
    yield {"rotate_done", "rotated"}, (_OUT,), kinds.RotatedChannel()
    yield {"rotate_failed"}, (_OUT,), kinds.RotatedChannel(outcome="failed")
    yield {"scan"}, (_OUT,), kinds.ScannerChannel()
    yield {"odom", "odometry"}, (_OUT,), kinds.OdometryChannel()
    yield {"imu"}, (_OUT,), kinds.ImuChannel()
    yield {"battery", "battery_state"}, (_OUT,), kinds.BatteryChannel()
    yield {"bumper"}, (_OUT,), kinds.BumperChannel()
    is_event = item.response is not None and type_text(item.response) == "none"
    for name in PANEL[:2]:
        words = {name, "button"} if name == PANEL[0] else {name}
        yield words, (_OUT,), kinds.ButtonChannel(name=name, on="press" if is_event else "change")
    yield {"line/correction"}, (_OUT,), kinds.LineChannel()
    yield {"line/lost"}, (_OUT,), kinds.LineLostChannel()
    yield {"emergency_stop/stop"}, (_OUT,), kinds.EmergencyStopChannel(event="stop")
    yield {"emergency_stop/resume"}, (_OUT,), kinds.EmergencyStopChannel(event="resume")


def _device(section: str, driver: str, port: str) -> list[str]:
    is_stable = port == UDEV_PORTS[driver]
    return [
        f"{section}:",
        f"  driver: {driver}",
        f"  # {'Its name by the udev rules' if is_stable else 'Best a stable name'}; alike devices: /dev/serial/by-id.",
        f"  port: {port if _PLAIN_PATH.fullmatch(port) else json.dumps(port)}",
        "",
    ]


def _settings(section: type[msgspec.Struct], depth: int = 1) -> Iterator[str]:
    """Every setting of a section with what it means and its default."""
    indent = "  " * depth
    for field in msgspec.structs.fields(section):
        for line in wrap(summary(field.type), _WIDTH - len(indent)):
            yield f"{indent}# {line}"
        inner = struct_of(field.type)
        if inner is None:
            yield f"{indent}{field.name}: {json.dumps(default_of(field))}"
        else:
            yield f"{indent}{field.name}:"
            yield from _settings(inner, depth + 1)


def _sections() -> Iterator[str]:
    """The sections that have defaults."""
    for field in msgspec.structs.fields(Configuration):
        section = struct_of(field.type)
        if section is not None and not field.required and section is not Scanner:
            yield from wrap(summary(field.type), _WIDTH, initial_indent="# ", subsequent_indent="# ")
            yield f"{field.name}:"
            yield from _settings(section)
            yield ""


def _channels(model: Model, drive: str) -> Iterator[str]:
    yield "channels:" if model.communications else "channels: {}"
    by_identifier: dict[str, list[Communication]] = {}
    for item in model.communications:
        by_identifier.setdefault(item.identifier, []).append(item)
    for identifier, items in by_identifier.items():
        found = [obvious_channel(model, item, drive) for item in items]
        if all(channel == found[0] for channel in found):
            yield from _entry(model, identifier, items, found[0])
        else:
            for item, channel in zip(items, found, strict=True):
                yield from _entry(model, item.name, [item], channel)


def _entry(model: Model, key: str, items: list[Communication], channel: Channel | None) -> Iterator[str]:
    for item in items:
        yield f"  # {item.component}.{item.name}: {item.kind}"
    if channel is not None:
        yield f"  {quoted(key)}: {_flow(channel)}"
        return
    possible = [
        channel_name(kind) for kind in CHANNELS if not any(unsuitable_because(model, item, kind) for item in items)
    ]
    yield f"  # To be filled in: {{channel: NAME}} with one of {', '.join(possible)}."
    yield f"  {quoted(key)}:"


def quoted(text: str) -> str:
    """A text as YAML in double quotes, on one line and printable whatever is in it."""
    return "".join(
        item if item.isprintable() else f"\\U{ord(item):08x}" for item in json.dumps(text, ensure_ascii=False)
    )


def _flow(channel: Channel) -> str:
    """A channel with all its options, on one line."""
    values = msgspec.to_builtins(channel)
    return "{" + ", ".join(f"{name}: {value}" for name, value in values.items()) + "}"
