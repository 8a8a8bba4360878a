"""The robot as ROS is shown it, without any ROS: what is due when, velocities, odometry, the pace of time."""

import argparse
import math
from collections import Counter

import numpy as np
import pytest

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import BODIES, Timebase, Walls, World, oval, room
from robosc_simulated.commands import UnknownCommandError
from robosc_simulated.ros import ros1
from robosc_simulated.ros.commands import HELP, execute
from robosc_simulated.ros.readings import Battery, Clock, Odometry, Picture, Reading, Scan
from robosc_simulated.ros.robot import RosRobot
from robosc_simulated.ros.serving import LONGEST_S, PacedClock, Pacer, make_robot, parser
from robosc_simulated.scene import Noise, Obstacle, Scene, SceneError

STEP_S = 0.01


def robot_in(scene: Scene, factor: float = 1.0, **options: object) -> RosRobot:
    world = World(BODIES["burger"], scene, Timebase(ManualClock(), factor))
    return RosRobot(world, **options)  # type: ignore[arg-type]


def in_room(**options: object) -> RosRobot:
    return robot_in(Scene("room", room(4.0, 3.0)), **options)  # type: ignore[arg-type]


def lived(robot: RosRobot, seconds: float, velocity: tuple[float, float] | None = None) -> list[Reading]:
    """All messages while time passes, with a velocity that is repeated."""
    found: list[Reading] = []
    for _ in range(round(seconds / STEP_S)):
        if velocity is not None:
            robot.command(*velocity)
        robot.advance(STEP_S)
        found += robot.update()
    return found


def last[Kind](kind: type[Kind], readings: list[Reading]) -> Kind:
    return [reading for reading in readings if isinstance(reading, kind)][-1]


def test_everything_comes_as_often_as_from_a_turtlebot() -> None:
    robot = robot_in(Scene("oval", Walls(()), line=oval()), lidar="lds01")
    counts = Counter(type(reading) for reading in lived(robot, 10.0))
    assert counts[Clock] == pytest.approx(1000, abs=2)
    assert counts[Odometry] == pytest.approx(300, abs=2)
    assert counts[Scan] == pytest.approx(50, abs=1)
    assert counts[Picture] == pytest.approx(200, abs=2)
    assert counts[Battery] == pytest.approx(10, abs=1)


def test_a_fast_world_reports_its_time_a_hundred_times_a_second_of_the_clock() -> None:
    robot = robot_in(Scene("open", Walls(())), factor=20.0)
    counts = Counter(type(reading) for reading in lived(robot, 2.0))
    assert counts[Clock] == pytest.approx(200, abs=2)
    assert counts[Scan] == pytest.approx(200, abs=2)


def test_what_was_missed_is_not_made_up_for() -> None:
    robot = in_room()
    robot.update()
    robot.advance(3.0)
    found = robot.update()
    assert Counter(type(reading) for reading in found) == {Clock: 1, Odometry: 1, Scan: 1, Battery: 1}
    assert [reading.stamp_s for reading in found] == pytest.approx([3.0] * 4)
    assert robot.update() == []
    assert robot.due_s > 3.0


def test_a_scan_goes_around_and_says_what_is_too_far_or_too_near() -> None:
    walls = Walls(((1.0, -2.0, 1.0, 2.0), (-2.0, 0.2, 2.0, 0.2), (-2.0, -5.0, 2.0, -5.0)))
    robot = robot_in(Scene("walls", walls), lidar="lds02")
    ranges_m = last(Scan, lived(robot, 0.2)).ranges_m
    assert ranges_m.shape == (385,)
    # The scanner is behind the middle of the robot.
    assert ranges_m[0] == pytest.approx(1.0 + 0.032, abs=1e-6)
    # The beams next to the left and the right; none is exactly there.
    assert ranges_m[96] == pytest.approx(0.2, rel=1e-3)
    assert ranges_m[289] == pytest.approx(5.0, rel=1e-3)
    assert ranges_m[192] == math.inf
    near = robot_in(Scene("walls", Walls(((-2.0, 0.1, 2.0, 0.1), (-2.0, -5.0, 2.0, -5.0)))), lidar="lds01")
    ranges_m = last(Scan, lived(near, 0.2)).ranges_m
    assert ranges_m[90] == -math.inf
    assert ranges_m[270] == math.inf


@pytest.mark.parametrize(("lidar", "beams"), [("lds01", 360), ("lds02", 385), ("lds03", 400)])
def test_a_scan_has_as_many_beams_as_the_sensor(lidar: str, beams: int) -> None:
    robot = robot_in(Scene("room", room(3.0, 2.0), noise=Noise(lidar_m=0.001)), lidar=lidar)
    ranges_m = last(Scan, lived(robot, 0.2)).ranges_m
    assert ranges_m.shape == (beams,)
    angles = math.tau * np.arange(beams) / beams
    cosines, sines = np.cos(angles), np.sin(angles)
    # The scanner is behind the middle of the robot, and of the room.
    ahead_m = np.where(cosines > 0.0, 1.532, 1.468) / np.maximum(np.abs(cosines), 1e-9)
    assert ranges_m == pytest.approx(np.minimum(ahead_m, 1.0 / np.maximum(np.abs(sines), 1e-9)), abs=0.01)
    robot.is_scanner_covered = True
    assert last(Scan, lived(robot, 0.3)).ranges_m.shape == (beams,)


