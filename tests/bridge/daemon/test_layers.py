"""A supervision layer in the daemon: what programs ask for is let through or held back, and ends with who asked."""

import math
import threading
from typing import Any
from unittest.mock import Mock

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc_bridge.daemon.programs import request_checker
from robosc_bridge.daemon.programs.items import (
    Answered,
    Attached,
    Blocked,
    CallMade,
    CallRequested,
    CancelRequested,
    Detached,
    FeedbackPassed,
    FromProgram,
    GoalOver,
    GoalRejected,
    GoalRequested,
    GoalTaken,
    MessageReceived,
    MessageRequested,
    PassedOn,
    Program,
    Refused,
    Replied,
)
from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.daemon.threads.reports import Device, DeviceDown
from robosc_bridge.devices.interface import STANDSTILL, Velocity
from support.daemons import Connected, Scene
from support.effort import examples

MODEL = """
robot Driven {
    interface twist use Twist from geometry_msgs
    interface laser use LaserScan from sensor_msgs
    interface turning use Turn from motion_msgs
    interface trigger use Ask from own_srvs
    datatype object Vector { x: double z: double }
    datatype object Twist { linear: Vector angular: Vector }
    datatype object Scan { ranges: array(double) }
    datatype object Angle { angle: double }
    datatype enum Way from Scan to { value.ranges[0] > 0.5 -> free default -> blocked }
    component Eyes {
        outgoing message scan with identifier: "/scan", type: Way links laser
        outgoing message stop with identifier: "/stop", type: none
        outgoing message resume with identifier: "/resume", type: none
        outgoing message mood with identifier: "/mood", type: string
        behaviour {
            variable way: Way = blocked
            on response from scan do way := value
            initial marked state calm { on response from stop goto stopped }
            marked state stopped { on response from resume goto calm }
        }
    }
    component Wheels {
        incoming message walk with identifier: "/cmd_vel", type: Twist, when: value.linear.x != 0.0 links twist
        incoming message halt with identifier: "/cmd_vel", type: Twist links twist
        incoming message spin with identifier: "/spin", type: integer
        service turn with identifier: "/turn", request: Angle, response: none links trigger
        action face with identifier: "/face", request: Angle, response: none, feedback: double links turning
        service think with identifier: "/think", request: string, response: string links trigger
    }
    requirement walk needs Eyes.way = free and Eyes.calm
    requirement {spin, turn, face} needs Eyes.calm
}
"""
CONFIGURATION = """
robot: burger
drive: {driver: opencr, port: /dev/base}
scanner: {driver: lds01, port: /dev/scanner}
execution: {period_s: 0.02, command_timeout_s: 0.4}
remote: {grpc_address: "127.0.0.1:0"}
channels:
  /scan: {channel: scanner}
  /stop: {channel: emergency_stop, event: stop}
  /resume: {channel: emergency_stop, event: resume}
  /mood: {channel: grpc}
  /cmd_vel: {channel: drive}
  /spin: {channel: rotate}
  /turn: {channel: rotate}
  /face: {channel: rotate}
  /think: {channel: grpc}
"""
FORWARD = {"linear": {"x": 0.1}}
ZERO = {"linear": {"x": 0.0}}


def driven(model: str = MODEL) -> Scene:
    scene = Scene(text=CONFIGURATION, model=model, is_layer=True, stays=True)
    scene.up()
    return scene


@pytest.fixture
def scene() -> Scene:
    return driven()


@pytest.fixture
def program(scene: Scene) -> Connected:
    return Connected(scene, "an operator")


def without_sensors(messages: list[Any]) -> list[Any]:
    return [item for item in messages if not isinstance(item, PassedOn)]


def refused(messages: list[Any]) -> list[str]:
    return [item.why for item in messages if isinstance(item, Refused)]


