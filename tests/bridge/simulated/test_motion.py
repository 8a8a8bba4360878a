"""The record of a motion, its checks and its picture: good motions pass, and each check fails on bad ones."""

import io
import json
import math
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import (
    BODIES,
    Goal,
    Motion,
    MotionError,
    MotionRecorder,
    Obstacle,
    Scene,
    Timebase,
    Track,
    Walls,
    World,
    load_scene,
    read_motion,
    room,
)
from robosc_simulated.map_picture import draw_map, outlined
from robosc_simulated.motion import Sample
from robosc_simulated.motion_checks import Halt, check_line, check_maze, lateral_errors_m, way_m

YARD = Scene(
    "yard",
    room(4.0, 2.0),
    goal=Goal(1.0, 0.0, 0.2),
    line=Track([(-1.5, 0.0), (1.5, 0.0)]),
    obstacles=(Obstacle("box", 1.5, 0.5, 0.1),),
)
EPOCH_S = 1_767_225_600.0


def drive(world: World, left_rad_s: float, right_rad_s: float, seconds: float) -> None:
    for wheel, goal_rad_s in ((world.left, left_rad_s), (world.right, right_rad_s)):
        wheel.is_driven, wheel.goal_rad_s = True, goal_rad_s
    world.time.advance(seconds)
    world.catch_up()


def recorded(scene: Scene, act: Callable[[World], None], path: Path, factor: float = 1.0) -> Motion:
    world = World(BODIES["burger"], scene, Timebase(ManualClock(epoch_s=EPOCH_S), factor))
    with path.open("w") as stream:
        recorder = MotionRecorder(world, stream)
        act(world)
        recorder.close()
        drive(world, 1.0, 1.0, 0.5)
    return read_motion(path)


def there(world: World) -> None:
    """0.2 m/s to the goal, and a second of rest."""
    drive(world, 0.2 / 0.033, 0.2 / 0.033, 4.5)
    drive(world, 0.0, 0.0, 1.0)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "motion.jsonl"


def test_a_motion_is_sampled_every_50_ms_of_the_world(path: Path) -> None:
    motion = recorded(YARD, there, path)
    assert [sample.world_s for sample in motion.samples] == pytest.approx([0.05 * index for index in range(111)])
    assert [sample.time for sample in motion.samples[:3]] == pytest.approx([EPOCH_S, EPOCH_S + 0.05, EPOCH_S + 0.1])
    middle, last = motion.samples[60], motion.samples[-1]
    assert (middle.linear_m_s, middle.angular_rad_s) == pytest.approx((0.2, 0.0), abs=0.001)
    assert (last.x_m, last.y_m, last.heading_rad) == pytest.approx((0.9, 0.0, 0.0), abs=0.01)
    assert (last.linear_m_s, last.collisions) == (0.0, 0)
    (goal,) = motion.happenings
    assert goal.happening == "goal"
    assert goal.x_m == pytest.approx(0.8, abs=0.002)
    assert goal.world_s == pytest.approx(4.0, abs=0.05)


def test_time_is_the_clocks_also_where_the_world_is_faster(path: Path) -> None:
    motion = recorded(YARD, lambda world: drive(world, 1.0, 1.0, 0.5), path, factor=10.0)
    assert motion.samples[-1].world_s == pytest.approx(5.0)
    assert motion.samples[-1].time == pytest.approx(EPOCH_S + 0.5)
    assert motion.samples[20].time == pytest.approx(EPOCH_S + 0.1)


def test_turns_are_recorded(path: Path) -> None:
    motion = recorded(YARD, lambda world: drive(world, -2.0, 2.0, 3.0), path)
    assert motion.samples[-1].angular_rad_s == pytest.approx(4.0 * 0.033 / 0.160, abs=0.001)
    assert motion.samples[-1].linear_m_s == 0.0


def test_what_happens_is_recorded(path: Path) -> None:
    def act(world: World) -> None:
        world.move_obstacle("box", 0.5, 0.0)
        drive(world, 6.0, 6.0, 4.0)
        world.put_obstacle("box", False)
        drive(world, -6.0, -6.0, 12.0)

    motion = recorded(YARD, act, path)
    found = [(event.happening, event.name, event.is_there) for event in motion.happenings]
    assert found == [
        ("obstacle", "box", True), ("collision", "box", True), ("obstacle", "box", False), ("collision", "", True),
    ]  # fmt: skip
    assert (motion.happenings[0].x_m, motion.happenings[0].radius_m) == (0.5, 0.1)
    assert motion.samples[-1].collisions == 2


