"""The motion beside a log that is replayed: where the robot was at each time, in the coordinates of the map."""

import asyncio
import json
import math
from pathlib import Path
from random import Random
from typing import Any

import pytest

from robosc.event_logs import read_log
from robosc.motion_record import Motion, Sample
from robosc_view.motion import MOST_POINTS, MotionTrace
from robosc_view.replay import Recording, Replay
from robosc_view.reports import Drive, Status
from robosc_view.scene_map import scene_map, scene_start
from robosc_view.sources import Seek
from support.live import large_model, supervisor_without_synthesis

BEGIN_S = 1.7e9


def sample(time_s: float, x_m: float, y_m: float = 0.0, heading_rad: float = 0.0) -> Sample:
    return Sample(BEGIN_S + time_s, 10 * time_s, x_m, y_m, heading_rad, 0.1, -0.2, 0)


def test_the_pose_is_that_of_the_last_sample() -> None:
    """The twin goes through all samples."""
    chance = Random(1)
    samples = tuple(sample(number * 0.05, float(number)) for number in range(100))
    seen = MotionTrace(Motion(samples, ()))
    for _ in range(200):
        time_s = BEGIN_S + chance.uniform(-0.5, 6.0)
        before = [each for each in samples if each.time <= time_s]
        expected = Drive((before[-1].x_m, 0.0, 0.0), 0.1, -0.2, None, None) if before else None
        assert seen.drive(time_s) == expected


def test_the_map_begins_where_the_scene_does() -> None:
    seen = MotionTrace(
        Motion((sample(0.0, 1.0, 2.0, math.pi / 2), sample(1.0, 1.0, 5.0, math.pi)), ()), (1.0, 2.0, math.pi / 2)
    )
    first, last = seen.drive(BEGIN_S), seen.drive(BEGIN_S + 1.0)
    assert first is not None
    assert last is not None
    assert first.pose == pytest.approx((0.0, 0.0, 0.0))
    assert last.pose == pytest.approx((3.0, 0.0, math.pi / 2))
    assert seen.way() == [[0.0, 0.0], [3.0, 0.0], [3.0, 0.0]]


def test_a_sample_at_the_start_of_a_scene_is_the_origin_of_its_map() -> None:
    x_m, y_m, heading_rad = scene_start("maze-rooms")
    drive = MotionTrace(Motion((sample(0.0, x_m, y_m, heading_rad),), ()), (x_m, y_m, heading_rad)).drive(BEGIN_S)
    assert drive is not None
    assert drive.pose == pytest.approx((0.0, 0.0, 0.0))
    assert scene_map("maze-rooms") is not None
    assert scene_start(None) == (0.0, 0.0, 0.0)


def test_a_long_way_is_thinned_and_keeps_its_end() -> None:
    way = MotionTrace(Motion(tuple(sample(number * 0.05, float(number)) for number in range(9000)), ())).way()
    assert len(way) <= MOST_POINTS + 1
    assert (way[0], way[-1]) == ([0.0, 0.0], [8999.0, 0.0])


class _Shown:
    """Sink that keeps the states it is shown."""

    def __init__(self) -> None:
        self.drives: list[Drive | None] = []
        self.scene: Any = None

    async def define(self, robot: Any) -> None:
        self.scene = robot.scene

    def show(self, status: Status) -> None:
        self.drives.append(status.drive)

    def __getattr__(self, name: str) -> Any:
        return lambda *arguments, **named: None


async def test_a_replay_shows_the_robot_where_it_was(tmp_path: Path) -> None:
    supervisor = supervisor_without_synthesis(large_model(2))
    log = tmp_path / "run.jsonl"
    entries = [{"time": BEGIN_S + time_s, "kind": "release", "identifier": "/x"} for time_s in (0.0, 2.0)]
    log.write_text("".join(json.dumps(entry) + "\n" for entry in entries), encoding="utf-8")
    motion = MotionTrace(Motion((sample(0.0, 0.0), sample(1.0, 3.0)), ()))
    replay, sink = Replay(Recording(read_log(log), supervisor, None, motion)), _Shown()
    running = asyncio.create_task(replay.run(sink))
    while not sink.drives:
        await asyncio.sleep(0)
    replay.control_replay(Seek(BEGIN_S + 1.5))
    while len(sink.drives) < 2:
        await asyncio.sleep(0)
    running.cancel()
    assert [drive.pose[0] for drive in sink.drives if drive is not None] == [0.0, 3.0]
    assert sink.scene == {"walls": [], "line": [], "way": [[0.0, 0.0], [3.0, 0.0], [3.0, 0.0]]}
    assert Recording(read_log(log), supervisor).robot.scene is None
