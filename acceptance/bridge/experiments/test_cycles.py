"""Times of control cycles, in every form that this machine can run."""

import importlib.util
import shutil
from pathlib import Path

import pytest

from robosc.supervisor import Supervisor
from robosc_experiments.cycles.driving import measured_driving
from robosc_experiments.cycles.measure import measure
from robosc_experiments.cycles.rclcpp import rclcpp_prefix
from robosc_experiments.cycles.times import PAPER
from robosc_experiments.ros1 import missing
from support.generated import example_supervisor

FORMS = (
    ("generated C, gcc -O2", False),
    ("generated Python", False),
    ("generated C, roscpp", True),
    ("generated C, rclcpp", True),
    ("generated Python, rclpy", True),
    ("generated Python, rospy", True),
)
HAS_GCC = shutil.which("gcc") is not None
HAS_ROSCPP = HAS_GCC and shutil.which("g++") is not None and Path("/usr/include/ros/ros.h").exists()


@pytest.mark.parametrize(
    ("experiment", "model"), [("maze", "maze_solver/narrow_maze"), ("line", "line_follower/line_follower_layer")]
)
def test_cycles_are_measured(experiment: str, model: str) -> None:
    found = measure(experiment, example_supervisor(model), runs=1, cycles=60)
    assert [(times.what, times.has_middleware) for times in found] == list(FORMS)
    has_ros1, has_ros2 = missing() is None, importlib.util.find_spec("rclpy") is not None
    has_rclcpp = all(map(shutil.which, ("gcc", "g++", "cmake"))) and rclcpp_prefix() is not None
    is_there = (HAS_GCC, True, HAS_ROSCPP and has_ros1, has_rclcpp and has_ros2, has_ros2, has_ros1)
    for times, is_expected in zip(found, is_there, strict=True):
        assert times.paper == PAPER[experiment, times.has_middleware]
        if times.microseconds is None:
            assert not is_expected, times.why
            assert "installed" in times.why or "not there" in times.why
            continue
        mean, least, most, deviation = times.microseconds
        assert 0 <= least <= mean <= most < 1e6
        assert (times.count, deviation >= 0, least <= times.median_us <= most) == (60, True, True)
        assert (times.publish_us is not None) is times.has_middleware
        assert times.publish_us is None or 0 < times.publish_us < 1e6


@pytest.fixture(scope="module")
def supervisor() -> Supervisor:
    return example_supervisor("line_follower/line_follower")


def test_a_model_without_velocities_has_no_cycles_with_middleware() -> None:
    for middleware in ("rclpy", "rospy", "roscpp", "rclcpp"):
        found = measured_driving(middleware, "maze", example_supervisor("navigation/navigation"), 1, 1)
        assert found == "its model sends no velocities"


@pytest.mark.skipif(not HAS_ROSCPP, reason="gcc, g++ or roscpp is not installed")
def test_what_does_not_compile_is_reported(supervisor: Supervisor, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robosc_experiments.cycles.driving._LIBRARIES", ("nowhere",))
    found = measured_driving("roscpp", "line", supervisor, 1, 1)
    assert isinstance(found, str)
    assert found.startswith("it failed: ")
