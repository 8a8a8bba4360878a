"""Two Dynamixel X servos as wheels, on a U2D2 or another half-duplex adapter.

The servos' bus watchdogs are armed while torque is on: a servo that receives nothing for half a second stops on its
own. A servo that has stopped on its own, for whatever reason, is not set in motion again until torque is switched on
anew. A servo that has shut down is not set in motion again until a person has requested its restart.

Source: ROBOTIS e-Manual, pages XL430-W250, XM430-W210 and "DYNAMIXEL Protocol 2.0".
"""

import contextlib
import logging
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

from robosc_bridge.devices.dynamixel_bus import ANSWER_LIMIT_S, BusCounters, DynamixelBus, exchange_limit_s
from robosc_bridge.devices.interface import (
    CONSTANT,
    UNDO_LIMIT_S,
    DriveLimits,
    DriveReading,
    MotorFault,
    Velocity,
    VelocitySource,
    has_stopped,
)
from robosc_bridge.devices.kinematics import body_velocity, wheel_goals
from robosc_bridge.devices.odometry import Odometry, velocity_variances
from robosc_bridge.devices.plausibility import Verdict, WheelCounts, wheel_judge
from robosc_bridge.devices.robots import ACCELERATION_RAW_RAD_S2, SERVOS, Body, Robot, Wheels
from robosc_bridge.devices.servo_pair import ServoPair
from robosc_bridge.devices.wheel_following import FOLLOWING_LIMIT_S, FollowingMonitor
from robosc_bridge.errors import (
    BridgeError,
    DeviceError,
    DeviceSilentError,
    LineError,
    StoppedError,
    WrongDeviceError,
)
from robosc_bridge.host import Host, Port
from robosc_bridge.protocol import servo
from robosc_bridge.protocol.servo import Measurement
from robosc_bridge.transport.system_host import SYSTEM_HOST

FACTORY_BAUD = 57_600
"""Baud rate of a servo fresh from the factory; a robot's servos are set to 1 000 000."""

CHECK_PERIOD_S = 0.1
"""Time between checks of the motors' torque and of tripped watchdogs, in seconds, beside every exchange."""

DriveMode = Literal["normal", "reverse"]
_MODES: dict[DriveMode, int] = {"normal": 0, "reverse": servo.REVERSE}
# Measurements in an exchange: what cannot be is asked for again.
_READS = 2
# An answer comes late by up to the time for which an adapter may keep bytes back, twice.
_COUNTS_LAG_S = 0.05
# A limit that was rounded to three digits is kept.
_ROUNDED = 1.001

_log = logging.getLogger(__name__)


