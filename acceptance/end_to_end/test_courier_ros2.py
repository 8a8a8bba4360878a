"""The courier over DDS: generated controller, rotator, household, and the twin in the house of its example's page."""

import json
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from support.example_robots import HELPERS, Stage, stage

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
pytest.importorskip("cv2", reason="OpenCV (the extra examples) is not installed")

pytestmark = [pytest.mark.ros2, pytest.mark.real_time]

SPEED = 4
LIMIT_S = 240.0
HOUSE = (
    "{python} -m robosc_examples.household --ros-args -p speed:={speed} -p opens_after:={opens} -p drain:={drain}"
    " | {python} -m robosc_simulated.ros.ros2 --scene rooms --command-timeout 0 --speed {speed} --motion {motion}"
)


@pytest.fixture
def at(tmp_path: Path) -> Iterator[Stage]:
    with stage(tmp_path) as made:
        yield made


def until(at: Stage, condition: Callable[[], bool], what: str, repeat: Callable[[], object] = lambda: None) -> None:
    at.peer.spin_until(condition, LIMIT_S, what, None, repeat, repeat_every_s=0.5)


def test_it_answers_an_order_goes_through_the_door_and_charges(at: Stage, tmp_path: Path) -> None:
    from nav_msgs.msg import Odometry
    from std_msgs.msg import Empty, String

    motion = tmp_path / "motion.jsonl"
    poses = at.peer.receive(Odometry, "/odom")
    unlocked, opened = at.peer.receive(Empty, "/tray/unlock"), at.peer.receive(Empty, "/door/opened")
    closed = at.peer.receive(Empty, "/tray/closed")
    command = HOUSE.format(python=sys.executable, speed=SPEED, opens=10.0, drain=0.009, motion=motion)
    at.run(["-c", command], [HELPERS], program="/bin/sh")
    until(at, lambda: bool(poses), "the twin")
    rotator = at.helper("rotator")
    controller = at.controller("courier")

    def is_near(x_m: float, y_m: float) -> bool:
        place = poses[-1].pose.pose.position
        return math.dist((place.x, place.y), (x_m, y_m)) < 0.3

    until(at, lambda: not is_near(0.0, 0.0), "the courier to begin its rounds")
    # Repeated orders change nothing while somebody waits.
    until(
        at, lambda: bool(unlocked), "the tray to be unlocked", lambda: at.peer.publish(String(data="office"), "/order")
    )
    assert is_near(3.5, 0.0)
    until(at, lambda: bool(closed), "the tray to be emptied")
    until(at, lambda: is_near(1.5, -2.0), "the lab")
    assert opened
    until(at, lambda: is_near(0.0, 0.0), "the dock, with a low battery")
    until(at, lambda: not is_near(0.0, 0.0), "the courier to go on with a full battery")
    assert (rotator.is_running, controller.is_running) == (True, True), controller.stderr
    samples = [json.loads(line) for line in motion.read_text().splitlines()[:-1] if '"collisions"' in line]
    assert samples[-1]["collisions"] == 0


def test_it_waits_before_a_door_that_never_opens(at: Stage, tmp_path: Path) -> None:
    from nav_msgs.msg import Odometry
    from std_msgs.msg import Empty

    poses, told = at.peer.receive(Odometry, "/odom"), at.peer.receive(Empty, "/door/open")
    command = HOUSE.format(python=sys.executable, speed=SPEED, opens=0.0, drain=0.0, motion=tmp_path / "motion.jsonl")
    at.run(["-c", command], [HELPERS], program="/bin/sh")
    until(at, lambda: bool(poses), "the twin")
    at.helper("rotator")
    controller = at.controller("courier")
    until(at, lambda: bool(told), "the door to be told")
    at.peer.spin_for(3.0)
    before = poses[-1].pose.pose.position
    at.peer.spin_for(5.0)
    after = poses[-1].pose.pose.position
    assert (after.x, after.y) == (before.x, before.y)
    assert controller.is_running