def test_what_is_allowed_moves_the_wheels_and_what_is_not_is_reported_to_its_sender(
    scene: Scene, program: Connected
) -> None:
    other = Connected(scene, "another")
    assert without_sensors(program.say(MessageRequested, "/cmd_vel", FORWARD)) == []
    scene.live(0.3, 2.0)
    assert scene.out == Velocity(0.1, 0.0)
    scene.live(0.1, 0.3)
    # Let go by the supervisor: an obstacle.
    assert scene.out == STANDSTILL
    other.received.clear()
    assert without_sensors(program.say(MessageRequested, "/cmd_vel", FORWARD)) == [Blocked("/cmd_vel")]
    assert without_sensors(other.received) == []
    assert without_sensors(program.say(MessageRequested, "/cmd_vel", ZERO)) == []


def test_what_was_asked_for_during_an_operators_stop_does_not_move_it_afterwards() -> None:
    careless = MODEL.replace(" and Eyes.calm", "").replace("    requirement {spin, turn, face} needs Eyes.calm\n", "")
    scene = Scene(text=CONFIGURATION.replace("0.4", "0"), model=careless, is_layer=True, stays=True)
    scene.up()
    program = Connected(scene, "an operator")
    scene.daemon.post(OperatorCommand.STOP)
    scene.live(0.1, 2.0)
    program.say(MessageRequested, "/cmd_vel", FORWARD)
    scene.live(0.3, 2.0)
    scene.daemon.post(OperatorCommand.RESUME)
    scene.live(0.5, 2.0)
    assert scene.out == STANDSTILL
    program.say(MessageRequested, "/cmd_vel", FORWARD)
    scene.live(0.5, 2.0)
    assert scene.out.linear_m_s == 0.1


def test_sensors_are_passed_on_after_the_supervisor_has_seen_them(scene: Scene, program: Connected) -> None:
    silent = Connected(scene, "a viewer", may_request=False)
    silent.cycle()
    program.say(MessageReceived, "/mood", "fine")
    scene.scan(0.3)
    program.cycle()
    assert program.of(PassedOn) == silent.of(PassedOn)[-1:]
    assert program.of(PassedOn)[0].identifier == "/scan"
    assert PassedOn("/mood", "fine") in silent.received
    assert scene.component("Eyes")["variables"]["way"] == "blocked"


def test_a_caller_that_falls_silent_is_released_though_the_loop_repeats_what_it_wanted(
    scene: Scene, program: Connected
) -> None:
    program.say(MessageRequested, "/cmd_vel", FORWARD)
    scene.live(0.3, 2.0)
    assert scene.out.linear_m_s == 0.1
    scene.live(0.2, 2.0)
    assert scene.out == STANDSTILL
    # A repeated request goes on.
    for _ in range(10):
        program.say(MessageRequested, "/cmd_vel", FORWARD)
        scene.live(0.2, 2.0)
        assert scene.out.linear_m_s == 0.1


@pytest.mark.parametrize("data", [{"linear": {"x": math.nan}}, {"linear": {"x": 0.2}}])
def test_a_silent_caller_is_released_whatever_is_held_back_from_others(data: Any) -> None:
    walk = next(line for line in MODEL.splitlines(keepends=True) if "message walk" in line)
    run = walk.replace("walk", "run").replace("!= 0.0", "> 0.15")
    never = "    requirement run needs Eyes.stopped\n    requirement {spin"
    scene = driven(MODEL.replace(walk, run + walk).replace("    requirement {spin", never))
    program, other = Connected(scene, "an operator"), Connected(scene, "another")
    program.say(MessageRequested, "/cmd_vel", FORWARD)
    scene.live(0.1, 2.0)
    for _ in range(3):
        assert Blocked("/cmd_vel") in other.say(MessageRequested, "/cmd_vel", data)
        scene.live(0.1, 2.0)
        assert scene.out.linear_m_s == 0.1
    assert Blocked("/cmd_vel") in other.say(MessageRequested, "/cmd_vel", data)
    scene.live(0.14, 2.0)
    assert scene.out == STANDSTILL
    # Its own are signs of its life, whether they go through or not.
    program.say(MessageRequested, "/cmd_vel", FORWARD)
    for _ in range(8):
        scene.live(0.2, 2.0)
        assert scene.out.linear_m_s == 0.1
        assert Blocked("/cmd_vel") in program.say(MessageRequested, "/cmd_vel", data)


