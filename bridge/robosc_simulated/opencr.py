"""OpenCR with the ROS 2 firmware of the TurtleBot3, as the Dynamixel device 200 that it is to its host.

After ROBOTIS-GIT/OpenCR 1.5.3 (`turtlebot3_ros2`) and Dynamixel2Arduino 0.8.0 (`slave`). It commands real servos
(`servo.py`) as the firmware does, so that what a servo refuses is not driven. To what its host commands it adds what
its two buttons want, each of which starts a drive of its own when it is held, and what an RC-100 remote control wants.

Its firmware is one loop. In each pass it compares the heartbeat, commands the servos every 20 ms, reads where they are
for the drives of the buttons, refreshes its registers every 20 ms, and handles one packet of its host. A servo that
does not answer (a loose cable, a dead motor) holds up each of these reads for 100 ms.
"""

import math
import struct
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from robosc_simulated.battery import Battery
from robosc_simulated.line import Sending
from robosc_simulated.packets import Error, Instruction, Request, RequestParser, status
from robosc_simulated.servo import TICKS, Servo
from robosc_simulated.world import World

DEVICE_ID = 200
CYCLE_S = 0.020
# The board's cycle is as much faster as the world is, as far as a process can serve it.
_SHORTEST_CYCLE_S = 0.004
HEARTBEAT_S = 0.500
_RAW_PER_M_S = 1263.632956882
_RAW_LIMIT = 337
_LONGEST_ANSWER = 2048
_SIZE = 346
_GRAVITY_M_S2 = 9.80665
_EARTH_FIELD_T = 20e-6
# Power to the motors: a mean of one second below 11 V for more than five cuts it; below 5 V the battery is off.
_CUT_V, _CUT_AFTER_S, _MEAN_OVER_S, _OFF_V = 11.0, 5.0, 1.0, 5.0
_EMPTY_V, _FULL_V = 10.5, 12.3
# Dynamixel2Arduino waits so long for a servo. The drives of the buttons read positions; the refresh reads positions,
# velocities, currents and torque.
_MUTE_S = 0.100
_BUTTON_READS, _REFRESH_READS = 1, 4
MUTE_PASS_S = (_BUTTON_READS + _REFRESH_READS) * _MUTE_S
"""Time of a pass of the firmware's loop while a servo does not answer, in seconds."""

# A button that is pressed, and pressed again or still so long afterwards, starts a drive (e-Manual: 30 cm forward, half
# a turn on the spot), which ends by the ticks of the right wheel.
_HELD_S = 3.0
_TEST_M, _TEST_RAD = 0.3, 3.14
_TEST_M_S, _TEST_RAD_S = 0.05, -0.7
_CIRCUMFERENCE_M = 0.207

_CHIP, _INFORMATION, _DEBUG, _CONNECTED, _HEARTBEAT = 0, 2, 14, 15, 19
_CALIBRATE, _TORQUE = 59, 149
_LINEAR_X, _ANGULAR_Z = 150, 170
_PROFILES = (174, 178)

# Address to the format of its item; what lies between them reads as 0.
_FORMATS = {
    0: "H", 2: "I", 6: "B", 7: "B", 9: "B", 10: "I", 14: "B", 15: "B", 16: "B", 18: "b", 19: "B", 20: "B", 21: "B",
    22: "B", 23: "B", 26: "B", 27: "B", 28: "B", 29: "B", 30: "H", 34: "I", 38: "f", 42: "I", 46: "I", 50: "B",
    59: "B", 60: "f", 64: "f", 68: "f", 72: "f", 76: "f", 80: "f", 84: "f", 88: "f", 92: "f", 96: "f", 100: "f",
    104: "f", 108: "f", 120: "i", 124: "i", 128: "i", 132: "i", 136: "i", 140: "i", 148: "B", 149: "B", 150: "i",
    154: "i", 158: "i", 162: "i", 166: "i", 170: "i", 174: "I", 178: "I",
}  # fmt: skip
_SIZES = {address: struct.calcsize("<" + code) for address, code in _FORMATS.items()}


@dataclass
class Panel:
    """Actions of a person or a test on the board.

    Attributes:
        battery_v: Voltage of the battery.
        button_1: True if it is pressed.
        button_2: The same.
        bumper_1: The one in front.
        bumper_2: The one behind.
        illumination: Reading of the light sensor.
        cliff: Reading of the infrared sensor.
    """

    battery_v: float = 12.0
    button_1: bool = False
    button_2: bool = False
    bumper_1: bool = False
    bumper_2: bool = False
    illumination: int = 0
    cliff: int = 0


