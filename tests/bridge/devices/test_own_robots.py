"""Robots of one's own: other wheels, gears and mountings than a TurtleBot3's, in a simulated world."""

import contextlib
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from robosc_bridge.assembly import AssemblyError, drive_base
from robosc_bridge.configuration import parse
from robosc_bridge.devices.dynamixel import DynamixelBase
from robosc_bridge.devices.interface import STANDSTILL, DriveReading, Pose, Velocity
from robosc_bridge.devices.opencr import OpenCrBase
from robosc_bridge.devices.robots import BURGER, Body
from robosc_bridge.errors import DeviceSilentError, WrongDeviceError
from robosc_simulated import BODIES, Noise, Scene, SimulatedTurtleBot3, VirtualHost, Walls
from robosc_simulated.robots import find_body
from support.drive import PATIENT_S, PERIOD_S

# A cart with large wheels, behind toothed belts, whose servos are mounted the other way round than a TurtleBot3's.
CART = replace(
    BODIES["burger"],
    name="cart",
    wheel_radius_m=0.06,
    wheel_separation_m=0.42,
    radius_m=0.3,
    servo_model="XM430-W210",
    gear_ratio=1.5,
    are_mirrored=(True, False),
    are_reversed=(False, False),
    ids=(11, 12),
    baud_code=1,
)
CART_OPTIONS: dict[str, object] = {
    "motors": (11, 12),
    "bauds": (1_000_000, 57_600),
    "wheel_radius_m": 0.06,
    "gear_ratio": 1.5,
    "mirrored": (True, False),
    "model": "XM430-W210",
}
# Both servos on the same side of a gear pair with direct drive, one of them set to reverse by the driver.
TRICYCLE = replace(
    BODIES["burger"], name="tricycle", wheel_radius_m=0.04, wheel_separation_m=0.22, radius_m=0.2, gear_ratio=0.5,
    are_mirrored=(False, True), are_reversed=(True, True), velocity_limit=200,
)  # fmt: skip
TRICYCLE_OPTIONS: dict[str, object] = {
    "wheel_radius_m": 0.04, "gear_ratio": 0.5, "drive_modes": ("normal", "reverse"), "model": "XL430-W250",
}  # fmt: skip
ROBOTS = {
    "cart": (CART, Body(0.25, 1.0, 0.42), CART_OPTIONS),
    "tricycle": (TRICYCLE, Body(0.3, 1.5, 0.22), TRICYCLE_OPTIONS),
}


class Bench:
    """A drive base and a simulated robot on one virtual host."""

    def __init__(self, host: VirtualHost, robot: SimulatedTurtleBot3, base: DynamixelBase | OpenCrBase) -> None:
        self.host, self.robot, self.base = host, robot, base

    def start(self) -> None:
        """Open it and switch torque on, again where the line has damaged too much."""
        for step in (self.base.open, lambda: self.base.set_torque(True)):
            _tried(step)

    def exchange(self, velocity: Velocity = STANDSTILL) -> DriveReading:
        """Exchange, a few times where the line has damaged too much."""
        reading = _tried(lambda: self.base.exchange(velocity))
        self.host.sleep(PERIOD_S)
        return reading

    def drive(self, velocity: Velocity, is_done: Callable[[DriveReading], bool]) -> DriveReading:
        """Drive until the odometry says so, and stop."""
        while not is_done(self.exchange(velocity)):
            pass
        for _ in range(40):
            reading = self.exchange()
        return reading

    def square(self, side_m: float, linear_m_s: float, angular_rad_s: float) -> DriveReading:
        """Drive a square by the odometry; the last reading."""
        reading = self.exchange()
        for _ in range(4):
            reading = self.drive(Velocity(linear_m_s), _is_away(reading.pose, side_m))
            goal_rad = reading.pose.heading_rad + math.pi / 2
            reading = self.drive(Velocity(0.0, angular_rad_s), _has_turned(goal_rad))
        return reading

    def errors(self, pose: Pose) -> tuple[float, float]:
        """Errors of a pose, in metres and in radians."""
        x_m, y_m, heading_rad = self.robot.world.pose
        return math.hypot(pose.x_m - x_m, pose.y_m - y_m), abs(math.remainder(pose.heading_rad - heading_rad, math.tau))


