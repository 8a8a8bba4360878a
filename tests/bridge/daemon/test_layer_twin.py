"""The layer in the daemon and the layer by itself get the same input, and must do the same, at random."""

from collections.abc import Callable
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.execution.interpreter import InterpretedSystem
from robosc.model.structure import Deployment
from robosc_bridge.daemon.programs.items import (
    Answered,
    Blocked,
    CallFailed,
    CallMade,
    CallRequested,
    CancelMade,
    CancelRequested,
    FeedbackGiven,
    FeedbackPassed,
    FromProgram,
    GoalAccepted,
    GoalEnded,
    GoalMade,
    GoalOver,
    GoalRejected,
    GoalRequested,
    GoalTaken,
    MessageReceived,
    MessageRequested,
    MessageSent,
    PassedOn,
    Program,
    Replied,
)
from robosc_bridge.daemon.states import State
from support.daemons import Connected, Scene, supervisor_of
from support.effort import examples
from support.layers import LayerBench

MODEL = """
robot Driven {
    interface twist use Twist from geometry_msgs
    interface turning use Turn from motion_msgs
    interface trigger use Ask from own_srvs
    datatype object Vector { x: double }
    datatype object Twist { linear: Vector }
    component Eyes {
        outgoing message way with identifier: "/way", type: boolean
        behaviour {
            variable is_free: boolean
            on response from way do is_free := value
            initial marked state only { }
        }
    }
    component Wheels {
        incoming message walk with identifier: "/cmd_vel", type: Twist, when: value.linear.x != 0.0 links twist
        incoming message halt with identifier: "/cmd_vel", type: Twist links twist
        service think with identifier: "/think", request: string, response: boolean links trigger
        action face with identifier: "/face", request: double, response: none, feedback: double links turning
        behaviour {
            initial marked state calm {
                on request to face goto turning
                on request to walk
                on request to think
            }
            marked state turning { on response from face goto calm on error from face goto calm }
        }
    }
    requirement walk needs Eyes.is_free
    requirement face needs Eyes.is_free
}
"""
CONFIGURATION = """
robot: burger
drive: {driver: opencr, port: /dev/base}
execution: {period_s: 0.02, command_timeout_s: 0.4, service_timeout_s: 1.0, release_identifiers: [/cmd_vel]}
remote: {grpc_address: "127.0.0.1:0"}
channels: {/way: {channel: grpc}, /cmd_vel: {channel: grpc}, /think: {channel: grpc}, /face: {channel: grpc}}
"""
TOLD_ROBOT = (MessageSent, CallMade, GoalMade, CancelMade)


