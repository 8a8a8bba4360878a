"""Two Dynamixel X servos as wheels, on a U2D2 or another half-duplex adapter.

The servos' bus watchdogs are armed while torque is on: when nothing reaches them for half a second, they stop by
themselves. A servo that has stopped itself, for whatever reason, is not set in motion again before torque is switched
on anew, and one that has shut down not before a person has it restarted.

Source: ROBOTIS e-Manual, pages XL430-W250, XM430-W210 and "DYNAMIXEL Protocol 2.0".
"""

import contextlib
import logging
import time
from collections.abc import Sequence

from robosc_bridge.devices.dynamixel_bus import ANSWER_LIMIT_S, DynamixelBus, RefusedError
from robosc_bridge.devices.following import FollowingWatch
from robosc_bridge.devices.interface import DriveLimits, DriveReading, MotorFault, Velocity
from robosc_bridge.devices.kinematics import body_velocity, wheel_goals
from robosc_bridge.devices.odometry import Odometry
from robosc_bridge.devices.robots import ACCELERATION_RAW_RAD_S2, Robot
from robosc_bridge.devices.servo_settings import ServoSettings, read_settings
from robosc_bridge.errors import BridgeError, DeviceError, DeviceFaultError, DeviceSilentError, WrongDeviceError
from robosc_bridge.protocol import servo
from robosc_bridge.protocol.dynamixel import Status
from robosc_bridge.protocol.servo import Measurement, decode_measurement, encode_velocity
from robosc_bridge.transport.serial_line import SerialLine

FACTORY_BAUD = 57_600
"""What a servo fresh from the factory speaks; a robot's are set to 1 000 000."""

EXCHANGE_LIMIT_S = 0.12
"""Longest `exchange`."""

CHECK_PERIOD_S = 0.1
"""How often it is looked whether the motors have torque and their watchdogs have tripped, beside every exchange."""

_FAULTS = {
    servo.VOLTAGE: MotorFault.VOLTAGE,
    servo.OVERHEATING: MotorFault.OVERHEATING,
    servo.ENCODER: MotorFault.ENCODER,
    servo.SHOCK: MotorFault.SHOCK,
    servo.OVERLOAD: MotorFault.OVERLOAD,
}
_COOLER_C = 10
_REST_RAW = 2
_REST_LIMIT_S = 1.0
_REBOOT_LIMIT_S = 2.0
_POLL_S = 0.01
_FOLLOWING_S = 0.7
# What a servo's LED tells a person, and us: the bridge has it, and it has not restarted since.
_OURS = b"\1"

_log = logging.getLogger(__name__)


