"""The devices' workers, step by step: what goes out, what is reported, and what follows a failure."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import pytest

from robosc_bridge.daemon.threads.backoff import Backoff
from robosc_bridge.daemon.threads.reports import Device, DeviceDown, DeviceUp, Report, ResetDone, SafetyNotice
from robosc_bridge.daemon.threads.workers import RESTART_LIMIT, VALID_LIMIT, DriveWorker, ScannerWorker
from robosc_bridge.daemon.timing import Latency, Timing
from robosc_bridge.devices.interface import (
    BINS,
    CONSTANT,
    STANDSTILL,
    DriveLimits,
    DriveReading,
    Pose,
    RawScan,
    Scan,
    ScannerCounters,
    Velocity,
    VelocitySource,
)
from robosc_bridge.errors import DeviceFaultError, DeviceSilentError, LineLostError, LineMissingError
from robosc_bridge.safety import Caution, Reason

PERIOD_S = 0.02
FORWARD = Velocity(0.1, 0.0)
BACKWARD = Velocity(-0.1, 0.0)


class Clock:
    """The time, which tests set."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@dataclass(frozen=True)
class Output:
    velocity: Velocity
    is_torque_wanted: bool
    reasons: tuple[Reason, ...] = ()
    warnings: tuple[Caution, ...] = ()


class SafetyGate:
    """A safety layer that lets through what a test says."""

    def __init__(self) -> None:
        self.next = Output(STANDSTILL, False)
        self.asked: list[float] = []
        self.readings: list[DriveReading] = []
        self.failures = 0
        self.scans: list[float] = []
        self.ranges_m: Sequence[float] = ()
        self.noises: list[bool] = []

    def output(self, now_s: float) -> Output:
        self.asked.append(now_s)
        return self.next

    def on_drive_reading(self, reading: DriveReading) -> None:
        self.readings.append(reading)

    def drive_failed(self) -> None:
        self.failures += 1

    def on_scan(self, now_s: float, ranges_m: Sequence[float]) -> None:
        self.scans.append(now_s)
        self.ranges_m = ranges_m

    def on_noise(self, is_noisy: bool) -> None:
        self.noises.append(is_noisy)


class Base:
    """A drive base that remembers what it is commanded, and fails where a test says."""

    limits = DriveLimits(0.2, 2.0, 0.2)

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.calls: list[object] = []
        self.failing: dict[str, Exception] = {}
        self.torque_takes_s = 0.0

    def _called(self, name: str, *arguments: object) -> None:
        self.calls.append((name, *arguments) if arguments else name)
        if name in self.failing:
            raise self.failing[name]

    def open(self) -> None:
        self._called("open")

    def set_torque(self, is_on: bool) -> None:
        self._clock.now_s += self.torque_takes_s
        self._called("torque", is_on)

    def exchange(self, velocity: Velocity) -> DriveReading:
        self._called("exchange", velocity)
        return DriveReading(self._clock.now_s, Pose(), velocity, (0.0, 0.0), True)

    def reset(self) -> None:
        self._called("reset")

    def close(self) -> None:
        self._called("close")


class AttentiveBase(Base):
    """One that asks for a newer velocity during an exchange, after what happens meanwhile."""

    def __init__(self, clock: Clock) -> None:
        super().__init__(clock)
        self.source: VelocitySource = CONSTANT
        self.meanwhile: Callable[[], None] = lambda: None
        self.is_written = True

    def attend(self, source: VelocitySource) -> None:
        self.source = source

    def wake(self) -> None:
        self._called("wake")

    def exchange(self, velocity: Velocity) -> DriveReading:
        self._clock.now_s += 0.001
        if self.is_written:
            self.source.written()
        self._clock.now_s += 0.002
        self.meanwhile()
        newer = self.source.newer()
        if newer is not None:
            self._called("newer", newer)
            self.source.written()
        self._clock.now_s += 0.003
        return super().exchange(velocity)


