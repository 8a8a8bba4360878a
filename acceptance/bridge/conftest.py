"""Robots of the tests of the bridge in real time."""

from collections.abc import Iterator

import pytest

from robosc_simulated import SimulatedTurtleBot3
from support.real_time import preferred


@pytest.fixture
def robot() -> Iterator[SimulatedTurtleBot3]:
    """Simulated TurtleBot3 that goes before other programs of the machine."""
    with preferred(), SimulatedTurtleBot3("burger", "opencr", "lds01") as made:
        yield made