def test_whose_message_went_through_last_is_who_keeps_it_acting(scene: Scene, program: Connected) -> None:
    other = Connected(scene, "another")
    program.say(MessageRequested, "/cmd_vel", FORWARD)
    scene.live(0.3, 2.0)
    other.say(MessageRequested, "/cmd_vel", {"linear": {"x": 0.05}})
    scene.live(0.3, 2.0)
    assert scene.out.linear_m_s == 0.05
    program.leave()
    scene.live(0.04, 2.0)
    assert scene.out.linear_m_s == 0.05
    scene.live(0.1, 2.0)
    assert scene.out == STANDSTILL


def test_a_caller_that_leaves_stands_still_at_once(scene: Scene, program: Connected) -> None:
    other = Connected(scene, "another")
    program.say(MessageRequested, "/cmd_vel", FORWARD)
    scene.live(0.3, 2.0)
    other.leave()
    scene.exchange()
    assert scene.out.linear_m_s == 0.1
    program.leave()
    scene.exchange()
    assert scene.out == STANDSTILL
    assert scene.log.entries[-1]["kind"] == "release"
    assert scene.daemon.state is State.RUNNING


def test_a_turn_that_was_asked_for_ends_with_who_asked(scene: Scene, program: Connected) -> None:
    for make, arguments in (
        (MessageRequested, ("/spin", 90)),
        (CallRequested, ("turn", "1", {"angle": 90.0})),
        (GoalRequested, ("face", "1", {"angle": 90.0})),
    ):
        caller = Connected(scene, "a caller")
        caller.say(make, *arguments)
        scene.live(0.3, 2.0)
        assert scene.out.angular_rad_s > 0.0
        caller.leave()
        scene.exchange()
        assert scene.out == STANDSTILL
        scene.live(0.3, 2.0)
        assert (scene.out, scene.daemon.state) == (STANDSTILL, State.RUNNING)


def test_a_call_is_answered(scene: Scene, program: Connected) -> None:
    program.say(CallRequested, "turn", "a", {"angle": 20})
    scene.live(3.0, 2.0)
    assert program.of(Answered) == [Answered("a", {"success": True, "message": ""}, is_default=False)]
    assert abs(math.degrees(scene.heading_rad) - 20) < 3


def test_a_call_that_is_held_back_is_answered_by_default_at_once(scene: Scene, program: Connected) -> None:
    scene.daemon.post(OperatorCommand.STOP)
    scene.live(0.1, 2.0)
    assert without_sensors(program.say(CallRequested, "turn", "a", {"angle": 20})) == [
        Answered("a", None, is_default=True),
        Blocked("/turn"),
    ]


def test_a_goal_is_taken_reported_on_and_ends(scene: Scene, program: Connected) -> None:
    assert without_sensors(program.say(GoalRequested, "face", "g", {"angle": 20}))[0] == GoalTaken("g")
    scene.live(3.0, 2.0)
    assert program.of(FeedbackPassed)[0].goal_id == "g"
    assert program.of(GoalOver) == [GoalOver("g", "succeeded", {"success": True, "message": ""})]


def test_a_goal_is_cancelled_by_who_asked_and_nobody_else(scene: Scene, program: Connected) -> None:
    other = Connected(scene, "another")
    program.say(GoalRequested, "face", "g", {"angle": 90})
    scene.live(0.3, 2.0)
    assert refused(other.say(CancelRequested, "face", "g")) == ["'g' is not a goal of 'face' in progress"]
    # One id means another goal with another program: held back, as the first is under way.
    assert without_sensors(other.say(GoalRequested, "face", "g", {"angle": 5})) == [GoalRejected("g"), Blocked("/face")]
    assert scene.out.angular_rad_s > 0.0
    assert without_sensors(program.say(CancelRequested, "face", "g")) == []
    # It is over when the wheels stand.
    scene.exchange()
    assert scene.out == STANDSTILL
    assert without_sensors(program.cycle()) == [GoalOver("g", "cancelled", None)]
    assert refused(program.say(CancelRequested, "face", "g")) == ["'g' is not a goal of 'face' in progress"]


