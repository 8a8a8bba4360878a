"""The safety layer itself: one lock, and one `output` for each exchange with the drive base."""

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace

from robosc_bridge.devices.interface import STANDSTILL, DriveReading, MotorFault, Velocity
from robosc_bridge.safety.limits import SafetyLimits
from robosc_bridge.safety.monitors import BatteryMonitor, Freshness, RefusalMonitor, ScanCoverageMonitor, WheelMonitor
from robosc_bridge.safety.motion import ramped, wheels, within
from robosc_bridge.safety.reasons import LATCHING, TORQUE_OFF, Caution, Reason

# The supply's bit alone does not switch a motor off; how much is left in the battery has a rule of its own.
_HARMLESS = frozenset({MotorFault.VOLTAGE})
# A driver that knows its own commands to the motors sees a motion that is none of it also while the robot drives.
_UNBIDDEN = frozenset({MotorFault.UNCOMMANDED})


@dataclass(frozen=True, slots=True)
class Output:
    """Command for the drive base in its next exchange.

    Attributes:
        velocity: Standstill whenever there is a reason; it holds for `SafetyLimits.motor_timeout_s`.
        is_torque_wanted: True if torque is to be on.
        reasons: Reasons why the robot may not move, in the order of `Reason`.
        warnings: Warnings for a person, in the order of `Caution`.
    """

    velocity: Velocity
    is_torque_wanted: bool
    reasons: tuple[Reason, ...]
    warnings: tuple[Caution, ...]