class Twins:
    """Both, with one caller and one program that serves the robot's side."""

    def __init__(self) -> None:
        self.scene = Scene(text=CONFIGURATION, model=MODEL, is_layer=True, needs_scanner=False)
        self.scene.up()
        self.caller = Connected(self.scene, "caller")
        self.server = Connected(self.scene, "server", ("think", "face"), may_request=False)
        self.scene.daemon.cycle()
        system = InterpretedSystem(supervisor_of(MODEL, Deployment.LAYER))
        self.twin = LayerBench(
            system, release_identifiers=("/cmd_vel",), command_timeout_s=0.4, service_timeout_s=1.0, period_s=0.02
        )
        # Numbers of the robot's side: the daemon's, the twin's.
        self.calls: list[tuple[int, int]] = []
        self.goals: list[tuple[int, int]] = []
        self.asked = 0

    def compare(self, act: Callable[[], None], twin: Callable[[], object]) -> None:
        """Let the same happen to both."""
        self.caller.received.clear()
        self.server.received.clear()
        before = len(self.twin.middleware.sent)
        act()
        twin()
        sent = self.twin.middleware.sent[before:]
        robots = [item for item in sent if item[0] in ("publish", "default", "call", "goal", "cancel")]
        callers = [item for item in sent if item not in robots]
        found = [item for item in self.server.received if isinstance(item, TOLD_ROBOT)]
        for own, other in zip(found, robots, strict=True):
            if isinstance(own, CallMade):
                self.calls.append((own.number, other[2]))
            elif isinstance(own, GoalMade):
                self.goals.append((own.number, other[2]))
        assert [self._robot_side(item) for item in found] == robots
        words = [_caller_side(self.caller.program, item) for item in self.caller.received]
        assert [item for item in words if item is not None] == callers

    def _robot_side(self, item: Any) -> tuple[Any, ...]:
        match item:
            case MessageSent(identifier=identifier, data=None):
                return ("default", identifier)
            case MessageSent(name=name, data=data):
                return ("publish", name, data)
            case CallMade(name=name, number=number, data=data):
                return ("call", name, dict(self.calls)[number], data)
            case GoalMade(name=name, number=number, data=data):
                return ("goal", name, dict(self.goals)[number], data)
        return ("cancel", item.name, dict(self.goals)[item.number])

    def wait(self, seconds: float) -> None:
        def live() -> None:
            self.scene.clock.advance(seconds)
            self.scene.daemon.cycle()

        self.compare(live, lambda: self.twin.wait(seconds))

    def both(self, item: FromProgram, act: Callable[..., None], *arguments: Any) -> None:
        """A program says something to the daemon, and the twin gets the same."""

        def say() -> None:
            self.scene.daemon.post(item)
            self.scene.daemon.cycle()

        self.compare(say, lambda: act(*arguments))

    def do(self, step: tuple[Any, ...]) -> None:
        """One step."""
        caller, server, twin = self.caller.program, self.server.program, self.twin.executor
        kind, *arguments = step
        calls, goals = self.calls[::-1], self.goals[::-1]
        match kind:
            case "way":
                self.both(MessageReceived(server, "/way", arguments[0]), twin.receive, "/way", arguments[0])
            case "move":
                message = {"linear": {"x": arguments[0]}}
                self.both(MessageRequested(caller, "/cmd_vel", message), twin.on_request, "/cmd_vel", message)
            case "call":
                self.asked += 1
                own = str(self.asked)
                self.both(CallRequested(caller, "think", own, "?"), twin.on_call, "think", (caller, own), "?")
            case "goal":
                self.asked += 1
                own = str(self.asked)
                self.both(GoalRequested(caller, "face", own, 1.5), twin.on_goal, "face", (caller, own), 1.5)
            case "cancel":
                own = str(arguments[0])
                self.both(CancelRequested(caller, "face", own), twin.on_cancel, "face", (caller, own))
            case "reply" if arguments[0] < len(calls):
                number, other = calls[arguments[0]]
                self.both(Replied(server, number, True), twin.on_reply, other, True)
            case "fail" if arguments[0] < len(calls):
                number, other = calls[arguments[0]]
                self.both(CallFailed(server, number, "no"), twin.on_call_failed, other, "no")
            case "accept" if arguments[0] < len(goals):
                number, other = goals[arguments[0]]
                self.both(GoalAccepted(server, number), twin.on_goal_accepted, other)
            case "feedback" if arguments[0] < len(goals):
                number, other = goals[arguments[0]]
                self.both(FeedbackGiven(server, number, 0.5), twin.on_feedback, other, 0.5)
            case "end" if arguments[0] < len(goals):
                number, other = goals[arguments[0]]
                self.both(GoalEnded(server, number, arguments[1], None), twin.on_goal_ended, other, arguments[1], None)


def _caller_side(program: Program, item: Any) -> tuple[Any, ...] | None:
    """Return the message to the daemon's caller in the words of the twin; None: the twin has none for it."""

    def key(own: str) -> tuple[Program, str]:
        return (program, own)

    match item:
        case PassedOn(identifier=identifier, data=data):
            return ("pass", identifier, data)
        case Blocked(identifier=identifier):
            return ("blocked", identifier)
        case Answered(call_id=own, is_default=True):
            return ("no answer", "think", key(own))
        case Answered(call_id=own, data=data):
            return ("answer", "think", key(own), data)
        case GoalTaken(goal_id=own):
            return ("accept", "face", key(own))
        case GoalRejected(goal_id=own):
            return ("reject", "face", key(own))
        case FeedbackPassed(goal_id=own, data=data):
            return ("feedback", "face", key(own), data)
        case GoalOver(goal_id=own, outcome=outcome, data=data):
            return ("end", "face", key(own), outcome, data)
    return None


STEPS = st.one_of(
    st.tuples(st.just("way"), st.booleans()),
    st.tuples(st.just("way"), st.just(True)),
    st.tuples(st.just("move"), st.sampled_from([0.0, 0.1, float("nan")])),
    st.tuples(st.just("call")),
    st.tuples(st.just("goal")),
    st.tuples(st.just("cancel"), st.integers(1, 8)),
    st.tuples(st.just("reply"), st.integers(0, 2)),
    st.tuples(st.just("fail"), st.integers(0, 2)),
    st.tuples(st.just("accept"), st.integers(0, 1)),
    st.tuples(st.just("feedback"), st.integers(0, 1)),
    st.tuples(st.just("end"), st.integers(0, 1), st.sampled_from(["succeeded", "aborted", "cancelled", "rejected"])),
)


@settings(max_examples=examples(60))
@given(st.lists(st.tuples(st.sampled_from([0.021, 0.021, 0.33]), STEPS), max_size=25))
def test_the_layer_in_the_daemon_is_the_layer_by_itself(steps: list[tuple[float, tuple[Any, ...]]]) -> None:
    twins = Twins()
    for seconds, step in steps:
        twins.wait(seconds)
        twins.do(step)
    assert twins.scene.daemon.state is State.RUNNING