class DynamixelBase:
    """An `AttentiveDriveBase`. Used from one thread.

    Args:
        path: Path of the adapter's port.
        robot: Robot that the wheels belong to: a TurtleBot3, or a body whose wheels the following arguments describe.
        motors: Ids of the left and the right motor.
        bauds: Baud rates at which to look for the motors, in this order.
        wheel_radius_m: Radius of the wheels; None: that of the TurtleBot3.
        gear_ratio: Revolutions of a motor for one revolution of its wheel.
        mirrored: For the left and the right motor, True if its own positive direction turns its wheel backward; the
            drive mode reverse inverts that.
        drive_modes: Drive mode of each motor, `normal` or `reverse`, kept in its EEPROM; None: left as it is.
        model: Required model of the motors; None: any that can be driven.
        acceleration_rad_s2: Acceleration of a wheel; None: the largest that the motor can do.
        watchdog_s: Time without a request after which the motors stop on their own, in seconds, at least three
            exchanges.
        answer_limit_s: Longest wait for one answer.
        host: Parts of its computer that it uses.

    Attributes:
        leftover: Text that says what the motors may still do after `close`; empty: nothing.

    Raises:
        ValueError: An argument is out of its range.
    """

    def __init__(
        self,
        path: str,
        robot: Robot | Body,
        motors: tuple[int, int] = (1, 2),
        bauds: Sequence[int] = (1_000_000,),
        wheel_radius_m: float | None = None,
        gear_ratio: float = 1.0,
        mirrored: tuple[bool, bool] = (False, True),
        drive_modes: tuple[DriveMode, DriveMode] | None = None,
        model: str | None = None,
        acceleration_rad_s2: float | None = None,
        watchdog_s: float = 0.5,
        answer_limit_s: float = ANSWER_LIMIT_S,
        host: Host = SYSTEM_HOST,
    ) -> None:
        if motors[0] == motors[1]:
            raise ValueError("the two motors must have different ids")
        if not bauds:
            raise ValueError("there must be a speed to look for the motors at")
        self._path = path
        self._robot = robot
        self._wheels = _wheels_of(robot, wheel_radius_m, gear_ratio)
        self._mirrored = mirrored
        self._drive_modes = None if drive_modes is None else (_MODES[drive_modes[0]], _MODES[drive_modes[1]])
        if model is not None and model not in SERVOS.values():
            raise ValueError(f"there is no model '{model}' that can be driven; there is {', '.join(SERVOS.values())}")
        self._model = model
        self._names = {motors[0]: f"{path}: motor {motors[0]} (left)", motors[1]: f"{path}: motor {motors[1]} (right)"}
        self._bauds = tuple(bauds)
        self._acceleration_raw, ramp_s = _profile(robot, self._wheels, acceleration_rad_s2)
        unit_rad_s2 = ACCELERATION_RAW_RAD_S2 / self._wheels.gear_ratio
        # None where the motors go to a goal as fast as they can.
        self._acceleration_m_s2 = self._acceleration_raw * unit_rad_s2 * self._wheels.radius_m or None
        self._watchdog = round(watchdog_s / servo.WATCHDOG_S)
        if not 1 <= self._watchdog <= servo.WATCHDOG_MOST:
            raise ValueError(f"the bus watchdog must be within {servo.WATCHDOG_MOST * servo.WATCHDOG_S:.2f} s")
        self._answer_limit_s = answer_limit_s
        self._exchange_limit_s = exchange_limit_s(answer_limit_s)
        self._limits = robot.limits if isinstance(robot, Body) else robot.limits(robot.motor.velocity_limit_raw)
        self._odometry = Odometry(self._wheels.tick_m, self._wheels.separation_m)
        self._judge = wheel_judge(path, _COUNTS_LAG_S)
        self._following = FollowingMonitor(FOLLOWING_LIMIT_S + ramp_s)
        self._host = host
        self._line: Port | None = None
        self._bus: DynamixelBus | None = None
        self._pair: ServoPair | None = None
        self._source: VelocitySource = CONSTANT
        self._is_torque_wanted = False
        self._is_torque_on = False
        # True from the first order to switch torque on until both motors are known to have none, or until it is known
        # whether they have.
        self._may_hold = self._is_uncertain = False
        self.leftover = ""
        # Faults that keep the motors at a standstill until torque is switched on anew.
        self._stops: frozenset[MotorFault] = frozenset()
        # A motor may have restarted.
        self._is_doubtful = True
        self._commanded_s = 0.0
        self._check_s = 0.0
        self._is_watchdog_next = False

    @property
    def limits(self) -> DriveLimits:
        """Limits of the wheels; known after `open`."""
        return self._limits

    @property
    def counters(self) -> BusCounters:
        """Health of the line since it was opened."""
        bus = self._bus
        if bus is None:
            return BusCounters()
        return replace(bus.counters, implausible=self._judge.refused, begun_anew=self._judge.begun_anew)

    # Each drive base with a bus has its own `attend` and `wake`: when it asks its source, only its line decides.
    def attend(self, source: VelocitySource) -> None:
        """Command newer velocities of this source from now on, also between the requests of an exchange."""
        self._source = source

    def wake(self) -> None:
        """Do nothing: while motors answer, nothing can be sent on their bus."""

    def open(self) -> None:
        """Find both motors, check that they can be driven, and set them up; wheels at rest, torque off.

        Hardware errors do not keep it from opening: `exchange` reports them, and `reset` clears them.

        Raises:
            LineError: The line cannot be used.
            DeviceSilentError: A motor does not answer.
            WrongDeviceError: The motors are of another or of different models, or have settings that cannot be driven.
            DeviceFaultError: The torque of a motor cannot be switched off.
        """
        self.close()
        self._odometry = self._odometry.rebased()
        self._judge = wheel_judge(self._path, _COUNTS_LAG_S)
        self._is_torque_wanted = self._is_torque_on = self._is_doubtful = False
        self._stops = frozenset()
        try:
            self._line = self._host.open_port(self._path, self._bauds[0])
            self._bus = DynamixelBus(self._line, self._names.__getitem__, self._answer_limit_s, self._host)
            self._find(self._line, self._bus)
            self._pair = ServoPair(
                self._bus, self._names, self._mirrored, self._exchange_limit_s, self._host, self._drive_modes
            )
            self._check_model(self._pair)
            self._limits = self._limits_of(self._pair)
            self._release_torque(self._pair)
            self._pair.set_up()
        except BaseException:
            self._release()
            raise

    def _check_model(self, pair: ServoPair) -> None:
        settings = next(iter(pair.settings.values()))
        found = SERVOS[settings.model_number]
        if self._model is not None and found != self._model:
            raise WrongDeviceError(f"{self._path}: the motors are of model {found}, not {self._model}")

    def _limits_of(self, pair: ServoPair) -> DriveLimits:
        most_raw = min(settings.velocity_limit_raw for settings in pair.settings.values())
        if isinstance(self._robot, Robot):
            return self._robot.limits(most_raw)
        wheel_m_s, limits = most_raw * self._wheels.raw_m_s, self._robot.limits
        rotation_m_s = limits.angular_rad_s * self._wheels.separation_m / 2
        if max(limits.linear_m_s, rotation_m_s) > wheel_m_s * _ROUNDED:
            raise WrongDeviceError(
                f"{self._path}: the motors turn the wheels with {wheel_m_s:.3f} m/s at most (velocity limit {most_raw} "
                f"at address {servo.VELOCITY_LIMIT}), and robot.linear_m_s and robot.angular_rad_s need "
                f"{max(limits.linear_m_s, rotation_m_s):.3f} m/s; make these smaller, or the limit larger"
            )
        return DriveLimits(limits.linear_m_s, limits.angular_rad_s, min(limits.wheel_m_s, wheel_m_s))

    def set_torque(self, is_on: bool) -> None:
        """Switch torque on and arm the watchdogs, from a standstill; or switch both off, after a stop.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: A motor does not answer.
            DeviceFaultError: A motor has shut down, or does not switch its torque.
            StoppedError: A stop came meanwhile.
            DeviceError: The wheels still rotate, or a motor refuses its settings.
        """
        pair, _ = self._opened()
        self._is_torque_wanted = self._is_torque_on = False
        if not is_on:
            self._release_torque(pair)
            self._stops = frozenset()
            return
        try:
            pair.arm(self._acceleration_raw, self._watchdog, self._begin)
        except BridgeError:
            with contextlib.suppress(BridgeError):
                self._release_torque(pair)
            raise
        self._is_torque_wanted = self._is_torque_on = True
        self._is_uncertain = False
        self._stops = frozenset()
        self._following.forget()
        self._commanded_s = self._host.monotonic()

    def _begin(self) -> None:
        """Note that torque goes on.

        Raises:
            StoppedError: A stop came; it must not.
        """
        if has_stopped(self._source):
            raise StoppedError(f"{self._path}: torque is not switched on, as a stop came meanwhile")
        self._may_hold = self._is_uncertain = True

    def _release_torque(self, pair: ServoPair) -> None:
        pair.release_torque()
        self._may_hold = self._is_uncertain = False
        self.leftover = ""

    def exchange(self, velocity: Velocity) -> DriveReading:
        """Command and read both wheels, in at most `exchange_limit_s` of the bus.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: A motor did not answer, also when asked again; a stop has been sent to the other one.
        """
        pair, bus = self._opened()
        bus.begin(self._exchange_limit_s)
        try:
            return self._exchange(pair, bus, velocity)
        except DeviceError:
            self._is_doubtful = True
            pair.halt()
            raise

    def reset(self) -> None:
        """Restart the motors that report a hardware error; torque is off afterwards.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: A motor does not come back.
            DeviceFaultError: A motor is still too hot, or its error remains.
        """
        pair, _ = self._opened()
        self._is_torque_wanted = self._is_torque_on = False
        pair.halt()
        is_left, is_right = pair.restart_faulty()
        self._odometry = self._odometry.rebased(is_left, is_right)
        self._judge.forget()
        self._release_torque(pair)
        pair.set_up()
        self._stops = frozenset()

    def close(self) -> None:
        """Stop the wheels, switch torque and watchdogs off, and close the line."""
        pair = self._pair
        if pair is not None:
            with contextlib.suppress(LineError):
                self._let_go(*self._opened())
            with contextlib.suppress(BridgeError):
                pair.switch_leds_off()
            names = " and ".join(self._names.values())
            self.leftover = (
                f"{names} may hold: they have not confirmed that torque is off; cut their power"
                if self._may_hold
                else ""
            )
        self._release()

    def _let_go(self, pair: ServoPair, bus: DynamixelBus) -> None:
        """Switch torque off; after a stop again and again for a time, where that is of use.

        Raises:
            LineError: The line is gone.
        """
        end_s = self._host.monotonic() + UNDO_LIMIT_S
        while True:
            began_s = self._host.monotonic()
            try:
                self._release_torque(pair)
            except DeviceError as error:
                _log.debug("%s", error)
            if not (self._may_hold and has_stopped(self._source)):
                return
            is_heard = bus.received_s > began_s
            if not (is_heard or self._is_uncertain) or self._host.monotonic() > end_s:
                return
            self._host.sleep(CHECK_PERIOD_S)

    def _release(self) -> None:
        if self._line is not None:
            self._line.close()
        self._line = self._bus = self._pair = None
        self._is_torque_wanted = self._is_torque_on = False

    def _opened(self) -> tuple[ServoPair, DynamixelBus]:
        if self._pair is None or self._bus is None:
            raise DeviceError(f"{self._path}: the motors are not open")
        return self._pair, self._bus

    def _find(self, line: Port, bus: DynamixelBus) -> None:
        """Set the line to the speed at which the left motor answers."""
        left = next(iter(self._names))
        for baud in self._bauds:
            if baud != line.baud:
                line.set_baud(baud)
            bus.begin(self._exchange_limit_s)
            try:
                bus.ping(left)
            except DeviceSilentError:
                continue
            if baud != self._bauds[0]:
                _log.info("%s: the motors speak %d baud instead of %d", self._path, baud, self._bauds[0])
            return
        tried = " or ".join(map(str, self._bauds))
        hint = "" if FACTORY_BAUD in self._bauds else f" A motor fresh from the factory speaks {FACTORY_BAUD} baud."
        raise DeviceSilentError(f"{self._names[left]} does not answer at {tried} baud; does it have power?{hint}")

    def _exchange(self, pair: ServoPair, bus: DynamixelBus, velocity: Velocity) -> DriveReading:
        if self._is_doubtful or self._has_paused():
            # No velocity is commanded before the state of the motors is known.
            self._check_torque(pair)
            self._check_watchdogs(pair)
            self._is_doubtful = False
            velocity = self._source.newer() or velocity
        goals = self._commanded(pair, velocity)
        measured, goals = self._measured(pair, bus, goals)
        time_s = bus.received_s
        if self._host.monotonic() >= self._check_s:
            goals = self._renewed(pair, goals)
            self._check_alternately(pair)
        return self._reading(pair, measured, goals, time_s)

    def _measured(
        self, pair: ServoPair, bus: DynamixelBus, goals: tuple[int, int]
    ) -> tuple[list[Measurement], tuple[int, int]]:
        """Return a measurement of each motor that can be, and the goals now; asks again for what cannot be.

        Raises:
            DeviceSilentError: The motors do not answer with what can be.
        """
        for _ in range(_READS):
            answers = pair.measure()
            for motor, (_, is_alert) in zip(pair.motors, answers, strict=True):
                self._look_at(pair, motor, is_alert)
            left, right = (measurement for measurement, _ in answers)
            counts = WheelCounts((left.ticks, right.ticks), (left.velocity_raw, right.velocity_raw))
            verdict = self._judge.judge(counts, bus.received_s)
            if verdict is Verdict.REFUSED:
                goals = self._renewed(pair, goals)
                if self._check_torque(pair) and len(self._judge.excess) == len(counts.ticks):
                    # One that has restarted counts anew.
                    self._judge.begin_anew(counts, bus.received_s)
                    return [left, right], goals
                continue
            if verdict is Verdict.ANEW:
                is_left, is_right = map(bool, self._judge.excess)
                self._odometry = self._odometry.rebased(is_left, is_right)
            return [left, right], goals
        reason = "; ".join(filter(None, self._judge.excess))
        raise DeviceSilentError(f"{self._path}: the motors do not answer with what can be: {reason}")

    def _commanded(self, pair: ServoPair, velocity: Velocity) -> tuple[int, int]:
        """Command a velocity, where the motors are to obey; returns their goals."""
        goals = (0, 0)
        if not self._is_torque_wanted:
            return goals
        if not self._stops and self._host.monotonic() <= velocity.until_s:
            goals = wheel_goals(velocity, self._limits, self._wheels.separation_m, self._wheels.raw_m_s)
        pair.command(goals)
        self._commanded_s = self._host.monotonic()
        if not self._stops:
            self._source.written()
        return goals

    def _renewed(self, pair: ServoPair, goals: tuple[int, int]) -> tuple[int, int]:
        """Command what is newer than these goals before something else is asked; returns the goals now."""
        velocity = self._source.newer() if self._is_torque_wanted else None
        return goals if velocity is None else self._commanded(pair, velocity)

    def _has_paused(self) -> bool:
        return (
            self._is_torque_wanted
            and self._host.monotonic() - self._commanded_s > self._watchdog * servo.WATCHDOG_S / 2
        )

    def _look_at(self, pair: ServoPair, motor: int, is_alert: bool) -> None:
        if not is_alert:
            pair.hardware[motor] = frozenset()
        elif faults := pair.read_hardware(motor) - {MotorFault.VOLTAGE}:
            self._is_torque_on = False
            # The other wheel, at once: one alone rotates the robot.
            self._stop_for(pair, faults)

    def _check_alternately(self, pair: ServoPair) -> None:
        self._check_s = self._host.monotonic() + CHECK_PERIOD_S / 2
        if self._is_watchdog_next:
            self._check_watchdogs(pair)
        else:
            self._check_torque(pair)
        self._is_watchdog_next = not self._is_watchdog_next

    def _check_torque(self, pair: ServoPair) -> bool:
        """Find out whether the motors have torque; returns whether one has restarted."""
        self._is_torque_on, (has_left, has_right) = pair.read_torque()
        if has_left or has_right:
            self._odometry = self._odometry.rebased(has_left, has_right)
            self._judge.forget()
        if not self._is_torque_on:
            self._stop_for(pair, frozenset({MotorFault.TORQUE_LOST}))
        return has_left or has_right

    def _check_watchdogs(self, pair: ServoPair) -> None:
        if pair.has_tripped():
            self._stop_for(pair, frozenset({MotorFault.WATCHDOG}))

    def _stop_for(self, pair: ServoPair, faults: frozenset[MotorFault]) -> None:
        if self._is_torque_wanted and not faults <= self._stops:
            self._stops |= faults
            pair.halt()

    def _reading(
        self, pair: ServoPair, measured: Sequence[Measurement], goals: tuple[int, int], time_s: float
    ) -> DriveReading:
        self._odometry = self._odometry.advanced(measured[0].ticks, measured[1].ticks)
        velocities_raw = [one.velocity_raw for one in measured]
        faults = self._stops.union(*pair.hardware.values())
        if not self._is_torque_wanted or self._stops:
            self._following.forget()
        elif self._following.is_blocked(goals, velocities_raw, time_s):
            faults |= {MotorFault.BLOCKED}
        left_m_s, right_m_s = (raw * self._wheels.raw_m_s for raw in velocities_raw)
        return DriveReading(
            time_s=time_s,
            pose=self._odometry.pose,
            velocity=body_velocity(left_m_s, right_m_s, self._wheels.separation_m),
            wheels_m_s=(left_m_s, right_m_s),
            is_torque_on=self._is_torque_on,
            faults=faults,
            acceleration_m_s2=self._acceleration_m_s2,
            battery_v=min(one.voltage_v for one in measured),
            temperature_c=max(one.temperature_c for one in measured),
            goals_m_s=self._goals_m_s(goals) if self._is_torque_wanted else None,
            wheels_m=self._odometry.wheels_m,
            wheel_radius_m=self._wheels.radius_m,
            refused=self._judge.refused,
            pose_covariance=self._odometry.covariance,
            velocity_variances=velocity_variances(left_m_s, right_m_s, self._wheels.raw_m_s, self._wheels.separation_m),
        )

    def _goals_m_s(self, goals: tuple[int, int]) -> tuple[float, float]:
        left, right = goals
        return left * self._wheels.raw_m_s, right * self._wheels.raw_m_s