def _tried[T](step: Callable[[], T]) -> T:
    """Do it as a bridge does: what fails three times in a row has failed."""
    for _ in range(2):
        with contextlib.suppress(DeviceSilentError):
            return step()
    return step()


def _is_away(start: Pose, way_m: float) -> Callable[[DriveReading], bool]:
    return lambda now: math.hypot(now.pose.x_m - start.x_m, now.pose.y_m - start.y_m) >= way_m


def _has_turned(goal_rad: float) -> Callable[[DriveReading], bool]:
    return lambda now: math.remainder(now.pose.heading_rad - goal_rad, math.tau) >= 0.0


@contextmanager
def own(name: str, profile: str = "ideal", **options: object) -> Iterator[Bench]:
    simulated, body, usual = ROBOTS[name]
    with (
        VirtualHost() as host,
        SimulatedTurtleBot3(simulated, "dynamixel", walls=Walls(()), clock=host, profile=profile) as robot,
    ):
        arguments = {"answer_limit_s": PATIENT_S, **usual, **options}
        base = DynamixelBase(robot.base_path, body, host=host, **arguments)  # type: ignore[arg-type]
        try:
            yield Bench(host, robot, base)
        finally:
            base.close()


@pytest.mark.parametrize("name", list(ROBOTS))
def test_it_drives_a_square_and_its_odometry_agrees_with_the_world(name: str) -> None:
    with own(name) as bench:
        bench.start()
        reading = bench.square(0.5, 0.15, 0.8)
        way_m, heading_rad = bench.errors(reading.pose)
        # Errors after a way of 2 m and a whole turn.
        assert way_m < 0.002
        assert heading_rad < 0.005
        x_m, y_m, turned_rad = bench.robot.world.pose
        assert math.hypot(x_m, y_m) < 0.09
        assert turned_rad == pytest.approx(2 * math.pi, abs=0.3)
        assert reading.faults == frozenset()


@pytest.mark.parametrize("name", list(ROBOTS))
def test_on_a_bad_day_the_square_is_within_what_the_covariance_says(name: str) -> None:
    with own(name, "bad-day", answer_limit_s=0.034) as bench:
        bench.start()
        reading = bench.square(0.5, 0.15, 0.8)
        way_m, heading_rad = bench.errors(reading.pose)
        xx, _, _, _, yy, _, _, _, hh = reading.pose_covariance
        assert way_m < 3 * math.sqrt(xx + yy)
        # Slip of 2 % of a whole turn is no chance, and more than the variance of chance.
        assert heading_rad < 3 * math.sqrt(hh) + 0.02 * 2 * math.pi
        assert way_m > 0.0


def test_velocities_are_those_of_the_body() -> None:
    with own("cart") as bench:
        bench.base.open()
        assert bench.base.limits.linear_m_s == 0.25
        bench.base.set_torque(True)
        for _ in range(60):
            reading = bench.exchange(Velocity(0.1, 0.3))
        assert reading.velocity.linear_m_s == pytest.approx(0.1, abs=0.001)
        assert reading.velocity.angular_rad_s == pytest.approx(0.3, abs=0.005)
        assert reading.goals_m_s == pytest.approx(reading.wheels_m_s, abs=0.001)
        world = bench.robot.world
        assert (world.floor_speed_m_s, world.floor_yaw_rate_rad_s) == pytest.approx((0.1, 0.3), abs=0.005)
        linear, angular = reading.velocity_variances or (0.0, 0.0)
        assert 1e-8 < linear < angular < 1e-3


