"""Calibration of the LiDAR's place: a robot that is turned before a wall by hand gives back where its LiDAR sits."""

import json
import math
import re
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc_bridge.devices.interface import RawScan
from robosc_bridge.first_drive import commands
from robosc_bridge.first_drive.calibration import CalibrationError
from robosc_bridge.first_drive.lidar_place import LEAST_SIGHTINGS, LidarPlace, Sighting, WallFollower, place_of, wall_of
from robosc_simulated import BODIES, PROFILES, SimulatedTurtleBot3, Walls
from robosc_simulated.virtual_host import VirtualHost
from support.effort import examples

WALL_M = 0.8
LONG_WALL = Walls([(WALL_M, -3.0, WALL_M, 3.0)])


@pytest.fixture
def host() -> Iterator[VirtualHost]:
    with VirtualHost() as found:
        yield found


class Turner:
    """Person who turns a robot on the spot: it rotates, and its wheels with it.

    Args:
        host: Host whose time passes meanwhile.
        robot: The robot.
        turned_rad: Angle by which it is turned.
        seconds: Time that this takes.
        aside_m: Distance by which it is pushed ahead meanwhile.
    """

    def __init__(
        self, host: VirtualHost, robot: SimulatedTurtleBot3, turned_rad: float, seconds: float, aside_m: float = 0.0
    ) -> None:
        self.host = host
        self.robot = robot
        self.turned_rad = turned_rad
        self.seconds = seconds
        self.aside_m = aside_m
        self.questions: list[str] = []

    def __call__(self, question: str) -> str:
        self.questions.append(question)
        # A LiDAR comes to its speed before anybody begins.
        self.host.sleep(4.0)
        if question.startswith("Turn"):
            world, steps = self.robot.world, round(self.seconds / 0.02)
            body = world.body
            for _ in range(steps):
                turn_rad, way_m = self.turned_rad / steps, self.aside_m / steps
                x_m, y_m, heading_rad = world.pose
                middle_rad = heading_rad + turn_rad / 2
                world.place(
                    x_m + way_m * math.cos(middle_rad), y_m + way_m * math.sin(middle_rad), heading_rad + turn_rad
                )
                with world.time.lock:
                    half_m = turn_rad * body.wheel_separation_m / 2
                    world.left.angle_rad += (way_m - half_m) / body.wheel_radius_m
                    world.right.angle_rad += (way_m + half_m) / body.wheel_radius_m
                assert not world.left.is_driven and not world.right.is_driven
                self.host.sleep(0.02)
        return ""


def calibrated(
    folder: Path, host: VirtualHost, robot: SimulatedTurtleBot3, base: str, lidar: str, person: Turner
) -> int:
    file = folder / "bridge.yaml"
    file.write_text(
        f"robot: burger\ndrive: {{driver: {base}, port: {robot.base_path}}}\n"
        f"scanner: {{driver: {lidar}, port: {robot.scanner_path}}}\nchannels: {{}}\n"
    )
    arguments = Namespace(what="lidar-place", config=file, radius_factor=1.0, json=True)
    return commands._calibrate(arguments, host, person)


