"""Workers that keep a device open and at work, step by step, independent of threads.

A step does the work that is due and returns the time of the next one. A device that fails is closed and opened again
later, with growing pauses, by the same steps as at the start. It never moves on its own afterwards: only the output of
the safety layer moves it.
"""

import logging
import math
from collections.abc import Callable, Sequence
from typing import Protocol

from robosc_bridge.daemon.threads.backoff import Backoff
from robosc_bridge.daemon.threads.frame_errors import FrameErrorMonitor
from robosc_bridge.daemon.threads.reports import Device, DeviceDown, DeviceUp, Report, ResetDone, SafetyNotice
from robosc_bridge.daemon.timing import Timing
from robosc_bridge.devices.interface import (
    STANDSTILL,
    AttentiveDriveBase,
    DriveBase,
    DriveReading,
    MotorFault,
    RangeScanner,
    Scan,
    Velocity,
)
from robosc_bridge.errors import BridgeError, DeviceSilentError, StoppedError
from robosc_bridge.safety import LATCHING, Caution, Reason

_LISTEN_S = 0.2
"""Time that a scanner is listened to at once, in seconds."""

SILENT_LIMIT = 3
"""Exchanges in a row without an answer after which the drive base counts as lost.

Fewer are noise on the line.
"""

_log = logging.getLogger(__name__)


_CLOSED_S = 0.1
"""Time between queries of the safety layer while there is no drive base, in seconds.

The safety layer must notice that nothing holds any more.
"""

RESTART_LIMIT = 3
"""Restarts of a scanner's motor without a full revolution after which the scanner is closed and opened anew."""

VALID_LIMIT = 8
"""A revolution with fewer valid ranges shows nothing: the LiDAR is covered, or something is too near."""


_EXCHANGE_LIMIT_S = 2.0
"""Time that no exchange takes: those of all drivers end after some tenths of a second."""

_STEP_LIMIT_S = 30.0
"""Time that no other step takes: opening a MAVLink rover that is to be brought to rest takes half of it."""


_HALTS = frozenset((Reason.STANDBY, *LATCHING))
"""Reasons after which nothing is begun: unlike the others, they do not end by themselves."""


class DriveCommand(Protocol):
    """Command for the drive base."""

    @property
    def velocity(self) -> Velocity:
        """Velocity to command; zero if there is a reason not to move."""

    @property
    def is_torque_wanted(self) -> bool:
        """True if torque is to be on."""

    @property
    def reasons(self) -> tuple[Reason, ...]:
        """Reasons why the robot may not move."""

    @property
    def warnings(self) -> tuple[Caution, ...]:
        """Warnings for a person."""


class SafetyGate(Protocol):
    """Part of the safety layer that a worker needs; its methods neither raise nor wait."""

    def output(self, now_s: float) -> DriveCommand:
        """Return the command for the drive base now."""

    def on_drive_reading(self, reading: DriveReading) -> None:
        """Handle a reading of the drive base."""

    def drive_failed(self) -> None:
        """Handle an exchange in which the drive base did not answer."""

    def on_scan(self, now_s: float, ranges_m: Sequence[float]) -> None:
        """Handle a full revolution, with a range for each degree."""

    def on_noise(self, is_noisy: bool) -> None:
        """Handle the report whether many frames of the scanner are damaged."""


class Worker(Protocol):
    """Work that a thread does step by step."""

    name: str

    def step(self, now_s: float) -> float:
        """Do the work that is due; return the time of the next step."""

    def wake(self) -> None:
        """Let a step that waits in its thread handle news, or end soon; called from other threads."""

    def close(self) -> None:
        """Close the device; never raises."""


