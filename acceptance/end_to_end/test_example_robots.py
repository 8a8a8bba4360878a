"""Every example robot does its job: generated controller and helper nodes over DDS, around a small robot."""

import math
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from support.example_robots import Stage, stage
from support.kinematic_robot import KinematicRobot, Picture, Thing, Wall, World, coloured_picture, floor_picture

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("cv2", reason="OpenCV (the extra examples) is not installed")

pytestmark = pytest.mark.ros2

RED, BLUE = (200, 20, 20), (20, 20, 200)


@pytest.fixture
def at(tmp_path: Path) -> Iterator[Stage]:
    with stage(tmp_path) as made:
        yield made


def test_the_line_follower_follows_its_line_and_stops_for_the_panel(at: Stage) -> None:
    read, write = os.pipe()
    covered: list[bool] = []

    def camera(robot: KinematicRobot) -> Picture:
        return np.full((48, 64), 220, np.uint8) if covered else floor_picture(robot)

    controller = at.controller("line_follower")
    at.helper("line_detector", "top:=0.0")
    panel = at.helper("stop_panel", stdin=read)
    os.close(read)
    robot = at.robot = KinematicRobot(at.peer, World(), camera)
    robot.y = 0.1
    at.until(lambda: robot.x > 0.45, "the robot to drive along the line", controller)
    assert abs(robot.y) < 0.05

    covered.append(True)
    at.until(lambda: robot.speed == 0.0, "the robot to stop without a line", controller)
    covered.clear()
    at.until(lambda: robot.speed > 0.0, "the robot to drive again", controller)

    os.write(write, b"stop\n")
    at.until(lambda: robot.speed == 0.0, "the stop button to stop it", controller)
    os.write(write, b"resume\n")
    at.until(lambda: robot.speed > 0.0, "the resume button to let it go on", controller)

    # The panel's terminal goes away.
    os.close(write)
    at.until(lambda: robot.speed == 0.0, "a lost panel to stop it", controller)
    assert panel.wait() == 0


def test_a_careless_line_follower_stands_still_behind_its_layer(at: Stage) -> None:
    """The follower never heeds obstacles or the stop button itself; what it sends then is held back and reported."""
    from std_msgs.msg import Empty, String

    blocked = at.peer.receive(String, "/blocked")
    layer = at.supervised("line_follower_layer", "careless_line_follower")
    at.helper("line_detector", "top:=0.0")
    world = World()
    robot = at.robot = KinematicRobot(at.peer, world, floor_picture)
    robot.y = 0.1
    at.until(lambda: robot.x > 0.3, "the robot to drive along the line", layer)

    world.walls.append(Wall(robot.x + 0.5, -1.0, robot.x + 0.5, 1.0))
    at.until(lambda: robot.speed == 0.0, "the robot to stop for a wall", layer)
    before, x = len(blocked), robot.x
    at.until(lambda: len(blocked) > before + 3, "what it sends now to be held back", layer)
    assert (robot.speed, robot.x) == (0.0, x)
    assert blocked[-1].data == "/cmd_vel"
    world.walls.clear()
    at.until(lambda: robot.speed > 0.0, "the robot to drive again", layer)

    at.peer.publish(Empty(), "/emergency_stop/stop")
    at.until(lambda: robot.speed == 0.0, "the stop button to stop it", layer)
    at.go_on(0.5)
    assert robot.speed == 0.0


def test_the_maze_solver_turns_left_at_a_wall_by_a_right_angle(at: Stage) -> None:
    controller = at.controller("maze_solver")
    rotator = at.helper("rotator", "speed_limit:=1.5")
    walls = [Wall(-2.0, -0.4, 2.0, -0.4), Wall(0.65, -0.4, 0.65, 3.0)]
    robot = at.robot = KinematicRobot(at.peer, World(walls))
    at.until(lambda: robot.turn > 0.0, "the turn to the left", rotator)
    assert 0.1 < robot.x < 0.4
    at.until(lambda: robot.speed > 0.0, "the robot to drive on after the turn", controller)
    assert abs(math.degrees(robot.yaw) - 90.0) < 3.0
    y = robot.y
    at.until(lambda: robot.y > y + 0.05, "the robot to follow the next wall", controller)


