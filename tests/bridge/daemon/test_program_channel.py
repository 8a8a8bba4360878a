"""The channel `grpc`: what the model and connected programs send each other, and what makes no sense."""

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc_bridge.daemon.programs.inbox import MAXIMUM_WAITING
from robosc_bridge.daemon.programs.items import (
    Attached,
    CallFailed,
    CallMade,
    CancelMade,
    FeedbackGiven,
    GoalAccepted,
    GoalEnded,
    GoalMade,
    MessageReceived,
    MessageRequested,
    MessageSent,
    Refused,
    Replied,
)
from robosc_bridge.daemon.states import OperatorCommand, State
from support.daemons import Connected, Scene
from support.effort import examples

MODEL = """
robot Helped {
    interface trigger use Ask from own_srvs
    interface fetching use Fetch from kitchen_msgs
    datatype object Place { x: double name: string }
    datatype object Far { left: integer }
    component World {
        outgoing message go with identifier: "/go", type: integer(0..9)
        incoming message note with identifier: "/note", type: string
        service ask with identifier: "/ask", request: none, response: boolean links trigger
        action fetch with identifier: "/fetch", request: Place, response: boolean, feedback: Far links fetching
        behaviour {
            variable wanted: integer(0..9) = 0
            variable left: integer
            variable answer: boolean
            on response from go do wanted := value
            on response from ask do answer := value
            on feedback from fetch do left := value.left
            initial marked state only { }
        }
    }
    component Flow {
        behaviour {
            initial marked state calm {
                on response from ask goto asked
                on error from ask goto failed
                on response from fetch goto fetched
                on error from fetch goto failed
            }
            marked state asked { on response from go goto calm }
            marked state fetched { on response from go goto calm }
            marked state failed { on response from go goto calm }
        }
    }
    requirement note needs World.wanted = 1 and Flow.calm
    requirement ask needs World.wanted = 2 and Flow.calm
    requirement fetch needs World.wanted = 3 and Flow.calm
    provide note with "here"
    provide fetch with { x: 1.5, name: "cup" }
}
"""
CONFIGURATION = """
robot: burger
drive: {driver: opencr, port: /dev/base}
scanner: {driver: lds01, port: /dev/scanner}
execution: {period_s: 0.02, service_timeout_s: 1.0}
remote: {grpc_address: "127.0.0.1:0"}
channels: {/go: {channel: grpc}, /note: {channel: grpc}, /ask: {channel: grpc}, /fetch: {channel: grpc}}
"""
OTHER_NUMBER = 2**63


def helped() -> Scene:
    scene = Scene(text=CONFIGURATION, model=MODEL, stays=True)
    scene.up()
    return scene


def state(scene: Scene) -> str:
    shown = scene.feed.snapshot
    assert shown is not None
    return str(shown.components["Flow"]["state"])


def variable(scene: Scene, name: str) -> Any:
    shown = scene.feed.snapshot
    assert shown is not None
    return shown.components["World"]["variables"][name]


def why(messages: list[Any]) -> list[str]:
    return [item.why for item in messages if isinstance(item, Refused)]


def test_messages_go_both_ways_and_reach_every_program() -> None:
    scene = helped()
    first, second = Connected(scene, "first"), Connected(scene, "second")
    first.say(MessageReceived, "/go", 1)
    scene.live(0.05, 2.0)
    assert variable(scene, "wanted") == 1
    assert first.of(MessageSent)[0] == second.of(MessageSent)[0] == MessageSent("note", "/note", "here")


@pytest.mark.parametrize("identifier", ["/note", "/ask", "/nowhere", "", "x" * 100_000])
def test_a_message_where_the_model_hears_nothing_is_refused(identifier: str) -> None:
    scene = helped()
    program = Connected(scene, "a program")
    assert why(program.say(MessageReceived, identifier, 1)) == [
        f"the model hears nothing on '{identifier[:255]}' from programs"
    ]


def called(scene: Scene) -> tuple[Connected, CallMade]:
    server = Connected(scene, "server", ("ask", "fetch"))
    server.say(MessageReceived, "/go", 2)
    scene.live(0.05, 2.0)
    (call,) = server.of(CallMade)
    return server, call


