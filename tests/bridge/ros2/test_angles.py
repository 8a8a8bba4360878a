"""Angles of wheels, worked out from the odometry that was made from them."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_api.v1 import bridge_pb2 as pb
from robosc_bridge.devices.odometry import Odometry
from robosc_bridge.devices.robots import BURGER
from robosc_bridge.main import main
from robosc_bridge.ros2.messages import Angles, Wheels, stamps

WHEELS = Wheels(BURGER.wheel_radius_m, BURGER.wheel_separation_m)
TICK_RAD = 2 * math.pi / 4096


@given(st.lists(st.tuples(st.integers(-200, 200), st.integers(-200, 200)), min_size=1, max_size=60))
def test_the_wheels_have_turned_as_their_encoders_say(steps: list[tuple[int, int]]) -> None:
    odometry, angles = Odometry(BURGER.tick_m, BURGER.wheel_separation_m).advanced(0, 0), Angles()
    left = right = 0
    for step in [(0, 0), *steps]:
        left, right = left + step[0], right + step[1]
        odometry = odometry.advanced(left, right)
        pose = odometry.pose
        told = pb.DriveState(pose=pb.Pose(x_m=pose.x_m, y_m=pose.y_m, heading_rad=pose.heading_rad))
        angles = angles.after(told, WHEELS)
    assert angles.left_rad == pytest.approx(left * TICK_RAD, abs=1e-9)
    assert angles.right_rad == pytest.approx(right * TICK_RAD, abs=1e-9)


def test_an_odometry_that_begins_anew_is_no_motion() -> None:
    before = Angles(3.0, 4.0)
    told = pb.DriveState(pose=pb.Pose(x_m=9.0, y_m=9.0, heading_rad=1.0))
    found = before.after(told, WHEELS)
    assert (found.left_rad, found.right_rad, found.pose) == (3.0, 4.0, (9.0, 9.0, 1.0))


def test_a_stamp_is_older_than_now_and_never_before_the_beginning() -> None:
    assert stamps(5_000_000_000, [0.0, 1.5, 9.0]) == [(5, 0), (3, 500_000_000), (0, 0)]


@pytest.mark.parametrize("value", ["-1", "-0.1"])
def test_wheels_that_cannot_be_are_refused(value: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ros2", f"--wheel-radius={value}"]) == 2
    assert "must have a radius and a distance above zero" in capsys.readouterr().err
