"""State of a bridge as entries for diagnostic_msgs/DiagnosticArray, without the message types."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum

from robosc_bridge.terminal.client import DriveState, Snapshot, is_fault, state_name
from robosc_bridge.terminal.formatting import STALE_S, mission_text, owed_text, standing_text

_STANDBY = "STANDBY"


class Level(IntEnum):
    """Level of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True)
class Entry:
    """An entry.

    Attributes:
        name: Subject.
        level: State of the subject.
        message: One sentence.
        values: Further facts by name.
    """

    name: str
    level: Level
    message: str
    values: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Link:
    """Connection to a bridge.

    Attributes:
        address: Address of the bridge.
        robot: Name of the robot in its model; empty: no bridge has answered yet.
        version: Version of the bridge; empty: no bridge has answered yet.
        problem: Reason why the bridge does not answer, one sentence; empty: it answers.
    """

    address: str
    robot: str = ""
    version: str = ""
    problem: str = ""


BRIDGE, SAFETY, SUPERVISOR, WARNINGS = "bridge", "safety", "supervisor", "warnings"
"""Entries that there always are; the others are about goals, and about the devices by name."""

GOALS = "goals"


def entries(link: Link, snapshot: Snapshot | None, age_s: float) -> tuple[Entry, ...]:
    """Return the entries.

    Args:
        link: Connection to the bridge.
        snapshot: Snapshot that was received last, also over an earlier connection; None: none was.
        age_s: Age of the snapshot, in seconds.
    """
    known = {"address": link.address, "robot": link.robot, "version": link.version}
    known = {name: value for name, value in known.items() if value}
    if link.problem:
        return (Entry(BRIDGE, Level.ERROR, link.problem, known), *_stale(snapshot, "The bridge is not heard."))
    if snapshot is None:
        return (Entry(BRIDGE, Level.WARN, "The bridge's loop has not run yet.", known),)
    if age_s > STALE_S:
        hangs = Entry(BRIDGE, Level.ERROR, f"The bridge's loop hangs, for {age_s:.1f} s.", known)
        return (hangs, *_stale(snapshot, "The bridge's loop hangs."))
    return (
        _bridge(snapshot, age_s, known),
        _safety(snapshot),
        _supervisor(snapshot),
        _warnings(snapshot),
        *_goals(snapshot),
        *_devices(snapshot),
    )


def _stale(snapshot: Snapshot | None, why: str) -> Iterator[Entry]:
    devices = [] if snapshot is None else [item.name for item in snapshot.devices]
    goals = [GOALS] if snapshot is not None and snapshot.HasField("progress") else []
    for name in (SAFETY, SUPERVISOR, WARNINGS, *goals, *devices):
        yield Entry(name, Level.STALE, why)


def _bridge(snapshot: Snapshot, age_s: float, known: dict[str, str]) -> Entry:
    state = state_name(snapshot)
    values = {**known, "state": state, "age_s": f"{age_s:.1f}", "decisions left out": str(snapshot.overruns)}
    if is_fault(snapshot):
        return Entry(BRIDGE, Level.ERROR, snapshot.problem or state, values)
    return Entry(BRIDGE, Level.OK if state in ("standby", "running") else Level.WARN, state, values)


def _safety(snapshot: Snapshot) -> Entry:
    values = {item.code: item.text for item in snapshot.reasons}
    if not snapshot.reasons:
        return Entry(SAFETY, Level.OK, "The robot may move.")
    message = " ".join(item.text for item in snapshot.reasons)
    if any(item.holds_until_reset for item in snapshot.reasons):
        return Entry(SAFETY, Level.ERROR, message, values)
    return Entry(SAFETY, Level.OK if set(values) == {_STANDBY} else Level.WARN, message, values)


def _supervisor(snapshot: Snapshot) -> Entry:
    values = {item.name: item.state for item in snapshot.components}
    values["allowed now"] = ", ".join(snapshot.enabled)
    values["cancelling"] = ", ".join(snapshot.cancelling)
    if not snapshot.components:
        return Entry(SUPERVISOR, Level.OK, "Nothing is executed.")
    if snapshot.overdue_cancels:
        names = ", ".join(snapshot.overdue_cancels)
        return Entry(SUPERVISOR, Level.ERROR, f"Goals do not end although they were cancelled: {names}.", values)
    if snapshot.stops:
        return Entry(SUPERVISOR, Level.WARN, f"Nothing is requested: {'; '.join(snapshot.stops)}", values)
    return Entry(SUPERVISOR, Level.OK, "The supervisor is executed.", values)


def _goals(snapshot: Snapshot) -> Iterator[Entry]:
    """Yield the entry about the strategy's goals, if there is a strategy."""
    if not snapshot.HasField("progress"):
        return
    progress = snapshot.progress
    values = {}
    for item in (*progress.aims, *progress.assumptions):
        values[item.name] = f"{standing_text(item)}, reached {item.times} times: {item.words}"
    values |= {f"mission {item.name}": mission_text(item, progress) for item in progress.missions}
    values |= {"approached": progress.approached, "chosen": progress.chosen}
    owed = [owed_text(item) for item in progress.assumptions if item.name in progress.overdue]
    if owed:
        yield Entry(GOALS, Level.WARN, "; ".join(owed), values)
        return
    message = f"The strategy approaches {progress.approached}." if progress.approached else "No goal is approached."
    yield Entry(GOALS, Level.OK, message, values)


def _warnings(snapshot: Snapshot) -> Entry:
    if not snapshot.warnings:
        return Entry(WARNINGS, Level.OK, "There are none.")
    message = " ".join(item.text for item in snapshot.warnings)
    return Entry(WARNINGS, Level.WARN, message, {item.code: item.text for item in snapshot.warnings})


def _devices(snapshot: Snapshot) -> Iterator[Entry]:
    for device in snapshot.devices:
        if not device.works:
            yield Entry(device.name, Level.ERROR, "The device is not there.")
        elif device.name == "drive" and snapshot.HasField("drive"):
            yield _drive(device.name, snapshot.drive)
        else:
            yield Entry(device.name, Level.OK, "The device works.")


def _drive(name: str, drive: DriveState) -> Entry:
    values = {"torque": "on" if drive.is_torque_on else "off"}
    for field_name, unit in (("battery_v", "V"), ("temperature_c", "degrees Celsius")):
        if drive.HasField(field_name):
            values[field_name.partition("_")[0]] = f"{getattr(drive, field_name):.1f} {unit}"
    values |= {button: "pressed" for button, is_pressed in sorted(drive.buttons.items()) if is_pressed}
    if drive.faults:
        return Entry(name, Level.ERROR, f"Motor faults: {', '.join(drive.faults)}.", values)
    return Entry(name, Level.OK, "The device works.", values)
