"""The scanner's worker with real drivers on simulated LiDARs that fall silent, are covered in part or send damage."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest

from robosc_bridge.daemon.threads.backoff import Backoff
from robosc_bridge.daemon.threads.reports import Device, DeviceDown, DeviceUp, Report
from robosc_bridge.daemon.threads.workers import RESTART_LIMIT, ScannerWorker
from robosc_bridge.devices.interface import STANDSTILL, Velocity
from robosc_bridge.devices.lidar import make_lds01
from robosc_bridge.safety import Caution, Reason, SafetyLayer
from robosc_simulated import SimulatedTurtleBot3, VirtualHost, Walls, room
from support.safety import LIMITS, reading

RESTART_S, SILENT_S = 3.0, 0.6


class Scene:
    """A LiDAR, its driver and worker, and the safety layer, on a virtual host."""

    def __init__(self, robot: SimulatedTurtleBot3, time: VirtualHost, *, stops_when_blind: bool = True) -> None:
        self.robot = robot
        self.time = time
        self._due_s = 0.0
        self.safety = SafetyLayer(replace(LIMITS, scan_timeout_s=None, is_stopped_when_blind=stops_when_blind))
        self.reports: list[Report] = []
        self.worker = ScannerWorker(
            make_lds01(robot.scanner_path, host=self.time),
            self.safety,
            self.reports.append,
            SILENT_S,
            RESTART_S,
            self.time.monotonic,
            Backoff(first_s=0.5),
        )

    def live(self, seconds: float) -> None:
        """Let the worker do what its thread does for so long, while the loop turns."""
        end_s = self.time.monotonic() + seconds
        while (now_s := self.time.monotonic()) < end_s:
            self.safety.loop_cycled(now_s)
            if now_s >= self._due_s:
                self._due_s = self.worker.step(now_s)
            self.time.sleep(max(min(self._due_s, end_s) - self.time.monotonic(), 0.0))

    def until(self, condition: Callable[[], bool], limit_s: float = 10.0) -> float:
        """Let it work until something is so; how long that takes."""
        begin_s = self.time.monotonic()
        while not condition():
            assert self.time.monotonic() - begin_s < limit_s, f"not within {limit_s} s; reports: {self.reports}"
            self.live(0.05)
        return self.time.monotonic() - begin_s

    def downs(self) -> list[DeviceDown]:
        return [item for item in self.reports if isinstance(item, DeviceDown)]

    def output(self, speed_m_s: float) -> tuple[Velocity, tuple[Reason, ...], tuple[Caution, ...]]:
        """Return the output of the safety layer for a speed, with a drive base that does as commanded."""
        for _ in range(20):
            now_s = self.time.monotonic()
            self.safety.loop_cycled(now_s)
            self.safety.operator_seen(now_s)
            self.safety.command(Velocity(speed_m_s), now_s)
            found = self.safety.output(now_s)
            self.time.sleep(0.002)
            v = found.velocity.linear_m_s
            self.safety.on_drive_reading(
                reading(self.time.monotonic(), wheels_m_s=(v, v), is_torque_on=found.is_torque_wanted)
            )
        return found.velocity, found.reasons, found.warnings


@pytest.fixture
def scene() -> Iterator[Scene]:
    with VirtualHost() as time, SimulatedTurtleBot3(lidar="lds01", walls=room(3.0, 2.0), clock=time) as robot:
        made = Scene(robot, time)
        yield made
        made.worker.close()


def test_one_that_stays_silent_is_restarted_so_often_and_then_opened_anew(scene: Scene) -> None:
    scene.until(lambda: DeviceUp(Device.SCANNER) in scene.reports)
    scene.robot.scanner.is_stalled = True
    before = scene.robot.scanner_line.received
    assert scene.until(lambda: bool(scene.downs())) == pytest.approx(SILENT_S, abs=0.3)
    assert [item.problem for item in scene.downs()] == ["no full revolution with valid ranges for 0.6 s"]
    passed_s = SILENT_S + scene.until(lambda: len(scene.downs()) == 2, 20.0)
    # A last time of silence follows the last restart.
    assert passed_s == pytest.approx((RESTART_LIMIT + 1) * RESTART_S, abs=0.3)
    silent = f"no full revolution, even after {RESTART_LIMIT} restarts of its motor"
    assert scene.downs()[1] == DeviceDown(Device.SCANNER, silent, 0.5, is_first=True)
    # Each restart is one byte, and so is its end: it was closed, which stops its motor.
    assert scene.robot.scanner_line.received == before + RESTART_LIMIT + 1
    assert not scene.robot.scanner.is_spinning
    # The scanner is there again as soon as it speaks.
    scene.robot.scanner.is_stalled = False
    scene.reports.clear()
    assert scene.until(lambda: DeviceUp(Device.SCANNER) in scene.reports) == pytest.approx(0.5 + 0.4, abs=0.2)
    assert scene.robot.scanner.is_spinning
    assert scene.downs() == []


def test_damaged_frames_are_warned_of_until_they_are_sound(scene: Scene, caplog: pytest.LogCaptureFixture) -> None:
    scene.until(lambda: DeviceUp(Device.SCANNER) in scene.reports)
    scene.safety.enable()
    assert scene.output(0.1)[2] == ()
    scene.robot.scanner_faults.corrupt_share = 0.2
    scene.until(lambda: scene.output(0.1)[2] == (Caution.SCAN_NOISY,))
    scene.robot.scanner_faults.clear()
    scene.until(lambda: scene.output(0.1)[2] == ())
    noisy, sound = (record.message for record in caplog.records)
    assert noisy.startswith("scanner: many frames are damaged: ")
    assert sound.startswith("scanner: its frames are sound again: 0 of ")


@pytest.mark.parametrize("is_stopped", [True, False])
def test_one_that_sees_nothing_ahead_stops_or_is_warned_of(is_stopped: bool) -> None:
    """Check a scanner with two walls at its sides: it sees nothing within 30 degrees of its way."""
    far = Walls(((-9.0, 2.0, 9.0, 2.0), (-9.0, -2.0, 9.0, -2.0)))
    with VirtualHost() as time, SimulatedTurtleBot3(lidar="lds01", walls=far, clock=time) as robot:
        scene = Scene(robot, time, stops_when_blind=is_stopped)
        scene.until(lambda: DeviceUp(Device.SCANNER) in scene.reports)
        scene.safety.enable()
        velocity, reasons, warnings = scene.output(0.1)
        assert (reasons, warnings) == ((Reason.SCAN_BLIND,) if is_stopped else (), (Caution.SCAN_BLIND,))
        assert (velocity == STANDSTILL) is is_stopped
        robot.world.walls = Walls((*far.segments, (0.8, -1.0, 0.8, 1.0)))
        scene.live(0.6)
        assert scene.output(0.1)[1:] == ((), ())
        scene.worker.close()