@pytest.mark.parametrize("seconds", [0.1, 0.12])
def test_the_last_sample_is_where_it_was_put_at_last(path: Path, seconds: float) -> None:
    def act(world: World) -> None:
        drive(world, 0.0, 0.0, seconds)
        world.place(1.0, 0.5, 0.0)

    samples = recorded(YARD, act, path).samples
    assert [sample.world_s for sample in samples] == pytest.approx([0.0, 0.05, 0.1, seconds])
    assert (samples[-2].x_m, samples[-1].x_m, samples[-1].y_m) == (0.0, 1.0, 0.5)


def test_a_line_is_written_at_once() -> None:
    world = World(BODIES["burger"], YARD, Timebase(ManualClock()))
    stream = io.StringIO()
    recorder = MotionRecorder(world, stream)
    drive(world, 1.0, 1.0, 0.11)
    assert stream.getvalue().count("\n") == 3
    assert json.loads(stream.getvalue().splitlines()[-1])["world_s"] == 0.1
    recorder.close()


GOOD = '{"time":1,"world_s":1,"x_m":0,"y_m":0,"heading_rad":0,"linear_m_s":0,"angular_rad_s":0,"collisions":0}\n'


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("{}\n", r":1: is not an entry of a motion record: .*missing required field"),
        (GOOD + GOOD.replace('"x_m":0', '"x_m":"a"'), r":2: is not an entry"),
        (GOOD + GOOD.replace('"x_m":0', '"x_m":1e999'), r":2: is not an entry"),
        (GOOD + GOOD.replace('"collisions":0', '"collisions":-1'), r":2: is not an entry"),
        (GOOD + GOOD.replace('"world_s":1', '"world_s":0.5'), r":2: goes back in time"),
        (GOOD + '{"time":1,"world_s":1,"happening":"party","x_m":0,"y_m":0}\n', r":2: is not an entry"),
        (GOOD + "x" * 5000 + "\n", r":2: is longer than 4096 bytes"),
        (GOOD + "\xff\n", r":2: is not an entry"),
    ],
)
def test_what_is_no_record_is_reported_with_its_line(text: str, problem: str, path: Path) -> None:
    path.write_text(text, encoding="latin-1")
    with pytest.raises(MotionError, match=problem) as caught:
        read_motion(path)
    assert "\n" not in str(caught.value)


def test_a_record_that_was_cut_off_is_read_so_far(path: Path) -> None:
    path.write_text(GOOD + GOOD[:40])
    assert len(read_motion(path).samples) == 1


def test_no_file_is_reported(path: Path) -> None:
    with pytest.raises(MotionError, match="there is no such file"):
        read_motion(path)
    with pytest.raises(MotionError, match="is not a regular file"):
        read_motion(path.parent)


def test_who_comes_to_the_goal_without_touching_is_right(path: Path) -> None:
    assert check_maze(YARD, recorded(YARD, there, path)) == ()


def test_who_is_not_at_the_goal_is_reported(path: Path) -> None:
    motion = recorded(YARD, lambda world: drive(world, 6.0, 6.0, 3.0), path)
    (fault,) = check_maze(YARD, motion)
    assert fault.startswith("it was never at the goal; at the end, 3.00 s, it is 0.4")


def test_who_touches_a_wall_on_the_way_is_reported(path: Path) -> None:
    def act(world: World) -> None:
        drive(world, -6.0, -6.0, 10.0)
        drive(world, 6.0, 6.0, 15.0)

    (fault,) = check_maze(YARD, recorded(YARD, act, path))
    assert fault.startswith("it has touched something 1 times, first at 9.6")
    assert fault.endswith(": a wall")