def test_a_rotation_goes_on_when_a_program_leaves_that_asked_for_another_motion(
    scene: Scene, program: Connected
) -> None:
    other = Connected(scene, "another")
    other.say(MessageRequested, "/cmd_vel", FORWARD)
    scene.live(0.1, 2.0)
    program.say(GoalRequested, "face", "g", {"angle": 90})
    scene.live(0.1, 2.0)
    other.leave()
    scene.live(0.5, 2.0)
    assert scene.out.angular_rad_s > 0.0


def test_a_goal_ends_when_the_drive_base_is_lost(scene: Scene, program: Connected) -> None:
    program.say(GoalRequested, "face", "g", {"angle": 90})
    scene.live(0.1, 2.0)
    scene.daemon.post(DeviceDown(Device.DRIVE, "no answer", 0.25, True))
    program.cycle()
    assert program.of(GoalOver) == [GoalOver("g", "aborted", {"success": False, "message": "the drive base is lost"})]


def test_no_end_of_a_goal_reaches_the_next_run(scene: Scene) -> None:
    robot, executor = scene.daemon._robot, Mock()
    robot.send_goal("face", 1, {"angle": 90.0})
    robot.forget()
    robot.stop("a test")
    robot.deliver_pending(executor)
    assert executor.mock_calls == []


def test_an_id_that_is_in_use_is_refused_and_free_again_afterwards(scene: Scene, program: Connected) -> None:
    program.say(GoalRequested, "face", "g", {"angle": 90})
    assert refused(program.say(GoalRequested, "face", "g", {"angle": 90})) == ["the id 'g' is in use"]
    assert refused(program.say(CallRequested, "turn", "g", {"angle": 90})) == ["the id 'g' is in use"]
    program.say(CancelRequested, "face", "g")
    assert without_sensors(program.say(GoalRequested, "face", "g", {"angle": 90})) == [GoalTaken("g")]


def test_an_operators_stop_ends_a_goal_and_holds_everything_back(scene: Scene, program: Connected) -> None:
    program.say(GoalRequested, "face", "g", {"angle": 90})
    scene.live(0.3, 2.0)
    scene.daemon.post(OperatorCommand.STOP)
    scene.live(0.1, 2.0)
    assert scene.out == STANDSTILL
    assert [item.outcome for item in program.of(GoalOver)] == ["aborted"]
    assert without_sensors(program.say(MessageRequested, "/cmd_vel", FORWARD)) == [Blocked("/cmd_vel")]


def test_in_standby_everything_is_held_back_and_what_was_awaited_is_answered(scene: Scene, program: Connected) -> None:
    server = Connected(scene, "a server", ("think",))
    server.cycle()
    program.say(CallRequested, "think", "t", "about it")
    program.say(GoalRequested, "face", "g", {"angle": 90})
    scene.daemon.post(OperatorCommand.STANDBY)
    scene.live(0.3, 2.0)
    assert scene.daemon.state is State.STANDBY
    assert program.of(Answered) == [Answered("t", None, is_default=True)]
    assert [item.outcome for item in program.of(GoalOver)] == ["aborted"]
    assert program.say(MessageRequested, "/cmd_vel", FORWARD) == [Blocked("/cmd_vel")]
    answered, blocked = program.say(CallRequested, "turn", "a", None)
    assert (answered, blocked) == (Answered("a", None, is_default=True), Blocked("/turn"))
    assert isinstance(blocked, Blocked)
    assert blocked.why == "the bridge executes no supervisor"
    assert program.say(GoalRequested, "face", "g", None) == [GoalRejected("g"), Blocked("/face")]
    scene.daemon.post(OperatorCommand.START)
    scene.live(0.3, 2.0)
    program.say(MessageRequested, "/cmd_vel", FORWARD)
    scene.live(0.3, 2.0)
    assert scene.out.linear_m_s == 0.1