class Scene:
    """A drive base's worker with everything around it.

    Args:
        kind: Kind of its drive base.
    """

    def __init__(self, kind: type[Base] = Base) -> None:
        self.clock = Clock()
        self.gate = SafetyGate()
        self.base = kind(self.clock)
        self.timing = Timing(self.clock)
        self.reports: list[Report] = []
        self.worker = DriveWorker(
            self.base,
            self.gate,
            self.reports.append,
            PERIOD_S,
            self.clock,
            Backoff(first_s=0.5, limit_s=1.5),
            self.timing,
        )

    def step(self) -> float:
        """One step; in how many seconds the next is due."""
        return self.worker.step(self.clock.now_s) - self.clock.now_s

    def until_open(self) -> float:
        """Steps until it is tried to open the base again; how long that was."""
        begin_s = self.clock.now_s
        self.base.calls.clear()
        while "open" not in self.base.calls:
            self.clock.now_s += self.step()
            assert self.clock.now_s < begin_s + 100.0
        return self.clock.now_s - begin_s

    def taken(self) -> list[object]:
        calls, self.base.calls = self.base.calls, []
        return calls

    def up(self) -> None:
        assert self.step() == 0.0
        assert self.taken() == ["open"]
        assert self.reports == [DeviceUp(Device.DRIVE)]
        self.reports.clear()


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_it_is_opened_and_rests_until_it_is_let(scene: Scene) -> None:
    scene.up()
    # Opening may take long: the gate is asked before.
    assert scene.gate.asked == [100.0]
    assert scene.step() == pytest.approx(PERIOD_S)
    assert scene.taken() == [("exchange", STANDSTILL)]
    assert scene.gate.readings == scene.reports != []


def test_torque_comes_before_motion_and_goes_after_it(scene: Scene) -> None:
    scene.up()
    scene.gate.asked.clear()
    scene.gate.next = Output(FORWARD, True)
    scene.base.torque_takes_s = 0.7
    scene.step()
    assert scene.taken() == [("torque", True), ("exchange", FORWARD)]
    # The gate asks again for what it lets through after so long.
    assert scene.gate.asked == [100.0, 100.7]
    scene.step()
    assert scene.taken() == [("exchange", FORWARD)]
    scene.gate.next = Output(STANDSTILL, False)
    scene.step()
    assert scene.taken() == [("torque", False), ("exchange", STANDSTILL)]


class AttentiveScene(Scene):
    """A scene whose drive base asks during an exchange, and drives."""

    base: AttentiveBase

    def __init__(self) -> None:
        super().__init__(AttentiveBase)
        self.up()
        self.gate.next = Output(FORWARD, True)
        self.step()
        self.taken()
        self.gate.asked.clear()

    def command(self, velocity: Velocity, *, is_torque_wanted: bool = True) -> None:
        """Let a scan of now be decided on, and another velocity through."""
        self.timing.scan_taken(self.clock.now_s)
        self.timing.commanding()
        self.gate.next = Output(velocity, is_torque_wanted)
        self.worker.wake()

    def scan_to_wheel(self) -> Latency:
        self.clock.now_s += 2.0
        (found,) = [one for one in self.timing.figures().latencies if one.name == "scan_to_wheel"]
        return found


def test_what_is_let_through_during_an_exchange_is_commanded_within_it() -> None:
    scene = AttentiveScene()
    scene.base.meanwhile = lambda: scene.command(BACKWARD)
    began_s = scene.clock.now_s
    scene.step()
    assert scene.taken() == ["wake", ("newer", BACKWARD), ("exchange", FORWARD)]
    # The safety layer is asked at the very time.
    assert scene.gate.asked == pytest.approx([began_s, began_s + 0.003])
    assert (scene.scan_to_wheel().count, scene.scan_to_wheel().max_s) == (1, 0.0)


def test_without_another_velocity_nothing_is_commanded_within_an_exchange() -> None:
    scene = AttentiveScene()
    scene.step()
    assert scene.taken() == [("exchange", FORWARD)]
    assert len(scene.gate.asked) == 1
    # The base wakes the worker during the exchange.
    scene.base.meanwhile = scene.worker.wake
    scene.step()
    assert scene.taken() == ["wake", ("exchange", FORWARD)]


