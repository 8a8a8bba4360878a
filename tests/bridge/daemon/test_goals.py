"""Goals of a run: what the bridge tells of them to watchers, on its terminal, to Prometheus and to ROS."""

import json
from collections.abc import Iterator

import pytest

from robosc.execution.runtime.progress import Progress
from robosc_api.v1 import bridge_pb2 as pb
from robosc_bridge.daemon.feed import Snapshot
from robosc_bridge.daemon.metrics import _metrics
from robosc_bridge.daemon.programs.items import MessageReceived
from robosc_bridge.remote.convert import SnapshotEncoder
from robosc_bridge.ros2.diagnostics import Entry, Level, Link, entries
from robosc_bridge.terminal.formatting import event_line, status_lines
from robosc_view.definition import robot_of
from robosc_view.messages import MessageBuilder, PreparedRobot
from robosc_view.remote_bridge import status_of as status_of_remote
from robosc_view.reports import SourceKind
from robosc_view.running import status_of
from support.daemons import Connected, Scene
from support.goal_porter import PORTER, porter_supervisor
from support.rounds import ROUNDS

CONFIGURATION = """
robot: burger
drive: {driver: opencr, port: /dev/base}
execution: {period_s: 0.02, assumption_timeout_s: 3.0}
channels:
  /door/open: {channel: grpc}
  /door/close: {channel: grpc}
  /door/opened: {channel: grpc}
  /door/closed: {channel: grpc}
  /enter: {channel: grpc}
  /leave: {channel: grpc}
  /call: {channel: grpc}
"""


ROUNDS_CONFIGURATION = """
robot: burger
drive: {driver: opencr, port: /dev/base}
execution: {period_s: 0.02}
channels:
  /to_kitchen: {channel: grpc}
  /to_office: {channel: grpc}
  /to_hall: {channel: grpc}
  /call: {channel: grpc}
  /begin: {channel: grpc}
  /end: {channel: grpc}
"""


class Called(Scene):
    """A bridge of a robot, the porter or another one, whose surroundings obey the test."""

    def __init__(self, text: str = CONFIGURATION, model: str = PORTER) -> None:
        super().__init__(text=text, model=model, needs_scanner=False)
        self.up()
        self.caller = Connected(self, "caller")

    def give(self, identifier: str) -> None:
        self.caller.say(MessageReceived, identifier, None)
        self.live(0.1)

    @property
    def snapshot(self) -> Snapshot:
        found = self.feed.snapshot
        assert found is not None
        return found

    @property
    def progress(self) -> Progress:
        assert self.snapshot.progress is not None
        return self.snapshot.progress

    @property
    def sent(self) -> pb.Snapshot:
        made = pb.Snapshot()
        SnapshotEncoder().put(made, self.snapshot)
        return made


@pytest.fixture(scope="module")
def owing() -> Iterator[Called]:
    """Return a bridge whose door was told to open five seconds ago."""
    scene = Called()
    scene.give("/call")
    scene.live(5.0)
    yield scene


def test_a_snapshot_tells_how_far_the_strategy_is(owing: Called) -> None:
    found = owing.progress
    assert (found.approached, found.chosen, found.overdue) == ("goal 1", None, ("assumption 1",))
    assert [item.is_met for item in (*found.aims, *found.assumptions)] == [False, False, False, True]
    assert found.assumptions[0].unmet_s == pytest.approx(5.1, abs=0.1)


def test_each_source_of_the_view_shows_the_same(owing: Called) -> None:
    near, far = status_of(owing.snapshot), status_of_remote(owing.sent)
    assert near.progress == far.progress == owing.progress
    builder = MessageBuilder(
        PreparedRobot(robot_of(porter_supervisor(), SourceKind.BRIDGE, version="", can_command=True))
    )
    message = json.loads(builder.update(far, 1, 0.0))
    assert message["progress"]["overdue"] == ["assumption 1"]
    assert message["progress"]["approached"] == "goal 1"
    assert message["progress"]["aims"][0]["words"] == "Caller.waiting leads to Base.inside"


def test_the_terminal_tells_it_in_words(owing: Called) -> None:
    lines = list(status_lines(owing.sent))
    assert "  goal 1: not yet, for 5 s, approached now, reached 0 times: Caller.waiting leads to Base.inside" in lines
    assert "  warning: assumption 1 has been owed for 5 s: Door.opening leads to Door.ajar" in lines
    assert "  the strategy waits" in lines