def test_a_covered_scanner_sees_something_too_near_everywhere() -> None:
    robot = in_room()
    execute(robot, "scanner cover")
    assert (last(Scan, lived(robot, 0.3)).ranges_m == -math.inf).all()
    execute(robot, "scanner uncover")
    assert np.isfinite(last(Scan, lived(robot, 0.3)).ranges_m).all()


def test_noise_of_the_scene_is_in_the_scan() -> None:
    scene = Scene("noisy", room(4.0, 3.0), noise=Noise(lidar_m=0.02))
    found = [reading.ranges_m[0] for reading in lived(robot_in(scene), 20.0) if isinstance(reading, Scan)]
    assert np.std(found) == pytest.approx(0.02, rel=0.3)
    again = [reading.ranges_m[0] for reading in lived(robot_in(scene), 20.0) if isinstance(reading, Scan)]
    assert found == again


def test_odometry_reports_where_velocities_have_led() -> None:
    robot = in_room()
    lived(robot, 2.0, (0.1, 0.0))
    lived(robot, 2.0, (0.0, math.pi / 4))
    odometry = last(Odometry, lived(robot, 1.0, (0.05, 0.0)))
    assert odometry.x_m == pytest.approx(0.2, abs=0.01)
    assert odometry.y_m == pytest.approx(0.05, abs=0.01)
    assert odometry.heading_rad == pytest.approx(math.pi / 2, abs=0.02)
    assert odometry.linear_m_s == pytest.approx(0.05, abs=1e-6)
    x_m, y_m, heading_rad = robot.world.pose
    assert (odometry.x_m, odometry.y_m) == pytest.approx((x_m, y_m), abs=0.005)
    assert odometry.heading_rad == pytest.approx(heading_rad, abs=0.01)


def test_odometry_begins_where_the_robot_stands_and_knows_nothing_of_slip() -> None:
    scene = Scene("slippery", Walls(()), start=(5.0, 5.0, 1.0), noise=Noise(slip_share=0.5))
    robot = robot_in(scene)
    odometry = last(Odometry, lived(robot, 2.0, (0.1, 0.0)))
    assert odometry.x_m == pytest.approx(0.2, abs=0.01)
    assert math.dist(robot.world.pose[:2], (5.0, 5.0)) == pytest.approx(0.1, abs=0.02)


def test_a_velocity_holds_for_half_a_second_of_the_clock_also_in_a_fast_world() -> None:
    robot = robot_in(Scene("open", Walls(())), factor=4.0)
    robot.command(0.1, 0.0)
    lived(robot, 0.45)
    assert robot.world.speed_m_s == pytest.approx(0.1)
    lived(robot, 0.1)
    assert robot.world.speed_m_s == 0.0
    assert robot.world.x_m == pytest.approx(0.5 * 4 * 0.1, abs=0.02)


def test_a_velocity_may_hold_for_ever() -> None:
    robot = in_room(command_timeout_s=0.0)
    robot.command(0.0, 0.1)
    lived(robot, 20.0)
    assert robot.world.yaw_rate_rad_s == pytest.approx(0.1)


def test_a_world_in_motion_may_wait_for_the_next_velocity() -> None:
    robot = robot_in(Scene("open", Walls(())), factor=20.0, patience_s=0.4)
    robot.command(0.1, 0.0)
    lived(robot, 0.3)
    assert robot.world.time.world_s() == pytest.approx(0.4)
    robot.command(0.1, 0.0)
    lived(robot, 0.3)
    assert robot.world.time.world_s() == pytest.approx(0.8)
    assert robot.world.x_m == pytest.approx(0.08, abs=0.01)
    # It ends on the computer's clock all the same, and at rest nothing is waited for.
    lived(robot, 0.3)
    assert robot.world.speed_m_s == 0.0
    assert robot.world.time.world_s() > 0.8 + 1.0
    before_s = robot.world.time.world_s()
    robot.command(0.0, 0.0)
    lived(robot, 0.2)
    assert robot.world.time.world_s() == pytest.approx(before_s + 0.2 * 20)


@pytest.mark.parametrize("wrong", [0.0, -1.0, math.nan, math.inf])
def test_a_patience_that_is_no_time_is_refused(wrong: float) -> None:
    with pytest.raises(ValueError, match="patience"):
        in_room(patience_s=wrong)


def test_wheels_turn_no_faster_than_the_motors_can() -> None:
    robot = in_room()
    lived(robot, 1.0, (50.0, 0.0))
    assert robot.world.left.speed_rad_s == pytest.approx(61.0 * math.tau / 60)


@pytest.mark.parametrize("wrong", [(math.nan, 0.0), (0.1, math.inf)])
def test_a_velocity_that_is_no_number_is_a_standstill(wrong: tuple[float, float]) -> None:
    robot = in_room()
    lived(robot, 0.3, (0.1, 0.0))
    lived(robot, 0.3, wrong)
    assert robot.world.speed_m_s == 0.0
    assert robot.refused > 0


