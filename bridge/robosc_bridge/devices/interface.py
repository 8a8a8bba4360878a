"""Interface of drive bases and range scanners to the rest of the bridge, the same for all devices.

Each is used from one thread, that of its line; none of the methods waits longer than the limit of the line. Times are
those of `robosc_bridge.host.monotonic`, in seconds. Axes are those of REP 103: x forward, angles counter-clockwise.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol, runtime_checkable


@dataclass(frozen=True)
class Velocity:
    """A velocity of the body.

    Attributes:
        linear_m_s: Forward.
        angular_rad_s: Counter-clockwise.
        until_s: Time after which it may no longer be commanded, in seconds; equality ignores it.
    """

    linear_m_s: float = 0.0
    angular_rad_s: float = 0.0
    until_s: float = field(default=math.inf, compare=False)


STANDSTILL = Velocity()


@dataclass(frozen=True)
class Pose:
    """Position and heading of the body since the odometry began.

    Attributes:
        x_m: Distance along the first heading, in metres.
        y_m: Distance to its left, in metres.
        heading_rad: Heading within (-pi, pi], in radians.
    """

    x_m: float = 0.0
    y_m: float = 0.0
    heading_rad: float = 0.0


class MotorFault(StrEnum):
    """Fault that a wheel's motor or the base reports; those from `OVERHEATING` to `TORQUE_LOST` end its torque."""

    VOLTAGE = "input voltage"
    OVERHEATING = "overheating"
    ENCODER = "encoder"
    SHOCK = "electrical shock"
    OVERLOAD = "overload"
    TORQUE_LOST = "torque off by itself"
    WATCHDOG = "bus watchdog"
    BLOCKED = "does not rotate as commanded"
    UNCOMMANDED = "rotates without a command"


class BatteryLevel(StrEnum):
    """Judgement of a drive base on its own battery."""

    SOUND = "sound"
    LOW = "low"
    EMPTY = "empty"


@dataclass(frozen=True)
class DriveReading:
    """Reading of a drive base in one exchange.

    Attributes:
        time_s: Time when its last byte had come, in seconds.
        pose: Odometry.
        velocity: Velocity as the wheels measure it.
        wheels_m_s: Speed of the left and the right wheel.
        goals_m_s: Speeds that were commanded to the left and the right wheel in this exchange, as the device rounds
            them; None: none were commanded, or the driver does not say.
        pose_covariance: Covariance of x, y and heading of the pose, row by row, in m², m rad and rad²; it grows from
            zero where the odometry began. Empty: it is not known.
        velocity_variances: Variances of the linear and the angular velocity; None: they are not known.
        is_torque_on: True if the motors hold and obey.
        faults: Faults of any motor.
        acceleration_m_s2: Acceleration with which the motors bring a wheel to a new goal; None: the largest they can
            do.
        battery_v: Voltage of the battery, in volts; None: it is not reported.
        battery_share: Charge of the battery, 0 to 1; None: it is not reported.
        battery_level: Judgement of the drive base itself on the battery; None: it makes none.
        temperature_c: Temperature of the hottest motor, in degrees Celsius; None: it is not reported.
        buttons: True for each button that is pressed, by name: `button_1`, `bumper_1` and so on.
        imu: Further measurements by name, such as `angular_velocity_z`; empty: there are none.
        wheels_m: Distance that the left and the right wheel have rolled since the odometry began; None: encoders are
            not read.
        wheel_radius_m: Radius of both wheels; None: not known.
        refused: Number of readings that were refused since the drive base was opened, as no body moves like that.
    """

    time_s: float
    pose: Pose
    velocity: Velocity
    wheels_m_s: tuple[float, float]
    is_torque_on: bool
    faults: frozenset[MotorFault] = frozenset()
    acceleration_m_s2: float | None = None
    battery_v: float | None = None
    battery_share: float | None = None
    battery_level: BatteryLevel | None = None
    temperature_c: float | None = None
    buttons: Mapping[str, bool] = field(default_factory=dict)
    imu: Mapping[str, float] = field(default_factory=dict)
    goals_m_s: tuple[float, float] | None = None
    pose_covariance: tuple[float, ...] = ()
    velocity_variances: tuple[float, float] | None = None
    wheels_m: tuple[float, float] | None = None
    wheel_radius_m: float | None = None
    refused: int = 0


@dataclass(frozen=True)
class DriveLimits:
    """Limits of a drive base.

    Attributes:
        linear_m_s: Fastest speed forward and backward.
        angular_rad_s: Fastest rotation.
        wheel_m_s: Fastest wheel.
    """

    linear_m_s: float
    angular_rad_s: float
    wheel_m_s: float