def test_a_call_is_answered_by_the_program_that_serves_it() -> None:
    scene = helped()
    server, call = called(scene)
    assert (call.name, call.data) == ("ask", None)
    assert why(server.say(Replied, call.number, True)) == []
    assert (state(scene), variable(scene, "answer")) == ("asked", True)
    # Once only.
    assert why(server.say(Replied, call.number, True)) == [
        f"{call.number} is not a call that this program has been asked for"
    ]


def test_a_call_that_fails_is_an_error() -> None:
    scene = helped()
    server, call = called(scene)
    server.say(CallFailed, call.number, "no\nidea")
    assert state(scene) == "failed"


def test_a_call_that_nobody_serves_fails_at_once() -> None:
    scene = helped()
    program = Connected(scene, "a program", ("fetch",))
    program.say(MessageReceived, "/go", 2)
    scene.live(0.05, 2.0)
    assert state(scene) == "failed"
    assert program.of(CallMade) == []


def test_an_answer_that_comes_after_the_time_for_it_means_nothing() -> None:
    scene = helped()
    server, call = called(scene)
    scene.live(1.2, 2.0)
    assert state(scene) == "failed"
    server.say(Replied, call.number, True)
    assert state(scene) == "failed"
    # Asked again: the old number is none any more.
    server.say(MessageReceived, "/go", 2)
    scene.live(0.1, 2.0)
    (again,) = server.of(CallMade)
    assert again.number != call.number
    assert len(why(server.say(Replied, call.number, True))) == 1
    server.say(Replied, again.number, True)
    assert state(scene) == "asked"


def test_a_server_that_never_answers_makes_nothing_grow() -> None:
    scene = helped()
    server, _ = called(scene)
    for _ in range(5):
        scene.live(1.2, 2.0)
        server.say(MessageReceived, "/go", 2)
        scene.live(0.1, 2.0)
    assert len(server.of(CallMade)) == 1
    assert len(scene.daemon._programs._program_channel._open) == 1


@pytest.mark.parametrize("make", [Replied, CallFailed])
def test_only_who_is_asked_may_answer(make: Any) -> None:
    scene = helped()
    _, call = called(scene)
    other = Connected(scene, "another")
    assert len(why(other.say(make, call.number, ""))) == 1
    assert state(scene) == "calm"


def fetching(scene: Scene) -> tuple[Connected, GoalMade]:
    server = Connected(scene, "server", ("ask", "fetch"))
    server.say(MessageReceived, "/go", 3)
    scene.live(0.05, 2.0)
    (goal,) = server.of(GoalMade)
    return server, goal


def test_a_goal_is_accepted_reported_on_and_ended() -> None:
    scene = helped()
    server, goal = fetching(scene)
    assert (goal.name, goal.data) == ("fetch", {"x": 1.5, "name": "cup"})
    server.say(GoalAccepted, goal.number)
    server.say(FeedbackGiven, goal.number, {"left": 4})
    assert variable(scene, "left") == 4
    server.say(GoalEnded, goal.number, "succeeded", True)
    assert state(scene) == "fetched"
    assert len(why(server.say(FeedbackGiven, goal.number, {"left": 3}))) == 1
    assert variable(scene, "left") == 4


def test_a_goal_that_was_given_up_unaccepted_is_cancelled_before_the_next_one() -> None:
    scene = helped()
    server, goal = fetching(scene)
    channel = scene.daemon._robot._program_channel
    assert channel.send_goal(channel._services["fetch"], 99, {"x": 2.0, "name": "pan"})
    scene.live(0.05, 2.0)
    assert server.of(CancelMade) == [CancelMade("fetch", goal.number)]
    # It may have begun all the same; its acceptance is that of nothing.
    assert len(why(server.say(GoalAccepted, goal.number))) == 1


@pytest.mark.parametrize("outcome", ["aborted", "cancelled", "rejected"])
def test_a_goal_that_does_not_succeed_is_an_error(outcome: str) -> None:
    scene = helped()
    server, goal = fetching(scene)
    server.say(GoalEnded, goal.number, outcome, None)
    assert state(scene) == "failed"


@pytest.mark.parametrize("outcome", ["lost", "", "done", 7, None])
def test_a_goal_ends_only_as_goals_do(outcome: Any) -> None:
    scene = helped()
    server, goal = fetching(scene)
    assert len(why(server.say(GoalEnded, goal.number, outcome, None))) == 1
    assert state(scene) == "calm"
    server.say(GoalEnded, goal.number, "succeeded", True)
    assert state(scene) == "fetched"