def test_the_object_finder_turns_to_its_object_and_has_it_announced(at: Stage) -> None:
    from std_msgs.msg import Empty, String

    controller = at.controller("object_finder")
    at.helper("blob_detector", "/blob:=/camera/detection")
    at.helper("announcer", "text:=here it is")
    thing = Thing(0.3, 0.75, 0.15, RED)
    robot = at.robot = KinematicRobot(at.peer, World(obstacles=[thing], things=[thing]), coloured_picture)
    announced = at.peer.receive(String, "/announcement")
    at.peer.wait_for_peers(["/search", "/cmd_vel", "/image", "/announcement"])
    at.go_on(0.3)
    assert (robot.speed, robot.turn) == (0.0, 0.0)
    at.peer.publish(Empty(), "/search")
    at.until(lambda: robot.turn > 0.4, "the robot to look around", controller)
    at.until(lambda: robot.speed > 0.0, "the robot to approach its object", controller)
    at.until(lambda: bool(announced), "the announcement", controller)
    assert [message.data for message in announced] == ["here it is"]
    at.until(lambda: (robot.speed, robot.turn) == (0.0, 0.0), "the robot to rest", controller)
    ahead, left = thing.place_from(robot.x, robot.y, robot.yaw)
    assert ahead < 0.7
    assert abs(left) < 0.2


def test_the_ball_pusher_pushes_its_ball_towards_the_goal(at: Stage) -> None:
    from std_msgs.msg import Bool, Empty

    controller = at.controller("ball_pusher")
    at.helper("blob_detector", "__node:=ball_detector", "/blob:=/ball", "width:=0.08")
    at.helper("blob_detector", "__node:=goal_detector", "/blob:=/goal", "width:=0.8", "hue_from:=110", "hue_to:=130")
    at.helper("pusher")
    ball, goal = Thing(0.4, 0.0, 0.04, RED), Thing(1.2, 0.0, 0.4, BLUE)
    robot = at.robot = KinematicRobot(at.peer, World(things=[ball, goal]), coloured_picture)

    def roll() -> None:
        """The ball goes before the robot."""
        ahead, _ = ball.place_from(robot.x, robot.y, robot.yaw)
        ball.x += max(0.0, 0.15 - ahead)
        at.peer.publish(Bool(data=False), "/bumper")

    robot.on_step = roll
    at.peer.wait_for_peers(["/kick_off", "/scored", "/bumper", "/cmd_vel", "/image", "/odom"])
    at.go_on(0.3)
    assert (robot.speed, robot.turn) == (0.0, 0.0)
    at.peer.publish(Empty(), "/kick_off")
    pushed = at.peer.receive(Empty, "/pushed")
    at.until(lambda: robot.speed == 0.15, "the robot to approach the ball", controller)
    at.until(lambda: len(pushed) == 1, "the push", controller)
    assert ball.x > 0.55
    assert abs(ball.y) < 0.05
    at.until(lambda: ball.x > 0.7, "the next push", controller)
    at.peer.publish(Empty(), "/scored")
    at.until(lambda: robot.speed == 0.0, "the robot to rest", controller)


def test_the_person_follower_keeps_its_distance(at: Stage) -> None:
    from std_msgs.msg import Empty

    controller = at.controller("person_follower")
    at.helper("person_detector")
    person = Thing(1.7, 0.0, 0.2)
    robot = at.robot = KinematicRobot(at.peer, World(obstacles=[person]))
    at.until(lambda: robot.speed == 0.2, "the robot to follow", controller)
    at.until(lambda: robot.speed == 0.0, "the robot to have caught up", controller)
    assert 1.1 < person.x - person.radius - robot.x < 1.3

    person.x = robot.x + 0.8
    at.until(lambda: robot.speed == -0.1, "the robot to back off", controller)
    at.peer.publish(Empty(), "/button")
    at.until(lambda: robot.speed == 0.0, "the button to pause it", controller)
    at.peer.publish(Empty(), "/button")
    at.until(lambda: robot.speed == -0.1, "the button to let it go on", controller)
    at.until(lambda: robot.speed == 0.0, "the robot to be far enough away", controller)

    person.x += 1.0
    at.until(lambda: robot.speed == 0.2, "the robot to follow again", controller)
    at.robot.world.obstacles.clear()
    at.until(lambda: robot.speed == 0.0, "the robot to stand without anybody", controller)
