"""A generated ROS 2 node takes a thousand messages a second: the short form of `tests/benchmarks/message_flood.py`."""

import sys
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")

pytestmark = pytest.mark.ros2

sys.path.append(str(Path(__file__).parents[2] / "tests" / "benchmarks"))

from message_flood import soak  # noqa: E402  # A folder of programs, not on the path of tests.

DEPTH = 5000
"""Deeper than what is sent is long: a machine that is busy with others must not make the test fail."""
ALLOWED_GROWTH_KB = 20_000


def test_a_thousand_messages_a_second_are_all_taken() -> None:
    found = soak(2.0, DEPTH)
    assert found.received == found.sent == 2000
    assert found.dropped == 0
    begin, end = found.resident_kb
    assert end - begin < ALLOWED_GROWTH_KB, found