class DynamixelBase:
    """A `DriveBase`. Used from one thread.

    Args:
        path: Of the adapter's port.
        robot: Whose wheels they are.
        motors: Ids of the left and the right one; the right one is mounted the other way round.
        bauds: Speeds to look for them at, in this order.
        acceleration_rad_s2: Of a wheel; None: as fast as it can.
        watchdog_s: After how long without a request the motors stop by themselves, at least three exchanges.
        answer_limit_s: Longest wait for one answer.

    Raises:
        ValueError: An argument is out of its range.
    """

    def __init__(
        self,
        path: str,
        robot: Robot,
        motors: tuple[int, int] = (1, 2),
        bauds: Sequence[int] = (1_000_000,),
        acceleration_rad_s2: float | None = None,
        watchdog_s: float = 0.5,
        answer_limit_s: float = ANSWER_LIMIT_S,
    ) -> None:
        if motors[0] == motors[1]:
            raise ValueError("the two motors must have different ids")
        if not bauds:
            raise ValueError("there must be a speed to look for the motors at")
        self._path = path
        self._robot = robot
        self._motors = motors
        self._names = dict(zip(motors, (f"motor {motors[0]} (left)", f"motor {motors[1]} (right)"), strict=True))
        self._bauds = tuple(bauds)
        self._acceleration_raw, ramp_s = _profile(robot, acceleration_rad_s2)
        self._watchdog = round(watchdog_s / servo.WATCHDOG_S)
        if not 1 <= self._watchdog <= servo.WATCHDOG_MOST:
            raise ValueError(f"the bus watchdog must be within {servo.WATCHDOG_MOST * servo.WATCHDOG_S:.2f} s")
        self._answer_limit_s = answer_limit_s
        self._limits = robot.limits(robot.motor.velocity_limit_raw)
        self._odometry = Odometry(robot.tick_m, robot.wheel_separation_m, self._limits.wheel_m_s)
        self._following = FollowingWatch(_FOLLOWING_S + ramp_s)
        self._line: SerialLine | None = None
        self._bus: DynamixelBus | None = None
        self._settings: dict[int, ServoSettings] = {}
        self._hardware: dict[int, frozenset[MotorFault]] = {}
        self._stops: frozenset[MotorFault] = frozenset()
        self._is_torque_wanted = False
        self._is_torque_on = False
        self._is_doubtful = True
        self._exchanged_s = 0.0
        self._check_s = 0.0
        self._checks_watchdog = False

    @property
    def limits(self) -> DriveLimits:
        """What the wheels can do; known after `open`."""
        return self._limits

    def open(self) -> None:
        """Find both motors, check that they can be driven, and set them up; wheels at rest, torque off.

        Hardware errors do not keep it from opening: they are told by `exchange`, and `reset` is what they need.

        Raises:
            LineError: The line cannot be used.
            DeviceSilentError: A motor does not answer.
            WrongDeviceError: They are no such motors, not alike, or set to what cannot be driven.
        """
        self.close()
        try:
            self._line = SerialLine(self._path, self._bauds[0])
            self._bus = DynamixelBus(self._line, self._names.__getitem__, self._answer_limit_s)
            self._odometry = self._odometry.rebased()
            self._is_torque_wanted = self._is_torque_on = False
            self._stops = frozenset()
            self._hardware = {motor: frozenset() for motor in self._motors}
            self._find(self._line)
            self._read_settings(self._bus)
            self._let_go()
            self._set_up(self._bus)
        except BaseException:
            self._release()
            raise

    def set_torque(self, is_on: bool) -> None:
        """Torque on and watchdogs armed, from a standstill; or both off, after a stop.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: A motor does not answer.
            DeviceFaultError: A motor has shut down, or does not do it.
            DeviceError: The wheels still turn, or a motor refuses its settings.
        """
        self._is_torque_wanted = False
        if not is_on:
            self._let_go()
            return
        bus = self._used_bus
        bus.begin(EXCHANGE_LIMIT_S)
        for motor in self._motors:
            if self._read_hardware(motor) - {MotorFault.VOLTAGE}:
                raise DeviceFaultError(f"{self._path}: {self._fault_text(motor)}; it must be reset")
        bus.sync_write(servo.GOAL_VELOCITY, dict.fromkeys(self._motors, encode_velocity(0)))
        if not self._comes_to_rest():
            raise DeviceError(f"{self._path}: the wheels still turn")
        try:
            self._arm(bus)
        except BridgeError:
            with contextlib.suppress(BridgeError):
                self._let_go()
            raise
        self._stops = frozenset()
        self._is_torque_wanted = True
        self._is_doubtful = False
        self._following.forget()
        self._exchanged_s = time.monotonic()

    def exchange(self, velocity: Velocity) -> DriveReading:
        """Command the wheels and read both; at most `EXCHANGE_LIMIT_S`.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: A motor did not answer, also when asked again; the other one has been told to stop.
        """
        bus = self._used_bus
        bus.begin(EXCHANGE_LIMIT_S)
        try:
            return self._exchange(bus, velocity)
        except DeviceError:
            self._is_doubtful = True
            self._halt(bus)
            raise

    def reset(self) -> None:
        """Restart the motors that tell a hardware error; torque is off afterwards.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: A motor does not come back.
            DeviceFaultError: A motor is too hot still, or its error remains.
        """
        bus = self._used_bus
        self._is_torque_wanted = False
        self._halt(bus)
        bus.begin(EXCHANGE_LIMIT_S)
        faulty = [motor for motor in self._motors if self._read_hardware(motor)]
        for motor in faulty:
            self._require_cool(bus, motor)
        for motor in faulty:
            bus.begin(EXCHANGE_LIMIT_S)
            bus.reboot(motor)
        for motor in faulty:
            self._await(bus, motor)
        self._odometry = self._odometry.rebased(self._motors[0] in faulty, self._motors[1] in faulty)
        self._let_go()
        self._set_up(bus)
        self._stops = frozenset()
        for motor in faulty:
            if self._hardware[motor]:
                raise DeviceFaultError(f"{self._path}: {self._fault_text(motor)}, after its restart, too")

    def close(self) -> None:
        """Stop, torque off, watchdogs off, and give the line back."""
        if self._bus is not None:
            self._is_torque_wanted = False
            with contextlib.suppress(BridgeError):
                self._let_go()
            with contextlib.suppress(BridgeError):
                self._bus.sync_write(servo.LED, dict.fromkeys(self._motors, b"\0"))
        self._release()

    def _release(self) -> None:
        if self._line is not None:
            self._line.close()
        self._line = self._bus = None

    @property
    def _used_bus(self) -> DynamixelBus:
        if self._bus is None:
            raise DeviceError(f"{self._path}: the motors are not open")
        return self._bus

    # How it begins.

    def _find(self, line: SerialLine) -> None:
        """Set the line to the speed at which the left motor answers."""
        bus = self._used_bus
        for baud in self._bauds:
            if baud != line.baud:
                line.set_baud(baud)
            bus.begin(EXCHANGE_LIMIT_S)
            try:
                bus.ping(self._motors[0])
            except DeviceSilentError:
                continue
            if baud != self._bauds[0]:
                _log.info("%s: the motors speak %d baud instead of %d", self._path, baud, self._bauds[0])
            return
        tried = ", ".join(map(str, self._bauds))
        hint = "" if FACTORY_BAUD in self._bauds else f"; one fresh from the factory speaks {FACTORY_BAUD} baud"
        raise DeviceSilentError(
            f"{self._path}: {self._names[self._motors[0]]} does not answer at {tried} baud; has it power?{hint}"
        )

    def _read_settings(self, bus: DynamixelBus) -> None:
        left, right = (
            read_settings(bus, motor, f"{self._path}: {self._names[motor]}", motor == self._motors[1], EXCHANGE_LIMIT_S)
            for motor in self._motors
        )
        if left.model_number != right.model_number:
            raise WrongDeviceError(
                f"{self._path}: the motors are not alike: the left one is of model {left.model_number}, "
                f"the right one of {right.model_number}"
            )
        self._settings = dict(zip(self._motors, (left, right), strict=True))
        self._limits = self._robot.limits(min(left.velocity_limit_raw, right.velocity_limit_raw))

    def _set_up(self, bus: DynamixelBus) -> None:
        """What can be done with torque off, and lasts until it restarts."""
        for motor in self._motors:
            bus.begin(EXCHANGE_LIMIT_S)
            if self._settings[motor].operating_mode != servo.VELOCITY_MODE:
                bus.write(motor, servo.OPERATING_MODE, bytes((servo.VELOCITY_MODE,)))
            bus.write(motor, servo.LED, _OURS)
            self._read_hardware(motor)
        self._is_doubtful = False

    def _arm(self, bus: DynamixelBus) -> None:
        """Torque on, then watchdogs, each seen to be done."""
        for motor in self._motors:
            bus.begin(EXCHANGE_LIMIT_S)
            # First the watchdog: a tripped one lets nothing else be written.
            bus.write(motor, servo.BUS_WATCHDOG, b"\0")
            bus.write(motor, servo.PROFILE_ACCELERATION, self._acceleration_raw.to_bytes(4, "little"))
            bus.write(motor, servo.GOAL_VELOCITY, encode_velocity(0))
            bus.write(motor, servo.LED, _OURS)
        self._write_both(servo.TORQUE, 1, "does not hold")
        self._is_torque_on = True
        self._write_both(servo.BUS_WATCHDOG, self._watchdog, "does not arm its bus watchdog")

    def _let_go(self) -> None:
        """Goal zero, wait for the wheels, watchdogs and torque off."""
        bus = self._used_bus
        bus.begin(EXCHANGE_LIMIT_S)
        self._halt(bus)
        try:
            self._comes_to_rest()
        except DeviceError:
            # One does not answer; the other one is let go all the same.
            bus.sync_write(servo.TORQUE, dict.fromkeys(self._motors, b"\0"))
            raise
        self._write_both(servo.BUS_WATCHDOG, 0, "does not disarm its bus watchdog")
        self._write_both(servo.TORQUE, 0, "does not let go")
        self._is_torque_on = False

    def _write_both(self, address: int, value: int, problem: str) -> None:
        """Write one byte to both motors at once, and see that they have it."""
        bus = self._used_bus
        bus.begin(EXCHANGE_LIMIT_S)
        for _ in range(2):
            bus.sync_write(address, dict.fromkeys(self._motors, bytes((value,))))
            found = self._read_both(bus, address, 1)
            wrong = [motor for motor, status in found.items() if status.data[0] != value]
            if not wrong:
                return
        raise DeviceFaultError(f"{self._path}: {self._names[wrong[0]]} {problem}")

    def _comes_to_rest(self) -> bool:
        """Whether both wheels stand still in time."""
        end_s = time.monotonic() + _REST_LIMIT_S
        while True:
            self._used_bus.begin(EXCHANGE_LIMIT_S)
            found = self._read_both(self._used_bus, servo.MEASUREMENT_ADDRESS, servo.MEASUREMENT_LENGTH)
            if all(abs(decode_measurement(status.data).velocity_raw) <= _REST_RAW for status in found.values()):
                return True
            if time.monotonic() > end_s:
                return False
            time.sleep(_POLL_S)

    # How it goes on.

    def _exchange(self, bus: DynamixelBus, velocity: Velocity) -> DriveReading:
        if self._is_doubtful or self._has_paused():
            # A motor that was away may have restarted; nothing is commanded before that is known.
            self._check_torque(bus)
            self._check_watchdogs(bus)
            self._is_doubtful = False
        goals = (0, 0)
        if self._is_torque_wanted:
            if not self._stops:
                goals = wheel_goals(velocity, self._limits, self._robot.wheel_separation_m, self._robot.raw_m_s)
            self._command(bus, goals)
            self._exchanged_s = time.monotonic()
        found = self._read_both(bus, servo.MEASUREMENT_ADDRESS, servo.MEASUREMENT_LENGTH)
        time_s = bus.received_s
        self._look_at_alerts(bus, found)
        self._check_by_turns(bus)
        measured = [decode_measurement(found[motor].data) for motor in self._motors]
        return self._reading(measured, goals, time_s)

    def _has_paused(self) -> bool:
        return self._is_torque_wanted and time.monotonic() - self._exchanged_s > self._watchdog * servo.WATCHDOG_S / 2

    def _command(self, bus: DynamixelBus, goals: tuple[int, int]) -> None:
        data = {
            motor: encode_velocity(self._settings[motor].sign * goal)
            for motor, goal in zip(self._motors, goals, strict=True)
        }
        bus.sync_write(servo.GOAL_VELOCITY, data)

    def _halt(self, bus: DynamixelBus) -> None:
        bus.sync_write(servo.GOAL_VELOCITY, dict.fromkeys(self._motors, encode_velocity(0)))

    def _read_both(self, bus: DynamixelBus, address: int, length: int) -> dict[int, Status]:
        """Sound answers of both motors.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: One does not answer.
            RefusedError: One refuses it.
        """
        found = bus.sync_read(address, length, self._motors)
        silent = [self._names[motor] for motor in self._motors if motor not in found]
        if silent:
            verb = "does" if len(silent) == 1 else "do"
            raise DeviceSilentError(f"{self._path}: {' and '.join(silent)} {verb} not answer")
        for motor, status in found.items():
            if status.number:
                raise RefusedError(f"{self._path}: {self._names[motor]} does not let {address} be read", status)
        return found

    # What the motors tell of themselves.

    def _look_at_alerts(self, bus: DynamixelBus, found: dict[int, Status]) -> None:
        for motor, status in found.items():
            if not status.is_alert:
                self._hardware[motor] = frozenset()
            elif self._read_hardware(motor) - {MotorFault.VOLTAGE}:
                self._is_torque_on = False
                # The other wheel, at once: one alone turns the robot.
                self._stop_for(bus, self._hardware[motor] - {MotorFault.VOLTAGE})

    def _stop_for(self, bus: DynamixelBus, faults: frozenset[MotorFault]) -> None:
        """Stop, and stay so until torque is switched on anew."""
        if self._is_torque_wanted and not faults <= self._stops:
            self._stops |= faults
            self._halt(bus)

    def _read_hardware(self, motor: int) -> frozenset[MotorFault]:
        bits = self._used_bus.read(motor, servo.HARDWARE_ERRORS, 1).data[0]
        self._hardware[motor] = frozenset(fault for bit, fault in _FAULTS.items() if bits & bit)
        return self._hardware[motor]

    def _fault_text(self, motor: int) -> str:
        return f"{self._names[motor]} tells {', '.join(sorted(self._hardware[motor]))}"

    def _check_by_turns(self, bus: DynamixelBus) -> None:
        now_s = time.monotonic()
        if now_s < self._check_s:
            return
        self._check_s = now_s + CHECK_PERIOD_S / 2
        if self._checks_watchdog:
            self._check_watchdogs(bus)
        else:
            self._check_torque(bus)
        self._checks_watchdog = not self._checks_watchdog

    def _check_torque(self, bus: DynamixelBus) -> None:
        found = self._read_both(bus, servo.TORQUE, 2)
        is_left, is_right = (found[motor].data[1:] != _OURS for motor in self._motors)
        if is_left or is_right:
            self._odometry = self._odometry.rebased(is_left, is_right)
            bus.sync_write(servo.LED, dict.fromkeys(self._motors, _OURS))
        self._is_torque_on = all(status.data[0] for status in found.values())
        if not self._is_torque_on:
            self._stop_for(bus, frozenset({MotorFault.TORQUE_LOST}))

    def _check_watchdogs(self, bus: DynamixelBus) -> None:
        found = self._read_both(bus, servo.BUS_WATCHDOG, 1)
        if any(status.data[0] == servo.WATCHDOG_TRIPPED for status in found.values()):
            self._stop_for(bus, frozenset({MotorFault.WATCHDOG}))

    def _reading(self, measured: Sequence[Measurement], goals: tuple[int, int], time_s: float) -> DriveReading:
        signs = [self._settings[motor].sign for motor in self._motors]
        ticks = [sign * one.ticks for sign, one in zip(signs, measured, strict=True)]
        velocities_raw = [sign * one.velocity_raw for sign, one in zip(signs, measured, strict=True)]
        before = self._odometry.rebases
        self._odometry = self._odometry.advanced(ticks[0], ticks[1], time_s)
        # Wheels do not jump: a motor has restarted, and is looked at before anything else is commanded.
        self._is_doubtful = self._odometry.rebases > before
        faults = self._stops.union(*self._hardware.values())
        if not self._is_torque_wanted or self._stops:
            self._following.forget()
        elif self._following.is_blocked(goals, velocities_raw, time_s):
            faults |= {MotorFault.BLOCKED}
        left_m_s, right_m_s = (raw * self._robot.raw_m_s for raw in velocities_raw)
        return DriveReading(
            time_s=time_s,
            pose=self._odometry.pose,
            velocity=body_velocity(left_m_s, right_m_s, self._robot.wheel_separation_m),
            wheels_m_s=(left_m_s, right_m_s),
            is_torque_on=self._is_torque_on,
            faults=faults,
            battery_v=min(one.voltage_v for one in measured),
            temperature_c=max(one.temperature_c for one in measured),
        )

    # How one is restarted.

    def _require_cool(self, bus: DynamixelBus, motor: int) -> None:
        if MotorFault.OVERHEATING not in self._hardware[motor]:
            return
        bus.begin(EXCHANGE_LIMIT_S)
        temperature_c = bus.read(motor, servo.TEMPERATURE, 1).data[0]
        most_c = self._settings[motor].temperature_limit_c - _COOLER_C
        if temperature_c > most_c:
            raise DeviceFaultError(
                f"{self._path}: {self._names[motor]} is at {temperature_c} degrees; let it cool down to {most_c} first"
            )

    def _await(self, bus: DynamixelBus, motor: int) -> None:
        """Wait for a motor that restarts."""
        end_s = time.monotonic() + _REBOOT_LIMIT_S
        while True:
            bus.begin(EXCHANGE_LIMIT_S, repeats=0)
            try:
                bus.ping(motor)
            except DeviceSilentError:
                if time.monotonic() > end_s:
                    raise
            else:
                return


def _profile(robot: Robot, acceleration_rad_s2: float | None) -> tuple[int, float]:
    """The profile acceleration, and how long a wheel takes with it from one full speed to the other.

    Raises:
        ValueError: It cannot be set.
    """
    if acceleration_rad_s2 is None:
        return 0, 0.0
    raw = round(acceleration_rad_s2 / ACCELERATION_RAW_RAD_S2)
    if not 1 <= raw <= servo.PROFILE_MOST:
        raise ValueError(
            f"the acceleration of a wheel must be between {ACCELERATION_RAW_RAD_S2:.2f} "
            f"and {servo.PROFILE_MOST * ACCELERATION_RAW_RAD_S2:.0f} rad/s2"
        )
    fastest_rad_s = robot.linear_m_s / robot.wheel_radius_m
    return raw, 2 * fastest_rad_s / (raw * ACCELERATION_RAW_RAD_S2)
