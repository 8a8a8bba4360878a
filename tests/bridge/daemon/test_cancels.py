"""Goals that are being cancelled: what the bridge tells of them, and when its own motions count as ended."""

import pytest

from robosc_api.v1 import bridge_pb2 as pb
from robosc_bridge.daemon.feed import Snapshot
from robosc_bridge.daemon.metrics import _metrics
from robosc_bridge.daemon.programs.items import CancelMade, FeedbackGiven, GoalAccepted, GoalEnded, GoalMade
from robosc_bridge.daemon.programs.items import MessageReceived as Heard
from robosc_bridge.daemon.states import OperatorCommand, Order, State
from robosc_bridge.daemon.threads.reports import Device, DeviceDown
from robosc_bridge.devices.interface import Velocity
from robosc_bridge.remote.convert import SnapshotEncoder
from robosc_bridge.ros2.diagnostics import Entry, Level, Link, entries
from robosc_bridge.terminal.formatting import event_line, status_lines
from robosc_view.remote_bridge import status_of as status_of_remote
from robosc_view.running import status_of
from support.daemons import PERIOD_S, Connected, Scene

LOADER = """
robot Loader {
    interface fetching use Fetch from kitchen_msgs
    interface trigger use Ask from own_srvs
    datatype object Place { x: double }
    datatype object Far { left: integer }
    component Stop {
        outgoing message stop with identifier: "/stop", type: boolean
        behaviour { variable pressed: boolean on response from stop do pressed := value initial marked state known { } }
    }
    component Drive {
        action travel with identifier: "/travel", request: Place, response: boolean, feedback: Far links fetching
        behaviour {
            initial marked state idle { on request to travel goto driving }
            state driving {
                on response from travel goto idle
                on error from travel goto idle
                on cancel to travel goto idle
            }
        }
    }
    component Arm {
        service reach with identifier: "/reach", request: none, response: boolean links trigger
        behaviour {
            initial marked state folded { on request to reach goto moving }
            state moving { on response from reach goto folded on error from reach goto folded }
        }
    }
    requirement travel needs !Stop.pressed and Arm.folded
    requirement reach needs Drive.idle and Stop.pressed
    provide travel with { x: 1.5 }
}
"""
CONFIGURATION = """
robot: burger
drive: {driver: opencr, port: /dev/base}
execution: {period_s: 0.02, cancel_timeout_s: 1.0}
channels: {/stop: {channel: grpc}, /travel: {channel: grpc}, /reach: {channel: grpc}}
"""


class Loading(Scene):
    """A bridge whose program drives, while the test holds the stop button."""

    def __init__(self) -> None:
        super().__init__(text=CONFIGURATION, model=LOADER, needs_scanner=False, stays=True)
        self.arm = Connected(self, "arm", ("reach",))
        self.server = Connected(self, "base", ("travel",))
        self.up()
        (self.goal,) = [item for item in self.server.received if isinstance(item, GoalMade)]
        self.server.say(GoalAccepted, self.goal.number)
        self.server.say(Heard, "/stop", True)
        assert self.server.of(CancelMade) == [CancelMade("travel", self.goal.number)]

    @property
    def snapshot(self) -> Snapshot:
        found = self.feed.snapshot
        assert found is not None
        return found

    @property
    def sent(self) -> pb.Snapshot:
        made = pb.Snapshot()
        SnapshotEncoder().put(made, self.snapshot)
        return made

    def supervisor_entry(self) -> Entry:
        (found,) = (item for item in entries(Link("robot:1", "L", "1"), self.sent, 0.1) if item.name == "supervisor")
        return found

    def samples(self) -> dict[tuple[str, ...], float]:
        return {
            (sample.name, *sample.labels.values()): sample.value
            for family in _metrics(self.snapshot)
            for sample in family.samples
        }


def test_all_who_watch_learn_that_a_goal_is_being_cancelled_and_that_it_does_not_end() -> None:
    scene = Loading()
    scene.live(0.5)
    assert (scene.snapshot.cancelling, scene.snapshot.overdue_cancels) == (("travel",), ())
    assert status_of(scene.snapshot).cancelling == ("travel",)
    assert status_of_remote(scene.sent).cancelling == ["travel"]
    assert "  the goal of travel is being cancelled and has not ended" in status_lines(scene.sent)
    assert scene.samples()["robosc_bridge_cancelling", "travel"] == 1.0
    assert scene.supervisor_entry().level is Level.OK
    assert scene.supervisor_entry().values["cancelling"] == "travel"
    scene.live(1.0)
    assert scene.snapshot.overdue_cancels == ("travel",)
    assert "  warning: the goal of travel is being cancelled and has not ended" in status_lines(scene.sent)
    assert scene.samples()["robosc_bridge_cancelling", "travel"] == 2.0
    found = scene.supervisor_entry()
    assert (found.level, found.message) == (Level.ERROR, "Goals do not end although they were cancelled: travel.")
    told = [line for line in scene.log.entries if line["kind"].startswith("cancel")]
    assert [event_line(line).split(maxsplit=1)[1] for line in told] == [
        "cancelling travel why=requirement 1 no longer holds",
        "! cancel_overdue travel asked_s=1",
    ]


