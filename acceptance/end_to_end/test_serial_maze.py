"""Out of mazes over serial lines: server, client, bridge and robot as processes, judged by motion and by the log."""

from collections.abc import Callable
from pathlib import Path

import pytest

from robosc.event_logs import read_log
from robosc_experiments.maze import run_maze

pytestmark = pytest.mark.real_time

SPEED = 10.0


@pytest.mark.parametrize(("scene", "seed"), [("maze-rooms", 0), ("maze-spiral", 0), ("maze-random", 3)])
def test_the_robot_comes_out_without_touching_a_wall(
    scene: str, seed: int, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    said: list[str] = []
    outcome = run_maze(tmp_path / "run", scene, speed=SPEED, say=said.append, seed=seed)
    assert outcome.faults == ()
    assert outcome.figures["collisions"] == 0
    assert outcome.figures["speed"] > 2.0
    requests = {entry.event for entry in read_log(outcome.event_log).events if entry.is_controllable}
    assert {"move.request", "rotate_left.request"} <= requests
    assert any("s of the world" in text for text in said)
    record_property(scene, f"{outcome.figures['way_m']:.1f} m at {outcome.figures['speed']:.1f} times real time")