def test_drive_modes_are_written_and_kept() -> None:
    with own("tricycle") as bench:
        left, right = bench.robot.left, bench.robot.right
        left.write(64, b"\1")
        bench.base.open()
        assert (left.table["drive mode"], right.table["drive mode"]) == (0, 1)
        assert not left.table["torque enable"]


def test_a_wrong_mounting_is_seen_in_the_world() -> None:
    """The checks above can fail."""
    with own("cart", mirrored=(False, True)) as bench:
        bench.start()
        for _ in range(60):
            reading = bench.exchange(Velocity(0.1))
        assert reading.pose.x_m > 0.04
        assert bench.robot.world.pose[0] < -0.04


@pytest.mark.parametrize(
    ("body", "options", "problem"),
    [
        (Body(0.25, 1.0, 0.42), {"wheel_radius_m": None}, "wheel_radius_m is missing: the radius of the wheels"),
        (Body(0.25, 1.0, 0.42), {"wheel_radius_m": 33.0}, "wheel_radius_m must be from 0.005 to 1, and is 33"),
        (Body(0.25, 1.0, 0.42), {"gear_ratio": 0.0}, "gear_ratio must be from 0.01 to 100, and is 0"),
        (Body(0.25, 1.0, 0.42), {"gear_ratio": math.nan}, "gear_ratio must be from 0.01 to 100, and is nan"),
        (
            Body(0.25, 1.0, 0.42),
            {"model": "XM430"},
            "no model 'XM430' that can be driven; there is XH430",
        ),
        (BURGER, {}, "wheel_radius_m and gear_ratio are for a robot of one's own; those of a burger are known"),
        (BURGER, {"wheel_radius_m": None}, "those of a burger are known"),
    ],
)
def test_what_cannot_be_is_reported_before_anything_is_opened(
    body: Body, options: dict[str, object], problem: str
) -> None:
    with pytest.raises(ValueError, match=problem):
        DynamixelBase("/nowhere", body, **{**CART_OPTIONS, **options})  # type: ignore[arg-type]


def test_wheels_that_are_too_slow_for_the_robot_are_refused() -> None:
    simulated, _, options = ROBOTS["cart"]
    for body, needed in ((Body(0.4, 1.0, 0.42), "0.400"), (Body(0.25, 2.0, 0.42), "0.420")):
        with VirtualHost() as host, SimulatedTurtleBot3(simulated, "dynamixel", clock=host) as robot:
            base = DynamixelBase(robot.base_path, body, host=host, **options)  # type: ignore[arg-type]
            with pytest.raises(WrongDeviceError, match=rf"0\.317 m/s at most \(velocity limit 330 .*need {needed} m/s"):
                base.open()


def test_another_model_is_refused() -> None:
    with own("cart", model="XL430-W250") as bench, pytest.raises(WrongDeviceError, match="model XM430-W210, not XL430"):
        bench.base.open()


def test_a_configuration_makes_it() -> None:
    text = (
        "robot: {wheel_separation_m: 0.42, linear_m_s: 0.25, angular_rad_s: 1.0}\n"
        "drive: {driver: dynamixel, port: /dev/ttyUSB1, options: {motors: [11, 12], model: XM430-W350, "
        "wheel_radius_m: RADIUS, gear_ratio: 1.5, mirrored: [true, false], drive_modes: [normal, reverse]}}\n"
    )
    base = drive_base(parse(text.replace("RADIUS", "0.06").encode(), "own.yaml").configuration)
    assert base.limits.linear_m_s == 0.25
    with pytest.raises(AssemblyError, match="driver 'dynamixel': wheel_radius_m must be from"):
        drive_base(parse(text.replace("RADIUS", "6").encode(), "own.yaml").configuration)
    with pytest.raises(AssemblyError, match="option 'drive_modes': Invalid enum value 'backward'"):
        drive_base(parse(text.replace("RADIUS", "1").replace("reverse", "backward").encode(), "o.yaml").configuration)


