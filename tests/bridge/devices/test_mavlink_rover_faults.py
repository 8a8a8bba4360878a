"""Faults of the line to a MAVLink rover, and signing."""

import math

import pytest

from robosc_bridge.devices.robots import Body


@pytest.mark.parametrize("values", [(0.0, 1.0, 0.3), (0.5, math.nan, 0.3), (0.5, 1.0, -1.0)])
def test_a_body_needs_numbers(values: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="must be a positive number"):
        Body(*values)