def _wheels_of(robot: Robot | Body, radius_m: float | None, gear_ratio: float) -> Wheels:
    """The wheels of a robot.

    Raises:
        ValueError: They are not known, or impossible.
    """
    for name, value, least, most in (
        ("wheel_radius_m", radius_m, 0.005, 1.0),
        ("gear_ratio", gear_ratio, 0.01, 100.0),
    ):
        if value is not None and not least <= value <= most:
            raise ValueError(f"{name} must be from {least:g} to {most:g}, and is {value:g}")
    if isinstance(robot, Robot):
        if radius_m is not None or gear_ratio != 1.0:
            raise ValueError(
                f"wheel_radius_m and gear_ratio are for a robot of one's own; those of a {robot.name} are known "
                "(write wheel_separation_m, linear_m_s and angular_rad_s below 'robot')"
            )
        return robot.wheels
    if radius_m is None:
        raise ValueError("wheel_radius_m is missing: the radius of the wheels of a robot of one's own, in metres")
    return Wheels(radius_m, robot.wheel_separation_m, gear_ratio)


def _profile(robot: Robot | Body, wheels: Wheels, acceleration_rad_s2: float | None) -> tuple[int, float]:
    """The profile acceleration, and how long a wheel takes with it from one full speed to the other.

    Raises:
        ValueError: It cannot be set.
    """
    if acceleration_rad_s2 is None:
        return 0, 0.0
    unit_rad_s2 = ACCELERATION_RAW_RAD_S2 / wheels.gear_ratio
    raw = round(acceleration_rad_s2 / unit_rad_s2)
    if not 1 <= raw <= servo.PROFILE_MOST:
        raise ValueError(
            f"the acceleration of a wheel must be between {unit_rad_s2:.2f} "
            f"and {servo.PROFILE_MOST * unit_rad_s2:.0f} rad/s2"
        )
    fastest_rad_s = robot.linear_m_s / wheels.radius_m
    return raw, 2 * fastest_rad_s / (raw * unit_rad_s2)