def test_torque_that_was_to_go_during_an_exchange_goes_also_if_it_is_wanted_again() -> None:
    scene = AttentiveScene()
    scene.base.meanwhile = lambda: scene.command(STANDSTILL, is_torque_wanted=False)
    scene.step()
    assert scene.taken() == ["wake", ("newer", STANDSTILL), ("exchange", FORWARD)]
    scene.base.meanwhile = lambda: None
    scene.gate.next = Output(FORWARD, True)
    scene.step()
    assert scene.taken() == [("torque", False), ("torque", True), ("exchange", FORWARD)]
    scene.step()
    assert scene.taken() == [("exchange", FORWARD)]

    def wanted_again_at_once() -> None:
        scene.command(STANDSTILL, is_torque_wanted=False)
        assert scene.base.source.newer() == STANDSTILL
        scene.command(FORWARD)

    scene.base.meanwhile = wanted_again_at_once
    scene.step()
    scene.taken()
    scene.base.meanwhile = lambda: None
    scene.step()
    assert scene.taken() == [("torque", False), ("torque", True), ("exchange", FORWARD)]


def test_a_velocity_counts_as_written_when_the_drive_base_says_so() -> None:
    scene = AttentiveScene()
    scene.command(BACKWARD)
    # It goes out with a later exchange only.
    scene.base.is_written = False
    scene.step()
    scene.base.is_written = True
    scene.step()
    found = scene.scan_to_wheel()
    assert found.count == 1
    assert found.max_s == pytest.approx(0.007)


def test_a_velocity_that_has_not_gone_out_when_the_base_fails_does_not_count() -> None:
    scene = AttentiveScene()
    scene.command(BACKWARD)
    scene.base.is_written = False
    scene.base.failing["exchange"] = LineLostError("/dev/x", "the line is gone")
    scene.step()
    scene.base.failing.clear()
    scene.base.is_written = True
    scene.clock.now_s += 5.0
    for _ in range(3):
        scene.clock.now_s += scene.step()
    assert ("exchange", BACKWARD) in scene.taken()
    assert scene.scan_to_wheel().count == 0


def test_the_end_of_the_exchange_counts_for_a_drive_base_that_reports_no_time(scene: Scene) -> None:
    scene.up()
    for is_torque_wanted, count in ((False, 0), (True, 1)):
        scene.gate.next = Output(FORWARD, is_torque_wanted)
        scene.step()
        scene.timing.scan_taken(scene.clock.now_s)
        scene.timing.commanding()
        scene.worker.wake()
        scene.clock.now_s += 0.01
        scene.step()
        scene.clock.now_s += 2.0
        (found,) = [one for one in scene.timing.figures().latencies if one.name == "scan_to_wheel"]
        assert found.count == count
        assert found.max_s == pytest.approx(0.01 * count)


def test_a_driver_that_fails_when_it_is_woken_does_not_fail_who_wakes_it(caplog: pytest.LogCaptureFixture) -> None:
    scene = AttentiveScene()
    scene.base.failing["wake"] = RuntimeError("a mistake")
    scene.worker.wake()
    assert "the drive base's driver failed when it was woken" in caplog.text
    assert scene.step() > 0.0


def test_cycles_keep_their_places_in_time_and_late_ones_are_left_out(scene: Scene) -> None:
    scene.up()
    assert scene.step() == pytest.approx(PERIOD_S)
    scene.clock.now_s += PERIOD_S + 0.003
    assert scene.step() == pytest.approx(PERIOD_S - 0.003)
    scene.clock.now_s += 10 * PERIOD_S
    assert scene.step() == pytest.approx(PERIOD_S)


