"""Tests of what diagnostics say about snapshots."""

import pytest

from robosc_api.v1 import bridge_pb2 as pb
from robosc_bridge.ros2.diagnostics import Entry, Level, Link, entries

LINK = Link("robot:50061", "Porter", "1.2")
GONE = Link("robot:50061", "Porter", "1.2", "no bridge answers at robot:50061: refused")


def snapshot(**changes: object) -> pb.Snapshot:
    devices = [pb.DeviceState(name="drive", works=True), pb.DeviceState(name="scanner", works=True)]
    return pb.Snapshot(**{"state": pb.BRIDGE_STATE_RUNNING, "devices": devices, **changes})  # type: ignore[arg-type]


def entries_of(shown: pb.Snapshot | None, age_s: float = 0.1, link: Link = LINK) -> dict[str, Entry]:
    found = entries(link, shown, age_s)
    assert len({entry.name for entry in found}) == len(found)
    return {entry.name: entry for entry in found}


def test_a_robot_that_is_well() -> None:
    found = entries_of(snapshot(components=[pb.ComponentState(name="Desk", state="idle")], enabled=["drive", "show"]))
    assert {name: entry.level for name, entry in found.items()} == dict.fromkeys(
        ("bridge", "safety", "supervisor", "warnings", "drive", "scanner"), Level.OK
    )
    assert found["bridge"].values == {
        "address": "robot:50061", "robot": "Porter", "version": "1.2", "state": "running", "age_s": "0.1",
        "decisions left out": "0",
    }  # fmt: skip
    assert found["supervisor"].values == {"Desk": "idle", "allowed now": "drive, show", "cancelling": ""}


@pytest.mark.parametrize(
    ("changes", "name", "level", "words"),
    [
        ({"state": pb.BRIDGE_STATE_STANDBY}, "bridge", Level.OK, "standby"),
        ({"state": pb.BRIDGE_STATE_STARTING}, "bridge", Level.WARN, "starting"),
        ({"state": pb.BRIDGE_STATE_FAULT, "problem": "the drive is lost"}, "bridge", Level.ERROR, "the drive is lost"),
        ({"reasons": [pb.Notice(code="STANDBY", text="In standby.")]}, "safety", Level.OK, "In standby."),
        ({"reasons": [pb.Notice(code="SCAN_STALE", text="No scan.")]}, "safety", Level.WARN, "No scan."),
        (
            {
                "reasons": [
                    pb.Notice(code="STANDBY", text="In standby."),
                    pb.Notice(code="OPERATOR_STOP", text="Stopped.", holds_until_reset=True),
                ]
            },
            "safety",
            Level.ERROR,
            "In standby. Stopped.",
        ),
        ({"warnings": [pb.Notice(code="BATTERY", text="Low.")]}, "warnings", Level.WARN, "Low."),
        (
            {"components": [pb.ComponentState(name="Desk", state="idle")], "stops": ["'/order' is stale"]},
            "supervisor",
            Level.WARN,
            "Nothing is requested: '/order' is stale",
        ),
        ({"devices": [pb.DeviceState(name="camera")]}, "camera", Level.ERROR, "The device is not there."),
        ({"drive": pb.DriveState(faults=["overload"])}, "drive", Level.ERROR, "Motor faults: overload."),
    ],
)
def test_what_is_not_as_it_should_be(changes: dict[str, object], name: str, level: Level, words: str) -> None:
    entry = entries_of(snapshot(**changes))[name]
    assert (entry.level, entry.message) == (level, words)


def test_the_drive_reports_what_it_knows() -> None:
    drive = pb.DriveState(is_torque_on=True, battery_v=11.84, buttons={"button_1": True, "button_2": False})
    assert entries_of(snapshot(drive=drive))["drive"].values == {
        "torque": "on",
        "battery": "11.8 V",
        "button_1": "pressed",
    }


def test_a_loop_that_hangs_is_an_error_whatever_it_said_last() -> None:
    found = entries_of(snapshot(), age_s=2.5)
    assert (found["bridge"].level, found["bridge"].message) == (Level.ERROR, "The bridge's loop hangs, for 2.5 s.")
    assert {entry.level for name, entry in found.items() if name != "bridge"} == {Level.STALE}
    assert "scanner" in found


@pytest.mark.parametrize("shown", [None, snapshot()])
def test_a_bridge_that_is_gone_is_an_error_and_the_rest_is_stale(shown: pb.Snapshot | None) -> None:
    found = entries_of(shown, link=GONE)
    assert (found["bridge"].level, found["bridge"].message) == (Level.ERROR, GONE.problem)
    assert {entry.level for name, entry in found.items() if name != "bridge"} == {Level.STALE}
    assert ("scanner" in found) is (shown is not None)


def test_before_the_first_snapshot() -> None:
    assert [(entry.name, entry.level) for entry in entries(LINK, None, 0.0)] == [("bridge", Level.WARN)]