class DriveBase(Protocol):
    """Two wheels and their motors, behind any device."""

    @property
    def limits(self) -> DriveLimits:
        """Limits of the drive base; known after `open`."""

    def open(self) -> None:
        """Find the device, check that it is the expected one, and leave it at a standstill with torque off.

        Raises:
            LineError: The line cannot be used.
            DeviceError: The device that answers there cannot be driven.
        """

    def set_torque(self, is_on: bool) -> None:
        """Switch torque on, from a standstill; or switch it off, after a goal of zero.

        Raises:
            LineError: The line is gone.
            StoppedError: A stop came meanwhile (`StoppableSource.is_stopped`), after which nothing was begun; what was
                begun before ends when torque is switched off, or with `close`.
            DeviceError: The device does not switch torque.
        """

    def exchange(self, velocity: Velocity) -> DriveReading:
        """One cycle: command a velocity within the limits, keep every watchdog fed, read everything.

        If the `until_s` of the velocity has passed, zero is commanded instead: a thread that was halted between the
        decision and the writing must not set the wheels in motion when it continues. The driver checks the time just
        before it writes.

        With torque off the velocity is not sent, and zero is what the device has as its goal.

        Raises:
            LineError: The line is gone.
            DeviceError: The device did not answer, also when asked again within the cycle.
        """

    def reset(self) -> None:
        """Reboot motors that have switched themselves off, at a person's request; torque is off afterwards.

        Raises:
            LineError: The line is gone.
            DeviceError: The device does not come back, or its fault remains (too hot still).
        """

    def close(self) -> None:
        """Stop the wheels, switch torque off, close the line; never raises, may be called at any time and again.

        What may have been begun is undone after a stop (`StoppableSource.is_stopped`) for up to `UNDO_LIMIT_S`, as long
        as the device is heard or it is not known whether it has begun. A driver that is not sure of it afterwards says
        so in an attribute `leftover`: what may still hold or move, in one line; empty: nothing does.
        """


class VelocitySource(Protocol):
    """Source of the velocity to command now, for a drive base that reads it during an exchange, too."""

    def newer(self) -> Velocity | None:
        """Return the velocity to command instead of the last one; None: there is no other one."""

    def written(self) -> None:
        """Note that the line has taken the bytes of the last velocity, or that the device has that velocity already."""


@runtime_checkable
class StoppableSource(VelocitySource, Protocol):
    """Source that also says when a stop has come."""

    def is_stopped(self) -> bool:
        """Return True if torque is no longer to be switched on: what has not begun must not begin then."""


class _ConstantSource:
    """Source for a drive base that is used alone: each velocity holds until the next exchange."""

    def newer(self) -> Velocity | None:
        return None

    def written(self) -> None:
        pass


UNDO_LIMIT_S = 5.0
"""Time for which a driver tries to undo what it may have begun, when it is closed, in seconds."""

CONSTANT: VelocitySource = _ConstantSource()


def has_stopped(source: VelocitySource) -> bool:
    """Return True if a source says that a stop has come; one that cannot say so never does."""
    return isinstance(source, StoppableSource) and source.is_stopped()


@runtime_checkable
class AttentiveDriveBase(DriveBase, Protocol):
    """A drive base that commands a newer velocity also during an exchange, and reports when a velocity was written.

    Of any other drive base, a velocity counts as written when its exchange is over, and a newer one waits for that.
    """

    def attend(self, source: VelocitySource) -> None:
        """Ask this source for velocities from now on, only within `exchange` and in the thread of the drive base."""

    def wake(self) -> None:
        """Let an exchange under way ask its source soon; from any thread or signal handler, at any time."""


@dataclass(frozen=True)
class RawScan:
    """One revolution as the device measured it, in its order.

    Attributes:
        angles_rad: Of each point, counter-clockwise from the front, within [0, 2 pi).
        ranges_m: 0 where something is nearer than the device measures; NaN where nothing valid was measured.
        intensities: As the device gives them.
    """

    angles_rad: tuple[float, ...]
    ranges_m: tuple[float, ...]
    intensities: tuple[float, ...]


BINS = 360


@dataclass(frozen=True)
class Scan:
    """One full revolution.

    Attributes:
        time_s: Time when its last byte had come, in seconds.
        ranges_m: `BINS` bins of one degree, counter-clockwise, the first straight ahead and half a degree to both
            sides of it; the smallest valid range of each: 0 where something is nearer than the device measures, NaN
            if none.
        raw: The scan as it was measured.
        revolutions_per_s: Speed of the motor as the device reports it.
        min_m: Shortest distance that the device measures; 0: unknown.
        max_m: Longest; infinite: unknown.
    """

    time_s: float
    ranges_m: tuple[float, ...]
    raw: RawScan
    revolutions_per_s: float
    min_m: float = 0.0
    max_m: float = math.inf


@dataclass
class ScannerCounters:
    """Health of a scanner's line.

    Attributes:
        scans: Full revolutions.
        frames: Well-formed frames.
        bad_frames: Frames with a wrong checksum or impossible contents.
        skipped_bytes: Bytes that belong to no frame.
        invalid: Measurements that the device itself marks as invalid.
    """

    scans: int = 0
    frames: int = 0
    bad_frames: int = 0
    skipped_bytes: int = 0
    invalid: int = 0


class RangeScanner(Protocol):
    """A LiDAR that rotates."""

    counters: ScannerCounters

    def open(self) -> None:
        """Open the line and start the motor.

        Raises:
            LineError: The line cannot be used.
        """

    def receive(self, limit_s: float) -> Scan | None:
        """Return the next full revolution; None: none was complete within the limit, or before `wake` was called.

        Raises:
            LineError: The line is gone.
        """

    def wake(self) -> None:
        """Let a `receive` that waits in another thread return at once."""

    def restart(self) -> None:
        """Stop and start a motor that has fallen silent, where the device has commands for that."""

    def close(self) -> None:
        """Stop the motor, close the line; never raises, may be called at any time and again."""