@dataclass
class _ButtonDrive:
    """A button that drives, as `test_motors_with_buttons` and `getButtonPress` of the firmware.

    Attributes:
        velocity: Linear and angular velocity that it wants, in m/s and rad/s.
        ticks: Ticks of the right wheel after which it ends.
        pressed_s: Time when it was found pressed; None: it waits for that.
        is_used_up: True until it is let go after it has started a drive.
        from_ticks: Ticks of the right wheel when it started; None: it does not drive.
    """

    velocity: tuple[float, float]
    ticks: float
    pressed_s: float | None = None
    is_used_up: bool = False
    from_ticks: int | None = None

    def is_started(self, is_pressed: bool, now_s: float) -> bool:
        """Return True if it has been held for long enough now; what was between is not looked at."""
        if self.is_used_up:
            self.is_used_up = is_pressed
        elif self.pressed_s is None:
            self.pressed_s = now_s if is_pressed else None
        elif now_s - self.pressed_s >= _HELD_S:
            self.pressed_s = None
            self.is_used_up = is_pressed
            return is_pressed
        return False


class OpenCr:
    """The board, its two servos and its sensors.

    Args:
        world: World that it drives in.
        left: The left servo.
        right: The right one.
        has_motors: True if the servos answered when it started.
        calibration_s: Time for which a recalibration of the gyroscope keeps it busy; 5 s at most.
        pass_s: Time of a pass of its loop in which it has nothing to refresh, in seconds; it handles a packet in each.
        refresh_s: Time of a pass in which it has, in seconds.
        battery: Battery that it measures, until `set_battery` says otherwise; None: 12 V.

    Attributes:
        panel: Buttons, bumpers, battery.
        answers_as: The ID that every answer carries; None: its own.
        stuffs_in_place: True for firmware that spoils an answer which contains a packet's header.
    """

    baud: int | None = None

    def __init__(
        self,
        world: World,
        left: Servo,
        right: Servo,
        *,
        has_motors: bool = True,
        calibration_s: float = 5.0,
        pass_s: float = 0.0,
        refresh_s: float = 0.0,
        battery: Battery | None = None,
    ) -> None:
        self.panel = Panel()
        self.answers_as: int | None = None
        self.stuffs_in_place = False
        self._world = world
        self._time = world.time
        self._servos = (left, right)
        self._has_motors = has_motors
        self._calibration_s = calibration_s
        self._parser = RequestParser()
        self._waiting: deque[Request] = deque()
        # Answers of passes that were done because somebody touched the board.
        self._unsent: list[Sending] = []
        self._memory = bytearray(_SIZE)
        self._began_s = self._time.now_s()
        self._cycle_s = self._began_s
        self._period_s = min(CYCLE_S, max(CYCLE_S / self._time.factor, _SHORTEST_CYCLE_S))
        self._busy_until_s: float | None = None
        self._pass_s, self._refresh_s = pass_s, refresh_s
        # Until when a pass lasts, and whether a servo that does not answer holds it up.
        self._pass_end_s = self._began_s
        self._is_held_up = False
        self._goal = (0.0, 0.0)
        self._remote_goal = (0.0, 0.0)
        turning_radius_m = world.body.wheel_separation_m / 2
        tick_m = _CIRCUMFERENCE_M / TICKS
        self._drives = (
            _ButtonDrive((_TEST_M_S, 0.0), _TEST_M / tick_m),
            _ButtonDrive((0.0, _TEST_RAD_S), _TEST_RAD * turning_radius_m / tick_m),
        )
        self._has_motor_power = True
        self._percent = 0.0
        self._battery = battery
        if battery is not None:
            self.panel.battery_v = battery.voltage_v()
        self._is_connected = False
        self._skips_comparison = False
        self._seen_heartbeat = 0
        self._alive_s = self._began_s
        self._voltages: deque[float] = deque([self.panel.battery_v], maxlen=round(_MEAN_OVER_S / self._period_s))
        self._sampled_s = self._began_s
        self._low_since_s: float | None = None
        self._start_heading_rad = world.heading_rad
        self._last_speed_m_s = 0.0
        self._forward_m_s2 = 0.0
        self._sensed_s = world.lived_s
        for address, value in (
            (_CHIP, 0x5000), (_INFORMATION, world.body.opencr_information), (6, 5), (7, DEVICE_ID), (9, 2),
        ):  # fmt: skip
            self._put(address, value)
        if has_motors:
            for servo in self._servos:
                servo.write(64, b"\x01")
        self._refresh()

    @property
    def is_connected(self) -> bool:
        """True if it hears its host's heartbeat."""
        return self._is_connected

    def press(self, **changes: bool) -> None:
        """Press or release buttons and bumpers, by their names in `Panel`."""
        with self._time.lock:
            self._unsent = list(self.update())
            for name, value in changes.items():
                if name not in ("button_1", "button_2", "bumper_1", "bumper_2"):
                    raise ValueError(f"there is no button or bumper {name!r}")
                setattr(self.panel, name, value)

    def steer(self, linear_m_s: float, angular_rad_s: float) -> None:
        """Let an RC-100 remote control want this velocity, until it wants another one."""
        fastest_m_s, fastest_rad_s = self._fastest()
        with self._time.lock:
            self._unsent = list(self.update())
            self._remote_goal = (_within(linear_m_s, fastest_m_s), _within(angular_rad_s, fastest_rad_s))

    def set_battery(self, voltage_v: float) -> None:
        """Let the battery have this voltage from now on."""
        with self._time.lock:
            self._unsent = list(self.update())
            self._battery = None
            self.panel.battery_v = voltage_v
            self._supply()

    # Methods of a device on a line.

    def plug_in(self) -> None:
        """Plug it in: it has its battery, and notices only missing bytes."""
        self._parser.clear()

    def due_s(self) -> float:
        """The next pass that does something, or the end of what keeps it busy."""
        if self._busy_until_s is not None:
            return self._busy_until_s
        if self._is_held_up:
            return self._pass_end_s
        return min(self._cycle_s, self._pass_end_s) if self._waiting else self._cycle_s

    def update(self) -> Iterable[Sending]:
        """Do all passes until now."""
        now_s = self._time.now_s()
        found, self._unsent = self._unsent, []
        if self._busy_until_s is not None and now_s >= self._busy_until_s:
            found += self._end_calibration(self._busy_until_s)
        while self._busy_until_s is None and now_s >= self.due_s():
            if self._is_held_up:
                self._is_held_up = False
                self._refresh()
                # The next pass begins at once, with the heartbeat and the motors.
                self._cycle_s = self._pass_end_s
                found += self._answer_next()
            elif self._waiting and self._pass_end_s < self._cycle_s:
                self._pass_end_s += self._pass_s
                found += self._answer_next()
            else:
                missed = int((now_s - self._cycle_s) / self._period_s)
                # One cycle at one time: the wheels have lived on meanwhile, and a late thread must not repeat itself.
                began_s = self._cycle_s + missed * self._period_s
                self._cycle_s = began_s + self._period_s
                self._cycle(began_s, now_s)
        return found

    def receive(self, data: bytes, baud: int) -> Iterable[Sending]:
        """Answer what is addressed to it, in the passes that follow."""
        found = list(self.update())
        now_s = self._time.now_s()
        is_first = not self._waiting
        self._waiting.extend(self._parser.feed(data, now_s))
        if self._is_held_up or self._busy_until_s is not None:
            return found
        if self._is_missing_servo():
            # The pass under way is held up already.
            self._cycle_s = now_s
        elif is_first and now_s > self._pass_end_s and self._pass_s:
            passes = math.ceil((now_s - self._pass_end_s) / self._pass_s)
            self._pass_end_s += passes * self._pass_s
        self._pass_end_s = max(self._pass_end_s, now_s)
        return found + list(self.update())

    def _answer_next(self) -> list[Sending]:
        answer = self._answer(self._waiting.popleft()) if self._waiting else None
        return [] if answer is None else [self._sending(*answer)]

    def _sending(self, error: int, data: bytes) -> Sending:
        sender = DEVICE_ID if self.answers_as is None else self.answers_as
        return Sending(status(sender, error, data, stuffs_in_place=self.stuffs_in_place))

    def _answer(self, request: Request) -> tuple[int, bytes] | None:
        if request.device_id != DEVICE_ID or not request.is_intact:
            return None
        parameters = request.parameters
        match request.instruction:
            case Instruction.PING:
                return Error.NONE, self._read(0, 2) + self._read(6, 1)
            case Instruction.READ:
                if len(parameters) != 4:
                    return Error.DATA_LENGTH, b""
                address, length = struct.unpack("<HH", parameters)
                if length + 11 > _LONGEST_ANSWER:
                    return None
                return Error.NONE, self._read(address, length)
            case Instruction.WRITE:
                if len(parameters) < 2:
                    return Error.DATA_LENGTH, b""
                error = self._write(int.from_bytes(parameters[:2], "little"), parameters[2:])
                # Its status comes after all that the write has caused.
                return None if self._busy_until_s is not None else (error, b"")
        return None

    # Its memory.

    def _put(self, address: int, value: float) -> None:
        struct.pack_into("<" + _FORMATS[address], self._memory, address, value)

    def _get(self, address: int) -> int:
        value: int = struct.unpack_from("<" + _FORMATS[address], self._memory, address)[0]
        return value

    def _read(self, address: int, length: int) -> bytes:
        found = bytearray(length)
        for start, size in _SIZES.items():
            if address <= start and start + size <= address + length:
                found[start - address : start - address + size] = self._memory[start : start + size]
        return bytes(found)

    def _write(self, address: int, data: bytes) -> int:
        error = Error.NONE
        for start, size in _SIZES.items():
            if not (address <= start and start + size <= address + len(data)):
                continue
            if start == _INFORMATION:
                error = Error.ACCESS
                continue
            self._memory[start : start + size] = data[start - address : start - address + size]
            self._written(start)
        return error

    def _written(self, address: int) -> None:
        fastest_m_s, fastest_rad_s = self._fastest()
        match address:
            case 19:
                self._compare_heartbeat(self._time.now_s())
            case 59:
                if self._get(_CALIBRATE):
                    self._busy_until_s = self._time.now_s() + self._calibration_s
            case 149:
                for servo in self._powered_servos():
                    servo.write(64, bytes((int(bool(self._get(_TORQUE))),)))
            case 150:
                self._goal = (_within(self._get(_LINEAR_X) * 0.01, fastest_m_s), self._goal[1])
            case 170:
                self._goal = (self._goal[0], _within(self._get(_ANGULAR_Z) * 0.01, fastest_rad_s))
            case 174 | 178:
                for servo, start in zip(self._servos, _PROFILES, strict=True):
                    if start == address and servo.answers and self._has_motors:
                        servo.instruction_received()
                        servo.write(108, bytes(self._memory[start : start + 4]))

    def _fastest(self) -> tuple[float, float]:
        """Limits of the firmware, in m/s and rad/s."""
        body = self._world.body
        fastest_m_s = 2 * math.pi * body.wheel_radius_m * body.fastest_rpm / 60
        return fastest_m_s, fastest_m_s / (body.wheel_separation_m / 2)

    def _end_calibration(self, ended_s: float) -> list[Sending]:
        self._busy_until_s = None
        self._put(_CALIBRATE, 0)
        # Its cycles stood still meanwhile, and what it reported before is reported until the next one.
        self._cycle_s = ended_s + self._period_s
        self._pass_end_s = ended_s
        return [self._sending(Error.NONE, b"")]

    # Its cycle.

    def _powered_servos(self) -> tuple[Servo, ...]:
        return tuple(servo for servo in self._servos if self._has_motors and servo.answers)

    def _is_missing_servo(self) -> bool:
        """Return True if a servo of its bus does not answer."""
        return self._has_motors and not all(servo.answers for servo in self._servos)

    def _cycle(self, began_s: float, now_s: float) -> None:
        self._compare_heartbeat(now_s)
        if not self._is_connected:
            self._goal = (0.0, 0.0)
        self._watch_battery(now_s)
        goals = (
            self._goal,
            self._remote_goal,
            *(drive.velocity for drive in self._drives if drive.from_ticks is not None),
        )
        linear_m_s, angular_rad_s = (sum(parts) for parts in zip(*goals, strict=True))
        half_m = self._world.body.wheel_separation_m / 2
        wheels_m_s = (linear_m_s - angular_rad_s * half_m, linear_m_s + angular_rad_s * half_m)
        for servo, wheel_m_s in zip(self._servos, wheels_m_s, strict=True):
            if self._has_motors and servo.answers:
                servo.instruction_received()
                servo.catch_up()
                raw = int(_within(wheel_m_s * _RAW_PER_M_S, _RAW_LIMIT))
                # A refusal of the servo is not reported, as in a SYNC WRITE.
                servo.write(104, raw.to_bytes(4, "little", signed=True))
        self._obey_buttons(now_s)
        if self._is_missing_servo():
            self._is_held_up = True
            self._pass_end_s = began_s + MUTE_PASS_S
            return
        self._pass_end_s = max(self._pass_end_s, began_s + self._refresh_s)
        self._refresh()

    def _obey_buttons(self, now_s: float) -> None:
        _, right = self._servos
        if not (self._has_motors and right.answers):
            return
        right.read(132, 4)
        ticks = right.table["present position"]
        straight, around = self._drives
        for drive, is_pressed in zip(self._drives, (self.panel.button_1, self.panel.button_2), strict=True):
            if drive.is_started(is_pressed, now_s):
                drive.from_ticks = ticks
            elif drive.from_ticks is not None and abs(ticks - drive.from_ticks) > drive.ticks:
                drive.from_ticks = None
        if straight.from_ticks is not None:
            # One at a time.
            around.from_ticks = None

    def _compare_heartbeat(self, now_s: float) -> None:
        if self._skips_comparison:
            self._skips_comparison = False
            self._alive_s = now_s
            return
        was_connected = self._is_connected
        heartbeat = self._get(_HEARTBEAT)
        if heartbeat != self._seen_heartbeat or self._get(_DEBUG):
            self._is_connected = True
            self._seen_heartbeat = heartbeat
            self._alive_s = now_s
        elif now_s - self._alive_s >= HEARTBEAT_S:
            self._is_connected = False
        self._skips_comparison = was_connected != self._is_connected

    def _watch_battery(self, now_s: float) -> None:
        if self._battery is not None:
            self.panel.battery_v = self._battery.voltage_v()
        voltage_v = self.panel.battery_v
        # After a long pass, the mean is of what there was meanwhile.
        samples = max(round((now_s - self._sampled_s) / self._period_s), 1)
        self._voltages.extend([voltage_v] * min(samples, self._voltages.maxlen or 1))
        self._sampled_s = now_s
        mean_v = sum(self._voltages) / len(self._voltages)
        if mean_v >= _CUT_V:
            self._low_since_s = None
            if not self._has_motor_power:
                self._has_motor_power = True
                self._supply()
        elif self._low_since_s is None:
            self._low_since_s = now_s
        elif now_s - self._low_since_s > _CUT_AFTER_S and self._has_motor_power:
            self._has_motor_power = False
            self._supply()
        if voltage_v >= _EMPTY_V:
            self._percent = (voltage_v - _EMPTY_V) / (_FULL_V - _EMPTY_V) * 100

    def _supply(self) -> None:
        battery_v = self.panel.battery_v
        for servo in self._servos:
            servo.brown_out(battery_v if self._has_motor_power and battery_v >= _OFF_V else 0.0)

    def _refresh(self) -> None:
        world, panel = self._world, self.panel
        world.catch_up()
        self._put(10, int((self._time.now_s() - self._began_s) * 1000) % 2**32)
        self._put(_CONNECTED, self._is_connected)
        self._put(16, 0)
        self._put(18, 0 if self._has_motors else -1)
        for address in (20, 21, 22):
            self._put(address, 0)
        self._put(23, self._is_connected)
        for address, value in zip(range(26, 30), (panel.button_1, panel.button_2, panel.bumper_1, panel.bumper_2),
                                  strict=True):  # fmt: skip
            self._put(address, value)
        self._put(30, panel.illumination)
        self._put(34, panel.cliff)
        self._put(38, 0.0)
        self._put(42, max(round(panel.battery_v * 100), 0))
        self._put(46, max(round(self._percent * 100), 0))
        self._sense_motion()
        servos = self._powered_servos()
        # The answers of servos that are silent leave what was there before.
        for address, item in ((120, "present load"), (128, "present velocity"), (136, "present position")):
            for servo, start in zip(self._servos, (address, address + 4), strict=True):
                if servo in servos:
                    servo.read(126, 2)
                    self._put(start, servo.table[item])
        self._put(148, self._has_motors)
        self._put(_TORQUE, len(servos) == 2 and all(servo.table["torque enable"] for servo in servos))

    def _sense_motion(self) -> None:
        """Update the readings of the inertial sensors: they feel the body on the floor, whatever the wheels do."""
        world = self._world
        speed_m_s, yaw_rate_rad_s = world.floor_speed_m_s, world.floor_yaw_rate_rad_s
        drift_rad_s = world.profile.yaw_drift_rad_s
        yaw_rad = world.heading_rad - self._start_heading_rad + drift_rad_s * world.lived_s
        yaw_rate_rad_s += drift_rad_s
        since_s = world.lived_s - self._sensed_s
        if since_s > 0.0:
            self._forward_m_s2 = (speed_m_s - self._last_speed_m_s) / since_s
            self._last_speed_m_s, self._sensed_s = speed_m_s, world.lived_s
        readings = (
            0.0, 0.0, yaw_rate_rad_s,
            self._forward_m_s2, speed_m_s * yaw_rate_rad_s, _GRAVITY_M_S2,
            _EARTH_FIELD_T * math.cos(yaw_rad), -_EARTH_FIELD_T * math.sin(yaw_rad), 0.0,
            math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2),
        )  # fmt: skip
        for address, value in zip(range(60, 112, 4), readings, strict=True):
            self._put(address, value)


def _within(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))
