"""A device kept open and at work, step by step: what a thread of its own does, without the thread.

A step does what is due and says when the next one is. A device that fails is closed and tried again later, each time
with a longer pause; it is opened by the same steps as at the start, and never moves by itself afterwards: what passes
the safety layer decides that alone.
"""

import logging
import math
from collections.abc import Callable
from typing import Protocol

from robosc_bridge.daemon.backoff import Backoff
from robosc_bridge.daemon.reports import Device, DeviceDown, DeviceUp, Report, ResetDone
from robosc_bridge.devices.interface import DriveBase, DriveReading, RangeScanner, Velocity
from robosc_bridge.errors import BridgeError, DeviceSilentError

_LISTEN_S = 0.2
"""How long a scanner is listened to at once."""

SILENT_LIMIT = 3
"""So many exchanges in a row without an answer, and the drive base counts as lost; fewer are noise on the line."""

_log = logging.getLogger(__name__)


VALID_LIMIT = 8
"""A turn with fewer valid ranges shows nothing: the LiDAR is covered, or something is too near."""


class Command(Protocol):
    """What the drive base is to do."""

    @property
    def velocity(self) -> Velocity:
        """Zero whenever something forbids to move."""

    @property
    def is_torque_wanted(self) -> bool:
        """Whether the motors are to hold."""


class Gate(Protocol):
    """What a worker needs of the safety layer; its methods neither raise nor wait."""

    def output(self, now_s: float) -> Command:
        """What the drive base is to do now."""

    def saw_drive(self, reading: DriveReading) -> None:
        """The drive base told something."""

    def drive_failed(self) -> None:
        """The drive base did not answer."""

    def saw_scan(self, now_s: float) -> None:
        """A full turn came."""


class Worker(Protocol):
    """Something that a thread does step by step."""

    name: str

    def step(self, now_s: float) -> float:
        """Do what is due; when the next step is."""

    def wake(self) -> None:
        """Let a step that waits in its thread end soon; called from other threads."""

    def close(self) -> None:
        """Give everything back; never raises."""


class DriveWorker:
    """Keeps a drive base in its cycle: what the safety layer lets through goes out, what comes back is reported.

    Args:
        base: The drive base.
        gate: The safety layer.
        report: Takes what is told; must not wait.
        period_s: Time between exchanges.
        clock: What the time is, in seconds.
        backoff: Pauses between attempts to open it.
    """

    name = "drive"

    def __init__(
        self,
        base: DriveBase,
        gate: Gate,
        report: Callable[[Report], None],
        period_s: float,
        clock: Callable[[], float],
        backoff: Backoff | None = None,
    ) -> None:
        self._base = base
        self._gate = gate
        self._report = report
        self._period_s = period_s
        self._clock = clock
        self._backoff = backoff or Backoff()
        self._is_open = False
        self._has_torque = False
        self._is_reset_wanted = False
        self._silent = 0
        self._due_s = 0.0

    def reset(self) -> None:
        """Let the next step reboot motors that have switched themselves off; called from other threads."""
        self._is_reset_wanted = True

    def step(self, now_s: float) -> float:
        """Open it, or exchange once."""
        try:
            if self._is_open:
                self._exchange(now_s)
            else:
                self._open(now_s)
        except DeviceSilentError as error:
            self._silent += 1
            if not self._is_open or self._silent >= SILENT_LIMIT:
                return self._failed(str(error))
            self._gate.drive_failed()
            return self._clock()
        except BridgeError as error:
            return self._failed(str(error))
        except Exception as error:  # Whatever breaks, the wheels stop: closing does that.
            _log.exception("the drive base's driver failed")
            return self._failed(f"the driver failed: {type(error).__name__}: {error}")
        return self._due_s

    def _open(self, now_s: float) -> None:
        self._base.open()
        self._backoff.succeeded()
        self._is_open, self._has_torque = True, False
        self._silent = 0
        self._due_s = now_s
        self._report(DeviceUp(Device.DRIVE))

    def _exchange(self, now_s: float) -> None:
        if self._is_reset_wanted:
            self._is_reset_wanted = False
            self._reset()
        command = self._gate.output(now_s)
        if command.is_torque_wanted != self._has_torque:
            self._base.set_torque(command.is_torque_wanted)
            self._has_torque = command.is_torque_wanted
            # That took a while: what was to be done then may be wrong now.
            command = self._gate.output(self._clock())
        reading = self._base.exchange(command.velocity)
        self._silent = 0
        self._gate.saw_drive(reading)
        self._report(reading)
        self._due_s += self._period_s
        if self._due_s <= now_s:
            # Too late for one cycle or more: they are left out.
            self._due_s = now_s + self._period_s

    def _reset(self) -> None:
        self._has_torque = False
        try:
            self._base.reset()
        except BridgeError as error:
            self._report(ResetDone(str(error)))
            raise
        self._report(ResetDone())

    def _failed(self, problem: str) -> float:
        self._is_open = self._has_torque = False
        self._gate.drive_failed()
        self._base.close()
        is_first = self._backoff.is_fresh
        retry_s = self._backoff.failed()
        self._report(DeviceDown(Device.DRIVE, problem, retry_s, is_first))
        return self._clock() + retry_s

    def wake(self) -> None:
        """Nothing: no step waits longer than its line's limit."""

    def close(self) -> None:
        """Stop the wheels, torque off, give the line back."""
        self._base.close()