def test_a_goal_whose_requirement_turns_false_is_cancelled() -> None:
    scene = helped()
    server, goal = fetching(scene)
    server.say(GoalAccepted, goal.number)
    server.say(MessageReceived, "/go", 0)
    assert server.of(CancelMade) == [CancelMade("fetch", goal.number)]
    server.say(GoalEnded, goal.number, "cancelled", None)
    assert scene.daemon.state is State.RUNNING


@pytest.mark.parametrize("start", [called, fetching])
def test_what_a_program_was_asked_for_fails_when_it_is_gone(start: Any) -> None:
    scene = helped()
    server, asked = start(scene)
    server.leave()
    assert state(scene) == "failed"
    # Later messages of it belong to no request.
    server.say(Replied, asked.number, True)
    server.say(MessageReceived, "/go", 0)
    assert (len(server.received), variable(scene, "wanted")) == (0, 2 if start is called else 3)


def test_what_is_served_already_is_not_served_by_another() -> None:
    scene = helped()
    first = Connected(scene, "first", ("ask",))
    second = Connected(scene, "second", ("ask", "fetch", "note", "nothing"))
    assert sorted(why(second.cycle())) == [
        "'ask' is served by first already",
        "'note' is not a service or action of the model that is mapped to grpc",
        "'nothing' is not a service or action of the model that is mapped to grpc",
    ]
    first.leave()
    third = Connected(scene, "third", ("ask",))
    assert why(third.cycle()) == []


def test_a_run_that_ends_takes_its_numbers_with_it() -> None:
    scene = helped()
    server, goal = fetching(scene)
    scene.daemon.post(OperatorCommand.STANDBY)
    server.received.clear()
    scene.live(0.3, 2.0)
    # It had not been accepted: the program learns all the same that it is not wanted any more.
    assert server.of(CancelMade) == [CancelMade("fetch", goal.number)]
    # Its end is awaited before the next run, to which it does not belong.
    assert why(server.say(GoalAccepted, goal.number)) == []
    assert why(server.say(GoalEnded, goal.number, "cancelled", None)) == []
    scene.daemon.post(OperatorCommand.START)
    scene.live(0.1, 2.0)
    server.say(MessageReceived, "/go", 3)
    scene.live(0.1, 2.0)
    (again,) = server.of(GoalMade)
    assert again.number != goal.number
    assert len(why(server.say(GoalEnded, goal.number, "succeeded", True))) == 1
    assert state(scene) == "calm"


def test_in_standby_nobody_listens_and_nothing_is_late() -> None:
    scene = Scene(text=CONFIGURATION, model=MODEL, starts_itself=False)
    scene.up()
    program = Connected(scene, "a program", ("ask",))
    assert program.say(MessageReceived, "/go", 1) == []
    assert len(why(program.say(Replied, 1, True))) == 1


def test_a_controller_lets_nobody_ask() -> None:
    scene = helped()
    program = Connected(scene, "a program")
    assert why(program.say(MessageRequested, "/note", "x")) == [
        "the supervisor is a controller, which takes no requests"
    ]


def test_a_program_that_raises_harms_nobody() -> None:
    scene = helped()

    def hostile(item: object) -> None:
        raise RuntimeError(str(item))

    other = Connected(scene, "another", ("fetch",))
    hostile_program = Connected(scene, "hostile", ("ask",))
    object.__setattr__(hostile_program.program, "tell", hostile)
    other.say(MessageReceived, "/go", 1)
    scene.live(0.1, 2.0)
    assert other.of(MessageSent)
    other.say(MessageReceived, "/go", 2)
    scene.live(0.1, 2.0)
    assert scene.daemon.state is State.RUNNING