def test_walls_and_obstacles_are_measured_again(path: Path) -> None:
    """A simulator that counts no collisions is found out."""
    motion = recorded(YARD, there, path)
    nearer = replace(YARD, walls=Walls([*YARD.walls.segments, (0.3, 0.05, 0.4, 0.05)]))
    (fault,) = check_maze(nearer, motion)
    assert "its middle is 0.10" in fault or "its middle is 0.09" in fault
    other = replace(YARD, obstacles=(Obstacle("bin", 0.5, 0.19, 0.1),))
    (fault,) = check_maze(other, motion)
    assert fault.endswith("it is where the obstacle 'bin' is")
    assert check_maze(replace(YARD, obstacles=(Obstacle("bin", 0.5, 0.19, 0.1, False),)), motion) == ()


def test_obstacles_count_from_when_they_are_there(path: Path) -> None:
    def act(world: World) -> None:
        world.put_obstacle("box", False)
        drive(world, 6.0, 6.0, 2.0)
        world.move_obstacle("box", 0.1, 0.0)
        drive(world, 6.0, 6.0, 3.0)

    # It stands where the robot was, and is no longer.
    assert check_maze(YARD, recorded(YARD, act, path)) == ()


def test_a_robot_that_was_carried_is_reported(path: Path) -> None:
    def act(world: World) -> None:
        drive(world, 6.0, 6.0, 1.0)
        world.place(0.9, 0.0, 0.0)
        drive(world, 0.0, 0.0, 0.5)

    (fault,) = check_maze(YARD, recorded(YARD, act, path))
    assert "moved by hand, or time is missing" in fault


def test_nothing_is_no_success() -> None:
    empty = Motion((), ())
    assert check_maze(YARD, empty) == ("nothing was recorded",)
    assert check_line(YARD, empty) == ("nothing was recorded",)


def test_a_record_with_a_hole_is_no_success(path: Path) -> None:
    motion = recorded(YARD, there, path)
    assert check_maze(YARD, motion) == ()
    hole = [sample for sample in motion.samples if not 4.8 < sample.world_s < 5.2]
    (fault,) = check_maze(YARD, Motion(tuple(hole), motion.happenings))
    assert fault == "nothing was recorded from 4.80 s to 5.20 s"


def test_a_record_that_its_writer_did_not_end_is_no_success(path: Path) -> None:
    recorded(YARD, there, path)
    lines = path.read_bytes().splitlines(keepends=True)
    assert b'"end"' in lines[-1]
    path.write_bytes(b"".join(lines[:-1]))
    assert check_maze(YARD, read_motion(path)) == (
        "the record has no end: whoever wrote it was killed, or had no room",
    )


def test_scenes_without_goal_or_line_are_not_judged() -> None:
    bare = Scene("bare", Walls(()))
    for check in (check_maze, check_line, lateral_errors_m):
        with pytest.raises(ValueError, match="bare has no"):
            check(bare, Motion((), ()))


def follow(world: World) -> None:
    drive(world, 6.0, 6.0, 2.0)
    drive(world, 0.0, 0.0, 3.0)
    drive(world, 6.0, 6.0, 2.0)


def test_who_keeps_to_the_line_and_stands_when_commanded_is_right(path: Path) -> None:
    motion = recorded(YARD, follow, path)
    assert check_line(YARD, motion, (Halt(2.0, 5.0, "the stop button"),), least_m=0.7) == ()
    assert max(lateral_errors_m(YARD, motion)) < 1e-6
    assert way_m(motion) == pytest.approx(0.79, abs=0.02)


def test_not_standing_when_commanded_is_reported(path: Path) -> None:
    motion = recorded(YARD, follow, path)
    (fault,) = check_line(YARD, motion, (Halt(1.5, 7.0, "an obstacle"),))
    assert fault.startswith("at 5.05 s it moves at")
    assert fault.endswith("since 1.50 s it was to stand still for an obstacle")
    # Or too late.
    (fault,) = check_line(YARD, motion, (Halt(1.5, 5.0, "an obstacle"),), settle_s=0.2)
    assert fault.startswith("at 1.70 s it moves at 0.198 m/s")


def test_a_halt_that_was_not_recorded_is_reported(path: Path) -> None:
    motion = recorded(YARD, follow, path)
    (fault,) = check_line(YARD, motion, (Halt(20.0, 25.0, "an obstacle"),))
    assert "there is no sample of that" in fault


def test_who_turns_on_the_spot_does_not_stand(path: Path) -> None:
    motion = recorded(YARD, lambda world: drive(world, -1.0, 1.0, 3.0), path)
    (fault,) = check_line(YARD, motion, (Halt(0.0, 3.0, "the stop button"),))
    assert "rad/s" in fault