def test_a_service_of_a_program_answers_another_programs_call(scene: Scene, program: Connected) -> None:
    server = Connected(scene, "a server", ("think",))
    server.cycle()
    server.received.clear()
    program.say(CallRequested, "think", "t", "about it")
    (call,) = server.of(CallMade)
    assert call.data == "about it"
    server.say(Replied, call.number, "done")
    assert program.of(Answered) == [Answered("t", "done", is_default=False)]


def test_a_viewer_may_not_ask(scene: Scene) -> None:
    viewer = Connected(scene, "a viewer", may_request=False)
    assert refused(viewer.say(MessageRequested, "/cmd_vel", FORWARD)) == ["this program may not send requests"]
    scene.live(0.2, 2.0)
    assert scene.out == STANDSTILL


WRONG = [
    (MessageRequested, ("/cmd_vel", {"linear": {"x": "fast"}}), "'walk': 'linear.x' must be number"),
    (MessageRequested, ("/cmd_vel", {"linear": {"x": True}}), "'walk': 'linear.x' must be number"),
    (MessageRequested, ("/cmd_vel", {"linear": {"x": [1]}}), "'linear.x' must be number"),
    (MessageRequested, ("/cmd_vel", {"linear": 1}), "'linear' must be {x: number"),
    (MessageRequested, ("/cmd_vel", 1), "must be "),
    (MessageRequested, ("/cmd_vel", {"linear": {"w": 1}}), "there is no field 'linear.w'; there is x, y, z"),
    (MessageRequested, ("/cmd_vel", {"linear": {"y": 0.1}}), "'linear.y' must be 0: 'drive' does not use it"),
    (MessageRequested, ("/cmd_vel", {"twist": FORWARD}), "there is no field 'twist'"),
    (MessageRequested, ("/cmd_vel", {"linear": {"x": 1 << 80}}), "a number of more than 64 bits"),
    (MessageRequested, ("/spin", 1.5), "'spin': the data must be a whole number"),
    (MessageRequested, ("/spin", {"data": 90}), "'spin': the data must be number"),
    (MessageRequested, ("/spin", 36_001), "beyond a hundred revolutions"),
    (MessageRequested, ("/spin", -36_001), "beyond a hundred revolutions"),
    (MessageRequested, ("/scan", {}), "no message to the robot on '/scan'"),
    (MessageRequested, ("/nowhere", {}), "no message to the robot on '/nowhere'"),
    (CallRequested, ("turn", "", {}), "an id has 1 to 255 characters"),
    (CallRequested, ("turn", "x" * 256, {}), "an id has 1 to 255 characters"),
    (CallRequested, ("face", "1", {}), "the model has no service 'face'"),
    (CallRequested, ("turn", "1", {"angle": "wide"}), "'angle' must be number"),
    (CallRequested, ("turn", "1", {"data": 90}), "there is no field 'data'; there is angle"),
    (CallRequested, ("think", "1", 5), "'think': the data must be a text"),
    (GoalRequested, ("turn", "1", {}), "the model has no action 'turn'"),
    (GoalRequested, ("face", "1", {"angle": 1e9}), "beyond a hundred revolutions"),
    (CancelRequested, ("face", "1"), "'1' is not a goal of 'face' in progress"),
]


@pytest.mark.parametrize(("make", "arguments", "reason"), WRONG)
def test_what_makes_no_sense_is_refused_and_changes_nothing(
    make: Any, arguments: tuple[Any, ...], reason: str, scene: Scene, program: Connected
) -> None:
    (why,) = refused(program.say(make, *arguments))
    assert reason in why
    scene.live(0.3, 2.0)
    assert (scene.out, scene.daemon.state) == (STANDSTILL, State.RUNNING)
    assert without_sensors(program.received)[1:] == []


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    ("make", "arguments"),
    [
        (MessageRequested, ("/cmd_vel", {"linear": {"x": "N"}})),
        (CallRequested, ("turn", "1", {"angle": "N"})),
        (GoalRequested, ("face", "1", {"angle": "N"})),
    ],
)
def test_what_is_not_finite_is_held_back(
    number: float, make: Any, arguments: tuple[Any, ...], scene: Scene, program: Connected
) -> None:
    *names, data = arguments
    (name, inner), *_ = data.items()
    wrong = {name: {"x": number} if isinstance(inner, dict) else number}
    assert isinstance(without_sensors(program.say(make, *names, wrong))[-1], Blocked)
    scene.live(0.2, 2.0)
    assert (scene.out, scene.daemon.state) == (STANDSTILL, State.RUNNING)