@pytest.mark.parametrize(
    ("profile", "base", "lidar", "x_m", "y_m", "turned_rad"),
    [
        ("ideal", "opencr", "lds01", -0.032, 0.0, 7.0),
        ("typical", "dynamixel", "lds02", 0.11, -0.06, -7.0),
        ("typical", "opencr", "lds03", -0.064, 0.02, 13.0),
        ("bad-day", "opencr", "lds01", 0.05, 0.04, 7.0),
    ],
)
def test_the_place_is_found_by_turning_on_the_spot(
    profile: str,
    base: str,
    lidar: str,
    x_m: float,
    y_m: float,
    turned_rad: float,
    host: VirtualHost,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    body = replace(BODIES["burger"], scanner_x_m=x_m, scanner_y_m=y_m)
    with SimulatedTurtleBot3(body, base, lidar, walls=LONG_WALL, clock=host, profile=profile, seed=3) as robot:
        person = Turner(host, robot, turned_rad, 30.0, 0.03)
        assert calibrated(tmp_path, host, robot, base, lidar, person) == 0, capsys.readouterr().err
        assert len(person.questions) == 2
    figures = json.loads(capsys.readouterr().out)
    within_m = {"ideal": 0.002, "typical": 0.005, "bad-day": 0.01}[profile]
    assert figures["x_m"] == pytest.approx(x_m, abs=within_m)
    assert figures["y_m"] == pytest.approx(y_m, abs=within_m)
    assert figures["deviation_m"] < within_m
    assert figures["rotation_deg"] == pytest.approx(math.degrees(turned_rad), abs=6.0)
    assert figures["scans"] >= LEAST_SIGHTINGS


@pytest.mark.parametrize(
    ("turned_rad", "seconds", "aside_m", "walls", "problem"),
    [
        (3.0, 20.0, 0.0, LONG_WALL, r"turn by 17\d degrees alone"),
        (7.0, 30.0, 2.0, LONG_WALL, "moved away from its place"),
        (7.0, 30.0, 0.0, Walls([(9.0, -3.0, 9.0, 3.0)]), "no plain wall is seen ahead"),
        (7.0, 4.0, 0.0, LONG_WALL, "turn the robot more slowly"),
    ],
)
def test_scans_without_information_are_refused(
    turned_rad: float,
    seconds: float,
    aside_m: float,
    walls: Walls,
    problem: str,
    host: VirtualHost,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    with SimulatedTurtleBot3("burger", "opencr", "lds01", walls=walls, clock=host) as robot:
        person = Turner(host, robot, turned_rad, seconds, aside_m)
        assert calibrated(tmp_path, host, robot, "opencr", "lds01", person) == 1
    streams = capsys.readouterr()
    assert streams.out == ""
    assert re.search(problem, streams.err)


def test_a_configuration_without_a_scanner_is_refused(
    host: VirtualHost, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "bridge.yaml"
    file.write_text("robot: burger\ndrive: {driver: opencr, port: /dev/x}\nchannels: {}\n")
    arguments = Namespace(what="lidar-place", config=file, radius_factor=1.0, json=False)
    assert commands._calibrate(arguments, host, lambda question: "") == 1
    assert "the configuration has no scanner" in capsys.readouterr().err


def seen(
    heading_rad: float, x_m: float, y_m: float, wall_m: float, chance: np.random.Generator, noise_m: float, share: float
) -> RawScan:
    """A scan of a wall that is a line without end, from a LiDAR on a robot at the origin; beam by beam."""
    angles, ranges = [], []
    place_m = math.cos(heading_rad) * x_m - math.sin(heading_rad) * y_m
    for degree in range(360):
        angle = math.radians(degree)
        towards = math.cos(heading_rad + angle)
        range_m = (wall_m - place_m) / towards if towards > 0.05 else math.nan
        angles.append(angle)
        ranges.append(range_m + chance.normal(0.0, noise_m + share * range_m) if range_m < 3.5 else math.nan)
    return RawScan(tuple(angles), tuple(ranges), ())


TYPICAL = PROFILES["typical"]


@settings(max_examples=examples(25), deadline=None)
@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(0.6, 1.2), st.booleans(), st.integers(0, 1000))
def test_any_place_is_found_with_the_noise_of_a_typical_day(
    x_m: float, y_m: float, wall_m: float, is_left: bool, seed: int
) -> None:
    """The twin computes each beam from where the LiDAR is, and knows nothing of lines or least squares."""
    chance = np.random.default_rng(seed)
    follower = WallFollower()
    for step in range(90):
        heading_rad = math.radians(4.5 * step) * (1 if is_left else -1)
        raw = seen(heading_rad, x_m, y_m, wall_m, chance, TYPICAL.noise.lidar_m, TYPICAL.lidar_share)
        assert follower.look(raw, heading_rad=heading_rad)
    found = place_of(follower.sightings, follower.rotation_rad)
    assert found.x_m == pytest.approx(x_m, abs=0.003)
    assert found.y_m == pytest.approx(y_m, abs=0.003)
    assert math.hypot(found.x_m - x_m, found.y_m - y_m) < 6 * found.deviation_m
    assert found.rotation_rad == pytest.approx(math.radians(4.5 * 89) * (1 if is_left else -1), abs=0.02)


def test_a_way_of_the_middle_is_taken_out() -> None:
    """The wheels measure how far the robot was pushed while it turned: the same place without that is wrong."""
    sightings, ignorant = [], []
    for step in range(90):
        heading = math.radians(4.5 * step)
        way_m = 0.001 * step
        # The wall is ahead of the first heading, and the LiDAR at 5 cm, 2 cm.
        distance_m = 0.8 - way_m - (math.cos(heading) * 0.05 - math.sin(heading) * 0.02)
        direction = -heading % math.tau
        sightings.append(Sighting(direction, distance_m, way_m, 0.0, heading))
        ignorant.append(Sighting(direction, distance_m, 0.0, 0.0, heading))
    found = place_of(sightings, math.radians(4.5 * 89))
    assert isinstance(found, LidarPlace)
    assert found.x_m == pytest.approx(0.05, abs=1e-9)
    assert found.y_m == pytest.approx(0.02, abs=1e-9)
    try:
        wrong = place_of(ignorant, math.radians(4.5 * 89))
    except CalibrationError:
        return
    assert math.hypot(wrong.x_m - 0.05, wrong.y_m - 0.02) > 0.005


def test_few_scans_and_rough_walls_are_refused() -> None:
    chance = np.random.default_rng(1)
    sightings = [
        Sighting(math.radians(9 * step), 0.8 + chance.normal(0.0, 0.05), 0.0, 0.0, -math.radians(9 * step))
        for step in range(45)
    ]
    with pytest.raises(CalibrationError, match="only 30 scans show the wall"):
        place_of(sightings[:30], math.tau)
    with pytest.raises(CalibrationError, match="are off by"):
        place_of(sightings, math.tau)
    far = [replace(each, distance_m=5.0 - 2.0 * math.cos(each.direction_rad)) for each in sightings]
    with pytest.raises(CalibrationError, match=r"would be at x 2\.00 m"):
        place_of(far, math.tau)


def test_corners_and_legs_are_no_wall() -> None:
    def raw(range_of: dict[int, float]) -> RawScan:
        return RawScan(
            tuple(math.radians(degree) for degree in range(360)),
            tuple(range_of.get(degree, math.nan) for degree in range(360)),
            (),
        )

    plain = {degree % 360: 0.8 / math.cos(math.radians(degree)) for degree in range(-30, 31)}
    assert wall_of(raw(plain), 0.0) == pytest.approx((0.0, 0.8), abs=1e-9)
    # One edge is left out.
    assert wall_of(raw(plain | {20: 2.0, 21: 2.0}), 0.0) == pytest.approx((0.0, 0.8))
    corner = {
        degree % 360: 0.8 / (math.cos(math.radians(degree)) + abs(math.sin(math.radians(degree))))
        for degree in range(-30, 31)
    }
    assert wall_of(raw(corner), 0.0) is None
    assert wall_of(raw({0: 0.8, 1: 0.8}), 0.0) is None