class SafetyLayer:
    """Safety layer that lets safe velocities pass and otherwise commands zero; in standby until it is enabled.

    The thread of the drive base calls `output`, switches torque and exchanges the velocity accordingly, and reports
    with `on_drive_reading` or `drive_failed`; the other methods may be called from any thread, and from a signal
    handler. All times are those of one monotonic clock, in seconds. No method raises, and none waits for anything but
    the lock, which is held for some 40 microseconds.

    A command counts only if it was given after an `output` without reasons, or if it ends a silence of commands: a
    command from before or during a stop never moves the robot afterwards. Motion begins with the ramp from standstill.

    Args:
        limits: Limits of velocities and times.
    """

    def __init__(self, limits: SafetyLimits) -> None:
        self._limits = limits
        self._torque_off = (*TORQUE_OFF, *([Reason.OPERATOR_STOP] * limits.is_torque_off_on_operator_stop))
        # A signal handler may call while its own thread is inside.
        self._lock = threading.RLock()
        self._now_s = 0.0
        # Time at which the drive base's thread or the loop was last at work.
        self._alive_s = 0.0
        self._is_enabled = False
        self._latched: set[Reason] = set()
        # The commanded velocity, within the limits, and the velocity of the last output.
        self._wanted = self._velocity = STANDSTILL
        self._is_refused = False
        # Forward velocity of the last command: whether it counts or not, the robot is wanted there.
        self._asked_m_s = 0.0
        # All commands up to the next output came too early to count.
        self._is_held = True
        # Reasons of the last output.
        self._reasons: tuple[Reason, ...] = ()
        self._commands = Freshness(limits.command_timeout_s)
        self._scans = Freshness(limits.scan_timeout_s)
        self._readings = Freshness(limits.motor_timeout_s)
        self._loop = Freshness(limits.loop_timeout_s)
        self._operator = Freshness(limits.operator_timeout_s)
        self._failures = 0
        self._faults: frozenset[MotorFault] = frozenset()
        self._sight = ScanCoverageMonitor(limits.min_valid_share)
        self._is_noisy = False
        self._battery = BatteryMonitor(limits)
        self._refusals = RefusalMonitor()
        self._wheels = WheelMonitor(limits)
        # Time since which torque is wanted, None if it is not; and the motors' report since then that they hold.
        self._torque_since_s: float | None = None
        self._is_torque_seen = False
        # Since when torque is to go off; when the last reading was taken, if the wheels stood still in it.
        self._letting_go_s: float | None = None
        self._still_s = -math.inf

    def enable(self) -> None:
        """Leave standby; earlier commands do not count."""
        with self._lock:
            self._is_enabled = True
            self._is_held = True

    def disable(self) -> None:
        """Go to standby: velocity zero, and torque off once the wheels stand still."""
        with self._lock:
            self._is_enabled = False
            self._is_held = True
            self._asked_m_s = 0.0

    def command(self, velocity: Velocity, now_s: float) -> None:
        """Request a velocity.

        Args:
            velocity: Requested velocity; a part beyond a limit is reduced to the limit; a velocity that is not finite
                is refused and counts as a stop.
            now_s: Time of the request, in seconds; a time that is not finite refuses it, too.
        """
        numbers = (velocity.linear_m_s, velocity.angular_rad_s, now_s)
        with self._lock:
            # Comparing takes integers of any size, too.
            self._is_refused = not all(-math.inf < number < math.inf for number in numbers)
            if self._is_refused:
                self._wanted = STANDSTILL
                self._asked_m_s = 0.0
            else:
                self._wanted = within(velocity, self._limits)
                self._asked_m_s = self._wanted.linear_m_s
                self._commands.update(now_s)

    def on_scan(self, now_s: float, ranges_m: Sequence[float] = ()) -> None:
        """Record that a full scan was complete.

        Args:
            now_s: Time at which it was complete, in seconds.
            ranges_m: Measured ranges (`ScanCoverageMonitor.update`); none: nothing is known about them.
        """
        with self._lock:
            self._scans.update(now_s)
            if ranges_m:
                self._sight.update(ranges_m)

    def on_noise(self, is_noisy: bool) -> None:
        """Record whether many frames of the scanner are damaged."""
        with self._lock:
            self._is_noisy = is_noisy

    def on_drive_reading(self, reading: DriveReading) -> None:
        """Record a reading of the drive base."""
        with self._lock:
            self._failures = 0
            self._readings.update(reading.time_s)
            self._faults = reading.faults
            if reading.faults - _HARMLESS - _UNBIDDEN:
                self._latched.add(Reason.MOTOR_FAULT)
            if reading.faults & _UNBIDDEN:
                self._latched.add(Reason.UNBIDDEN_MOTION)
            self._refusals.update(reading.refused, reading.time_s)
            self._battery.update(reading.battery_v, reading.time_s, reading.battery_level)
            if self._battery.is_empty:
                self._latched.add(Reason.BATTERY_LOW)
            is_still = all(abs(speed) <= self._limits.standstill_m_s for speed in reading.wheels_m_s)
            self._still_s = reading.time_s if is_still else -math.inf
            if self._torque_since_s is not None and reading.time_s > self._torque_since_s:
                self._judge_wheels(reading)

    def _judge_wheels(self, reading: DriveReading) -> None:
        if not reading.is_torque_on:
            # Torque that is to go off anyway is not lost.
            if self._is_torque_seen and self._letting_go_s is None:
                self._latched.add(Reason.TORQUE_LOST)
            return
        self._is_torque_seen = True
        self._wheels.update(wheels(self._velocity, self._limits), reading)
        if self._wheels.is_astray:
            self._latched.add(Reason.WHEEL_ASTRAY)
        if self._wheels.is_unbidden:
            self._latched.add(Reason.UNBIDDEN_MOTION)

    def drive_failed(self) -> None:
        """Record that an exchange with the drive base has failed."""
        with self._lock:
            self._failures += 1

    def loop_cycled(self, now_s: float) -> None:
        """Record the time of a cycle of the supervisor's loop."""
        with self._lock:
            self._find_pause(now_s)
            self._loop.update(now_s)

    def supervisor_fault(self) -> None:
        """Record that the supervisor, or the loop that runs it, has failed."""
        with self._lock:
            self._latched.add(Reason.SUPERVISOR_FAULT)

    def operator_stop(self) -> None:
        """Stop the robot for an operator: always possible, and overrides every other call."""
        with self._lock:
            self._latched.add(Reason.OPERATOR_STOP)

    def operator_seen(self, now_s: float) -> None:
        """Record the time of a sign of life of the operator."""
        with self._lock:
            self._operator.update(now_s)

    def reset(self) -> tuple[Reason, ...]:
        """Clear the latched reasons on an operator's command; the robot is in standby afterwards.

        Returns:
            Reasons that forbid the reset, in which case none was cleared; empty: the reset is done. It needs that each
            reason has been in an output, that torque is off if a reason requires that, that the motors report no fault,
            and that the battery is not empty.
        """
        with self._lock:
            remaining = tuple(reason for reason in LATCHING if reason in self._latched and self._holds(reason))
            if not remaining:
                self._latched.clear()
                self._is_enabled = False
                self._is_held = True
                self._asked_m_s = 0.0
            return remaining

    @property
    def is_letting_go(self) -> bool:
        """True if a latched reason requires torque off, and the motors still have torque."""
        with self._lock:
            return self._torque_since_s is not None and not self._latched.isdisjoint(self._torque_off)

    def _holds(self, reason: Reason) -> bool:
        """Return True if a latched reason has not had its effect yet, or its cause still holds."""
        if reason not in self._reasons:
            return True
        if reason is Reason.MOTOR_FAULT and self._faults - _HARMLESS - _UNBIDDEN:
            return True
        if reason is Reason.BATTERY_LOW and self._battery.is_empty:
            return True
        return reason in self._torque_off and self._torque_since_s is not None

    def output(self, now_s: float) -> Output:
        """Return the output that the drive base is to carry out now.

        Args:
            now_s: Current time, in seconds, not before that of the last call; if it is before, or not finite, this
                call gives standstill.
        """
        with self._lock:
            self._find_pause(now_s)
            is_clock_wrong = not self._now_s <= now_s < math.inf
            step_s = now_s - self._now_s
            if step_s > self._limits.motor_timeout_s:
                # The last output holds no longer: motion begins anew.
                self._velocity, step_s = STANDSTILL, 0.0
            if math.isfinite(now_s):
                self._now_s = now_s
            # A time ahead of the clock counts from now.
            self._alive_s = self._now_s
            self._switch_torque()
            if self._is_held:
                self._wanted = STANDSTILL
            self._reasons = self._find_reasons(is_clock_wrong)
            self._is_held = any(reason is not Reason.COMMAND_SILENT for reason in self._reasons)
            if self._reasons or self._wanted == STANDSTILL:
                self._velocity = STANDSTILL
            else:
                self._velocity = ramped(self._velocity, self._wanted, self._limits, step_s)
            # A velocity that is written later was decided from outdated measurements.
            velocity = replace(self._velocity, until_s=self._now_s + self._limits.motor_timeout_s)
            return Output(velocity, self._torque_since_s is not None, self._reasons, self._find_warnings())

    def _find_pause(self, now_s: float) -> None:
        """Find out whether nothing of the bridge was at work for too long; what was known before is no longer so.

        One of the two threads may wait for long, for a device or for a supervisor, but not both. A scan does not
        count here: its time is not that of who reports it, and one that came first after a pause would hide it.
        """
        if not math.isfinite(now_s):
            return
        has_torque = self._torque_since_s is not None and self._is_torque_seen
        if has_torque and now_s - self._alive_s > self._limits.pause_s:
            self._latched.add(Reason.PAUSED)
            self._is_held = True
            for known in (self._scans, self._readings, self._loop):
                known.forget()
            self._wheels.forget()
        self._alive_s = max(self._alive_s, now_s)

    def _switch_torque(self) -> None:
        """Let torque be wanted or not; where the clock went back, times begin anew."""
        if self._torque_since_s is not None:
            self._torque_since_s = min(self._torque_since_s, self._now_s)
            if not self._is_torque_seen and self._now_s - self._torque_since_s > self._limits.torque_on_s:
                self._latched.add(Reason.TORQUE_LOST)
        if self._is_enabled and self._latched.isdisjoint(self._torque_off):
            self._letting_go_s = None
            if self._torque_since_s is None:
                self._torque_since_s = self._now_s
                self._is_torque_seen = False
                self._wheels.forget()
        elif self._torque_since_s is not None:
            self._letting_go_s = self._now_s if self._letting_go_s is None else min(self._letting_go_s, self._now_s)
            self._still_s = min(self._still_s, self._now_s)
            # Motors that rotate against a goal of zero obey something else: they come to rest without torque alone.
            is_over = self._now_s - self._letting_go_s >= self._limits.torque_off_s
            if self._still_s > self._letting_go_s or is_over or Reason.UNBIDDEN_MOTION in self._latched:
                self._torque_since_s = self._letting_go_s = None

    def _find_reasons(self, is_clock_wrong: bool) -> tuple[Reason, ...]:
        holds = {
            Reason.STANDBY: not self._is_enabled,
            Reason.CLOCK: is_clock_wrong,
            Reason.TORQUE_AWAITED: self._torque_since_s is not None and not self._is_torque_seen,
            Reason.COMMAND_SILENT: self._wanted != STANDSTILL and self._commands.is_stale(self._now_s),
            Reason.SCAN_STALE: self._scans.is_stale(self._now_s),
            Reason.SCAN_BLIND: self._limits.is_stopped_when_blind and self._sight.is_blind(self._asked_m_s),
            Reason.SCAN_TOUCHING: self._sight.is_touching(self._asked_m_s),
            Reason.MOTOR_SILENT: self._readings.is_stale(self._now_s) or self._failures >= self._limits.motor_failures,
            Reason.LOOP_OVERRUN: self._loop.is_stale(self._now_s),
            Reason.OPERATOR_LOST: self._operator.is_stale(self._now_s),
        }
        return tuple(reason for reason in Reason if reason in self._latched or holds.get(reason))

    def _find_warnings(self) -> tuple[Caution, ...]:
        holds = {
            Caution.BATTERY: self._battery.is_near_empty,
            Caution.MOTOR_VOLTAGE: MotorFault.VOLTAGE in self._faults,
            Caution.COMMAND_REFUSED: self._is_refused,
            Caution.SCAN_BLIND: self._sight.is_blind(self._asked_m_s),
            Caution.READING_REFUSED: self._refusals.is_recent(self._now_s),
            Caution.SCAN_NOISY: self._is_noisy,
            Caution.TORQUE_HELD: self._limits.has_own_controls
            and self._torque_since_s is not None
            and Reason.OPERATOR_STOP in self._latched,
        }
        return tuple(caution for caution, is_so in holds.items() if is_so)