def test_pictures_show_the_line_grey_or_coloured() -> None:
    grey = last(Picture, lived(robot_in(Scene("oval", Walls(()), line=oval())), 0.2))
    assert (grey.encoding, len(grey.data)) == ("mono8", grey.width * grey.height)
    coloured = last(Picture, lived(robot_in(Scene("oval", Walls(()), line=oval()), encoding="rgb8"), 0.2))
    assert coloured.encoding == "rgb8"
    assert coloured.data == bytes(shade for shade in grey.data for _ in range(3))
    middle = np.frombuffer(grey.data, np.uint8).reshape(grey.height, grey.width)[-1]
    assert middle[grey.width // 2] < 100 < middle[0]


def test_a_covered_camera_sees_nothing() -> None:
    robot = robot_in(Scene("oval", Walls(()), line=oval()))
    execute(robot, "camera cover")
    assert set(last(Picture, lived(robot, 0.2)).data) == {0}


def test_the_world_takes_the_commands_of_serial_lines() -> None:
    scene = Scene("box", room(4.0, 3.0), obstacles=(Obstacle("box", 1.0, 0.0, 0.1, is_there=False),))
    robot = robot_in(scene)
    free_m = last(Scan, lived(robot, 0.3)).ranges_m[0]
    assert execute(robot, "obstacle box back") == ""
    assert last(Scan, lived(robot, 0.3)).ranges_m[0] == pytest.approx(free_m - 1.1, abs=1e-6)
    assert execute(robot, "pose") == "pose 0.0000 0.0000 0.0000"
    assert execute(robot, "collisions") == "collisions 0"
    assert execute(robot, "help") == HELP
    assert execute(robot, "") == ""
    execute(robot, "battery 10.9")
    assert last(Battery, lived(robot, 1.1)).voltage_v == 10.9


@pytest.mark.parametrize(
    "wrong",
    ["dance", "battery", "battery nan", "battery 1e300", "pose nan 0 0", "battery full", "obstacle box back", "goal"],
)
def test_what_it_cannot_do_is_reported(wrong: str) -> None:
    with pytest.raises(UnknownCommandError):
        execute(in_room(), wrong)


@pytest.mark.parametrize("wrong", [{"lidar": "sonar"}, {"encoding": "jpeg"}])
def test_an_unknown_kind_of_sensor_is_refused(wrong: dict[str, str]) -> None:
    with pytest.raises(ValueError, match="there is no"):
        in_room(**wrong)


def test_frames_sit_where_the_body_has_them() -> None:
    frames = {frame.child: frame for frame in robot_in(Scene("oval", Walls(()), line=oval())).frames}
    assert set(frames) == {"base_link", "base_scan", "camera_link"}
    assert frames["base_scan"].x_m == BODIES["burger"].scanner_x_m
    # The camera's height is above the floor, its frame's above the base.
    assert frames["camera_link"].z_m + frames["base_link"].z_m == pytest.approx(0.15)
    assert len(in_room().frames) == 2


def test_time_that_the_process_did_not_get_is_not_lived() -> None:
    now_s = 0.0
    time = Timebase(PacedClock(), 10.0)
    robot = RosRobot(World(BODIES["burger"], room(4.0, 3.0), time))
    pacer = Pacer(robot, lambda: now_s)
    now_s = 5.0
    pacer.begin()
    now_s += 0.02
    pacer.catch_up()
    assert time.world_s() == pytest.approx(0.2)
    assert pacer.until_s(0.3) == pytest.approx(0.01)
    now_s += 1.0
    pacer.catch_up()
    assert time.world_s() == pytest.approx(0.2 + 10 * LONGEST_S)
    assert pacer.late_s == pytest.approx(1.0 - LONGEST_S)


def options(*arguments: str) -> argparse.Namespace:
    return parser("twin", "").parse_args(arguments)


def test_options_of_a_node_on_ros_1() -> None:
    found = ros1._parser().parse_args(["--sim-time", "--python", "/opt/python", "--scene", "line-oval"])
    assert (found.sim_time, found.stamped, found.python, found.scene) == (True, False, "/opt/python", "line-oval")


def test_a_robot_is_made_as_the_command_line_says() -> None:
    robot, pacer = make_robot(options("--scene", "line-oval", "--robot", "waffle", "--speed", "3"))
    assert robot.world.body.name == "waffle"
    assert robot.world.scene.name == "line-oval"
    assert pacer.until_s(3.0) == pytest.approx(1.0, abs=0.1)


def test_a_command_line_that_cannot_be_is_refused() -> None:
    with pytest.raises(SceneError):
        make_robot(options("--scene", "nowhere"))
    with pytest.raises(ValueError, match="speed"):
        make_robot(options("--speed", "1e6"))
    for wrong in (("--command-timeout", "nan"), ("--seed", "-1"), ("--seed", "10000000000")):
        with pytest.raises(SystemExit):
            options(*wrong)