def test_a_file_describes_a_simulated_robot(tmp_path: Path) -> None:
    file = tmp_path / "cart.yaml"
    file.write_text(
        "{wheel_radius_m: 0.06, wheel_separation_m: 0.42, radius_m: 0.3, scanner_x_m: -0.032, servo_model: XM430-W210, "
        "gear_ratio: 1.5, are_mirrored: [true, false], are_reversed: [false, false], ids: [11, 12], baud: 57600}"
    )
    assert find_body(file) == replace(CART, fastest_rpm=0.0, opencr_information=0)
    with pytest.raises(ValueError, match="OpenCR's firmware knows the TurtleBot3s alone"):
        SimulatedTurtleBot3(str(file), "opencr")
    for text, problem in (
        ("wheel_radius_m: 0.06", "wheel_separation_m"),
        ("{wheel_radius_m: 9, wheel_separation_m: 0.4, radius_m: 0.3}", "wheel_radius_m"),
        ("{wheel_radius_m: 0.1, wheel_separation_m: 0.4, radius_m: 0.3, baud: 5}", "a servo has no baud 5"),
        ("{wheel_radius_m: 0.1, wheel_separation_m: 0.4, radius_m: 0.3, ids: [1, 1]}", "must have different ids"),
        ("{wheel_radius_m: 0.1, wheel_separation_m: 0.4, radius_m: 0.3, servo_model: X}", "no servo model 'X'"),
    ):
        file.write_text(text)
        with pytest.raises(ValueError, match=problem):
            find_body(file)
    with pytest.raises(ValueError, match="there is no robot and no file 'cart'"):
        find_body("cart")


# Heading from the inertial sensor.


def heading_error_rad(heading: str, noise: Noise, profile: str = "ideal") -> tuple[float, float]:
    """Error of the heading after a square on a floor, and its standard deviation as the odometry has it."""
    scene = Scene("floor", Walls(()), noise=noise)
    with (
        VirtualHost() as host,
        SimulatedTurtleBot3("burger", "opencr", scene=scene, clock=host, profile=profile, seed=3) as robot,
    ):
        base = OpenCrBase(robot.base_path, BURGER, heading=heading, host=host)  # type: ignore[arg-type]
        bench = Bench(host, robot, base)
        bench.start()
        reading = bench.square(0.2, 0.15, 1.0)
        _, error_rad = bench.errors(reading.pose)
        base.close()
        return error_rad, math.sqrt(reading.pose_covariance[8])


@pytest.mark.parametrize("profile", ["ideal", "bad-day"])
def test_with_slipping_wheels_the_heading_is_better_with_the_inertial_sensor(profile: str) -> None:
    slippery = Noise(slip_share=0.1, slip_deviation=0.03)
    wheels_rad, wheels_deviation_rad = heading_error_rad("wheels", slippery, profile)
    fused_rad, fused_deviation_rad = heading_error_rad("fused", slippery, profile)
    # A whole turn, of which a tenth is lost; and a gyroscope that drifts by 0.06 degrees a second.
    assert wheels_rad > 0.3
    assert fused_rad < (0.02 if profile == "ideal" else 0.1)
    assert fused_deviation_rad < wheels_deviation_rad


def test_at_a_standstill_a_drifting_sensor_does_not_rotate_the_robot() -> None:
    with VirtualHost() as host, SimulatedTurtleBot3("burger", "opencr", clock=host, profile="bad-day") as robot:
        base = OpenCrBase(robot.base_path, BURGER, host=host)
        bench = Bench(host, robot, base)
        bench.start()
        begin = bench.exchange()
        host.sleep(60.0)
        for _ in range(20):
            reading = bench.exchange()
        yaw = [2 * math.atan2(one.imu["orientation_z"], one.imu["orientation_w"]) for one in (begin, reading)]
        assert yaw[1] - yaw[0] > 0.05
        assert reading.pose.heading_rad == begin.pose.heading_rad
        base.close()
