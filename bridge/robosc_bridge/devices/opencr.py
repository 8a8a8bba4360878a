"""A stock TurtleBot3: its OpenCR board, which drives the wheels, as a Dynamixel device.

The board has no time limit for commands: the last command holds as long as the heartbeat from the bridge changes. It
stops the wheels half a second after the last change. It does not report what is wrong with a motor, only that torque is
off.

Sources: ROBOTIS-GIT/OpenCR 1.5.3 (`turtlebot3_ros2`) and turtlebot3_node 2.3.6, without two mistakes of the latter (it
reads the device status before it has one, and takes old readings for new ones).

A wheel servo that does not answer the board holds up each pass of the board's firmware for half a second, and the
firmware handles one packet in a pass: the board answers, but only after the limit of any request. The driver then sends
no more requests than it needs to distinguish this board from a silent one, since the board must process every request
before it receives any other.

A request waits for the end of the firmware's pass, up to 10 ms. A velocity that is newer than that of the exchange
under way is therefore written at once, behind the request that waits: the port is a USB device, which is read and
written at the same time, and the firmware reads one packet from its buffer in each pass. The next exchange, which
follows at once, carries the velocity as well. A board that does not answer such packets is sent no more of them.

The board adds the motion of its own inputs to every command: of its two buttons, held for 3 s, one drives 0.3 m and the
other one makes half a turn, and an RC-100 remote control steers. A command of zero does not end that motion, torque off
does.
"""

import contextlib
import logging
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Literal, NoReturn

from robosc_bridge.devices.board_yaw import UPTIME_MODULUS, BoardYaw
from robosc_bridge.devices.dynamixel_bus import (
    ANSWER_LIMIT_S,
    SETTLING_LENGTHS,
    BusCounters,
    DynamixelBus,
    exchange_limit_s,
)
from robosc_bridge.devices.interface import (
    CONSTANT,
    STANDSTILL,
    UNDO_LIMIT_S,
    DriveLimits,
    DriveReading,
    MotorFault,
    Velocity,
    VelocitySource,
    has_stopped,
)
from robosc_bridge.devices.kinematics import body_velocity, opencr_words, wheel_speeds
from robosc_bridge.devices.odometry import Odometry, velocity_variances
from robosc_bridge.devices.plausibility import Verdict, WheelCounts, measurable, wheel_judge
from robosc_bridge.devices.robots import Robot
from robosc_bridge.devices.wheel_following import ExcessMonitor, FollowingMonitor
from robosc_bridge.errors import (
    DeviceError,
    DeviceFaultError,
    DeviceSilentError,
    LineError,
    StoppedError,
    WrongDeviceError,
)
from robosc_bridge.host import Host, Port
from robosc_bridge.protocol import opencr
from robosc_bridge.protocol.opencr import Block, decode_block, encode_command
from robosc_bridge.transport.system_host import SYSTEM_HOST

BAUD = 1_000_000  # A USB device: any is right.

_CALIBRATION_LIMIT_S = 6.0
# A board that a servo holds up takes half a second for a packet, and begins at any time in it.
_SLOW_LIMIT_S = 0.65
# Exchanges in a row without an answer after which it is seen whether the board is slow.
_SILENT_LIMIT = 3
# Packets in a row behind another one that are not answered, after which none is sent there any more.
_UNHEARD_LIMIT = 3
# Time after which a held button is warned of: half of the 3 s after which it drives, so that one can let go.
_HELD_S = 1.5
_DRIVES = {"button_1": "0.3 m forward", "button_2": "half a turn to the right"}
_REST_RAW = 2
_REST_LIMIT_S = 1.0
_TORQUE_LIMIT_S = 1.0
_REFRESHED_MS = 45  # Two refreshes, every 20 ms, of what the board knows of its motors.
_POLL_S = 0.01
# Differences between the board's time and the computer's, from one reading to the next, beyond which the board counts
# as restarted.
_LEAD_S = 0.7
_LAG_S = 1.0
# Reads of the block in an exchange: what cannot be is asked for again, and a third time in other parts.
_READS = 3
# Two refreshes.
_COUNTS_LAG_S = 0.04


_log = logging.getLogger(__name__)


