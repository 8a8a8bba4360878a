"""The two wheel servos on their bus, as one unit that confirms its commands."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from robosc_bridge.devices.dynamixel_bus import DynamixelBus, RefusedError
from robosc_bridge.devices.interface import MotorFault
from robosc_bridge.devices.servo_settings import ServoSettings, read_settings
from robosc_bridge.errors import DeviceError, DeviceFaultError, DeviceSilentError, WrongDeviceError
from robosc_bridge.host import Host
from robosc_bridge.protocol import servo
from robosc_bridge.protocol.dynamixel import StatusPacket
from robosc_bridge.protocol.servo import Measurement, decode_measurement, encode_velocity

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
# Value of a servo's LED, on since the bridge has opened it: a servo that has restarted since has it off.
_OURS = b"\1"


class ServoPair:
    """Two servos, read and set up. Used from one thread.

    Args:
        bus: Bus that they are on.
        names: Name of each in messages, by id: the left one, then the right one.
        are_mirrored: For each, True if it is mounted so that its own positive direction is backward.
        exchange_limit_s: Longest time for a few requests.
        host: Host whose time it uses.
        drive_modes: Drive mode that each is to have, written where it has another one; None: as they are.

    Attributes:
        motors: Ids of the left and the right one.
        settings: Settings of each, once they are read.
        hardware: Hardware errors of each, as it reported them last.

    Raises:
        LineError: The line is gone.
        DeviceSilentError: One does not answer.
        WrongDeviceError: They are no such motors, not alike, or set to what cannot be driven.
    """

    def __init__(
        self,
        bus: DynamixelBus,
        names: Mapping[int, str],
        are_mirrored: tuple[bool, bool],
        exchange_limit_s: float,
        host: Host,
        drive_modes: tuple[int, int] | None = None,
    ) -> None:
        self._bus = bus
        self._host = host
        self._names = names
        self._limit_s = exchange_limit_s
        self.motors: tuple[int, ...] = tuple(names)
        self.hardware: dict[int, frozenset[MotorFault]] = {motor: frozenset() for motor in names}
        if drive_modes is not None:
            self._write_modes(drive_modes)
        self.settings: dict[int, ServoSettings] = {
            motor: read_settings(bus, motor, names[motor], is_mirrored, exchange_limit_s)
            for motor, is_mirrored in zip(names, are_mirrored, strict=True)
        }
        left, right = self.settings.values()
        if left.model_number != right.model_number:
            raise WrongDeviceError(
                f"{names[self.motors[0]]} is of model {left.model_number}, {names[self.motors[1]]} of "
                f"{right.model_number}; they must be alike"
            )

    def _write_modes(self, drive_modes: tuple[int, int]) -> None:
        for motor, mode in zip(self.motors, drive_modes, strict=True):
            self._bus.begin(self._limit_s)
            # An earlier answer may have been one to another session.
            self._bus.settle(motor)
            if self._bus.read(motor, servo.DRIVE_MODE, 1).data[0] != mode:
                # It lets nothing of its EEPROM be written while it has torque, and must not drive meanwhile.
                self._bus.write(motor, servo.TORQUE, b"\0")
                self._bus.write(motor, servo.DRIVE_MODE, bytes((mode,)))

    def set_up(self) -> None:
        """Write the settings that need torque off, and that last until the servos restart.

        Raises:
            LineError: The line is gone.
            DeviceError: One does not answer, or refuses it.
        """
        for motor in self.motors:
            self._bus.begin(self._limit_s)
            if self.settings[motor].operating_mode != servo.VELOCITY_MODE:
                self._bus.write(motor, servo.OPERATING_MODE, bytes((servo.VELOCITY_MODE,)))
            self._bus.write(motor, servo.LED, _OURS)
            self.read_hardware(motor)

    def arm(self, acceleration_raw: int, watchdog: int, begin: Callable[[], None]) -> None:
        """Switch torque on, from a standstill, and then the bus watchdogs, and check each of them.

        Args:
            acceleration_raw: Profile acceleration.
            watchdog: In units of `servo.WATCHDOG_S`.
            begin: Function that is called just before torque goes on, and that may raise.

        Raises:
            LineError: The line is gone.
            DeviceFaultError: One has shut down, or does not do it.
            DeviceError: One does not answer or still rotates, or refuses it.
        """
        self._bus.begin(self._limit_s)
        for motor in self.motors:
            if self.read_hardware(motor) - {MotorFault.VOLTAGE}:
                raise DeviceFaultError(f"{self._hardware_text(motor)}; it must be reset")
        self.halt()
        if not self.stops_in_time():
            raise DeviceError(f"{self._names[self.motors[0]]} or {self._names[self.motors[1]]} still rotates")
        # A servo keeps its goal when its watchdog trips, and goes on once it is cleared: torque must be off then.
        self._write_both(servo.TORQUE, 0, "does not let go")
        for motor in self.motors:
            self._bus.begin(self._limit_s)
            # First the watchdog: a tripped one lets no goal be written.
            self._bus.write(motor, servo.BUS_WATCHDOG, b"\0")
            self._bus.write(motor, servo.PROFILE_ACCELERATION, acceleration_raw.to_bytes(4, "little"))
            self._bus.write(motor, servo.GOAL_VELOCITY, encode_velocity(0))
            self._bus.write(motor, servo.LED, _OURS)
        begin()
        self._write_both(servo.TORQUE, 1, "does not hold")
        self._write_both(servo.BUS_WATCHDOG, watchdog, "does not arm its bus watchdog")

    def release_torque(self) -> None:
        """Command a goal of zero, wait for the wheels, then switch torque and watchdogs off.

        Raises:
            LineError: The line is gone.
            DeviceError: One does not answer, or does not do it; the other one is let go all the same.
        """
        self.halt()
        try:
            self.stops_in_time()
            self._write_both(servo.TORQUE, 0, "does not let go")
            # Not before: one that has tripped keeps its goal, and goes on once it is cleared.
            self._write_both(servo.BUS_WATCHDOG, 0, "does not disarm its bus watchdog")
        except DeviceError:
            # Watchdogs stay: they alone may stop a motor that did not let go.
            self._bus.sync_write(servo.TORQUE, dict.fromkeys(self.motors, b"\0"))
            raise

    def switch_leds_off(self) -> None:
        """Switch off the LEDs, which show a person that the bridge has the motors."""
        self._bus.sync_write(servo.LED, dict.fromkeys(self.motors, b"\0"))

    def halt(self) -> None:
        """Command a goal of zero to both."""
        self.command((0, 0))

    def command(self, goals_raw: tuple[int, int]) -> None:
        """Command a goal to each, positive forward."""
        goals = zip(self.settings.items(), goals_raw, strict=True)
        data = {motor: encode_velocity(settings.sign * goal) for (motor, settings), goal in goals}
        self._bus.sync_write(servo.GOAL_VELOCITY, data)

    def stops_in_time(self) -> bool:
        """Return True if both stand still in time."""
        end_s = self._host.monotonic() + _REST_LIMIT_S
        while True:
            self._bus.begin(self._limit_s)
            if all(abs(found.velocity_raw) <= _REST_RAW for found, _ in self.measure()):
                return True
            if self._host.monotonic() > end_s:
                return False
            self._host.sleep(_POLL_S)

    def measure(self) -> list[tuple[Measurement, bool]]:
        """Return the measurement of each, positive forward, and True if it reports a hardware error.

        Raises:
            LineError: The line is gone.
            DeviceError: One does not answer, or refuses it.
        """
        found = self._read_both(servo.MEASUREMENT_ADDRESS, servo.MEASUREMENT_LENGTH)
        return [
            (_forward(decode_measurement(found[motor].data), settings.sign), found[motor].is_alert)
            for motor, settings in self.settings.items()
        ]

    def read_torque(self) -> tuple[bool, list[bool]]:
        """Return True if both have torque, and for each True if it has restarted since this was asked last.

        Raises:
            LineError: The line is gone.
            DeviceError: One does not answer, or refuses it.
        """
        found = self._read_both(servo.TORQUE, 2)
        have_restarted = [found[motor].data[1:] != _OURS for motor in self.motors]
        if any(have_restarted):
            self._bus.sync_write(servo.LED, dict.fromkeys(self.motors, _OURS))
        return all(status.data[0] for status in found.values()), have_restarted

    def has_tripped(self) -> bool:
        """Return True if the bus watchdog of one has stopped it.

        Raises:
            LineError: The line is gone.
            DeviceError: One does not answer, or refuses it.
        """
        found = self._read_both(servo.BUS_WATCHDOG, 1)
        return any(status.data[0] == servo.WATCHDOG_TRIPPED for status in found.values())

    def read_hardware(self, motor: int) -> frozenset[MotorFault]:
        """Return the hardware errors of one servo.

        Raises:
            LineError: The line is gone.
            DeviceError: It does not answer, or refuses it.
        """
        bits = self._bus.read(motor, servo.HARDWARE_ERRORS, 1).data[0]
        self.hardware[motor] = frozenset(fault for bit, fault in _FAULTS.items() if bits & bit)
        return self.hardware[motor]

    def restart_faulty(self) -> tuple[bool, bool]:
        """Restart the motors that report a hardware error.

        Returns:
            For the left and the right servo, True if it was restarted.

        Raises:
            LineError: The line is gone.
            DeviceFaultError: One is too hot still; none was restarted then. Or its error remains.
            DeviceSilentError: One does not come back.
        """
        self._bus.begin(self._limit_s)
        faulty = [motor for motor in self.motors if self.read_hardware(motor)]
        for motor in faulty:
            self._require_cool(motor)
        for motor in faulty:
            self._bus.begin(self._limit_s)
            self._bus.reboot(motor)
        for motor in faulty:
            self._await(motor)
            self._bus.begin(self._limit_s)
            if self.read_hardware(motor):
                raise DeviceFaultError(f"{self._hardware_text(motor)}, even after its restart")
        return self.motors[0] in faulty, self.motors[1] in faulty

    def _require_cool(self, motor: int) -> None:
        if MotorFault.OVERHEATING not in self.hardware[motor]:
            return
        self._bus.begin(self._limit_s)
        temperature_c = self._bus.read(motor, servo.TEMPERATURE, 1).data[0]
        most_c = self.settings[motor].temperature_limit_c - _COOLER_C
        if temperature_c > most_c:
            raise DeviceFaultError(
                f"{self._names[motor]} is at {temperature_c} degrees; let it cool down to {most_c} first"
            )

    def _await(self, motor: int) -> None:
        end_s = self._host.monotonic() + _REBOOT_LIMIT_S
        while True:
            self._bus.begin(self._limit_s, repeats=0)
            try:
                self._bus.ping(motor)
            except DeviceSilentError:
                if self._host.monotonic() > end_s:
                    raise
            else:
                return

    def _hardware_text(self, motor: int) -> str:
        return f"{self._names[motor]} reports {', '.join(sorted(self.hardware[motor]))}"

    def _write_both(self, address: int, value: int, problem: str) -> None:
        """Write one byte to both at once, and see that they have it."""
        self._bus.begin(self._limit_s)
        for _ in range(2):  # The first packet is not acknowledged and may have been lost.
            self._bus.sync_write(address, dict.fromkeys(self.motors, bytes((value,))))
            found = self._read_both(address, 1)
            wrong = [motor for motor in self.motors if found[motor].data[0] != value]
            if not wrong:
                return
        raise DeviceFaultError(f"{self._names[wrong[0]]} {problem}")

    def _read_both(self, address: int, length: int) -> dict[int, StatusPacket]:
        found = self._bus.sync_read(address, length, self.motors)
        silent = [self._names[motor] for motor in self.motors if motor not in found]
        if silent:
            raise self._bus.silence_of(" and ".join(silent), "does" if len(silent) == 1 else "do")
        for motor, status in found.items():
            if status.number:
                raise RefusedError(f"{self._names[motor]} does not let {length} bytes at {address} be read", status)
        return found


def _forward(measurement: Measurement, sign: int) -> Measurement:
    """The same in the robot's direction."""
    return replace(
        measurement,
        load=sign * measurement.load,
        velocity_raw=sign * measurement.velocity_raw,
        ticks=sign * measurement.ticks,
    )