class DriveWorker:
    """Worker that keeps a drive base in its cycle.

    It sends the velocities that the safety layer lets through, and reports the readings. For a drive base that asks
    during an exchange, too, it is the `VelocitySource`.

    Args:
        base: The drive base.
        gate: The safety layer.
        report: Function that takes the reports; must not wait.
        period_s: Time between exchanges, in seconds.
        clock: Clock that returns the time, in seconds.
        backoff: Pauses between attempts to open it.
        timing: Measurement of the bridge's times; None: a new one.

    Attributes:
        stepped_s: Time at which its last step began or ended.
        is_exchanging: True during an exchange, which takes no longer than its line's limit.
    """

    name = "drive"

    def __init__(
        self,
        base: DriveBase,
        gate: SafetyGate,
        report: Callable[[Report], None],
        period_s: float,
        clock: Callable[[], float],
        backoff: Backoff | None = None,
        timing: Timing | None = None,
    ) -> None:
        self.stepped_s = clock()
        self.is_exchanging = False
        self._timing = timing or Timing(clock)
        self._base = base
        self._attentive = base if isinstance(base, AttentiveDriveBase) else None
        if self._attentive is not None:
            self._attentive.attend(self)
        self._gate = gate
        self._report = report
        self._period_s = period_s
        self._clock = clock
        self._backoff = backoff or Backoff()
        self._is_open = False
        self._has_torque = False
        self._is_reset_wanted = False
        self._silent = 0
        self._due_s = self._open_at_s = -math.inf
        self._notice = SafetyNotice((), ())
        # True from `wake` until the safety layer is asked.
        self._is_newer = False
        # The velocity that the drive base was given last, and the time of the scan that it was decided on, until it is
        # written.
        self._given = STANDSTILL
        self._scan_s: float | None = None
        # True if torque was to go during an exchange: it goes, whatever is wanted afterwards.
        self._must_let_go = False
        # Faults that were reported since it was opened or reset: one that comes and goes is reported once.
        self._reported: frozenset[MotorFault] = frozenset()
        # True once nothing is to begin any more; and the halts under which a reset was ordered.
        self._is_ending = False
        self._known_halts: frozenset[Reason] = frozenset()

    @property
    def leftover(self) -> str:
        """Text that says what the drive base may still do after it was closed, in one line; empty: nothing."""
        return getattr(self._base, "leftover", "")

    def end(self) -> None:
        """Let nothing begin any more; called from other threads, before the end of this one."""
        self._is_ending = True

    def is_stopped(self) -> bool:
        """Return True if torque is no longer to be switched on."""
        return self._is_ending or self._is_halted(self._ask(self._clock()))

    def _is_halted(self, command: DriveCommand) -> bool:
        return not self._known_halts.issuperset(_HALTS.intersection(command.reasons))

    def is_cycling(self, now_s: float) -> bool:
        """Return True if no step takes longer than it may; called from other threads."""
        return now_s - self.stepped_s <= (_EXCHANGE_LIMIT_S if self.is_exchanging else _STEP_LIMIT_S)

    def reset(self) -> None:
        """Let the next step reboot motors that have switched themselves off; called from other threads."""
        self._is_reset_wanted = True

    def step(self, now_s: float) -> float:
        """Open the drive base, or make one exchange with it."""
        self.stepped_s = now_s
        try:
            return self._step(now_s)
        finally:
            self.is_exchanging = False
            self.stepped_s = self._clock()

    def _step(self, now_s: float) -> float:
        try:
            if self._is_open:
                self._exchange(now_s)
            elif now_s >= self._open_at_s:
                self._ask(now_s)
                self._open(now_s)
            else:
                self._ask(now_s)
                return min(self._open_at_s, now_s + _CLOSED_S)
        except DeviceSilentError as error:
            self._silent += 1
            if not self._is_open or self._silent >= SILENT_LIMIT:
                return self._failed(str(error))
            self._gate.drive_failed()
            return self._clock()
        except BridgeError as error:
            return self._failed(str(error))
        except Exception as error:  # Closing stops the wheels after any failure.
            _log.exception("the drive base's driver failed")
            return self._failed(f"the driver failed: {type(error).__name__}: {error}")
        return self._due_s

    def _open(self, now_s: float) -> None:
        self._base.open()
        self._backoff.succeeded()
        self._is_open, self._has_torque = True, False
        self._reported = frozenset()
        self._silent = 0
        self._due_s = now_s
        self._report(DeviceUp(Device.DRIVE))

    def _exchange(self, now_s: float) -> None:
        is_reset = self._is_reset_wanted
        if is_reset:
            self._is_reset_wanted = False
            is_reset = self._reset()
        if self._must_let_go:
            self._must_let_go = False
            if self._has_torque:
                self._switch_torque(False)
                now_s = self._clock()
        command = self._take(now_s)
        is_begun_after_stop = command.is_torque_wanted and self._is_halted(command)
        if command.is_torque_wanted != self._has_torque and not is_begun_after_stop:
            self._switch_torque(command.is_torque_wanted)
            # That took a while: what was to be done then may be wrong now.
            command = self._take(self._clock())
        began_s = self._clock()
        self.is_exchanging, self.stepped_s = True, began_s
        self._given = command.velocity
        reading = self._base.exchange(command.velocity)
        self._timing.exchanged(began_s)
        if not self._has_torque:
            # No velocity is written while torque is off.
            self._scan_s = None
        elif self._attentive is None:
            self.written()
        self._silent = 0
        if news := reading.faults - self._reported:
            _log.warning("the motors report: %s", ", ".join(sorted(news)))
            self._reported |= news
        self._gate.on_drive_reading(reading)
        self._report(reading)
        if is_reset:
            # Now it is known how the motors are.
            self._report(ResetDone())
        # One that came early, because it was hurried, is no reason for a long pause.
        self._due_s = min(self._due_s, now_s) + self._period_s
        if self._due_s <= now_s:
            # Too late for one cycle or more: they are left out.
            self._due_s = now_s + self._period_s

    def _switch_torque(self, is_on: bool) -> None:
        # A velocity from before does not count.
        self._scan_s = None
        try:
            self._base.set_torque(is_on)
            self._has_torque = is_on
        except StoppedError as error:
            _log.info("%s", error)
            self._has_torque = False
            if not self._is_ending:
                # This ends now what may have begun; at the end, closing does that.
                self._base.set_torque(False)

    def newer(self) -> Velocity | None:
        """Return the velocity that the safety layer lets through now, if `wake` was called and it is another one."""
        if not self._is_newer:
            return None
        command = self._take(self._clock())
        self._must_let_go = self._must_let_go or not command.is_torque_wanted
        if command.velocity == self._given:
            return None
        self._given = command.velocity
        return command.velocity

    def written(self) -> None:
        """Note that the bytes of the last velocity are on the line."""
        scan_s, self._scan_s = self._scan_s, None
        if scan_s is not None:
            self._timing.written(scan_s)

    def _take(self, now_s: float) -> DriveCommand:
        """Return the command of the safety layer, and remember the scan that it was decided on."""
        self._is_newer = False
        scan_s = self._timing.take_command()
        if scan_s is not None:
            self._scan_s = scan_s
        return self._ask(now_s)

    def _ask(self, now_s: float) -> DriveCommand:
        """Return the command of the safety layer; new reasons and warnings in it are reported."""
        command = self._gate.output(now_s)
        notice = SafetyNotice(command.reasons, command.warnings)
        if notice != self._notice:
            self._notice = notice
            self._report(notice)
        return command

    def _reset(self) -> bool:
        """Reset the drive base; returns whether no stop has come meanwhile."""
        self._has_torque = False
        self._reported = frozenset()
        # A reset is ordered while a stop holds; another one ends it.
        self._known_halts = _HALTS.intersection(self._ask(self._clock()).reasons)
        try:
            self._base.reset()
        except StoppedError as error:
            self._report(ResetDone(str(error)))
            self._base.set_torque(False)
            return False
        except BridgeError as error:
            self._report(ResetDone(str(error)))
            raise
        finally:
            self._known_halts = frozenset()
        return True

    def _failed(self, problem: str) -> float:
        self._is_open = False
        self._gate.drive_failed()
        is_first = self._backoff.is_fresh
        retry_s = self._backoff.failed()
        self._report(DeviceDown(Device.DRIVE, problem, retry_s, is_first))
        _closed(self._base)
        now_s = self._clock()
        self._open_at_s = now_s + retry_s
        return min(self._open_at_s, now_s + _CLOSED_S)

    def wake(self) -> None:
        """Let an exchange under way command the velocity that the safety layer lets through now."""
        self._is_newer = True
        if self._attentive is not None:
            try:
                self._attentive.wake()
            except Exception:  # The caller, perhaps the loop, must not end by it.
                _log.exception("the drive base's driver failed when it was woken")

    def close(self) -> None:
        """Stop the wheels, switch torque off, and close the line."""
        _closed(self._base)