@pytest.mark.parametrize(
    ("outcome", "event"), [("cancelled", "cancel"), ("succeeded", "response"), ("aborted", "error")]
)
def test_the_arm_waits_for_the_real_end_of_the_goal(outcome: str, event: str) -> None:
    scene = Loading()
    scene.live(2.0)
    scene.server.say(FeedbackGiven, scene.goal.number, {"left": 1})
    assert "reach.request" not in scene.events()
    scene.server.say(GoalEnded, scene.goal.number, outcome, True)
    last = [f"travel.{event}", *([] if event == "cancel" else ["travel.reset"]), "reach.request"]
    assert scene.events()[-len(last) :] == last
    assert scene.snapshot.cancelling == ()


def test_a_program_that_goes_ends_its_goal_as_an_error() -> None:
    scene = Loading()
    scene.server.leave()
    assert scene.events()[-3:] == ["travel.error", "travel.reset", "reach.request"]
    assert scene.daemon.state is State.RUNNING


def test_no_run_begins_before_the_goals_of_the_last_one_have_ended() -> None:
    scene = Loading()
    answers: list[str] = []
    scene.daemon.post(Order(OperatorCommand.STANDBY, "a test", answers.append))
    scene.live(1.0)
    assert str(scene.daemon.state) == "standby"
    scene.daemon.post(Order(OperatorCommand.START, "a test", answers.append))
    scene.live(0.5)
    assert answers == ["", "goals of the last run have not ended: travel"]
    scene.server.say(FeedbackGiven, scene.goal.number, {"left": 1})
    assert scene.server.received == []
    scene.server.say(GoalEnded, scene.goal.number, "cancelled", None)
    scene.daemon.post(Order(OperatorCommand.START, "a test", answers.append))
    scene.live(0.5)
    assert answers[2:] == [""]
    assert scene.daemon.state is State.RUNNING


def test_a_program_that_goes_has_no_goals_of_the_last_run() -> None:
    scene = Loading()
    answers: list[str] = []
    scene.daemon.post(Order(OperatorCommand.STANDBY, "a test", answers.append))
    scene.live(1.0)
    scene.server.leave()
    scene.daemon.post(Order(OperatorCommand.START, "a test", answers.append))
    scene.live(0.5)
    # An action that fails at once, again and again, keeps nothing else from happening.
    assert answers == ["", ""]
    assert scene.events().count("travel.error") > 10


TURNER = """
robot Turner {
    interface rotation use RotateAngle from turtlebot3_msgs
    interface halting use Trigger from std_srvs
    datatype object Angle { angle: double }
    datatype object Left { remaining: double }
    datatype object Answer { success: boolean }
    component Button {
        outgoing message button with identifier: "/button", type: boolean
        behaviour { variable held: boolean on response from button do held := value initial marked state known { } }
    }
    component Base {
        action turn with identifier: "/turn", request: Angle, response: Answer, feedback: Left links rotation
        service halt with identifier: "/halt", request: none, response: Answer links halting
        behaviour {
            initial marked state idle { on request to turn goto turning }
            state turning { on response from turn goto idle on error from turn goto idle on cancel to turn goto idle }
        }
    }
    requirement turn needs !Button.held
    requirement halt needs Button.held
    provide turn with { angle: 3.0 }
}
"""
TURNING = """
robot: burger
drive: {driver: opencr, port: /dev/base}
scanner: {driver: lds01, port: /dev/scanner}
execution: {period_s: 0.02}
channels:
  /button: {channel: button, name: button_1, on: change}
  /turn: {channel: rotate, direction: left, unit: radians}
  /halt: {channel: stop}
"""


class Heavy(Scene):
    """A robot whose wheels take their time to follow a command: 2 rad/s^2."""

    turns_rad_s = 0.0

    def measured(self) -> Velocity:
        wanted, most = self.out.angular_rad_s, 2.0 * PERIOD_S
        self.turns_rad_s += max(min(wanted - self.turns_rad_s, most), -most)
        return Velocity(0.0, self.turns_rad_s)


def turning() -> Heavy:
    scene = Heavy(text=TURNING, model=TURNER)
    scene.up()
    scene.live(0.5, 2.0)
    assert scene.turns_rad_s > 0.5
    scene.buttons["button_1"] = True
    return scene


def turns_at(scene: Heavy, event: str) -> float:
    """Let the robot live until an event; returns how fast it turns then."""
    for _ in range(200):
        scene.live(0.02, 2.0)
        if event in scene.events():
            return abs(scene.turns_rad_s)
    raise AssertionError(f"{event} did not happen")


def test_a_rotation_that_is_cancelled_has_ended_when_the_wheels_stand() -> None:
    scene = turning()
    assert turns_at(scene, "turn.cancel") < 0.05
    (asked,) = [line["time"] for line in scene.log.entries if line["kind"] == "cancelling"]
    (ended,) = [line["time"] for line in scene.log.entries if line.get("event") == "turn.cancel"]
    # The robot brakes from its speed: that takes its time.
    assert ended - asked > 0.1


def test_a_call_to_stop_is_answered_when_the_wheels_stand() -> None:
    scene = turning()
    assert turns_at(scene, "halt.response") < 0.05
    assert "halt.request" in scene.events()


def test_a_rotation_ends_at_once_if_nobody_measures_it() -> None:
    scene = turning()
    scene.daemon.post(DeviceDown(Device.DRIVE, "no answer", 0.25, is_first=True))
    scene.daemon.cycle()
    assert "turn.error" in scene.events()
