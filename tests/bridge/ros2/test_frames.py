"""Tests of where frames are on a robot."""

import pytest

from robosc_bridge.configuration.structure import TURTLEBOTS as CONFIGURED
from robosc_bridge.ros2.frames import TURTLEBOTS, Frames, Mounting, Place, Places, mountings, places_of
from robosc_simulated.robots import BODIES


def test_every_turtlebot_of_a_configuration_is_known() -> None:
    assert sorted(TURTLEBOTS) == sorted(CONFIGURED)


@pytest.mark.parametrize("name", CONFIGURED)
def test_the_laser_is_where_the_simulated_robot_has_it(name: str) -> None:
    assert TURTLEBOTS[name].scan.x_m == BODIES[name].scanner_x_m


def test_a_chain_from_the_floor_to_the_laser() -> None:
    burger = TURTLEBOTS["burger"]
    assert burger.imu is not None
    assert mountings(Frames(prefix="robot1/"), burger) == (
        Mounting("robot1/base_footprint", "robot1/base_link", burger.base),
        Mounting("robot1/base_link", "robot1/base_scan", burger.scan),
        Mounting("robot1/base_link", "robot1/imu_link", burger.imu),
    )


def test_no_frame_is_in_itself() -> None:
    found = mountings(Frames(base="base_link", scan="laser"), TURTLEBOTS["waffle"])
    assert [(item.parent, item.child) for item in found] == [("base_link", "laser"), ("base_link", "imu_link")]


def test_another_robot_needs_the_place_of_its_laser() -> None:
    place = Place(0.1, 0.0, 0.2)
    assert places_of("", None) is None
    assert places_of("tracked", None) is None
    assert places_of("", place) == Places(Place(), place)
    assert places_of("burger", None) == TURTLEBOTS["burger"]
    assert places_of("burger", place) == Places(TURTLEBOTS["burger"].base, place, TURTLEBOTS["burger"].imu)


def test_a_place_of_the_configuration_takes_the_turtlebots_place_and_keeps_its_height() -> None:
    burger = TURTLEBOTS["burger"]
    assert places_of("burger", None, (0.05, -0.02)) == Places(
        burger.base, Place(0.05, -0.02, burger.scan.z_m), burger.imu
    )
    assert places_of("", None, (0.05, -0.02)) == Places(Place(), Place(0.05, -0.02, 0.0))
    place = Place(0.1, 0.0, 0.2)
    assert places_of("burger", place, (0.05, -0.02)) == Places(burger.base, place, burger.imu)