class ScannerWorker:
    """Worker that keeps a range scanner rotating, and reports each full revolution.

    Args:
        scanner: The scanner.
        gate: The safety layer.
        report: Function that takes the reports; must not wait.
        silent_after_s: Time without a full revolution after which it counts as lost, in seconds.
        restart_after_s: Time without any revolution after which its motor is restarted, in seconds; after
            `RESTART_LIMIT` restarts the scanner is lost.
        clock: Clock that returns the time, in seconds.
        backoff: Pauses between attempts to open it.
        bad_frames_share: Share of damaged frames in a second above which its line is reported to be noisy.
    """

    name = "scanner"

    def __init__(
        self,
        scanner: RangeScanner,
        gate: SafetyGate,
        report: Callable[[Report], None],
        silent_after_s: float,
        restart_after_s: float,
        clock: Callable[[], float],
        backoff: Backoff | None = None,
        bad_frames_share: float = 0.1,
    ) -> None:
        self._scanner = scanner
        self._gate = gate
        self._report = report
        self._silent_after_s = silent_after_s
        self._restart_after_s = restart_after_s
        self._clock = clock
        self._backoff = backoff or Backoff()
        self._is_open = False
        self._is_rotating = False
        self._heard_s = self._restart_at_s = 0.0
        self._restarts = 0
        self._frames = FrameErrorMonitor(scanner.counters, bad_frames_share)

    def step(self, now_s: float) -> float:
        """Open the scanner, or wait for a revolution."""
        try:
            if self._is_open:
                self._listen()
            else:
                self._scanner.open()
                self._is_open = True
                self._heard_s = self._clock()
                self._restart_at_s = self._heard_s + self._restart_after_s
                self._restarts = 0
        except BridgeError as error:
            return self._failed(str(error))
        except Exception as error:  # The safety layer stops the wheels without a scanner.
            _log.exception("the range scanner's driver failed")
            return self._failed(f"the driver failed: {type(error).__name__}: {error}")
        return now_s

    def _listen(self) -> None:
        scan = self._scanner.receive(_LISTEN_S)
        if scan is not None and sum(not math.isnan(value) for value in scan.ranges_m) >= VALID_LIMIT:
            self._heard(scan)
        elif self._is_rotating and self._clock() - self._heard_s > self._silent_after_s:
            self._is_rotating = False
            what = f"no full revolution with valid ranges for {self._silent_after_s:g} s"
            self._report(DeviceDown(Device.SCANNER, what, 0.0, is_first=True))
        if scan is not None:
            # It rotates, whatever it sees.
            self._restarts = 0
            self._restart_at_s = self._clock() + self._restart_after_s
        elif self._clock() >= self._restart_at_s:
            self._restart()
        self._look_at_frames()

    def _restart(self) -> None:
        if self._restarts >= RESTART_LIMIT:
            raise DeviceSilentError(f"no full revolution, even after {RESTART_LIMIT} restarts of its motor")
        self._restarts += 1
        self._scanner.restart()
        self._restart_at_s = self._clock() + self._restart_after_s

    def _look_at_frames(self) -> None:
        found = self._frames.poll(self._clock())
        if found is not None:
            self._gate.on_noise(found.is_noisy)
            _log.warning("scanner: %s", found.text)

    def _heard(self, scan: Scan) -> None:
        self._backoff.succeeded()
        self._gate.on_scan(scan.time_s, scan.ranges_m)
        if not self._is_rotating:
            self._is_rotating = True
            self._report(DeviceUp(Device.SCANNER))
        self._report(scan)
        self._heard_s = scan.time_s

    def _failed(self, problem: str) -> float:
        self._is_open = self._is_rotating = False
        is_first = self._backoff.is_fresh
        retry_s = self._backoff.failed()
        self._report(DeviceDown(Device.SCANNER, problem, retry_s, is_first))
        _closed(self._scanner)
        return self._clock() + retry_s

    def wake(self) -> None:
        """End a wait for a revolution."""
        self._scanner.wake()

    def close(self) -> None:
        """Stop its motor, and close the line."""
        _closed(self._scanner)


def _closed(device: DriveBase | RangeScanner) -> None:
    """Close a device, whatever its driver does: its thread must go on."""
    try:
        device.close()
    except Exception:
        _log.exception("a driver failed when its device was closed")
