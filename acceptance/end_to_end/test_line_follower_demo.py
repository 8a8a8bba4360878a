"""The line follower on ROS 2, run as the tutorial runs it: it passes, and it leaves nothing behind."""

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.demonstration import Demonstration, demonstration

pytest.importorskip("rclpy", reason="it needs ROS 2 (the ros2 extra)")

LIMIT_S = 120.0

pytestmark = [pytest.mark.ros2, pytest.mark.real_time]


@pytest.fixture
def demo(tmp_path: Path) -> Iterator[Demonstration]:
    with demonstration("line_follower.py", folder=tmp_path / "temporary", limit_s=LIMIT_S) as found:
        yield found


def test_it_passes_and_leaves_nothing(demo: Demonstration) -> None:
    output = demo.passes()
    assert "passed: it moved only with a line" in output
    assert "move.request" in output
    for cause in ("line lost", "obstacle", "stop button"):
        assert f"{cause}: at rest after" in output


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_ctrl_c_or_a_closed_terminal_stops_everything(demo: Demonstration, number: signal.Signals) -> None:
    demo.until("are running")
    demo.is_interrupted_by(number)
