"""A MAVLink rover: ArduPilot Rover, driven in its mode GUIDED by velocity and yaw rate.

The vehicle itself stops 3 s after the last target. It is not a real-time wheel bus: it reports only once a second
whether it is armed and in which mode. A person with its remote control may take it over at any time, and the driver
respects that.

Sources: ArduPilot Rover (`GCS_MAVLink_Rover.cpp`, `mode_guided.cpp`, `AP_Arming_Rover.cpp`), mavlink.io.
"""

import contextlib
import logging
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass

from robosc_bridge.devices.interface import (
    CONSTANT,
    STANDSTILL,
    UNDO_LIMIT_S,
    BatteryLevel,
    DriveLimits,
    DriveReading,
    MotorFault,
    Velocity,
    VelocitySource,
    has_stopped,
)
from robosc_bridge.devices.kinematics import wheel_speeds, within_limits
from robosc_bridge.devices.mavlink_link import (
    BAUD,
    OWN_COMPONENT,
    OWN_SYSTEM,
    LinkSettings,
    VehicleLink,
    acquire,
    release,
)
from robosc_bridge.devices.mavlink_odometry import VehicleTracker, estimate
from robosc_bridge.devices.mavlink_state import TEXT_LIMIT_S, Timestamped, VehicleState
from robosc_bridge.devices.robots import Body
from robosc_bridge.devices.wheel_following import FollowingMonitor
from robosc_bridge.errors import (
    BridgeError,
    DeviceError,
    DeviceFaultError,
    DeviceSilentError,
    StoppedError,
    WrongDeviceError,
)
from robosc_bridge.host import Host
from robosc_bridge.protocol.framing import FrameCounts
from robosc_bridge.protocol.mavlink_messages import (
    ChargeState,
    Heartbeat,
    MavCommand,
    Mode,
    MotionEstimate,
    Result,
    Telemetry,
    arming,
    command,
    entering,
    velocity_target,
)
from robosc_bridge.protocol.mavlink_signing import Signing
from robosc_bridge.transport.system_host import SYSTEM_HOST

HEARTBEAT_LIMIT_S = 3.5
"""Three heartbeats of the vehicle were lost."""

_FIRST_HEARTBEAT_LIMIT_S = 3.5
_TELEMETRY = (
    Telemetry.ATTITUDE,
    Telemetry.LOCAL_POSITION,
    Telemetry.ODOMETRY,
    Telemetry.SYS_STATUS,
    Telemetry.BATTERY_STATUS,
)
_TELEMETRY_S = {Telemetry.SYS_STATUS: 1.0, Telemetry.BATTERY_STATUS: 1.0}
_ANSWER_LIMIT_S = 1.0
_TRIALS = 3
_SHOWN_LIMIT_S = 3.0
_SLICE_S = 0.05
_REST_LIMIT_S = 3.0
_REST_M_S = 0.05
_REST_RAD_S = 0.1
_CLOSE_TRIALS = 1
# Orders are carried out one after the other: a rover that is disarmed so long after an order to disarm stays it.
_UNANSWERED_S = 2.0
# Five times a second is asked for. A new velocity goes out at once, but no more than one each 16 ms in the long run,
# and no more than one ahead of that, so that a slow radio is not filled: at 57600 baud a signed target takes 14 ms.
_TARGET_S = 0.1
_NEW_TARGET_S = 0.016
_WARNING = 4
_FOLLOWING_LIMIT_S = 2.0
_MM = 1000
_LEVELS: Mapping[int, BatteryLevel] = {
    ChargeState.OK: BatteryLevel.SOUND,
    ChargeState.CHARGING: BatteryLevel.SOUND,
    ChargeState.LOW: BatteryLevel.LOW,
    ChargeState.UNHEALTHY: BatteryLevel.LOW,
    ChargeState.CRITICAL: BatteryLevel.EMPTY,
    ChargeState.EMERGENCY: BatteryLevel.EMPTY,
    ChargeState.FAILED: BatteryLevel.EMPTY,
}
_WORSE = tuple(BatteryLevel)
_LONG_TARGETS = (
    "the rover is armed; if the bridge or its line fails, it drives on for up to 3 s, until its target expires "
    "(docs/bridge-safety.md says what shortens that)"
)