def test_what_is_left_out_is_zero_for_model_and_wheels_alike() -> None:
    first, second = (line for line in MODEL.splitlines(keepends=True) if '"/cmd_vel"' in line)
    halt = second.replace("type: Twist", "type: Twist, when: value.linear.x = 0.0")
    walk = first.replace(", when: value.linear.x != 0.0", "")
    scene = driven(model=MODEL.replace(first, halt).replace(second, walk))
    program = Connected(scene, "an operator")
    scene.live(0.1, 0.3)
    # Not to walk, for which there is no way, but to halt.
    nothing: list[Any] = [None, {}, {"linear": None}, {"linear": {}}, {"angular": {"z": 0}}]
    for data in nothing:
        assert without_sensors(program.say(MessageRequested, "/cmd_vel", data)) == []
    assert without_sensors(program.say(MessageRequested, "/cmd_vel", {"linear": {"x": 0.001}})) == [Blocked("/cmd_vel")]


def test_who_sends_too_much_is_stopped(scene: Scene, program: Connected) -> None:
    program.say(MessageRequested, "/cmd_vel", FORWARD)
    for _ in range(300):
        scene.daemon.post(MessageRequested(program.program, "/cmd_vel", FORWARD))
    for _ in range(10):
        program.cycle()
        scene.exchange()
    assert scene.out == STANDSTILL


@pytest.mark.parametrize(
    ("make", "arguments"),
    [
        (GoalRequested, ("face", "g", {"angle": 340})),
        (CallRequested, ("turn", "c", {"angle": 340})),
        (MessageRequested, ("/spin", 340)),
    ],
)
def test_what_who_sends_too_much_has_asked_for_ends(
    make: Any, arguments: tuple[Any, ...], scene: Scene, program: Connected
) -> None:
    program.say(make, *arguments)
    scene.live(0.3, 2.0)
    assert scene.out.angular_rad_s > 0.0
    for _ in range(260):
        scene.daemon.post(MessageRequested(program.program, "/nowhere", None))
    # It may have been this one that is lost.
    scene.daemon.post(CancelRequested(program.program, "face", "g"))
    program.received.clear()
    scene.live(0.3, 2.0)
    assert scene.out == STANDSTILL
    assert any("too much at once" in why for why in refused(program.received))
    if make is GoalRequested:
        assert program.of(GoalOver) == [GoalOver("g", "cancelled", None)]
    if make is CallRequested:
        assert program.of(Answered) == [Answered("c", None, is_default=True)]
    # It may go on.
    program.say(MessageRequested, "/cmd_vel", FORWARD)
    scene.live(0.3, 2.0)
    assert scene.out.linear_m_s == 0.1


def test_what_is_costly_to_take_up_is_spread_over_turns(scene: Scene) -> None:
    taken: list[str] = []

    def take_time(item: Any) -> None:
        if isinstance(item, Blocked):
            taken.append(item.identifier)
            scene.clock.advance(0.0015)

    slow = Program("slow", take_time, may_request=True)
    scene.daemon.post(Attached(slow))
    scene.daemon.cycle()
    other = Connected(scene, "another")
    other.cycle()
    for _ in range(50):
        scene.daemon.post(MessageRequested(slow, "/cmd_vel", {"linear": {"x": math.nan}}))
    # Its first is taken up in the first rotation, and so is that of the other one.
    assert Blocked("/cmd_vel") in other.say(MessageRequested, "/cmd_vel", {"linear": {"x": math.nan}})
    for turns in range(1, 20):
        assert len(taken) <= 2 * turns
        scene.daemon.cycle()
    while len(taken) < 50:
        before = len(taken)
        scene.daemon.cycle()
        assert len(taken) > before


