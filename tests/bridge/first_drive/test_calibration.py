"""Calibration: what a person does by hand with a robot of known errors gives back these errors."""

import json
import math
from argparse import Namespace
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.devices.interface import BINS
from robosc_bridge.first_drive import commands
from robosc_bridge.first_drive.calibration import (
    CalibrationError,
    RolledMotion,
    wall_angle_rad,
    wheel_radius_m,
    wheel_separation_m,
)
from robosc_simulated import SimulatedTurtleBot3
from robosc_simulated.virtual_host import VirtualHost

RADIUS_M, SEPARATION_M = 0.033, 0.160


@pytest.fixture
def host() -> Iterator[VirtualHost]:
    with VirtualHost() as found:
        yield found


def configured(folder: Path, robot: SimulatedTurtleBot3, base: str, scanner: str = "") -> Path:
    file = folder / "bridge.yaml"
    file.write_text(f"robot: burger\ndrive: {{driver: {base}, port: {robot.base_path}}}\n{scanner}\nchannels: {{}}\n")
    return file


def calibrated(what: str, file: Path, host: VirtualHost, ask: Callable[[str], str], factor: float = 1.0) -> int:
    return commands._calibrate(Namespace(what=what, config=file, radius_factor=factor, json=True), host, ask)


class Person:
    """Person who pushes a robot by hand: its wheels turn, its motors do not.

    Args:
        host: Host whose time passes meanwhile.
        robot: The robot.
        left_rad: Angle by which the left wheel is turned, in all.
        right_rad: The same of the right one.
        answers: Answers to the questions for a number.
    """

    def __init__(
        self, host: VirtualHost, robot: SimulatedTurtleBot3, left_rad: float, right_rad: float, *answers: str
    ) -> None:
        self.host = host
        self.robot = robot
        self.angles_rad = (left_rad, right_rad)
        self.answers = list(answers)
        self.questions: list[str] = []

    def __call__(self, question: str) -> str:
        self.questions.append(question)
        world = self.robot.world
        if question.startswith(("Push", "Turn")):
            for _ in range(200):
                with world.time.lock:
                    world.left.angle_rad += self.angles_rad[0] / 200
                    world.right.angle_rad += self.angles_rad[1] / 200
                assert not world.left.is_driven and not world.right.is_driven
                self.host.sleep(0.02)
            self.host.sleep(0.2)
        return "" if question.endswith("Enter. ") else self.answers.pop(0)