def test_a_port_that_is_missing_is_tried_again_with_longer_pauses(scene: Scene) -> None:
    scene.base.failing["open"] = LineMissingError("/dev/x", "there is no such port")
    scene.step()
    scene.until_open()
    scene.until_open()
    scene.until_open()
    problem = "/dev/x: there is no such port"
    assert scene.reports == [
        DeviceDown(Device.DRIVE, problem, retry_s, is_first=number == 0)
        for number, retry_s in enumerate((0.5, 1.0, 1.5, 1.5))
    ]
    # Meanwhile the safety layer is asked all the time.
    assert len(scene.gate.asked) > 20


def test_after_it_was_open_the_pauses_begin_anew(scene: Scene) -> None:
    scene.up()
    scene.base.failing["exchange"] = LineLostError("/dev/x", "the line is gone")
    assert scene.step() == pytest.approx(0.1)
    assert scene.until_open() == pytest.approx(0.5)


def test_a_hurried_exchange_is_no_reason_for_a_pause(scene: Scene) -> None:
    scene.up()
    for _ in range(100):
        scene.clock.now_s += 0.001
        assert scene.step() <= PERIOD_S + 1e-9


def test_what_the_safety_layer_says_anew_is_reported_once(scene: Scene) -> None:
    scene.up()
    scene.gate.next = Output(STANDSTILL, True, (Reason.SCAN_STALE,), (Caution.BATTERY,))
    scene.step()
    scene.step()
    notice = SafetyNotice((Reason.SCAN_STALE,), (Caution.BATTERY,))
    assert [item for item in scene.reports if isinstance(item, SafetyNotice)] == [notice]
    scene.gate.next = Output(STANDSTILL, True)
    scene.step()
    assert scene.reports[-2] == SafetyNotice((), ())


def test_a_driver_that_fails_when_it_is_closed_does_not_end_the_thread(scene: Scene) -> None:
    scene.up()
    scene.base.failing["exchange"] = scene.base.failing["close"] = ZeroDivisionError("a bug")
    scene.step()
    assert isinstance(scene.reports[-1], DeviceDown)
    scene.worker.close()


@pytest.mark.parametrize(
    "error", [LineLostError("/dev/x", "gone"), DeviceFaultError("no motors"), ZeroDivisionError("a bug")]
)
def test_whatever_breaks_it_is_closed_and_opened_anew_with_torque_off(scene: Scene, error: Exception) -> None:
    scene.up()
    scene.gate.next = Output(FORWARD, True)
    scene.step()
    scene.taken()
    scene.reports.clear()
    scene.base.failing["exchange"] = error
    scene.step()
    assert scene.taken() == [("exchange", FORWARD), "close"]
    assert scene.gate.failures == 1
    (report,) = scene.reports
    assert isinstance(report, DeviceDown)
    assert str(error) in report.problem
    scene.base.failing.clear()
    scene.until_open()
    scene.taken()
    scene.step()
    assert scene.taken() == [("torque", True), ("exchange", FORWARD)]


def test_a_missing_answer_is_noise_and_three_in_a_row_are_a_loss(scene: Scene) -> None:
    scene.up()
    for _ in range(2):
        scene.base.failing["exchange"] = DeviceSilentError("no answer")
        for _ in range(2):
            # At once again.
            assert scene.step() == 0.0
        del scene.base.failing["exchange"]
        scene.step()
    assert "close" not in scene.taken()
    assert scene.gate.failures == 2 * 2
    scene.base.failing["exchange"] = DeviceSilentError("no answer")
    for _ in range(3):
        scene.step()
    assert scene.taken()[-1] == "close"


def test_motors_that_do_not_hold_are_a_failure(scene: Scene) -> None:
    scene.up()
    scene.gate.next = Output(FORWARD, True)
    scene.base.failing["torque"] = DeviceFaultError("a motor does not hold")
    scene.step()
    assert scene.taken() == [("torque", True), "close"]
    assert scene.gate.failures == 1