def test_data_is_looked_through_in_the_thread_of_who_sends_it(
    scene: Scene, program: Connected, monkeypatch: pytest.MonkeyPatch
) -> None:
    looked: list[int] = []

    def noting(function: Any) -> Any:
        def noted(*arguments: Any) -> Any:
            looked.append(threading.get_ident())
            return function(*arguments)

        return noted

    for name in ("why_not_shaped", "why_not_typed", "completed", "_leaves"):
        monkeypatch.setattr(request_checker, name, noting(getattr(request_checker, name)))
    program.cycle()
    items: list[FromProgram] = [
        MessageRequested(program.program, "/cmd_vel", FORWARD),
        CallRequested(program.program, "turn", "1", {"angle": 20}),
        GoalRequested(program.program, "face", "g", {"angle": "wide"}),
    ]

    def send() -> None:
        for item in items:
            scene.daemon.post(item)

    sender = threading.Thread(target=send)
    sender.start()
    sender.join()
    assert len(looked) > 6
    assert threading.get_ident() not in looked
    looked.clear()
    assert refused(program.cycle()) == ["'face': 'angle' must be number"]
    scene.live(0.3, 2.0)
    assert scene.out.angular_rad_s > 0.0
    assert looked == []


def test_a_lost_drive_base_ends_a_layers_run(scene: Scene, program: Connected) -> None:
    program.say(GoalRequested, "face", "g", {"angle": 90})
    scene.daemon.post(DeviceDown(Device.DRIVE, "no answer", 0.25, True))
    program.cycle()
    assert [item.outcome for item in program.of(GoalOver)] == ["aborted"]
    assert scene.daemon.state is State.FAULT
    scene.daemon.post(Detached(program.program))
    scene.daemon.cycle()


EVERYTHING = [
    (MessageRequested, ("/cmd_vel", FORWARD)),
    (MessageRequested, ("/cmd_vel", ZERO)),
    (MessageRequested, ("/spin", 40)),
    (CallRequested, ("turn", "1", {"angle": 40})),
    (CallRequested, ("think", "2", "?")),
    (GoalRequested, ("face", "3", {"angle": 40})),
    (CancelRequested, ("face", "3")),
    (MessageReceived, ("/mood", "x")),
]


@settings(max_examples=examples(25))
@given(
    st.lists(
        st.tuples(
            st.integers(0, 2), st.none() | st.sampled_from(EVERYTHING), st.sampled_from([0.02, 0.1]), st.booleans()
        ),
        min_size=1,
        max_size=15,
    )
)
def test_programs_may_come_and_go_in_the_middle_of_everything(steps: list[tuple[int, Any, float, bool]]) -> None:
    scene = driven()
    names = iter(range(1000))

    def come() -> Connected:
        return Connected(scene, str(next(names)), ("think",))

    programs = [come() for _ in range(3)]
    for who, what, seconds, is_free in steps:
        if what is None:
            programs[who].leave()
            programs[who] = come()
        else:
            make, arguments = what
            programs[who].say(make, *arguments)
        scene.live(seconds, 2.0 if is_free else 0.3)
        assert scene.daemon.state is State.RUNNING
    for program in programs:
        program.leave()
    scene.exchange()
    # The caller has gone, so no motion is wanted.
    assert scene.out == STANDSTILL
    scene.live(1.0, 2.0)
    assert (scene.out, scene.daemon.state) == (STANDSTILL, State.RUNNING)
    # A program that comes finds everything free.
    late = come()
    late.say(GoalRequested, "face", "1", {"angle": 10})
    assert GoalTaken("1") in late.received
    scene.live(3.0, 2.0)
    assert [item.outcome for item in late.of(GoalOver)] == ["succeeded"]