class ScannerWorker:
    """Keeps a range scanner turning: each full turn is reported.

    Args:
        scanner: The scanner.
        gate: The safety layer.
        report: Takes what is told; must not wait.
        restart_after_s: After so long without a full turn its motor is restarted, again and again.
        clock: What the time is, in seconds.
        backoff: Pauses between attempts to open it.
    """

    name = "scanner"

    def __init__(
        self,
        scanner: RangeScanner,
        gate: Gate,
        report: Callable[[Report], None],
        restart_after_s: float,
        clock: Callable[[], float],
        backoff: Backoff | None = None,
    ) -> None:
        self._scanner = scanner
        self._gate = gate
        self._report = report
        self._restart_after_s = restart_after_s
        self._clock = clock
        self._backoff = backoff or Backoff()
        self._is_open = False
        self._restart_at_s = 0.0

    def step(self, now_s: float) -> float:
        """Open it, or listen for a turn."""
        try:
            if self._is_open:
                self._listen()
            else:
                self._scanner.open()
                self._is_open = True
                self._restart_at_s = self._clock() + self._restart_after_s
                self._report(DeviceUp(Device.SCANNER))
        except BridgeError as error:
            return self._failed(str(error))
        except Exception as error:  # Without a scanner, the safety layer stops the wheels.
            _log.exception("the range scanner's driver failed")
            return self._failed(f"the driver failed: {type(error).__name__}: {error}")
        return now_s

    def _listen(self) -> None:
        scan = self._scanner.receive(_LISTEN_S)
        if scan is not None:
            self._backoff.succeeded()
            if sum(not math.isnan(value) for value in scan.ranges_m) >= VALID_LIMIT:
                self._gate.saw_scan(scan.time_s)
            self._report(scan)
            self._restart_at_s = scan.time_s + self._restart_after_s
        elif self._clock() >= self._restart_at_s:
            self._scanner.restart()
            self._restart_at_s = self._clock() + self._restart_after_s

    def _failed(self, problem: str) -> float:
        self._is_open = False
        self._scanner.close()
        is_first = self._backoff.is_fresh
        retry_s = self._backoff.failed()
        self._report(DeviceDown(Device.SCANNER, problem, retry_s, is_first))
        return self._clock() + retry_s

    def wake(self) -> None:
        """Let it listen no longer."""
        self._scanner.wake()

    def close(self) -> None:
        """Stop its motor, give the line back."""
        self._scanner.close()