def test_prometheus_reads_it(owing: Called) -> None:
    samples = {
        (sample.name, *sample.labels.values()): sample.value
        for family in _metrics(owing.snapshot)
        for sample in family.samples
    }
    assert samples["robosc_bridge_goal_reached_total", "goal 1"] == 0
    assert samples["robosc_bridge_assumption_owed_seconds", "assumption 1"] == pytest.approx(5.1, abs=0.1)
    assert samples["robosc_bridge_assumption_owed_seconds", "assumption 2"] == 0.0


def goals_entry(shown: pb.Snapshot) -> Entry:
    (found,) = (entry for entry in entries(Link("robot:1", "Porter", "1"), shown, 0.1) if entry.name == "goals")
    return found


def test_diagnostics_of_ros_warn_of_what_is_owed_for_too_long(owing: Called) -> None:
    found = goals_entry(owing.sent)
    words = "assumption 1 has been owed for 5 s: Door.opening leads to Door.ajar"
    assert (found.level, found.message) == (Level.WARN, words)
    assert found.values["approached"] == "goal 1"


def test_the_log_tells_what_changes_and_the_warning_ends() -> None:
    scene = Called()
    scene.give("/call")
    scene.live(5.0)
    scene.give("/door/opened")
    scene.live(0.5)
    assert scene.progress.overdue == ()
    assert scene.progress.aims[0].times == 1
    found = goals_entry(scene.sent)
    assert (found.level, found.message) == (Level.OK, "The strategy approaches goal 2.")
    told = [line for line in scene.log.entries if line["kind"] in ("reached", "approach", "owed", "met")]
    assert [line["kind"] for line in told][:6] == ["approach", "approach", "owed", "met", "reached", "approach"]
    assert event_line(told[2]).split("!", 1)[1].split() == (
        "owed Door.opening leads to Door.ajar assumption=assumption 1 owed_s=3".split()
    )


def test_a_robot_without_goals_and_one_that_rests_tell_nothing() -> None:
    scene = Scene()
    scene.up()
    snapshot = scene.feed.snapshot
    assert snapshot is not None and snapshot.progress is None
    made = pb.Snapshot()
    SnapshotEncoder().put(made, snapshot)
    assert not made.HasField("progress")
    assert "robosc_bridge_goal_reached" not in {family.name for family in _metrics(snapshot)}


def test_missions_are_told_by_each_way() -> None:
    scene = Called(ROUNDS_CONFIGURATION, ROUNDS)
    words = {line.split(":", 1)[0].strip(): line for line in status_lines(scene.sent)}
    assert words["mission rounds"] == "  mission rounds: not asked for; rounds made: 0"
    assert (
        words["visit 1 of mission rounds"]
        == "  visit 1 of mission rounds: not wanted now, reached 0 times: Base.kitchen"
    )
    scene.give("/begin")
    scene.give("/call")
    scene.live(0.5)
    found = scene.progress
    assert found == status_of(scene.snapshot).progress == status_of_remote(scene.sent).progress
    (mission,) = found.missions
    assert mission.rounds > 3 and mission.visit in (1, 2) and mission.detours == (0,)
    assert [item.mission for item in found.aims] == ["rounds"] * 3
    assert [item.times for item in found.aims][1:] == [mission.rounds, 1]
    where = f"at visit {mission.visit}, {found.aims[mission.visit - 1].words}; rounds made: {mission.rounds}"
    assert f"  mission rounds: {where}" in list(status_lines(scene.sent))
    assert goals_entry(scene.sent).values["mission rounds"] == where
    samples = {
        (sample.name, *sample.labels.values()): sample.value
        for family in _metrics(scene.snapshot)
        for sample in family.samples
    }
    assert samples["robosc_bridge_mission_visit", "rounds"] == mission.visit
    assert samples["robosc_bridge_mission_rounds_total", "rounds"] == mission.rounds
    assert samples["robosc_bridge_goal_reached_total", "visit 1 of detour 1 of mission rounds"] == 1


def test_a_detour_that_is_under_way_is_told() -> None:
    made = pb.Snapshot()
    made.progress.aims.add(name="visit 2 of mission m", words="Base.office", mission="m")
    made.progress.aims.add(name="visit 1 of detour 2 of mission m", words="Base.hall", mission="m", unmet_s=3.0)
    made.progress.missions.add(name="m", visit=2, rounds=1, detours=[0, 1])
    lines = list(status_lines(made))
    where = "at visit 2, Base.office; detour 2 under way, at visit 1, Base.hall; rounds made: 1"
    assert f"  mission m: {where}" in lines
    assert "  visit 1 of detour 2 of mission m: wanted for 3 s, reached 0 times: Base.hall" in lines
    made.progress.missions[0].is_round = True
    assert "  mission m: every visit is true; detour 2 under way" in "\n".join(status_lines(made))