DEEP: Any = []
for _ in range(100):
    DEEP = [DEEP]


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (DEEP, "the data is nested more than 20 deep"),
        ([0] * 20_000, "the data has more than 20000 parts"),
        ({"x": "y" * 65_537}, "the data has a text of more than 65536 characters"),
        ({"x" * 65_537: 1}, "the data has a name that is not a text of at most 65536 characters"),
        ({1: 1}, "the data has a name that is not a text of at most 65536 characters"),
        (1 << 64, "the data has a number of more than 64 bits"),
        (b"bytes", "the data is not plain"),
        (object(), "the data is not plain"),
        ({"x": (1, 2)}, "the data is not plain"),
    ],
)
def test_data_that_is_not_plain_or_too_large_is_refused(data: Any, reason: str) -> None:
    scene = helped()
    program = Connected(scene, "a program")
    assert why(program.say(MessageReceived, "/go", data)) == [reason]
    assert variable(scene, "wanted") == 0


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["x", "name", "left", "data", "linear"]), inner, max_size=3)
    ),
    max_leaves=6,
)
NUMBERS = st.integers(-1, 5) | st.just(OTHER_NUMBER)
SAYINGS = st.one_of(
    st.tuples(st.just(MessageReceived), st.sampled_from(["/go", "/note", "/ask", "/x"]), PLAIN),
    st.tuples(st.just(MessageReceived), st.just("/go"), st.integers(0, 4)),
    st.tuples(st.just(Replied), NUMBERS, PLAIN),
    st.tuples(st.just(CallFailed), NUMBERS, st.text(max_size=5)),
    st.tuples(st.just(GoalAccepted), NUMBERS),
    st.tuples(st.just(FeedbackGiven), NUMBERS, PLAIN),
    st.tuples(st.just(GoalEnded), NUMBERS, st.sampled_from(["succeeded", "aborted", "x"]), PLAIN),
)


@settings(max_examples=examples(25))
@given(st.lists(st.tuples(st.booleans(), SAYINGS), max_size=20))
def test_whatever_programs_say_the_bridge_goes_on(sayings: list[tuple[bool, tuple[Any, ...]]]) -> None:
    scene = helped()
    programs = [Connected(scene, "server", ("ask", "fetch")), Connected(scene, "other")]
    scene.live(0.1, 2.0)
    for is_first, (make, *arguments) in sayings:
        programs[not is_first].say(make, *arguments)
        scene.live(0.04, 2.0)
        assert scene.daemon.state is State.RUNNING
        shown = scene.feed.snapshot
        assert shown is not None
        assert shown.stops == ()
        assert 0 <= variable(scene, "wanted") <= 9


def test_who_sends_too_much_loses_it_and_learns_it_and_others_are_not_held_up() -> None:
    scene = helped()
    loud, quiet = Connected(scene, "loud"), Connected(scene, "quiet")
    scene.daemon.cycle()
    for _ in range(MAXIMUM_WAITING + 30):
        scene.daemon.post(MessageReceived(loud.program, "/go", 4))
    quiet.say(MessageReceived, "/go", 5)
    # Taken up in the first rotation, though hundreds came before it.
    assert variable(scene, "wanted") in (4, 5)
    heard = [entry["data"] for entry in scene.log.entries if entry.get("event") == "go.response"]
    assert {"value": 5} in heard
    assert len(heard) < 60
    for _ in range(10):
        scene.daemon.cycle()
    assert why(loud.received) == ["this program sends too much at once: 30 of it were not looked at"]
    assert why(quiet.received) == []
    loud.say(MessageReceived, "/go", 7)
    assert variable(scene, "wanted") == 7


def test_a_number_that_is_none_reaches_no_model() -> None:
    scene = helped()
    program = Connected(scene, "a program")
    program.say(MessageReceived, "/go", math.nan)
    program.say(MessageReceived, "/go", True)
    program.say(MessageReceived, "/go", "3")
    assert (variable(scene, "wanted"), scene.daemon.state) == (0, State.RUNNING)


def test_a_program_that_comes_twice_is_one() -> None:
    scene = helped()
    program = Connected(scene, "a program")
    program.cycle()
    scene.daemon.post(Attached(program.program))
    assert why(program.cycle()) == ["this program is there already"]


def test_data_that_lacks_what_every_message_has_is_refused_and_nothing_happens() -> None:
    scene = helped()
    program = Connected(scene, "program")
    for data, words in ((None, "value is missing"), ("1", "value is '1', and must be an integer"), ({}, "value is {}")):
        program.say(MessageReceived, "/go", data)
        scene.live(0.05, 2.0)
        assert words in why(program.of(Refused))[-1]
    assert variable(scene, "wanted") == 0
    assert state(scene) == "calm"