def test_a_reset_is_done_once_before_the_next_exchange(scene: Scene) -> None:
    scene.up()
    scene.gate.next = Output(STANDSTILL, True)
    scene.step()
    scene.taken()
    scene.reports.clear()
    scene.worker.reset()
    scene.step()
    assert scene.taken() == ["reset", ("torque", True), ("exchange", STANDSTILL)]
    # The state of the motors is known when the device is reported.
    assert scene.reports[0] == scene.gate.readings[-1]
    assert scene.reports[1] == ResetDone()
    scene.step()
    assert scene.taken() == [("exchange", STANDSTILL)]


def test_a_reset_that_fails_is_reported_with_its_reason(scene: Scene) -> None:
    scene.up()
    scene.worker.reset()
    scene.base.failing["reset"] = DeviceFaultError("still too hot")
    scene.step()
    assert scene.reports[0] == ResetDone("still too hot")
    assert scene.taken() == ["reset", "close"]


def test_closing_closes_the_base(scene: Scene) -> None:
    scene.up()
    scene.worker.wake()
    scene.worker.close()
    assert scene.taken() == ["close"]


# The scanner.


class Scanner:
    """A scanner that gives what a test has put into it."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.counters = ScannerCounters()
        self.coming: list[Scan | Exception] = []
        self.calls: list[str] = []
        self.opening: Callable[[], None] = lambda: None

    def open(self) -> None:
        self.calls.append("open")
        self.opening()

    def receive(self, limit_s: float) -> Scan | None:
        if not self.coming:
            self._clock.now_s += limit_s
            return None
        item = self.coming.pop(0)
        if isinstance(item, Exception):
            raise item
        return item

    def wake(self) -> None:
        self.calls.append("wake")

    def restart(self) -> None:
        self.calls.append("restart")

    def close(self) -> None:
        self.calls.append("close")


def scan(time_s: float) -> Scan:
    return Scan(time_s, (1.0,) * BINS, RawScan((), (), ()), 5.0)


class ScannerScene:
    """A scanner's worker with everything around it."""

    def __init__(self) -> None:
        self.clock = Clock()
        self.gate = SafetyGate()
        self.scanner = Scanner(self.clock)
        self.reports: list[Report] = []
        self.worker = ScannerWorker(
            self.scanner, self.gate, self.reports.append, 0.6, 1.0, self.clock, Backoff(first_s=0.5, limit_s=1.5)
        )

    def step(self) -> float:
        return self.worker.step(self.clock.now_s) - self.clock.now_s

    def up(self) -> None:
        self.step()
        assert self.scanner.calls == ["open"]
        assert self.reports == []
        # It is there with its first rotation.
        first = scan(self.clock.now_s)
        self.scanner.coming = [first]
        self.step()
        assert self.reports == [DeviceUp(Device.SCANNER), first]
        self.scanner.calls.clear()
        self.reports.clear()
        self.gate.scans.clear()


@pytest.fixture
def turning() -> ScannerScene:
    made = ScannerScene()
    made.up()
    return made


def test_each_turn_is_reported_with_its_own_time(turning: ScannerScene) -> None:
    turning.scanner.coming = [scan(100.1), scan(100.3)]
    turning.step()
    turning.step()
    assert turning.reports == [scan(100.1), scan(100.3)]
    assert turning.gate.scans == [100.1, 100.3]


@pytest.mark.parametrize(("valid", "counts"), [(VALID_LIMIT, True), (VALID_LIMIT - 1, False), (0, False)])
def test_a_turn_that_shows_nothing_is_none_for_safety(turning: ScannerScene, valid: int, counts: bool) -> None:
    shown = replace(scan(100.1), ranges_m=(1.0,) * valid + (math.nan,) * (BINS - valid))
    turning.scanner.coming = [shown]
    turning.step()
    assert turning.reports == ([shown] if counts else [])
    assert turning.gate.scans == ([100.1] if counts else [])
    assert (turning.gate.ranges_m is shown.ranges_m) is counts


def test_a_silent_scanner_is_reported_once_and_its_first_turn_again(turning: ScannerScene) -> None:
    for _ in range(8):
        turning.step()
    losses = [item for item in turning.reports if isinstance(item, DeviceDown)]
    assert losses == [DeviceDown(Device.SCANNER, "no full revolution with valid ranges for 0.6 s", 0.0, is_first=True)]
    turning.reports.clear()
    turning.scanner.coming = [scan(turning.clock.now_s)]
    turning.step()
    assert turning.reports[0] == DeviceUp(Device.SCANNER)


