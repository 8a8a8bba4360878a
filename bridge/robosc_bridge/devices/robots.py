"""Robots as data: the TurtleBot3s, and bodies of one's own.

Sources: ROBOTIS e-Manual, "TurtleBot3: Features"; ROBOTIS-GIT/OpenCR 1.5.3, `turtlebot3_ros2` (what its firmware makes
of a command); e-Manual pages XL430-W250 and XM430-W210.
"""

import math
from dataclasses import dataclass

from robosc_bridge.devices.interface import DriveLimits

TICKS_PER_TURN = 4096

RAW_RPM = 0.229
"""Revolutions per minute in one unit of a servo's velocity."""

ACCELERATION_RAW_RAD_S2 = 214.577 * 2 * math.pi / 3600
"""One unit of a servo's profile acceleration (214.577 rev/min2)."""


@dataclass(frozen=True, slots=True)
class Motor:
    """A kind of wheel servo.

    Attributes:
        name: Name as on its label.
        model_number: Number that it reports.
        velocity_limit_raw: Factory setting of the limit of its goal velocity; it ignores goals beyond the limit.
        lowest_v: Lowest supply that it is made for, in volts.
    """

    name: str
    model_number: int
    velocity_limit_raw: int
    lowest_v: float


XL430_W250 = Motor("XL430-W250", 1060, 265, 6.5)
XM430_W210 = Motor("XM430-W210", 1030, 330, 10.0)
SERVOS = {
    1000: "XH430-W350", 1001: "XD430-T350", 1010: "XH430-W210", 1011: "XD430-T210", 1020: "XM430-W350",
    1030: "XM430-W210", 1040: "XH430-V350", 1050: "XH430-V210", 1060: "XL430-W250", 1070: "XC430-W150",
    1080: "XC430-W240", 1090: "2XL430-W250", 1100: "XH540-W270", 1110: "XH540-W150", 1120: "XM540-W270",
    1130: "XM540-W150", 1160: "2XC430-W250",
}  # fmt: skip
"""Servos that can be wheels, by model number: those of the X series whose control tables have what is needed in one
place and one unit (dynamixel-sdk 4.1.0, `control_table/*.model`)."""


@dataclass(frozen=True, slots=True)
class Battery:
    """Voltages of the battery.

    Attributes:
        empty_v: Voltage of an empty battery.
    """

    empty_v: float = 10.5


@dataclass(frozen=True, slots=True)
class Body:
    """Abilities of a robot as its owner states them: enough for a drive base that controls its own motors.

    Attributes:
        linear_m_s: Fastest speed forward and backward; of a MAVLink rover, not more than its parameter CRUISE_SPEED.
        angular_rad_s: Fastest rotation.
        wheel_separation_m: Distance between its left and its right wheels, in metres.
    """

    linear_m_s: float
    angular_rad_s: float
    wheel_separation_m: float

    def __post_init__(self) -> None:
        for name in ("linear_m_s", "angular_rad_s", "wheel_separation_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} of a robot must be a positive number, and is {value}")

    @property
    def limits(self) -> DriveLimits:
        """Limits of the body; a wheel may be as fast as full speed and full rotation together make it."""
        wheel_m_s = self.linear_m_s + self.angular_rad_s * self.wheel_separation_m / 2
        return DriveLimits(self.linear_m_s, self.angular_rad_s, wheel_m_s)


@dataclass(frozen=True, slots=True)
class Wheels:
    """Two wheels, each driven by a servo.

    Attributes:
        radius_m: Radius of both, in metres.
        separation_m: Distance between their middles, in metres.
        gear_ratio: Revolutions of a servo for one of its wheel.
    """

    radius_m: float
    separation_m: float
    gear_ratio: float = 1.0

    @property
    def raw_m_s(self) -> float:
        """Speed of a wheel in one unit of its servo's velocity."""
        return RAW_RPM * 2 * math.pi / 60 * self.radius_m / self.gear_ratio

    @property
    def tick_m(self) -> float:
        """Way of a wheel in one tick of its servo's encoder."""
        return 2 * math.pi / TICKS_PER_TURN * self.radius_m / self.gear_ratio


@dataclass(frozen=True, slots=True)
class Robot:
    """A differential-drive robot.

    Attributes:
        name: Name of the robot in configurations.
        radius_m: Radius of the circle around it, as the firmware has it.
        wheel_radius_m: Radius of both wheels.
        wheel_separation_m: Distance between the wheels' middles, in metres.
        linear_m_s: Fastest as published; also what the teleoperation of the stock robot clamps to.
        angular_rad_s: Fastest rotation, with the same source.
        motor: Motor of both wheels.
        firmware_rpm: Limit that OpenCR's firmware puts on its commands, in rpm.
        opencr_information: Numbers that an OpenCR for this robot reports as its model information.
        battery: Voltages at which its battery is low.
    """

    name: str
    radius_m: float
    wheel_radius_m: float
    wheel_separation_m: float
    linear_m_s: float
    angular_rad_s: float
    motor: Motor
    firmware_rpm: float
    opencr_information: frozenset[int]
    battery: Battery = Battery()

    @property
    def raw_m_s(self) -> float:
        """Speed of a wheel in one unit of its servo's velocity."""
        return RAW_RPM * 2 * math.pi / 60 * self.wheel_radius_m

    @property
    def tick_m(self) -> float:
        """Way of a wheel in one tick of its encoder."""
        return 2 * math.pi / TICKS_PER_TURN * self.wheel_radius_m

    @property
    def wheels(self) -> "Wheels":
        """Wheels of the robot."""
        return Wheels(self.wheel_radius_m, self.wheel_separation_m)

    @property
    def body(self) -> Body:
        """Body of the robot, for a drive base that controls its own motors."""
        return Body(self.linear_m_s, self.angular_rad_s, self.wheel_separation_m)

    def limits(self, velocity_limit_raw: int) -> DriveLimits:
        """Return the limits of the robot with servos that accept goal velocities up to a limit."""
        firmware_m_s = self.firmware_rpm * 2 * math.pi / 60 * self.wheel_radius_m
        wheel_m_s = min(velocity_limit_raw * self.raw_m_s, firmware_m_s)
        rotation_rad_s = wheel_m_s / (self.wheel_separation_m / 2)
        return DriveLimits(min(self.linear_m_s, wheel_m_s), min(self.angular_rad_s, rotation_rad_s), wheel_m_s)


BURGER = Robot("burger", 0.105, 0.033, 0.160, 0.22, 2.84, XL430_W250, 61.0, frozenset({1}))
# The board of a Waffle reports another number with an OpenManipulator.
WAFFLE = Robot("waffle", 0.220, 0.033, 0.287, 0.26, 1.82, XM430_W210, 77.0, frozenset({2, 3}))
WAFFLE_PI = Robot("waffle_pi", 0.220, 0.033, 0.287, 0.26, 1.82, XM430_W210, 77.0, frozenset({2, 3}))
ROBOTS = {robot.name: robot for robot in (BURGER, WAFFLE, WAFFLE_PI)}
