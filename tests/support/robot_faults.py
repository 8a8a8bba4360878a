"""Faults of a robot that moves, and within which time each is stated to stop its wheels (docs/bridge-safety.md)."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from _pytest.mark import ParameterSet

from robosc_simulated import SimulatedTurtleBot3
from support.driven import Driven

PAGE = (Path(__file__).parents[2] / "docs" / "bridge-safety.md").read_text(encoding="utf-8")
TABLE = PAGE.partition("## Every fault, measured at the motors")[2]
STATED_S = {name: float(time_s) for name, time_s in re.findall(r"^\| ([^|]+?) \| ([0-9.]+) s \|", TABLE, re.MULTILINE)}
BASES = ("opencr", "dynamixel")


@dataclass(frozen=True)
class Fault:
    """A fault of a robot that moves.

    Attributes:
        row: Row of the table on the page.
        cause: Function that lets it happen.
        problem: Problem that the run ends with.
        bases: Bases where it can happen.
        is_line: True if the base itself is lost with it, which is reported to the model.
    """

    row: str
    cause: Callable[[Driven], object]
    problem: str
    bases: tuple[str, ...] = BASES
    is_line: bool = False


def wires(bridge: Driven, **faults: object) -> None:
    """Let something be wrong with the wire of the base."""
    for name, value in faults.items():
        setattr(bridge.robot.base_faults, name, value)


def speak(bridge: Driven, code: int) -> None:
    """Let the motors speak at another speed."""
    with bridge.robot.time.lock:
        for servo in (bridge.robot.left, bridge.robot.right):
            servo.table["baud rate"] = code


def answer_as(robot: SimulatedTurtleBot3, device_id: int | None) -> None:
    """Let the base answer by another id; None: by its own."""
    device = robot.opencr or robot.bus
    assert device is not None
    device.answers_as = device_id


def empty(bridge: Driven) -> None:
    """Let the battery be empty."""
    stop_v = bridge.limits.battery_stop_v
    if stop_v is None:
        assert bridge.robot.rover is not None
        bridge.robot.rover.charge_state = 3
        return
    for servo in (bridge.robot.left, bridge.robot.right):
        servo.brown_out(stop_v - 0.05)
    if bridge.robot.opencr is not None:
        bridge.robot.opencr.set_battery(stop_v - 0.05)


def steer(bridge: Driven) -> None:
    """Let OpenCR's own remote control steer, too."""
    assert bridge.robot.opencr is not None
    bridge.robot.opencr.steer(0.04, 0.0)


# Faults that a person must see to.
GRAVE = (
    Fault("a motor is overloaded", lambda bridge: bridge.robot.left.overload(), "A motor reports a fault."),
    Fault("a motor is too hot", lambda bridge: bridge.robot.right.overheat(), "A motor reports a fault."),
    Fault(
        "a motor has lost its power",
        lambda bridge: bridge.robot.right.brown_out(0.0),
        "motor 2 (right) does not answer",
        ("dynamixel",),
        is_line=True,
    ),
    Fault(
        "a motor behind OpenCR is mute",
        lambda bridge: bridge.robot.right.brown_out(0.0),
        "OpenCR answers too slowly, as when a wheel servo does not answer it: it may be disconnected",
        ("opencr",),
        is_line=True,
    ),
    Fault("OpenCR's remote control steers", steer, "The wheels rotate without a command", ("opencr",)),
    Fault("a wheel is held", lambda bridge: bridge.robot.left.block_wheel(), "A motor reports a fault."),
    Fault("the battery is empty", empty, "The battery is empty.", (*BASES, "mavlink-rover")),
    Fault("the base is unplugged", lambda bridge: bridge.robot.base_line.disconnect(), "the drive base is lost: /",
          is_line=True),
    Fault("the base hears nothing", lambda bridge: wires(bridge, is_deaf=True), " not answer", is_line=True),
    Fault("its answers are lost", lambda bridge: wires(bridge, drop_share=1.0), " not answer", is_line=True),
    Fault("its answers are damaged", lambda bridge: wires(bridge, corrupt_share=1.0), " not answer", is_line=True),
    Fault("its answers are cut", lambda bridge: wires(bridge, cut_next=10**9), " not answer", is_line=True),
    Fault("another id answers", lambda bridge: answer_as(bridge.robot, 7), " not answer, but device 7 does",
          is_line=True),
    Fault("it speaks at another baud", lambda bridge: speak(bridge, 1), " not answer", ("dynamixel",), is_line=True),
)  # fmt: skip


def cases(faults: tuple[Fault, ...]) -> list[ParameterSet]:
    """Return a parameter for each fault on each base where it can happen."""
    return [
        pytest.param(base, fault, id=f"{base}-{fault.row.replace(' ', '-')}")
        for fault in faults
        for base in fault.bases
    ]