def test_a_motor_that_stays_silent_is_restarted_so_often_and_then_opened_anew(turning: ScannerScene) -> None:
    problem = f"no full revolution, even after {RESTART_LIMIT} restarts of its motor"
    for is_first, retry_s in ((True, 0.5), (False, 1.0)):
        turning.scanner.calls.clear()
        while "close" not in turning.scanner.calls:
            due_s = turning.worker.step(turning.clock.now_s)
        assert [name for name in turning.scanner.calls if name != "open"] == ["restart"] * RESTART_LIMIT + ["close"]
        assert turning.reports[-1] == DeviceDown(Device.SCANNER, problem, retry_s, is_first)
        assert due_s - turning.clock.now_s == pytest.approx(retry_s)
    # A turn makes good for all.
    turning.scanner.calls.clear()
    turning.step()
    turning.scanner.coming = [scan(turning.clock.now_s)]
    for _ in range(6 * RESTART_LIMIT):
        turning.step()
    assert turning.scanner.calls == ["open", *["restart"] * RESTART_LIMIT]


def test_a_covered_scanner_that_turns_is_not_restarted(turning: ScannerScene) -> None:
    covered = replace(scan(0.0), ranges_m=(math.nan,) * BINS)
    for _ in range(40):
        # A rotation, and a wait for the next one that is in vain.
        turning.scanner.coming = [covered]
        turning.step()
        turning.step()
    assert turning.scanner.calls == []
    assert [type(item) for item in turning.reports] == [DeviceDown]


def test_damaged_frames_are_reported_with_their_numbers_once(
    turning: ScannerScene, caplog: pytest.LogCaptureFixture
) -> None:
    counters = turning.scanner.counters
    for bad in (10, 10, 11, 30, 6, 5, 5):
        counters.bad_frames += bad
        counters.frames += 100 - bad
        turning.clock.now_s += 1.0
        turning.scanner.coming = [scan(turning.clock.now_s)]
        turning.step()
    assert turning.gate.noises == [True, False]
    assert [record.message for record in caplog.records] == [
        "scanner: many frames are damaged: 11 of 100 in 1.0 s (11.0%)",
        "scanner: its frames are sound again: 5 of 100 in 1.0 s (5.0%)",
    ]


def test_a_motor_that_falls_silent_is_restarted_again_and_again(turning: ScannerScene) -> None:
    for _ in range(4):
        turning.step()
    assert turning.scanner.calls == []
    turning.step()
    assert turning.scanner.calls == ["restart"]
    for _ in range(5):
        turning.step()
    assert turning.scanner.calls == ["restart", "restart"]
    # A turn ends that.
    turning.scanner.coming = [scan(turning.clock.now_s)]
    for _ in range(5):
        turning.step()
    assert turning.scanner.calls == ["restart", "restart"]


@pytest.mark.parametrize("error", [LineLostError("/dev/y", "gone"), ZeroDivisionError("a bug")])
def test_a_scanner_that_is_unplugged_is_opened_again(turning: ScannerScene, error: Exception) -> None:
    turning.scanner.coming = [error]
    assert turning.step() == pytest.approx(0.5)
    (report,) = turning.reports
    assert isinstance(report, DeviceDown)
    assert report.device is Device.SCANNER
    assert report.is_first
    assert turning.scanner.calls == ["close"]
    turning.scanner.calls.clear()
    turning.step()
    assert turning.scanner.calls == ["open"]
    # It was opened, but has not turned yet: the pauses go on growing.
    turning.scanner.coming = [error]
    assert turning.step() == pytest.approx(1.0)


def test_waking_and_closing_reach_the_scanner(turning: ScannerScene) -> None:
    turning.worker.wake()
    turning.worker.close()
    assert turning.scanner.calls == ["wake", "close"]