def test_who_leaves_the_line_is_reported(path: Path) -> None:
    motion = recorded(YARD, lambda world: drive(world, 5.0, 6.0, 4.0), path)
    (fault,) = check_line(YARD, motion)
    assert fault.startswith("at 4.00 s it is 0.")
    assert fault.endswith("m beside the line; 0.08 m are allowed")
    assert check_line(YARD, motion, lateral_m=2.0) == ()


def test_who_never_drives_is_reported(path: Path) -> None:
    motion = recorded(YARD, lambda world: drive(world, 0.0, 0.0, 4.0), path)
    assert check_line(YARD, motion) == ()
    (fault,) = check_line(YARD, motion, least_m=0.5)
    assert fault == "it has driven 0.00 m in all; 0.5 m were to be driven"


def test_a_map_shows_the_way(path: Path, tmp_path: Path) -> None:
    def act(world: World) -> None:
        drive(world, 5.0, 6.0, 4.0)
        drive(world, 6.0, 6.0, 8.0)

    motion = recorded(YARD, act, path)
    assert motion.samples[-1].collisions
    picture, text = tmp_path / "map.png", tmp_path / "map.svg"
    draw_map(YARD, motion, picture)
    shown = cv2.imread(str(picture))
    assert shown is not None
    assert min(shown.shape[:2]) > 200

    # The way is blue: of the colour there is something where the robot was, and nothing on a map of the scene alone.
    def blue(place: Path) -> int:
        pixels = np.asarray(cv2.imread(str(place)), dtype=np.int64)
        return int(((pixels[..., 0] > 150) & (pixels[..., 2] < 60)).sum())

    bare = tmp_path / "bare.png"
    draw_map(YARD, None, bare)
    assert blue(picture) > blue(bare) + 200
    draw_map(YARD, motion, text)
    root = ET.parse(text).getroot()
    assert root.tag.endswith("svg")
    again = tmp_path / "again.svg"
    draw_map(YARD, motion, again)
    assert again.read_bytes() == text.read_bytes()
    with pytest.raises(ValueError, match=r"drawn as .png, .svg, .pdf, not as .bmp"):
        draw_map(YARD, motion, tmp_path / "map.bmp")


def test_maps_of_all_scenes_of_the_package_can_be_drawn(tmp_path: Path) -> None:
    for name in ("maze-rooms", "line-curves", "room"):
        draw_map(load_scene(name), None, tmp_path / f"{name}.svg")
        assert (tmp_path / f"{name}.svg").stat().st_size > 5000


def test_a_sample_has_the_keys_of_its_page() -> None:
    sample = Sample(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8)
    keys = ["time", "world_s", "x_m", "y_m", "heading_rad", "linear_m_s", "angular_rad_s", "collisions"]
    assert list(msgspec.to_builtins(sample)) == keys
    assert math.isfinite(sample.time)


def test_the_robot_is_drawn_at_like_distances() -> None:
    def at(x_m: float) -> Sample:
        return Sample(EPOCH_S, 0.0, x_m, 0.0, 0.0, 0.0, 0.0, 0)

    short = outlined([at(0.01 * number) for number in range(101)], 0.1)
    assert [round(each.x_m, 2) for each in short] == [0.0, 0.5, 1.0]
    assert [each.x_m for each in outlined([at(0.0)] * 50, 0.1)] == [0.0, 0.0]
    long = outlined([at(0.05 * number) for number in range(10_001)], 0.1)
    assert len(long) <= 26
    gaps_m = [after.x_m - before.x_m for before, after in pairwise(long)]
    assert min(gaps_m) > 0.2
    assert max(gaps_m) < 22.0


def test_a_robot_is_drawn_to_scale_with_its_heading(path: Path, tmp_path: Path) -> None:
    motion = recorded(YARD, lambda world: drive(world, 2.0, 2.0, 4.0), path)
    drawn = {}
    for robot in ("burger", "waffle"):
        picture = tmp_path / f"{robot}.svg"
        draw_map(YARD, motion, picture, robot)
        drawn[robot] = picture.read_text(encoding="utf-8")
    assert drawn["burger"] != drawn["waffle"]
    assert "<!-- robot, to scale -->" in drawn["burger"]
