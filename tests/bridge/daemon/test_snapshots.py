"""Tests of the data for watchers: every change at once, measurements at most twenty times a second, log entries."""

from robosc_bridge.daemon.feed import Snapshot
from robosc_bridge.daemon.states import OperatorCommand, Order, State
from robosc_bridge.daemon.threads.reports import Device, DeviceDown, SafetyNotice
from robosc_bridge.safety import Caution, Reason
from support.daemons import PERIOD_S, Scene


class Watched(Scene):
    """A scene with an observer."""

    def __init__(self, *, starts_itself: bool = True) -> None:
        super().__init__(starts_itself=starts_itself, stays=True)
        self.shown: list[Snapshot] = []
        self.subscription = self.feed.subscribe(self._wake)

    def _wake(self) -> None:
        latest = self.feed.snapshot
        if latest is not None and (not self.shown or self.shown[-1] is not latest):
            self.shown.append(latest)

    @property
    def latest(self) -> Snapshot:
        return self.shown[-1]

    def new_entries(self) -> list[tuple[str, str]]:
        entries = self.subscription.take().entries
        return [(entry["kind"], str(entry.get("what", entry.get("event")))) for entry in entries]


def test_a_snapshot_reports_all_that_is_so() -> None:
    scene = Watched()
    scene.up()
    shown = scene.latest
    assert (shown.state, shown.problem, shown.stops) == (State.RUNNING, "", ())
    assert shown.devices == {Device.DRIVE: True, Device.SCANNER: True}
    assert shown.components["Eyes"] == {"state": "calm", "variables": {"way": "free", "pressed": False}}
    assert shown.enabled == ("drive",)
    assert shown.reading is not None
    assert shown.scan is not None
    assert shown.overruns == scene.daemon.overruns
    assert abs(shown.time_s - scene.clock.wall()) < 3 * PERIOD_S
    assert [item.number for item in scene.shown] == list(range(1, len(scene.shown) + 1))


def test_without_a_run_nothing_of_the_supervisor_is_shown() -> None:
    scene = Watched(starts_itself=False)
    scene.up()
    assert (scene.latest.state, scene.latest.components, scene.latest.enabled) == (State.STANDBY, {}, ())


def test_each_change_is_shown_in_its_turn_and_measurements_now_and_then() -> None:
    scene = Watched()
    scene.up()
    scene.live(0.2, 2.0)
    before = len(scene.shown)
    scene.live(1.0, 2.0)
    # The state of the model stays what it is: only measurements change.
    assert 15 <= len(scene.shown) - before <= 20
    scene.scan(0.3)
    scene.daemon.cycle()
    assert scene.latest.components["Eyes"]["variables"]["way"] == "blocked"
    assert "drive" not in scene.latest.enabled
    notice = SafetyNotice((Reason.SCAN_STALE,), (Caution.BATTERY,))
    scene.daemon.post(notice)
    scene.daemon.cycle()
    assert (scene.latest.reasons, scene.latest.warnings) == (notice.reasons, notice.warnings)
    scene.daemon.post(DeviceDown(Device.SCANNER, "gone", 0.25, True))
    scene.daemon.cycle()
    assert scene.latest.devices[Device.SCANNER] is False
    assert scene.latest.scan is None
    scene.daemon.post(OperatorCommand.STANDBY)
    scene.daemon.cycle()
    assert (scene.latest.state, scene.latest.stops) == (State.STOPPING, ("standby",))


def test_a_new_run_is_shown_though_its_counts_begin_anew() -> None:
    scene = Watched()
    scene.up()
    for _ in range(2):
        scene.daemon.post(OperatorCommand.STANDBY)
        scene.live(0.3, 2.0)
        assert scene.latest.components == {}
        scene.daemon.post(OperatorCommand.START)
        scene.live(0.3, 2.0)
        assert scene.latest.components["Eyes"]["variables"]["way"] == "free"


def test_a_fault_is_shown_with_its_problem() -> None:
    scene = Watched()
    scene.up()
    scene.daemon.post(DeviceDown(Device.DRIVE, "no answer", 0.25, True))
    scene.daemon.cycle()
    assert (scene.latest.state, scene.latest.problem) == (State.FAULT, "the drive base is lost: no answer")
    assert (scene.latest.reading, scene.latest.devices[Device.DRIVE]) == (None, False)


def test_entries_of_the_log_and_of_the_bridge_are_reported_and_the_log_knows_only_its_own() -> None:
    scene = Watched()
    scene.up()
    assert {("event", "scan.response"), ("event", "drive.request"), ("state", "running")} <= set(scene.new_entries())
    scene.daemon.post(Order(OperatorCommand.STOP, "Ada", lambda why: None))
    scene.live(0.1, 2.0)
    assert {("order", "stop (Ada)"), ("event", "stop.response")} <= set(scene.new_entries())
    scene.daemon.post(DeviceDown(Device.DRIVE, "no answer", 0.25, True))
    scene.live(0.1)
    new_entries = scene.new_entries()
    assert ("device", "drive: no answer") in new_entries
    assert ("state", "fault: the drive base is lost: no answer") in new_entries
    assert {entry["kind"] for entry in scene.log.entries} <= {"event", "stop", "release", "unexpected"}


def test_a_late_watcher_receives_all_the_same() -> None:
    """Also where no log is written: the need for entries is looked up anew each time."""
    scene = Watched()
    scene.subscription.close()
    scene.log.is_active = False
    scene.up()
    assert scene.new_entries() == []
    scene.subscription = scene.feed.subscribe(lambda: None)
    scene.scan(0.3)
    scene.daemon.cycle()
    assert ("event", "scan.response") in scene.new_entries()
