"""Tests of the meaning of each command, and of the motion that set-points ask for."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.daemon.states import OperatorCommand
from robosc_bridge.devices.interface import STANDSTILL, Velocity
from robosc_bridge.ground_station.commands import (
    Change,
    Checks,
    Interval,
    Meaning,
    Once,
    Refusal,
    Stop,
    meaning,
    mode_meaning,
)
from robosc_bridge.ground_station.driving import (
    Unusable,
    drive_data,
    drive_message,
    from_manual_control,
    from_position_target,
)
from robosc_bridge.protocol.mavlink_messages import Mode, Result
from support.ground import MODEL, PlayedDaemon, Station


def _meaning(number: int, *parameters: float) -> Meaning:
    first, second, third, fourth, fifth, sixth, seventh = (*parameters, *(0.0,) * (7 - len(parameters)))
    return meaning(number, (first, second, third, fourth, fifth, sixth, seventh))


@pytest.mark.parametrize(
    ("number", "parameters", "expected"),
    [
        (400, (1.0,), Change(OperatorCommand.START)),
        (400, (1.0, 21196.0), Change(OperatorCommand.START)),
        (400, (0.0,), Stop.STANDBY),
        (400, (0.0, 21196.0), Stop.STANDBY),
        (400, (0.0, math.nan), Stop.STANDBY),
        (176, (1.0, 4.0), Stop.OPERATOR),
        (176, (1.0, 10.0), Change(OperatorCommand.RESUME, Mode.AUTO)),
        (176, (1.0, 15.0), Change(OperatorCommand.RESUME, Mode.GUIDED)),
        (176, (209.0, 15.0), Change(OperatorCommand.RESUME, Mode.GUIDED)),
        (176, (4.0, 0.0), Change(OperatorCommand.RESUME)),
        (176, (math.nan, 4.0), Stop.OPERATOR),
        (185, (1.0,), Stop.OPERATOR),
        (185, (math.nan,), Stop.OPERATOR),
        (193, (0.0,), Stop.OPERATOR),
        (193, (1.0,), Change(OperatorCommand.RESUME)),
        (246, (1.0,), Change(OperatorCommand.RESET)),
        (401, (), Checks()),
        (511, (331.0, 50_000.0), Interval(331, 0.05)),
        (511, (331.0, 1.0), Interval(331, 0.02)),
        (511, (331.0, math.inf), Interval(331, 3600.0)),
        (511, (331.0, 0.0), Interval(331, None)),
        (511, (331.0, -1.0), Interval(331, math.inf)),
        (512, (148.0,), Once(148)),
        (520, (1.0,), Once(148)),
    ],
)
def test_commands_mean(number: int, parameters: tuple[float, ...], expected: Meaning) -> None:
    assert _meaning(number, *parameters) == expected


@pytest.mark.parametrize(
    ("number", "parameters", "result"),
    [
        (400, (2.0,), Result.DENIED),
        (400, (math.nan,), Result.DENIED),
        (400, (1.0, 1.0), Result.DENIED),
        (176, (1.0, 0.0), Result.DENIED),
        (176, (1.0, 99.0), Result.DENIED),
        (176, (1.0, math.nan), Result.DENIED),
        (176, (64.0, 0.0), Result.DENIED),
        (176, (math.inf, 10.0), Result.DENIED),
        (185, (0.0,), Result.DENIED),
        (193, (2.0,), Result.DENIED),
        (246, (0.0,), Result.DENIED),
        (246, (2.0,), Result.UNSUPPORTED),
        (246, (0.0, 1.0), Result.UNSUPPORTED),
        (511, (-1.0, 100.0), Result.DENIED),
        (511, (331.0, -2.0), Result.DENIED),
        (511, (331.0, math.nan), Result.DENIED),
        (512, (math.inf,), Result.DENIED),
        (520, (0.0,), Result.DENIED),
        (410, (), Result.UNSUPPORTED),
        (192, (), Result.UNSUPPORTED),
        (519, (1.0,), Result.UNSUPPORTED),
        (60000, (), Result.UNSUPPORTED),
    ],
)
def test_others_are_refused(number: int, parameters: tuple[float, ...], result: Result) -> None:
    found = _meaning(number, *parameters)
    assert isinstance(found, Refusal)
    assert found.result is result
    assert found.why or result is Result.UNSUPPORTED


def test_a_refused_mode_is_named() -> None:
    found = mode_meaning(1.0, 11.0)
    assert found == Refusal(Result.DENIED, "There is no mode RTL here; there are HOLD, AUTO and GUIDED.")


@given(st.integers(0, 65535), st.tuples(*[st.floats(width=32)] * 7))
def test_every_command_means_something(number: int, parameters: tuple[float, ...]) -> None:
    _meaning(number, *parameters)


@given(st.floats(), st.tuples(*[st.floats()] * 6))
def test_disarming_is_never_refused(force: float, others: tuple[float, ...]) -> None:
    assert _meaning(400, 0.0, force, *others[:5]) is Stop.STANDBY
    assert _meaning(176, force, 4.0) is Stop.OPERATOR


def _target(mask: int, frame: int = 8, vx: float = 0.0, vy: float = 0.0, yaw_rate: float = 0.0) -> Any:
    library = Station().codec
    return library.set_position_target_local_ned_encode(0, 1, 1, frame, mask, 9, 9, 9, vx, vy, 7, 5, 5, 5, 4, yaw_rate)


@pytest.mark.parametrize(
    ("mask", "expected"),
    [
        (0x05E7, Velocity(0.1, -0.5)),
        (0x05C7, Velocity(0.1, -0.5)),
        (0x05FF, Velocity(0.0, -0.5)),
        (0x0DE7, Velocity(0.1, 0.0)),
    ],
)
@pytest.mark.parametrize("frame", [8, 9, 12])
def test_set_points(mask: int, expected: Velocity, frame: int) -> None:
    assert from_position_target(_target(mask, frame, 0.1, 0.0, 0.5)) == expected


@pytest.mark.parametrize(
    ("mask", "frame", "vx", "vy", "yaw_rate", "why"),
    [
        (0x0DFC, 8, 0.1, 0.0, 0.0, "type mask"),
        (0x09FF, 8, 0.1, 0.0, 0.0, "type mask"),
        (0x0427, 8, 0.1, 0.0, 0.0, "type mask"),
        (0x07E7, 8, 0.1, 0.0, 0.0, "type mask"),
        (0x0DFF, 8, 0.1, 0.0, 0.0, "type mask"),
        (0x05E7, 1, 0.1, 0.0, 0.0, "frame"),
        (0x05E7, 8, 0.1, 0.1, 0.0, "sideways"),
        (0x05E7, 8, math.nan, 0.0, 0.0, "not a number"),
        (0x05E7, 8, 0.1, math.inf, 0.0, "not a number"),
        (0x05E7, 8, 0.1, 0.0, -math.inf, "not a number"),
    ],
)
def test_other_set_points_are_refused(mask: int, frame: int, vx: float, vy: float, yaw_rate: float, why: str) -> None:
    with pytest.raises(Unusable, match=why):
        from_position_target(_target(mask, frame, vx, vy, yaw_rate))


def test_a_stick() -> None:
    library = Station().codec
    fastest = Velocity(0.2, 2.0)
    assert from_manual_control(library.manual_control_encode(1, 500, 999, 999, 250, 0), fastest) == Velocity(0.1, -0.5)
    assert from_manual_control(library.manual_control_encode(1, 0, 0, 500, 0, 0), fastest) == STANDSTILL
    for x, r in ((32767, 0), (0, 32767), (-1001, 0)):
        with pytest.raises(Unusable, match="axis"):
            from_manual_control(library.manual_control_encode(1, x, 0, 0, r, 0), fastest)


def test_a_twist_has_the_shape_of_the_message() -> None:
    operations = PlayedDaemon().operations
    message = drive_message(operations.mapping)
    assert message is not None
    twist = {"linear": {"x": 0.1, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": -0.5}}
    assert drive_data(operations.model, message, Velocity(0.1, -0.5)) == twist
    stamped = MODEL.replace("type: Twist links", "type: Stamped links").replace(
        "datatype enum", "datatype object Stamped { twist: Twist } datatype enum"
    )
    stamped = stamped.replace("with { linear: { x: 0.1 } }", "with { twist: { linear: { x: 0.1 } } }")
    operations = PlayedDaemon(model=stamped).operations
    message = drive_message(operations.mapping)
    assert message is not None
    assert drive_data(operations.model, message, Velocity(0.1, -0.5)) == {"twist": twist}
