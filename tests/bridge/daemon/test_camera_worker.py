"""The camera's worker, step by step, on a clock that a test sets: what is reported of the line, and of the camera."""

import numpy as np
import pytest

from robosc_bridge.daemon.threads.backoff import Backoff
from robosc_bridge.daemon.threads.camera_worker import FIRST_PICTURE_S, LISTEN_S, REOPEN_S, CameraWorker
from robosc_bridge.daemon.threads.reports import Device, DeviceDown, DeviceUp, Report, Sighting
from robosc_bridge.devices.camera import GreyRows
from robosc_bridge.errors import LineLostError, LineMissingError
from robosc_bridge.skills.settings import LineSettings

MIDDLE = np.full((10, 100), 200, np.uint8)
MIDDLE[:, 48:52] = 10
ASIDE = np.roll(MIDDLE, -25, axis=1)
NOTHING = np.full((10, 100), 200, np.uint8)
LOST = None


class Clock:
    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


class FakeCamera:
    """Gives what a test has put into it; without anything, it lets its caller wait."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.coming: list[GreyRows | Exception] = []
        self.calls: list[str] = []
        self.failing: dict[str, Exception] = {}

    def _called(self, name: str) -> None:
        self.calls.append(name)
        if name in self.failing:
            raise self.failing[name]

    def open(self) -> None:
        self._called("open")

    def receive(self, limit_s: float) -> GreyRows | None:
        if not self.coming:
            self._clock.now_s += limit_s
            return None
        item = self.coming.pop(0)
        if isinstance(item, Exception):
            raise item
        self._clock.now_s += 0.01
        return item

    def close(self) -> None:
        self._called("close")


class Scene:
    def __init__(self) -> None:
        self.clock = Clock()
        self.camera = FakeCamera(self.clock)
        self.reports: list[Report] = []
        self.worker = CameraWorker(
            self.camera, LineSettings(timeout_s=0.5), self.reports.append, self.clock, Backoff(first_s=1.0, limit_s=4.0)
        )

    def step(self) -> None:
        """A step, and time until the next is due."""
        self.clock.now_s = max(self.clock.now_s, self.worker.step(self.clock.now_s))

    def steps(self, seconds: float) -> list[Report]:
        """Step for this time, and return the reports."""
        end_s = self.clock.now_s + seconds - 1e-9
        while self.clock.now_s < end_s:
            self.step()
        return self.taken()

    def taken(self) -> list[Report]:
        found, self.reports[:] = list(self.reports), []
        return found

    def up(self) -> None:
        self.step()
        self.camera.coming = [MIDDLE]
        self.step()
        assert self.camera.calls == ["open"]
        found = self.taken()
        assert found == [DeviceUp(Device.CAMERA), Sighting(self.clock.now_s, 0.0)]
        self.camera.calls.clear()


@pytest.fixture
def scene() -> Scene:
    return Scene()


def lines(reports: list[Report]) -> list[float | None]:
    return [item.correction_rad_s for item in reports if isinstance(item, Sighting)]


def downs(reports: list[Report]) -> list[DeviceDown]:
    return [item for item in reports if isinstance(item, DeviceDown)]


def test_each_picture_is_a_sighting(scene: Scene) -> None:
    scene.up()
    scene.camera.coming = [ASIDE, NOTHING, MIDDLE]
    for _ in range(3):
        scene.step()
    assert lines(scene.taken()) == [pytest.approx(0.5), LOST, pytest.approx(0.0)]


def test_without_pictures_the_line_is_lost_in_time_and_then_the_camera(scene: Scene) -> None:
    scene.up()
    seen_s = scene.clock.now_s
    found = scene.steps(0.5 + LISTEN_S)
    lost, down = found
    assert isinstance(lost, Sighting)
    assert lost.correction_rad_s is LOST
    assert 0.5 - 1e-9 <= lost.time_s - seen_s <= 0.5 + LISTEN_S
    assert down == DeviceDown(Device.CAMERA, "no picture for 0.5 s", 0.0, is_first=True)
    # It is still listened to, and comes back by itself.
    scene.camera.coming = [ASIDE]
    scene.step()
    assert scene.taken() == [DeviceUp(Device.CAMERA), Sighting(scene.clock.now_s, 0.5)]
    assert scene.camera.calls == []


def test_one_that_stays_silent_is_closed_and_opened_anew(scene: Scene) -> None:
    scene.up()
    found = scene.steps(REOPEN_S + LISTEN_S)
    assert downs(found)[1:] == [DeviceDown(Device.CAMERA, "the camera sends no pictures", 1.0, is_first=True)]
    assert scene.camera.calls == ["close"]
    # The line stays lost, also for a model that starts anew.
    found = scene.steps(10.0)
    assert set(lines(found)) == {LOST}
    assert len(lines(found)) == pytest.approx(20, abs=3)
    assert "open" in scene.camera.calls


def test_the_first_picture_may_take_longer(scene: Scene) -> None:
    scene.step()
    found = scene.steps(FIRST_PICTURE_S - 1.0)
    assert downs(found) == []
    assert len(lines(found)) == pytest.approx((FIRST_PICTURE_S - 1.0) / 0.5, abs=2)
    found = scene.steps(1.5)
    assert downs(found) == [DeviceDown(Device.CAMERA, "the camera sends no pictures", 1.0, is_first=True)]


def test_a_camera_that_is_missing_is_tried_again_with_longer_pauses(scene: Scene) -> None:
    scene.camera.failing["open"] = LineMissingError("/dev/video0", "there is no such camera")
    found = scene.steps(10.0)
    problem = "/dev/video0: there is no such camera"
    expected = [DeviceDown(Device.CAMERA, problem, retry_s, n == 0) for n, retry_s in enumerate((1.0, 2.0, 4.0, 4.0))]
    assert downs(found) == expected
    # Meanwhile the line is lost, again and again.
    assert set(lines(found)) == {LOST}
    assert len(lines(found)) == pytest.approx(20, abs=3)


@pytest.mark.parametrize("error", [LineLostError("/dev/video0", "gone"), ZeroDivisionError("a bug")])
def test_a_camera_that_is_unplugged_loses_the_line_at_once(scene: Scene, error: Exception) -> None:
    scene.up()
    scene.camera.coming = [error]
    unplugged_s = scene.clock.now_s
    scene.step()
    lost, down = scene.taken()
    assert lost == Sighting(unplugged_s, LOST)
    assert isinstance(down, DeviceDown)
    assert str(error) in down.problem
    assert scene.camera.calls == ["close"]
    # It is opened again after its pause, and by a picture it is back.
    scene.steps(0.9)
    assert scene.camera.calls == ["close"]
    scene.steps(0.2)
    scene.taken()
    assert scene.camera.calls == ["close", "open"]
    scene.camera.coming = [ASIDE]
    scene.step()
    assert scene.taken()[0] == DeviceUp(Device.CAMERA)
    # The pauses begin anew then.
    scene.camera.coming = [LineLostError("/dev/video0", "gone")]
    scene.step()
    assert downs(scene.taken())[0].retry_s == 1.0


def test_a_driver_that_fails_when_it_is_closed_does_not_end_the_thread(scene: Scene) -> None:
    scene.up()
    scene.camera.coming = [LineLostError("/dev/video0", "gone")]
    scene.camera.failing["close"] = ZeroDivisionError("a bug")
    scene.step()
    assert len(downs(scene.taken())) == 1
    scene.worker.wake()
    scene.worker.close()
    assert scene.camera.calls == ["close", "close"]