class OpenCrBase:
    """An `AttentiveDriveBase`. Used from one thread, but for `wake`.

    Args:
        path: Path of its port.
        robot: Robot that it belongs to.
        calibrates_gyro: True to calibrate the gyroscope when it is opened, at rest; takes up to 5 s.
        heading: Source of the heading: `fused` of wheels and the board's inertial sensor, or `wheels` alone.
        answer_limit_s: Longest wait for one answer.
        host: Parts of its computer that it uses.

    Attributes:
        limits: Limits of the drive base.
        leftover: Text that says what the motors may still do after `close`; empty: nothing.
    """

    def __init__(
        self,
        path: str,
        robot: Robot,
        calibrates_gyro: bool = False,
        answer_limit_s: float = ANSWER_LIMIT_S,
        heading: Literal["fused", "wheels"] = "fused",
        host: Host = SYSTEM_HOST,
    ) -> None:
        # None where the heading is that of the wheels alone.
        self._yaw = BoardYaw(path) if heading == "fused" else None
        self._judge = wheel_judge(path, _COUNTS_LAG_S)
        self.limits: DriveLimits = robot.limits(robot.motor.velocity_limit_raw)
        self._path = path
        self._robot = robot
        self._calibrates_gyro = calibrates_gyro
        self._answer_limit_s = answer_limit_s
        self._exchange_limit_s = exchange_limit_s(answer_limit_s)
        self._host = host
        self._line: Port | None = None
        self._bus: DynamixelBus | None = None
        self._odometry = Odometry(robot.tick_m, robot.wheel_separation_m)
        self._following = FollowingMonitor()
        self._excess = ExcessMonitor()
        self._is_driven_otherwise = False
        # Since when each button is pressed, until a person was warned.
        self._pressed_s: dict[str, float] = {}
        self._heartbeat = 0
        self._source: VelocitySource = CONSTANT
        # The last command.
        self._words = (0, 0)
        # Time of the board since it was opened; the uptime in the last block, and when that was asked for and received.
        self._board_s = 0.0
        self._uptime: tuple[int, float, float] | None = None
        self._is_torque_wanted = False
        self._is_torque_lost = False
        # True from the first order to switch torque on until both motors are known to have none, or until it is known
        # whether they have.
        self._may_hold = self._is_uncertain = False
        self.leftover = ""
        # Exchanges in a row without an answer, and what was so when the first of them began.
        self._silent = 0
        self._late = 0
        self._asked_s = 0.0
        # True if the board was too slow last: old requests may still be answered in the next session.
        self._is_slow = False

    @property
    def counters(self) -> BusCounters:
        """Health of the line since it was opened."""
        bus = self._bus
        if bus is None:
            return BusCounters()
        return replace(bus.counters, implausible=self._refused, begun_anew=self._begun_anew)

    def attend(self, source: VelocitySource) -> None:
        """Command newer velocities of this source from now on, also during an exchange."""
        self._source = source

    def wake(self) -> None:
        """Let an exchange under way ask its source now."""
        line = self._line
        if line is not None:
            line.wake()

    def open(self) -> None:
        """Find the board and check that it is the expected one; wheels at rest, torque off.

        Raises:
            LineError: The line cannot be used.
            DeviceSilentError: Nothing answers.
            WrongDeviceError: It is another device, firmware or robot.
            DeviceFaultError: The board has found no motors, keeps a profile acceleration, or is too slow, as when a
                motor does not answer it; or a motor does not let go.
        """
        self.close()
        line = self._host.open_port(self._path, BAUD)
        try:
            self._line = line
            self._bus = DynamixelBus(line, lambda device: f"{self._path}: OpenCR", self._answer_limit_s, self._host)
            self._uptime = None
            self._judge = wheel_judge(self._path, _COUNTS_LAG_S)
            self._yaw = None if self._yaw is None else BoardYaw(self._path)
            self._is_torque_wanted = self._is_torque_lost = False
            self._odometry = self._odometry.rebased()
            self._following.forget()
            self._excess.forget()
            self._is_driven_otherwise = False
            self._silent = 0
            self._check_speed(self._bus)
            try:
                self._set_up(self._bus)
            except DeviceSilentError:
                self._check_late(self._bus, 0)
                raise
        except BaseException:
            self._release()
            raise

    def _set_up(self, bus: DynamixelBus) -> None:
        self._check_identity(bus)
        self._check_motors(bus)
        self._clear_profile(bus)
        self._await_refresh()
        self._comes_to_rest()
        self._switch_torque(False)
        if self._calibrates_gyro:
            self._calibrate(bus)

    def _check_speed(self, bus: DynamixelBus) -> None:
        """See that the board answers at once, at the cost of one request where it does not.

        Raises:
            DeviceFaultError: It is slow.
        """
        if self._is_slow and bus.is_late(opencr.DEVICE, _SLOW_LIMIT_S):
            # It has not worked off yet what it was asked before.
            raise self._slowness()
        self._is_slow = False
        bus.begin(self._exchange_limit_s, repeats=0)
        try:
            bus.ping(opencr.DEVICE)
        except DeviceSilentError:
            # One that is silent is asked again, as one whose answer was lost.
            self._check_late(bus, 0, _SLOW_LIMIT_S)

    def _check_late(self, bus: DynamixelBus, late: int, limit_s: float = 0.0) -> None:
        """Raise what is wrong if the board answers, too late.

        Args:
            bus: Bus of the board.
            late: Number of late answers that had come when this began.
            limit_s: Further wait for one, in seconds.

        Raises:
            DeviceFaultError: The board is slow.
        """
        if bus.counters.late > late or (limit_s > 0.0 and bus.is_late(opencr.DEVICE, limit_s)):
            raise self._slowness()

    def _slowness(self) -> DeviceFaultError:
        self._is_slow = True
        return DeviceFaultError(
            f"{self._path}: OpenCR answers too slowly, as when a wheel servo does not answer it: it may be "
            "disconnected, or have no power; check the cables of both"
        )

    def set_torque(self, is_on: bool) -> None:
        """Switch torque on, from a standstill; or switch it off, after a stop.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: The board does not answer.
            DeviceFaultError: A motor does not hold.
            StoppedError: A stop came meanwhile.
            DeviceError: The wheels do not come to rest.
        """
        self._is_torque_wanted = False
        # Wheels that do not obey do not come to rest either.
        is_awaited = is_on or not self._is_driven_otherwise
        self._is_driven_otherwise = False
        if is_awaited and not self._comes_to_rest() and is_on:
            raise DeviceError(f"{self._path}: the wheels still rotate")
        try:
            self._switch_torque(is_on)
        except DeviceFaultError:
            # One wheel alone must not hold.
            self._write_torque(False)
            raise
        self._is_torque_wanted = is_on
        self._is_torque_lost = False
        self._following.forget()
        self._excess.forget()

    def exchange(self, velocity: Velocity) -> DriveReading:
        """Command a velocity, change the heartbeat, read everything; at most `exchange_limit_s` of the bus.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: The board did not answer, also when asked again; it has been commanded to stop.
            DeviceFaultError: It is slow, as when a motor does not answer it; it has been commanded to stop.
            DeviceError: The board has started anew, or the computer stood still; the board has been commanded to stop.
        """
        bus = self._used_bus
        if self._silent == 0:
            self._late, self._asked_s = bus.counters.late, self._host.monotonic()
        try:
            reading = self._exchange(velocity)
        except DeviceSilentError:
            if self._is_torque_wanted:
                # It may hear though it is not heard: its own time limit is half a second.
                bus.write_unanswered(opencr.DEVICE, opencr.COMMAND, encode_command(0, 0))
            self._silent += 1
            if self._silent >= _SILENT_LIMIT:
                self._check_late(bus, self._late, self._asked_s + _SLOW_LIMIT_S - self._host.monotonic())
            raise
        self._silent = 0
        return reading

    def _exchange(self, velocity: Velocity) -> DriveReading:
        is_obeying = self._is_torque_wanted and not self._is_torque_lost
        bus = self._used_bus
        is_interrupted = is_obeying and bus.unheard < _UNHEARD_LIMIT
        bus.interruption = self._renew if is_interrupted else None
        try:
            if is_obeying:
                block = self._cycle(velocity, self._source.written)
            else:
                block = self._cycle(STANDSTILL if self._is_torque_wanted else None)
        finally:
            bus.interruption = None
        if self._is_torque_wanted and not block.is_torque_on and not self._is_torque_lost:
            self._is_torque_lost = True
            # A motor that has lost its power counts within one revolution afterwards.
            self._odometry = self._odometry.rebased()
            self._command(STANDSTILL)
        faults = {MotorFault.TORQUE_LOST} if self._is_torque_lost else set()
        if is_obeying and not self._is_torque_lost:
            goals_raw = self._wheels_raw(self._words)
            faults |= self._unfollowed(goals_raw, block)
            self._watch_buttons(block)
            left_m_s, right_m_s = (raw * self._robot.raw_m_s for raw in goals_raw)
            return replace(self._reading(block, frozenset(faults)), goals_m_s=(left_m_s, right_m_s))
        self._following.forget()
        self._excess.forget()
        self._pressed_s.clear()
        return self._reading(block, frozenset(faults))

    def _unfollowed(self, goals_raw: tuple[int, int], block: Block) -> set[MotorFault]:
        """Return what is wrong with how the wheels follow their goals."""
        time_s = self._used_bus.received_s
        is_blocked = self._following.is_blocked(goals_raw, block.velocities_raw, time_s)
        if self._excess.is_driven(goals_raw, block.velocities_raw, time_s):
            if not self._is_driven_otherwise:
                self._is_driven_otherwise = True
                _log.warning(
                    "%s: the wheels rotate though the bridge has not commanded it: a button of OpenCR was held for "
                    "3 s, or its remote control (RC-100) steers",
                    self._path,
                )
            return {MotorFault.UNCOMMANDED}
        return {MotorFault.BLOCKED} if is_blocked and not self._is_driven_otherwise else set()

    def _watch_buttons(self, block: Block) -> None:
        time_s = self._used_bus.received_s
        for button, drive in _DRIVES.items():
            if not block.buttons[button]:
                self._pressed_s.pop(button, None)
                continue
            since_s = self._pressed_s.setdefault(button, time_s)
            if time_s - since_s >= _HELD_S:
                # Once for each time that it is pressed.
                self._pressed_s[button] = math.inf
                _log.warning(
                    "%s: let %s go: held for 3 s, it lets OpenCR drive %s, whatever the bridge commands",
                    self._path,
                    button.replace("_", " "),
                    drive,
                )

    def reset(self) -> None:
        """Check whether both motors hold again; the board cannot restart them.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: The board does not answer.
            DeviceFaultError: A motor does not hold; the robot must be switched off and on.
        """
        self.set_torque(True)
        self.set_torque(False)

    def close(self) -> None:
        """Stop the wheels, switch torque off, and close the line."""
        bus, self._is_torque_wanted = self._bus, False
        if bus is not None:
            with contextlib.suppress(LineError):
                self._let_go(bus)
            self.leftover = (
                f"{self._path}: the wheel motors may hold: OpenCR has not confirmed that torque is off; switch the "
                "robot off"
                if self._may_hold
                else ""
            )
        self._release()

    def _let_go(self, bus: DynamixelBus) -> None:
        """Switch torque off; after a stop again and again for a time, where that is of use.

        Raises:
            LineError: The line is gone.
        """
        end_s = self._host.monotonic() + UNDO_LIMIT_S
        while True:
            began_s = self._host.monotonic()
            if self._lets_go(bus) or not self._may_hold or not has_stopped(self._source):
                return
            is_heard = bus.received_s > began_s
            if not (is_heard or self._is_uncertain) or self._host.monotonic() > end_s:
                return
            self._host.sleep(_POLL_S)

    def _lets_go(self, bus: DynamixelBus) -> bool:
        """Stop the wheels and switch torque off; returns whether that is known.

        Raises:
            LineError: The line is gone.
        """
        try:
            if self._is_slow:
                # No answer is awaited: the wheels have stopped when the board comes to the second packet.
                bus.write_unanswered(opencr.DEVICE, opencr.COMMAND, encode_command(0, 0))
                bus.write_unanswered(opencr.DEVICE, opencr.TORQUE, b"\0")
                self._host.sleep(_SLOW_LIMIT_S)
                return False
            with contextlib.suppress(DeviceError):
                self._comes_to_rest()
            self._switch_torque(False)
        except DeviceError:
            return False
        return True

    def _release(self) -> None:
        if self._line is not None:
            self._line.close()
        self._line = self._bus = None

    @property
    def _used_bus(self) -> DynamixelBus:
        if self._bus is None:
            raise DeviceError(f"{self._path}: OpenCR is not open")
        return self._bus

    def _check_identity(self, bus: DynamixelBus) -> None:
        bus.begin(self._exchange_limit_s)
        model, firmware = bus.ping(opencr.DEVICE)
        # An earlier answer may have been one to another session.
        bus.settle(opencr.DEVICE)
        if model != opencr.MODEL_NUMBER:
            raise WrongDeviceError(f"{self._path}: this is device model {model}, not an OpenCR ({opencr.MODEL_NUMBER})")
        if firmware != opencr.FIRMWARE:
            advice = (
                "it is from before October 2022; update it to TurtleBot3's present ROS 2 firmware"
                if firmware < opencr.FIRMWARE
                else f"it is newer than is known here; update the bridge, or load version {opencr.FIRMWARE}"
            )
            raise WrongDeviceError(
                f"{self._path}: OpenCR has firmware version {firmware} instead of {opencr.FIRMWARE}: {advice}"
            )
        information = int.from_bytes(bus.read(opencr.DEVICE, opencr.MODEL_INFORMATION, 4).data, "little")
        if information not in self._robot.opencr_information:
            raise WrongDeviceError(
                f"{self._path}: OpenCR's firmware is for another robot than '{self._robot.name}' "
                f"(it reports {information})"
            )

    def _check_motors(self, bus: DynamixelBus) -> None:
        bus.begin(self._exchange_limit_s)
        status = bus.read(opencr.DEVICE, opencr.DEVICE_STATUS, 1).data
        are_connected = bus.read(opencr.DEVICE, opencr.MOTORS_CONNECTED, 1).data
        if status != b"\0" or are_connected != b"\1":
            raise DeviceFaultError(
                f"{self._path}: OpenCR found no wheel motors when it started; "
                "check their cables, then switch the robot off and on"
            )
        bus.begin(self._exchange_limit_s)
        # The first one must be another than the board knows.
        self._heartbeat = bus.read(opencr.DEVICE, opencr.HEARTBEAT, 1).data[0]

    def _clear_profile(self, bus: DynamixelBus) -> None:
        # A profile that other software has left makes a goal of zero a long way to a standstill.
        bus.begin(self._exchange_limit_s)
        bus.write(opencr.DEVICE, opencr.PROFILE_ACCELERATIONS, opencr.NO_PROFILE)
        if bus.read(opencr.DEVICE, opencr.PROFILE_ACCELERATIONS, len(opencr.NO_PROFILE)).data != opencr.NO_PROFILE:
            raise DeviceFaultError(f"{self._path}: OpenCR keeps a profile acceleration; switch the robot off and on")

    def _calibrate(self, bus: DynamixelBus) -> None:
        # The board does nothing else until it is done, and answers then.
        bus.begin(_CALIBRATION_LIMIT_S)
        bus.write(opencr.DEVICE, opencr.CALIBRATE_GYRO, b"\1", _CALIBRATION_LIMIT_S)
        self._await_refresh()

    def _await_refresh(self) -> None:
        # After a calibration, which another program may have begun, the board first reports an uptime from before it.
        self._host.sleep(_REFRESHED_MS / 1000)

    def _comes_to_rest(self) -> bool:
        """Command zero and wait for the wheels; whether they came to rest in time."""
        return self._cycles_until(lambda block: max(map(abs, block.velocities_raw)) <= _REST_RAW, _REST_LIMIT_S)

    def _switch_torque(self, is_on: bool) -> None:
        if is_on:
            if has_stopped(self._source):
                raise StoppedError(f"{self._path}: torque is not switched on, as a stop came meanwhile")
            self._may_hold = self._is_uncertain = True
        self._write_torque(is_on)
        if not self._cycles_until(lambda block: block.is_torque_on == is_on, _TORQUE_LIMIT_S):
            done = "hold" if is_on else "let go"
            raise DeviceFaultError(f"{self._path}: a wheel motor does not {done}; switch the robot off and on")
        self._is_uncertain = False
        if not is_on:
            self._may_hold, self.leftover = False, ""

    def _write_torque(self, is_on: bool) -> None:
        bus = self._used_bus
        bus.begin(self._exchange_limit_s)
        bus.write(opencr.DEVICE, opencr.TORQUE, bytes((is_on,)))

    def _cycles_until(self, is_done: Callable[[Block], bool], limit_s: float) -> bool:
        """Exchange with a command of zero until it has the effect; whether it had in time."""
        begin_ms = self._cycle(STANDSTILL).uptime_ms
        end_s = self._host.monotonic() + limit_s
        while True:
            self._host.sleep(_POLL_S)
            block = self._cycle(STANDSTILL)
            # Before a refresh, the board reports what was written or an earlier state, and not what the motors do.
            is_refreshed = (block.uptime_ms - begin_ms) % UPTIME_MODULUS >= _REFRESHED_MS
            if is_refreshed and is_done(block):
                return True
            if self._host.monotonic() > end_s:
                return False

    def _cycle(self, velocity: Velocity | None, sent: Callable[[], None] | None = None) -> Block:
        """Command, if there is anything to, change the heartbeat, and read."""
        bus = self._used_bus
        bus.begin(self._exchange_limit_s)
        if velocity is not None:
            self._command(velocity, sent)
        self._heartbeat = (self._heartbeat + 1) % 256
        bus.write(opencr.DEVICE, opencr.HEARTBEAT, bytes((self._heartbeat,)))
        return self._block(bus)

    def _block(self, bus: DynamixelBus) -> Block:
        """Read everything; what cannot be is asked for again.

        Raises:
            DeviceSilentError: Nothing that can be has come.
        """
        spoilt: int | None = None
        for trial in range(_READS):
            is_last = trial == _READS - 1
            asked_s = self._host.monotonic()
            data = self._data(bus, spoilt if is_last else None)
            problem = opencr.impossibility(data)
            if problem:
                spoilt = opencr.spoilt_from(data)
                self._judge.refuse(problem, self._board_s)
                continue
            block = decode_block(data)
            passed_s, problem = self._passed_s(block.uptime_ms, asked_s)
            if problem:
                if trial > 0:
                    self._give_up(problem)
                self._judge.refuse(problem, self._board_s)
            elif self._counts(block, self._board_s + passed_s):
                self._board_s += passed_s
                self._uptime = block.uptime_ms, asked_s, bus.received_s
                return block
            else:
                problem = "; ".join(filter(None, self._judge.excess))
            if trial > 0:
                break
        raise DeviceSilentError(f"{self._path}: OpenCR does not answer with what can be: {problem}")

    def _data(self, bus: DynamixelBus, spoilt: int | None) -> bytes:
        """Read the block, in two parts if its firmware spoils what follows an index, where an item begins."""
        address, length = opencr.BLOCK_ADDRESS, opencr.BLOCK_LENGTH
        if spoilt is None or address + spoilt not in opencr.MOTOR_ITEMS:
            return bus.read(opencr.DEVICE, address, length).data
        # The last bytes are of no use here.
        rest = next(count for count in range(length - spoilt, 0, -1) if count not in SETTLING_LENGTHS)
        begin = bus.read(opencr.DEVICE, address, spoilt).data
        return (begin + bus.read(opencr.DEVICE, address + spoilt, rest).data).ljust(length, b"\0")

    def _counts(self, block: Block, time_s: float) -> bool:
        """Return True if the wheels can have got there."""
        counts = WheelCounts(block.ticks, block.velocities_raw)
        verdict = self._judge.judge(counts, time_s)
        if verdict is Verdict.REFUSED and not block.is_torque_on and len(self._judge.excess) == len(block.ticks):
            # The firmware does not switch torque on again: only now a motor may have restarted.
            self._judge.begin_anew(counts, time_s)
            verdict = Verdict.ANEW
        if verdict is Verdict.ANEW:
            is_left, is_right = map(bool, self._judge.excess)
            self._odometry = self._odometry.rebased(is_left, is_right)
        return verdict is not Verdict.REFUSED

    @property
    def _refused(self) -> int:
        return self._judge.refused + (0 if self._yaw is None else self._yaw.judge.refused)

    @property
    def _begun_anew(self) -> int:
        return self._judge.begun_anew + (0 if self._yaw is None else self._yaw.judge.begun_anew)

    def _command(self, velocity: Velocity, sent: Callable[[], None] | None = None) -> None:
        self._words = self._words_of(velocity)
        self._used_bus.write(opencr.DEVICE, opencr.COMMAND, encode_command(*self._words), sent=sent)

    def _renew(self) -> None:
        """Command what is newer than what was commanded in this exchange; called while an answer is awaited."""
        velocity = self._source.newer()
        if velocity is not None:
            self._words = self._words_of(velocity)
            self._used_bus.interject(opencr.DEVICE, opencr.COMMAND, encode_command(*self._words))
            self._source.written()

    def _words_of(self, velocity: Velocity) -> tuple[int, int]:
        if self._host.monotonic() > velocity.until_s:
            return 0, 0
        return opencr_words(velocity, self.limits, self._robot.wheel_separation_m)

    def _passed_s(self, uptime_ms: int, asked_s: float) -> tuple[float, str]:
        """Return the time of the board since the last block, and what is wrong with it; empty: nothing."""
        if self._uptime is None:
            return 0.0, ""
        before_ms, before_asked_s, before_received_s = self._uptime
        half = UPTIME_MODULUS // 2
        passed_s = ((uptime_ms - before_ms + half) % UPTIME_MODULUS - half) / 1000
        if passed_s < max(0.0, asked_s - before_received_s - _LAG_S):
            return passed_s, "OpenCR has restarted"
        if passed_s > self._used_bus.received_s - before_asked_s + _LEAD_S:
            return passed_s, "the computer stood still or OpenCR has restarted"
        return passed_s, ""

    def _give_up(self, problem: str) -> NoReturn:
        # The board switches torque on by itself when it starts, and its motors count anew.
        self._is_torque_wanted, self._may_hold = False, True
        self._used_bus.write_unanswered(opencr.DEVICE, opencr.COMMAND, encode_command(0, 0))
        raise DeviceError(f"{self._path}: {problem}; it must be opened again")

    def _wheels_raw(self, words: tuple[int, int]) -> tuple[int, int]:
        velocity = Velocity(words[0] / 100, words[1] / 100)
        left_m_s, right_m_s = wheel_speeds(velocity, self._robot.wheel_separation_m)
        return int(left_m_s / self._robot.raw_m_s), int(right_m_s / self._robot.raw_m_s)

    def _reading(self, block: Block, faults: frozenset[MotorFault]) -> DriveReading:
        time_s = self._used_bus.received_s
        self._odometry = self._odometry.advanced(*block.ticks, None if self._yaw is None else self._yaw.rotation(block))
        left_m_s, right_m_s = (raw * self._robot.raw_m_s for raw in block.velocities_raw)
        # Below this, the board no longer refreshes the share.
        is_empty = block.battery_v < self._robot.battery.empty_v
        imu = measurable(block.motion)
        if len(imu) < len(block.motion):
            self._judge.refuse(
                f"it measures more than it can: {sorted(block.motion.keys() - imu.keys())}", self._board_s
            )
        return DriveReading(
            time_s=time_s,
            pose=self._odometry.pose,
            velocity=body_velocity(left_m_s, right_m_s, self._robot.wheel_separation_m),
            wheels_m_s=(left_m_s, right_m_s),
            is_torque_on=block.is_torque_on,
            faults=faults,
            battery_v=block.battery_v,
            battery_share=0.0 if is_empty else block.battery_share,
            buttons=block.buttons,
            imu=imu,
            wheels_m=self._odometry.wheels_m,
            wheel_radius_m=self._robot.wheel_radius_m,
            refused=self._refused,
            pose_covariance=self._odometry.covariance,
            velocity_variances=velocity_variances(
                left_m_s, right_m_s, self._robot.raw_m_s, self._robot.wheel_separation_m
            ),
        )