_log = logging.getLogger(__name__)


@dataclass
class VehicleCounts(FrameCounts):
    """Counts of the line to a vehicle, and of its reports.

    Attributes:
        implausible: Estimates of its motion that were refused, as no body moves like that.
        begun_anew: Times that its estimate has begun from another place.
    """

    implausible: int = 0
    begun_anew: int = 0


class MavlinkRover:
    """An `AttentiveDriveBase`. Used from one thread.

    Args:
        path: Path of a serial port; or `udpin:HOST:PORT`, `udpout:HOST:PORT`, `tcp:HOST:PORT`.
        robot: Abilities of the robot.
        baud: Speed of a serial port.
        system: System number of the vehicle; None: the first rover that is heard.
        own_system: Our system number.
        own_component: Our component number.
        signing: Signing of packets; None: none.
        host: Parts of its computer that it uses.
        motion_limit_s: Time for which the vehicle's last estimate of its motion holds, in seconds.
        telemetry_s: Period at which it is asked to report its motion, in seconds.

    Attributes:
        limits: Limits of the drive base.
        leftover: Text that says what the rover may still do after `close`; empty: nothing.
    """

    def __init__(
        self,
        path: str,
        robot: Body,
        baud: int = BAUD,
        *,
        system: int | None = None,
        own_system: int = OWN_SYSTEM,
        own_component: int = OWN_COMPONENT,
        signing: Signing | None = None,
        host: Host = SYSTEM_HOST,
        motion_limit_s: float = 1.0,
        telemetry_s: float = 0.05,
    ) -> None:
        self.limits: DriveLimits = robot.limits
        self._path = path
        self._robot = robot
        self._host = host
        self._settings = LinkSettings(path, baud, system, own_system, own_component, signing)
        self._motion_limit_s = motion_limit_s
        self._telemetry_s = telemetry_s
        self._link: VehicleLink | None = None
        self._tracker = VehicleTracker(path, robot.limits)
        self._following = FollowingMonitor(_FOLLOWING_LIMIT_S)
        self._began_s = self._host.monotonic()
        self._restarts = 0
        self._is_torque_wanted = False
        self._is_torque_lost = False
        # True from the first order to arm until the rover is known to be disarmed, or until it is known whether it is.
        self._may_be_armed = self._is_uncertain = False
        self.leftover = ""
        self._target = STANDSTILL
        self._target_s = -math.inf
        # Until when the radio has to do with the targets so far.
        self._filled_s = -math.inf
        self._is_warned = False
        self._source: VelocitySource = CONSTANT

    @property
    def counters(self) -> VehicleCounts:
        """Health of the line since it was opened."""
        link, judge = self._link, self._tracker.judge
        counts = FrameCounts() if link is None else link.counts
        return VehicleCounts(**asdict(counts), implausible=judge.refused, begun_anew=judge.begun_anew)

    def attend(self, source: VelocitySource) -> None:
        """Report to this source when a target was sent; no exchange takes long enough to ask it for a newer one."""
        self._source = source

    def wake(self) -> None:
        """Do nothing: no exchange waits."""

    def open(self) -> None:
        """Find the vehicle and check that it is a rover which reports its position, without another driver.

        Raises:
            LineError: The line cannot be used.
            DeviceSilentError: No vehicle is heard.
            WrongDeviceError: It is no ArduPilot Rover.
            DeviceFaultError: Another operator drives it, or it does not know its position, or does not disarm.
        """
        self.close()
        self._link = acquire(self._settings, as_driver=True, host=self._host)
        try:
            self._is_torque_wanted = self._is_torque_lost = False
            self._target, self._target_s = STANDSTILL, -math.inf
            self._tracker.begin_anew()
            self._following.forget()
            self._find(self._link)
            self._restarts = self._link.state.restarts
            heartbeat = self._heartbeat(self._link.state)
            self._check_ours(heartbeat)
            if self._may_be_armed:
                self._must_undo()
            self.leftover = ""
            self._leave_at_rest(heartbeat)
            for telemetry in _TELEMETRY:
                self._link.request((telemetry,), _TELEMETRY_S.get(telemetry, self._telemetry_s))
            if not self._waits(lambda state: self._fresh(state) is not None, _SHOWN_LIMIT_S):
                raise DeviceFaultError(
                    f"{self._path}: the rover does not report where it is; its estimator has no origin (GPS, or "
                    "another source of its position)"
                )
        except BaseException:
            self._release()
            raise

    def set_torque(self, is_on: bool) -> None:
        """Enter GUIDED and arm; or stop and disarm. A vehicle that another operator has taken over is left alone.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: The vehicle does not answer.
            DeviceFaultError: It refuses, with its reason, or another operator drives it.
            StoppedError: A stop came meanwhile; it may be armed until this is called again to disarm it.
        """
        link = self._used_link
        self._is_torque_wanted = False
        heartbeat = self._heartbeat(link.state)
        if not is_on:
            if self._is_another_s(heartbeat):
                self._may_be_armed = self._is_uncertain = False
            elif heartbeat.is_armed:
                self._leave_at_rest(heartbeat)
            elif self._may_be_armed:
                # An order to arm may still be on its way.
                self._must_undo()
            return
        self._check_ours(heartbeat)
        self._begin(link, heartbeat)
        self._send_target(STANDSTILL)
        self._is_torque_wanted = True
        self._is_torque_lost = False
        self._following.forget()
        if not self._is_warned:
            self._is_warned = True
            _log.warning("%s: %s", self._path, _LONG_TARGETS)

    def _begin(self, link: VehicleLink, heartbeat: Heartbeat) -> None:
        """Enter GUIDED and arm, as long as no stop comes."""
        if heartbeat.mode != Mode.GUIDED:
            self._command(MavCommand.SET_MODE, entering(Mode.GUIDED), "go to mode GUIDED", is_beginning=True)
            self._must_show(lambda heartbeat: heartbeat.mode == Mode.GUIDED, "show mode GUIDED", is_beginning=True)
        self._send_target(STANDSTILL)
        if not self._heartbeat(link.state).is_armed:
            self._require_no_stop()
            self._may_be_armed = self._is_uncertain = True
            try:
                self._command(MavCommand.ARM_DISARM, arming(True), "arm", is_beginning=True)
            except DeviceFaultError:
                self._may_be_armed = self._is_uncertain = False
                raise
            try:
                self._must_show(lambda heartbeat: heartbeat.is_armed, "show that it is armed", is_beginning=True)
            except DeviceFaultError:
                self._disarm(_CLOSE_TRIALS)
                raise
        self._may_be_armed, self._is_uncertain = True, False

    def _require_no_stop(self) -> None:
        """Raise if what has not begun must not begin any more.

        Raises:
            StoppedError: A stop came.
        """
        if has_stopped(self._source):
            raise StoppedError(f"{self._path}: the rover is not armed, as a stop came meanwhile")

    def exchange(self, velocity: Velocity) -> DriveReading:
        """Send the velocity and our heartbeat when they are due, and return what has arrived; waits for nothing.

        A target is sent at once when it is another one, and again every 100 ms, if this is called that often.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: No heartbeat, or no estimate of its motion, has come for too long.
            DeviceError: The vehicle has started anew.
        """
        link = self._used_link
        link.keep_alive()
        state = link.state
        heartbeat = self._heartbeat(state)
        if state.restarts != self._restarts:
            self._is_torque_wanted = False
            raise DeviceError(f"{self._path}: the rover has restarted; it must be opened again")
        is_obeying = heartbeat.is_armed and heartbeat.mode == Mode.GUIDED
        report = self._fresh(state)
        if self._is_torque_wanted:
            self._is_torque_lost = self._is_torque_lost or not is_obeying
            # A rover that no longer reports its motion is not driven, either.
            is_driven = not self._is_torque_lost and report is not None
            target = velocity if is_driven else STANDSTILL
            target = within_limits(target, self.limits, self._robot.wheel_separation_m)
            if self._host.monotonic() > velocity.until_s:
                target = STANDSTILL
            if self._is_due(target):
                self._send_target(target)
            if is_driven and target == self._target:
                self._source.written()
        if report is None:
            raise DeviceSilentError(
                f"{self._path}: the rover has not reported its motion for {self._motion_limit_s:g} s"
            )
        return self._reading(state, report, is_obeying)

    def reset(self) -> None:
        """Check whether the vehicle can be armed in GUIDED again, and disarm it.

        Raises:
            LineError: The line is gone.
            DeviceSilentError: The vehicle does not answer.
            DeviceFaultError: It refuses, with its reason.
        """
        self.set_torque(True)
        self.set_torque(False)

    def close(self) -> None:
        """Stop, disarm, and close the line; a vehicle that another operator drives is left alone."""
        if self._link is not None and (self._is_torque_wanted or self._may_be_armed):
            self._is_torque_wanted = False
            is_undone = False
            with contextlib.suppress(BridgeError):
                is_undone = self._let_go()
            self.leftover = (
                ""
                if is_undone
                else f"{self._path}: the rover may be armed: it has not confirmed within "
                f"{UNDO_LIMIT_S:g} s that it is disarmed; switch it off, or disarm it by its remote control"
            )
        self._release()

    def _let_go(self) -> bool:
        """Stop and disarm; returns whether that is known, or another operator drives it."""
        report = self._used_link.state.heartbeat
        is_heard = report is not None and self._host.monotonic() - report.time_s <= HEARTBEAT_LIMIT_S
        if report is not None and is_heard and self._is_another_s(report.content):
            self._may_be_armed = self._is_uncertain = False
            return True
        self._send_target(STANDSTILL)
        if is_heard:
            self._comes_to_rest()
        return self._undo()

    def _must_undo(self) -> None:
        """Disarm as `_undo`.

        Raises:
            DeviceSilentError: It is not known whether the rover is disarmed.
        """
        if not self._undo():
            raise DeviceSilentError(f"{self._path}: the rover does not confirm that it is disarmed")

    def _undo(self) -> bool:
        """Disarm a rover that may be armed, or may become so by an order that is still on its way.

        Returns:
            Whether a heartbeat shows that it is disarmed, which came after the answer, or long enough after the order;
            or whether another operator drives it.
        """
        link, began_s = self._used_link, self._host.monotonic()
        end_s, is_forced, confirmation = began_s + UNDO_LIMIT_S, False, 0

        def is_over(state: VehicleState) -> bool:
            answer, report = state.answers.get(MavCommand.ARM_DISARM), state.heartbeat
            if report is None or report.time_s <= began_s:
                return False
            if self._is_another_s(report.content):
                return True
            is_answered = answer is not None and began_s <= answer.time_s < report.time_s
            is_late = report.time_s > began_s + _UNANSWERED_S
            return (is_answered or is_late) and not report.content.is_armed

        while (left_s := end_s - self._host.monotonic()) > 0.0:
            state = link.state
            if state.system is None or state.component is None:
                return False
            parameters = arming(False, is_forced=is_forced)
            link.send(command(state.system, state.component, MavCommand.ARM_DISARM, confirmation, *parameters))
            if self._waits(is_over, min(left_s, _ANSWER_LIMIT_S)):
                self._may_be_armed = self._is_uncertain = False
                return True
            is_heard = self._host.monotonic() - link.state.heard_s <= _ANSWER_LIMIT_S
            if not (is_heard or self._is_uncertain):
                break
            # Stopping is not refused: what a polite command does not reach, a forced one does.
            is_forced, confirmation = True, confirmation + 1
        return False

    def _release(self) -> None:
        link, self._link = self._link, None
        if link is not None:
            release(link, as_driver=True)

    @property
    def _used_link(self) -> VehicleLink:
        if self._link is None:
            raise DeviceError(f"{self._path}: the rover is not open")
        return self._link

    def _find(self, link: VehicleLink) -> None:
        if self._waits(lambda state: state.heartbeat is not None, _FIRST_HEARTBEAT_LIMIT_S):
            self._heartbeat(link.state)
            if self._settings.is_own(link.state.system, link.state.component):
                raise WrongDeviceError(
                    f"{self._path}: the rover has the numbers {link.state.system} (system) and {link.state.component} "
                    "(component), as the bridge; set own_system or own_component to others"
                )
            return
        stranger = link.state.stranger
        if stranger is not None:
            raise WrongDeviceError(
                f"{self._path}: the vehicle there is of type {stranger.kind} with autopilot {stranger.autopilot}"
                f"{'' if self._settings.system is None else ' or has another system number'}, "
                "not ArduPilot Rover (10, 3)"
            )
        raise DeviceSilentError(
            f"{self._path}: no heartbeat of a rover within {_FIRST_HEARTBEAT_LIMIT_S:g} s; is it on, does it speak "
            f"MAVLink 2 here{'' if self._settings.signing is None else ', and has it the same signing key'}?"
        )

    def _heartbeat(self, state: VehicleState) -> Heartbeat:
        """The last one.

        Raises:
            DeviceSilentError: It was too long ago.
        """
        report = state.heartbeat
        if report is None or self._host.monotonic() - report.time_s > HEARTBEAT_LIMIT_S:
            raise DeviceSilentError(f"{self._path}: no heartbeat of the rover for {HEARTBEAT_LIMIT_S:g} s")
        return report.content

    def _fresh(self, state: VehicleState) -> Timestamped[MotionEstimate] | None:
        """Return the last estimate that counts, if it is not too old."""
        self._tracker.take(estimate(state))
        report = self._tracker.accepted
        is_fresh = report is not None and self._host.monotonic() - report.time_s <= self._motion_limit_s
        return report if is_fresh else None

    def _is_another_s(self, heartbeat: Heartbeat) -> bool:
        return heartbeat.is_armed and heartbeat.mode != Mode.GUIDED

    def _check_ours(self, heartbeat: Heartbeat) -> None:
        if self._is_another_s(heartbeat):
            mode = Mode(heartbeat.mode).name if heartbeat.mode in Mode else str(heartbeat.mode)
            raise DeviceFaultError(
                f"{self._path}: somebody else drives the rover: it is armed in mode {mode}; disarm it there first"
            )

    def _leave_at_rest(self, heartbeat: Heartbeat) -> None:
        if heartbeat.is_armed:
            self._send_target(STANDSTILL)
            self._comes_to_rest()
            self._disarm(_TRIALS)

    def _disarm(self, trials: int) -> None:
        """Stopping is not refused: what a polite command does not reach, a forced one does."""
        try:
            self._command(MavCommand.ARM_DISARM, arming(False), "disarm", trials)
        except DeviceFaultError:
            self._command(MavCommand.ARM_DISARM, arming(False, is_forced=True), "disarm by force", trials)
        self._must_show(lambda heartbeat: not heartbeat.is_armed, "show that it is disarmed")
        self._may_be_armed = self._is_uncertain = False

    def _comes_to_rest(self) -> bool:
        def is_at_rest(state: VehicleState) -> bool:
            # A rover that reports no motion cannot be waited for.
            report = self._fresh(state)
            return report is None or (
                abs(report.content.linear_m_s) < _REST_M_S and abs(report.content.angular_rad_s) < _REST_RAD_S
            )

        return self._waits(is_at_rest, _REST_LIMIT_S)

    def _command(
        self,
        number: MavCommand,
        parameters: tuple[float, ...],
        action: str,
        trials: int = _TRIALS,
        *,
        is_beginning: bool = False,
    ) -> None:
        """Send a command until it is answered; one that begins something only as long as no stop comes.

        Raises:
            DeviceFaultError: It is refused.
            WrongDeviceError: The vehicle does not know it.
            DeviceSilentError: It is not answered.
            StoppedError: A stop came; the command may have been carried out.
        """
        link = self._used_link
        began_s = self._host.monotonic()
        for confirmation in range(trials):
            state = link.state
            if state.system is None or state.component is None:
                break
            if is_beginning:
                self._require_no_stop()
            link.send(command(state.system, state.component, number, confirmation, *parameters))

            def is_answered(now: VehicleState) -> bool:
                report = now.answers.get(number)
                return report is not None and report.time_s >= began_s and report.content.result != Result.IN_PROGRESS

            if self._waits(is_answered, _ANSWER_LIMIT_S, is_beginning=is_beginning):
                self._check_answer(link.state, number, began_s, action)
                return
        raise DeviceSilentError(f"{self._path}: the rover does not answer the command to {action}")

    def _check_answer(self, state: VehicleState, number: MavCommand, began_s: float, action: str) -> None:
        result = state.answers[number].content.result
        if result == Result.ACCEPTED:
            return
        if result == Result.UNSUPPORTED:
            raise WrongDeviceError(f"{self._path}: the rover does not know how to {action}")
        name = Result(result).name.lower().replace("_", " ") if result in Result else f"result {result}"
        # The reason comes as text, before the answer; pieces of it may have been lost.
        self._waits(lambda state: not state.at(self._host.monotonic()).is_text_awaited, TEXT_LIMIT_S)
        reasons = [
            report.content.text
            for report in self._used_link.state.at_end().texts
            if report.time_s >= began_s and report.content.severity <= _WARNING and report.content.data
        ]
        reason = "; ".join(dict.fromkeys(reasons)) or "it gives no reason"
        raise DeviceFaultError(f"{self._path}: the rover does not {action} ({name}): {reason}")

    def _must_show(self, is_so: Callable[[Heartbeat], bool], what: str, *, is_beginning: bool = False) -> None:
        """Wait for the heartbeat that shows it: an accepted command is not yet a done one.

        Raises:
            DeviceFaultError: It does not come.
            StoppedError: A stop came before it.
        """

        def is_shown(state: VehicleState) -> bool:
            return state.heartbeat is not None and is_so(state.heartbeat.content)

        if not self._waits(is_shown, _SHOWN_LIMIT_S, is_beginning=is_beginning):
            raise DeviceFaultError(f"{self._path}: the rover has accepted the command, but does not {what}")

    def _waits(self, is_so: Callable[[VehicleState], bool], limit_s: float, *, is_beginning: bool = False) -> bool:
        """Wait for a state of the vehicle, with our heartbeat going on; returns whether it came in time.

        Raises:
            LineError: The line is gone.
            StoppedError: Something is to begin, and a stop came.
        """
        link = self._used_link
        end_s = self._host.monotonic() + limit_s
        while True:
            link.keep_alive()
            left_s = end_s - self._host.monotonic()
            if link.wait(is_so, max(min(left_s, _SLICE_S), 0.0)):
                return True
            if is_beginning:
                self._require_no_stop()
            if left_s <= 0:
                return False

    def _is_due(self, target: Velocity) -> bool:
        now_s = self._host.monotonic()
        if target == self._target:
            return now_s - self._target_s >= _TARGET_S
        return target == STANDSTILL or self._filled_s <= now_s + _NEW_TARGET_S

    def _send_target(self, target: Velocity) -> None:
        link = self._used_link
        state = link.state
        if state.system is None or state.component is None:
            return
        self._target, self._target_s = target, self._host.monotonic()
        self._filled_s = max(self._filled_s, self._target_s) + _NEW_TARGET_S
        boot_ms = int((self._target_s - self._began_s) * 1000) % 2**32
        link.send(velocity_target(state.system, state.component, boot_ms, target.linear_m_s, target.angular_rad_s))

    def _reading(self, state: VehicleState, report: Timestamped[MotionEstimate], is_obeying: bool) -> DriveReading:
        odometry = self._tracker.odometry
        velocity = odometry.velocity
        wheels_m_s = wheel_speeds(velocity, self._robot.wheel_separation_m)
        faults = {MotorFault.TORQUE_LOST} if self._is_torque_lost else set()
        is_on = self._is_torque_wanted and is_obeying and not self._is_torque_lost
        if is_on:
            goals = [round(speed * _MM) for speed in wheel_speeds(self._target, self._robot.wheel_separation_m)]
            if self._following.is_blocked(goals, [round(speed * _MM) for speed in wheels_m_s], report.time_s):
                faults.add(MotorFault.BLOCKED)
        else:
            self._following.forget()
        batteries = [
            found for found in (state.battery, *map(state.packs.get, sorted(state.packs))) if found is not None
        ]
        shares = [found.share for found in batteries if found.share is not None]
        levels = [_LEVELS[found.state] for found in batteries if found.state in _LEVELS]
        return DriveReading(
            time_s=report.time_s,
            pose=odometry.pose,
            velocity=velocity,
            wheels_m_s=wheels_m_s,
            is_torque_on=is_on,
            faults=frozenset(faults),
            # That of the first battery; of charge and judgement, the worst counts.
            battery_v=next((found.voltage_v for found in batteries if found.voltage_v is not None), None),
            battery_share=min(shares, default=None),
            battery_level=max(levels, key=_WORSE.index, default=None),
            refused=self._tracker.judge.refused,
            imu={"angular_velocity_z": velocity.angular_rad_s},
        )
