"""Wheel commands in the data of messages."""

import math
from typing import Any

import pytest

from robosc.execution.runtime.protocol import DataDoesNotFit
from robosc_bridge.daemon.channel_data import angle_of, finite, is_default, velocity_of
from robosc_bridge.devices.interface import Velocity


@pytest.mark.parametrize(
    ("message", "velocity"),
    [
        ({"linear": {"x": 0.25}, "angular": {"z": -1.5}}, Velocity(0.25, -1.5)),
        ({"header": {}, "twist": {"linear": {"x": 0.25}, "angular": {"z": -1.5}}}, Velocity(0.25, -1.5)),
        ({"linear": {"x": 1}}, Velocity(1.0, 0.0)),
        ({"twist": None}, Velocity(0.0, 0.0)),
        ({"linear": None, "angular": {"z": None}}, Velocity(0.0, 0.0)),
        (None, Velocity(0.0, 0.0)),
    ],
)
def test_velocities(message: Any, velocity: Velocity) -> None:
    assert velocity_of(message) == velocity


@pytest.mark.parametrize(
    ("message", "angle"), [(90, 90.0), ({"data": 1.5}, 1.5), ({"angle": -2}, -2.0), ({}, 0.0), (None, 0.0)]
)
def test_angles(message: Any, angle: float) -> None:
    assert angle_of(message) == angle


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    "where", [lambda x: x, lambda x: {"linear": {"x": 1.0, "y": x}}, lambda x: [1.0, (2, {"level": x})]]
)
def test_a_number_that_is_not_finite_is_found_wherever_it_is(where: Any, number: float) -> None:
    with pytest.raises(DataDoesNotFit, match=r"^'/cmd_vel' has a number that is not finite$"):
        finite("/cmd_vel", where(number))
    sound = where(0.5)
    assert finite("/cmd_vel", sound) is sound


def test_defaults() -> None:
    assert is_default({"linear": {"x": 0.0, "y": 0}, "text": "", "list": [], "none": None})
    assert not is_default({"linear": {"x": 0.0, "y": 1e-9}})