@pytest.mark.parametrize("base", ["opencr", "dynamixel"])
def test_worn_wheels_are_found_by_a_tape_measure(
    base: str, host: VirtualHost, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with SimulatedTurtleBot3("burger", base, clock=host) as robot:
        # Wheels of 32 mm that roll for 2 m.
        person = Person(host, robot, 2.0 / 0.032, 2.0 / 0.032, "2,0")
        assert calibrated("wheel-radius", configured(tmp_path, robot, base), host, person) == 0
        assert len(person.questions) == 3
    figures = json.loads(capsys.readouterr().out)
    assert figures["wheel_radius_m"] == pytest.approx(0.032, abs=2e-5)
    assert figures["radius_factor"] == pytest.approx(0.032 / 0.033, abs=1e-3)
    assert figures["odometry_m"] == pytest.approx(2.0 * 0.033 / 0.032, abs=1e-3)


@pytest.mark.parametrize("base", ["opencr", "dynamixel"])
def test_the_distance_between_the_wheels_is_found_by_whole_revolutions(
    base: str, host: VirtualHost, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with SimulatedTurtleBot3("burger", base, clock=host) as robot:
        # A robot of 170 mm, with wheels of 32 mm, turned by five revolutions.
        angle_rad = 5 * 2 * math.pi * (0.170 / 2) / 0.032
        person = Person(host, robot, angle_rad, -angle_rad, "5")
        file = configured(tmp_path, robot, base)
        assert calibrated("wheel-separation", file, host, person, 0.032 / 0.033) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["wheel_separation_m"] == pytest.approx(0.170, abs=2e-4)


@pytest.mark.parametrize("turned_deg", [-12.0, 0.0, 7.0])
def test_a_lidar_that_is_mounted_turned_is_found_before_a_wall(
    turned_deg: float, host: VirtualHost, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with SimulatedTurtleBot3("burger", "opencr", "lds02", clock=host, pose=(1.2, 0.0, 0.0)) as robot:
        # The driver believes that its front points elsewhere than it does.
        options = f"options: {{front_rad: {math.radians(turned_deg)}}}"
        scanner = f"scanner: {{driver: lds02, port: {robot.scanner_path}, {options}}}"
        file = configured(tmp_path, robot, "opencr", scanner)
        assert calibrated("lidar-front", file, host, lambda question: "") == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["front_rad"] == pytest.approx(0.0, abs=math.radians(0.5))
    assert figures["change_deg"] == pytest.approx(-turned_deg, abs=0.5)


@given(st.floats(-0.3, 0.3), st.floats(0.4, 1.5))
def test_a_wall_is_seen_where_it_is(angle_rad: float, distance_m: float) -> None:
    ranges_m = [math.nan] * BINS
    for degree in range(-40, 41):
        cosine = math.cos(math.radians(degree) - angle_rad)
        ranges_m[degree % BINS] = distance_m / cosine
    assert wall_angle_rad(ranges_m) == pytest.approx(angle_rad, abs=1e-9)


def test_what_is_no_wall_is_refused() -> None:
    with pytest.raises(CalibrationError, match="no wall is seen ahead"):
        wall_angle_rad([math.nan] * BINS)
    corner = [0.5 + abs(degree - 360 * (degree > 180)) * 0.02 for degree in range(BINS)]
    with pytest.raises(CalibrationError, match="not a plain wall"):
        wall_angle_rad(corner)


@pytest.mark.parametrize(
    ("way", "measured_m", "problem"),
    [
        (RolledMotion(0.1, 0.0), 0.1, "too short"),
        (RolledMotion(2.0, 0.5), 2.0, "turned by 29 degrees"),
        (RolledMotion(2.0, 0.0), 1.0, "would be 0.0165 m"),
    ],
)
def test_a_way_that_says_nothing_of_the_wheels_is_refused(way: RolledMotion, measured_m: float, problem: str) -> None:
    with pytest.raises(CalibrationError, match=problem):
        wheel_radius_m(way, measured_m, RADIUS_M)


@pytest.mark.parametrize(
    ("way", "problem"),
    [
        (RolledMotion(0.0, 1.0), "not turned by a whole revolution"),
        (RolledMotion(5.0, 31.4), "moved away from its place"),
        (RolledMotion(0.0, 31.4 * 2), "would be 0.3"),
    ],
)
def test_a_rotation_that_says_nothing_of_the_wheels_is_refused(way: RolledMotion, problem: str) -> None:
    with pytest.raises(CalibrationError, match=problem):
        wheel_separation_m(way, 5, SEPARATION_M)


def test_a_robot_of_ones_own_goes_by_its_options(
    host: VirtualHost, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with SimulatedTurtleBot3("burger", "dynamixel", clock=host) as robot:
        person = Person(host, robot, -2.0 / 0.032, -2.0 / 0.032, "2")
        file = tmp_path / "bridge.yaml"
        file.write_text(
            "robot: {linear_m_s: 0.2, angular_rad_s: 1, wheel_separation_m: 0.16}\n"
            f"drive: {{driver: dynamixel, port: {robot.base_path}, options: {{wheel_radius_m: 0.033}}}}\n"
            "channels: {}\n"
        )
        assert calibrated("wheel-radius", file, host, person) == 0
    assert json.loads(capsys.readouterr().out)["wheel_radius_m"] == pytest.approx(0.032, abs=2e-5)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (
            "robot: burger\ndrive: {driver: mavlink-rover, port: /dev/x}\nchannels: {}\n",
            "a rover's autopilot has its own",
        ),
        (
            "robot: {linear_m_s: 1, angular_rad_s: 1, wheel_separation_m: 0.3}\n"
            "drive: {driver: dynamixel, port: /dev/x}\nchannels: {}\n",
            "drive.options.wheel_radius_m is missing",
        ),
    ],
)
def test_robots_whose_wheels_are_not_known_are_refused(
    text: str, problem: str, host: VirtualHost, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "bridge.yaml"
    file.write_text(text)
    assert calibrated("wheel-radius", file, host, lambda question: "1") == 1
    assert problem in capsys.readouterr().err


def test_an_answer_that_is_no_number_is_refused(
    host: VirtualHost, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with SimulatedTurtleBot3("burger", "opencr", clock=host) as robot:
        person = Person(host, robot, 60.0, 60.0, "two")
        assert calibrated("wheel-radius", configured(tmp_path, robot, "opencr"), host, person) == 1
    assert "'two' is no number" in capsys.readouterr().err
