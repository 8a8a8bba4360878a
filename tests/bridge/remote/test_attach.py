"""Programs of the model and operators of a layer, over real sockets."""

import asyncio
import itertools
import math
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import grpc
import pytest

from robosc_api.v1 import bridge_pb2 as pb
from robosc_bridge.daemon.programs import items as programs
from robosc_bridge.remote import RemoteEndpoint, RemoteSettings, service, session
from robosc_bridge.remote import endpoint as endpoint_module
from robosc_bridge.remote.data import MAXIMUM_DEPTH, value_of
from robosc_bridge.remote.operator_presence import FLOOD_S, MESSAGES_A_S, FloodError, OperatorPresence
from support.remote import Attachment, FakeDaemon, connected, served
from support.waiting import PATIENCE_S, wait_until


@pytest.fixture
def daemon() -> Any:
    with FakeDaemon(is_layer=True) as made:
        yield made


@pytest.fixture
def endpoint(daemon: FakeDaemon) -> Any:
    with served(daemon, RemoteSettings("127.0.0.1:0", operator_timeout_s=2.5)) as made:
        yield made


def attached(stub: Any, **hello: Any) -> Attachment:
    """A program that has been welcomed."""
    made = Attachment(stub, **{"name": "arm", **hello})
    assert made.receive().HasField("welcome")
    return made


class TestHello:
    def test_the_metadata_come_before_every_message(self, stub: Any) -> None:
        """A call that ends while its first message is being sent can be given a status."""
        is_begun = threading.Event()

        def messages() -> Iterator[Any]:
            assert is_begun.wait(PATIENCE_S)
            yield pb.AttachRequest(hello=pb.Hello(name="arm"))

        call = stub.Attach(messages(), timeout=PATIENCE_S)
        call.initial_metadata()
        is_begun.set()
        assert next(call).HasField("welcome")
        call.cancel()

    def test_a_program_is_there_as_long_as_its_stream(self, daemon: FakeDaemon, stub: Any) -> None:
        program = Attachment(stub, name="arm", serves=["open", "carry"])
        assert program.receive().welcome.operator_timeout_s == 2.5
        known = daemon.program()
        assert known.name.startswith("arm (ipv4:127.0.0.1:")
        assert known.serves == {"open", "carry"}
        assert not known.may_request
        program.end()
        assert list(program.call) == []
        assert wait_until(lambda: daemon.of(programs.Detached))[0].program is known

    @pytest.mark.parametrize(("is_layer", "is_operator"), [(True, True), (True, False), (False, True)])
    def test_only_an_operator_before_a_layer_may_request(self, is_layer: bool, is_operator: bool) -> None:
        with FakeDaemon(is_layer=is_layer) as daemon, served(daemon) as endpoint, connected(endpoint.address) as stub:
            program = attached(stub, is_operator=is_operator)
            assert daemon.program().may_request is (is_layer and is_operator)
            program.end()

    @pytest.mark.parametrize(
        ("hello", "words"),
        [
            ({"name": ""}, "a name of 1 to 100 printable characters"),
            ({"name": "x" * 101}, "a name of 1 to 100 printable characters"),
            ({"name": "a\nb"}, "a name of 1 to 100 printable characters"),
            ({"name": "\x1b[31m"}, "a name of 1 to 100 printable characters"),
            ({"name": "arm", "serves": ["nothing"]}, "'nothing' is not a service or action"),
            ({"name": "arm", "serves": ["order"]}, "'order' is not a service or action"),
            ({"name": "arm", "serves": ["x" * 100_000]}, "is not a service or action"),
            ({"name": "arm", "serves": ["\n"]}, "'?' is not a service or action"),
        ],
    )
    def test_a_hello_that_makes_no_sense(self, hello: Any, words: str, daemon: FakeDaemon, stub: Any) -> None:
        code, details = Attachment(stub, **hello).failure()
        assert code is grpc.StatusCode.INVALID_ARGUMENT
        assert words in details
        assert len(details) < 200
        assert daemon.received == []

    def test_it_is_the_first_message(self, daemon: FakeDaemon, stub: Any) -> None:
        program = Attachment(stub)
        program.send(keep_alive=pb.KeepAlive())
        assert program.failure() == (
            grpc.StatusCode.INVALID_ARGUMENT,
            "the first message must be 'hello', within 5 seconds",
        )
        program = attached(stub)
        program.send(hello=pb.Hello(name="other"))
        assert program.receive().refused.why == "only the first message may be 'hello'"
        program.end()

    def test_it_comes_soon_or_the_place_is_given_to_another(self, stub: Any, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(service, "HELLO_LIMIT_S", 0.05)
        program = Attachment(stub)
        assert program.failure()[0] is grpc.StatusCode.INVALID_ARGUMENT
        program.end()

    def test_programs_are_bounded(self, stub: Any) -> None:
        there = [attached(stub) for _ in range(service.MAXIMUM_PROGRAMS)]
        one_more = Attachment(stub, name="one more")
        assert one_more.failure() == (grpc.StatusCode.RESOURCE_EXHAUSTED, "there are 16 programs already")
        there[0].end()
        assert list(there[0].call) == []
        there[0] = attached(stub)
        for program in [*there, one_more]:
            program.end()


DATA = value_of({"x": 3})
SAID = [
    ({"give": pb.Message(identifier="/order", data=DATA)}, programs.MessageReceived, ("/order", {"x": 3})),
    ({"give": pb.Message(identifier="/order")}, programs.MessageReceived, ("/order", None)),
    ({"reply": pb.NumberedData(number=7, data=DATA)}, programs.Replied, (7, {"x": 3})),
    ({"call_failure": pb.CallFailure(number=7, reason="no")}, programs.CallFailed, (7, "no")),
    ({"goal_acceptance": pb.GoalNumber(number=2**64 - 1)}, programs.GoalAccepted, (2**64 - 1,)),
    ({"feedback": pb.NumberedData(number=7, data=value_of(0.5))}, programs.FeedbackGiven, (7, 0.5)),
    (
        {"goal_end": pb.GoalEnd(number=7, outcome=pb.GOAL_OUTCOME_SUCCEEDED, data=value_of(1.0))},
        programs.GoalEnded,
        (7, "succeeded", 1),
    ),
    (
        {"goal_end": pb.GoalEnd(number=7, outcome=pb.GOAL_OUTCOME_REJECTED)},
        programs.GoalEnded,
        (7, "rejected", None),
    ),
    ({"request": pb.Message(identifier="/cmd_vel", data=DATA)}, programs.MessageRequested, ("/cmd_vel", {"x": 3})),
    ({"call": pb.OwnRequest(name="open", id="a", data=DATA)}, programs.CallRequested, ("open", "a", {"x": 3})),
    ({"goal": pb.OwnRequest(name="carry", id="b")}, programs.GoalRequested, ("carry", "b", None)),
    ({"cancel": pb.OwnCancel(name="carry", id="b")}, programs.CancelRequested, ("carry", "b")),
]

HEARD = [
    (programs.MessageSent("show", "/show", "hi"), "message_sent", {"name": "show", "identifier": "/show"}, "hi"),
    (programs.CallMade("open", 3, 4), "call", {"name": "open", "number": 3}, 4),
    (programs.GoalMade("carry", 5, None), "goal", {"name": "carry", "number": 5}, None),
    (programs.CancelMade("carry", 5), "cancel", {"name": "carry", "number": 5}, None),
    (programs.PassedOn("/scan", {"a": [1]}), "passed_on", {"identifier": "/scan"}, {"a": [1]}),
    (programs.Blocked("/cmd_vel"), "blocked", {"identifier": "/cmd_vel"}, None),
    (programs.Answered("a", True, is_default=False), "answer", {"id": "a", "is_default": False}, True),
    (programs.Answered("a", None, is_default=True), "answer", {"id": "a", "is_default": True}, None),
    (programs.GoalTaken("b"), "goal_taken", {"id": "b"}, None),
    (programs.GoalRejected("b"), "goal_rejected", {"id": "b"}, None),
    (programs.FeedbackPassed("b", 0.5), "goal_feedback", {"id": "b"}, 0.5),
    (programs.GoalOver("b", "aborted", 2), "goal_over", {"id": "b", "outcome": pb.GOAL_OUTCOME_ABORTED}, 2),
    (programs.Refused("who are you?"), "refused", {"why": "who are you?"}, None),
]


class TestTalk:
    @pytest.mark.parametrize(("message", "kind", "parts"), SAID)
    def test_what_a_program_says(self, message: Any, kind: Any, parts: Any, daemon: FakeDaemon, stub: Any) -> None:
        program = attached(stub)
        program.send(**message)
        assert wait_until(lambda: daemon.of(kind)) == [kind(daemon.program(), *parts)]
        program.end()

    @pytest.mark.parametrize(("item", "kind", "fields", "data"), HEARD)
    def test_what_a_program_hears(
        self, item: Any, kind: str, fields: Any, data: Any, daemon: FakeDaemon, stub: Any
    ) -> None:
        program = attached(stub)
        daemon.program().send(item)
        response = program.receive()
        assert response.WhichOneof("message") == kind
        part = getattr(response, kind)
        assert {name: getattr(part, name) for name in fields} == fields
        if hasattr(part, "data"):
            assert part.data == value_of(data)
        program.end()

    def test_not_a_number_goes_through_both_ways(self, daemon: FakeDaemon, stub: Any) -> None:
        program = attached(stub, is_operator=True)
        program.send(request=pb.Message(identifier="/cmd_vel", data=value_of([math.nan, math.inf])))
        data = wait_until(lambda: daemon.of(programs.MessageRequested))[0].data
        assert math.isnan(data[0])
        assert data[1] == math.inf
        daemon.program().send(programs.PassedOn("/scan", [math.nan]))
        assert math.isnan(program.receive().passed_on.data.list_value.values[0].number_value)
        program.end()

    def test_the_order_stays(self, daemon: FakeDaemon, stub: Any) -> None:
        program = attached(stub)
        for number in range(500):
            program.send(give=pb.Message(identifier="/order", data=value_of(number)))
        wait_until(lambda: len(daemon.of(programs.MessageReceived)) == 500)
        assert [item.data for item in daemon.of(programs.MessageReceived)] == list(range(500))
        for number in range(500):
            daemon.program().send(programs.MessageSent("show", "/show", number))
        heard = [program.receive().message_sent.data.number_value for _ in range(500)]
        assert heard == list(range(500))
        program.end()


class TestOperator:
    def test_each_message_is_a_sign_of_life(self, daemon: FakeDaemon, stub: Any) -> None:
        program = attached(stub, is_operator=True)
        wait_until(lambda: daemon.seen == 1)
        program.send(keep_alive=pb.KeepAlive())
        wait_until(lambda: daemon.seen == 2)
        program.send(request=pb.Message(identifier="/cmd_vel"))
        wait_until(lambda: daemon.seen == 3)
        assert wait_until(lambda: daemon.of(programs.MessageRequested))
        program.end()

    def test_one_that_sends_as_fast_as_it_can_is_ended(
        self, daemon: FakeDaemon, stub: Any, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        looks = itertools.count()
        # By its clock, which is looked at for each message, more come than may.
        monkeypatch.setattr(
            session, "OperatorPresence", lambda _: OperatorPresence(lambda: next(looks) / (1.2 * MESSAGES_A_S))
        )
        program = attached(stub, is_operator=True)
        for _ in range(2 * FLOOD_S * MESSAGES_A_S):
            program.send(keep_alive=pb.KeepAlive())

        def turn() -> Any:
            daemon.show()
            return daemon.of(programs.Detached)

        wait_until(turn)
        code, details = program.failure()
        program.end()
        assert code is grpc.StatusCode.RESOURCE_EXHAUSTED
        assert details == "an operator may send at most 200 messages a second; this one sends more"
        assert daemon.seen <= 2 + MESSAGES_A_S

    def test_other_programs_give_none(self, daemon: FakeDaemon, stub: Any) -> None:
        program = attached(stub)
        program.send(keep_alive=pb.KeepAlive())
        program.send(give=pb.Message(identifier="/order"))
        wait_until(lambda: daemon.of(programs.MessageReceived))
        assert daemon.seen == 0
        program.end()


class TestPace:
    def test_what_waited_in_buffers_is_no_sign_of_life(self) -> None:
        now_s = 100.0
        presence = OperatorPresence(lambda: now_s)
        assert sum(presence.message_received() for _ in range(1000)) == MESSAGES_A_S
        now_s += 1.0
        # The rest of what waited, at whatever speed it is read.
        assert not any(presence.message_received() for _ in range(50))
        now_s += 1.0
        assert presence.message_received()

    def test_a_busy_operator_is_seen_with_each_message(self) -> None:
        now_s = 100.0
        presence = OperatorPresence(lambda: now_s)
        for _ in range(1000):
            assert presence.message_received()
            now_s += 0.01

    def test_a_flood_ends_it(self) -> None:
        now_s = 100.0
        presence = OperatorPresence(lambda: now_s)
        for _ in range(FLOOD_S):
            for _ in range(MESSAGES_A_S + 1):
                presence.message_received()
            now_s += 1.0
        with pytest.raises(FloodError):
            presence.message_received()


def nested(levels: int) -> Any:
    value = value_of(1)
    for _ in range(levels):
        outer = value_of([])
        outer.list_value.values.append(value)
        value = outer
    return value


def part(number: int, content: bytes) -> bytes:
    """A field of a protobuf message, by hand."""
    length, size = bytearray(), len(content)
    while size > 127:
        length.append(size & 127 | 128)
        size >>= 7
    return bytes([number << 3 | 2, *length, size]) + content


class TestHostilePrograms:
    @pytest.mark.parametrize(
        ("message", "why"),
        [
            ({}, "a message without a kind"),
            ({"give": pb.Message(identifier="/order", data=nested(MAXIMUM_DEPTH + 1))}, "nested deeper than"),
            ({"give": pb.Message(identifier="/order", data=value_of([None] * 30_000))}, "more than 20000 values"),
            ({"give": pb.Message(identifier="/order", data=value_of({"x" * 300: 1}))}, "a name of more than"),
            ({"give": pb.Message(identifier="x" * 2000)}, "more than 1000 characters"),
            ({"call": pb.OwnRequest(name="open", id="x" * 2000)}, "more than 1000 characters"),
            ({"call_failure": pb.CallFailure(number=1, reason="x" * 2000)}, "more than 1000 characters"),
            ({"goal_end": pb.GoalEnd(number=1)}, "there is no outcome of number 0"),
            ({"goal_end": pb.GoalEnd(number=1, outcome=99)}, "there is no outcome of number 99"),  # type: ignore[arg-type]
        ],
    )
    def test_what_makes_no_sense_is_refused_and_changes_nothing(
        self, message: Any, why: str, daemon: FakeDaemon, stub: Any
    ) -> None:
        program = attached(stub)
        program.send(**message)
        assert why in program.receive().refused.why
        program.send(give=pb.Message(identifier="/order"))
        assert len(wait_until(lambda: daemon.of(programs.MessageReceived))) == 1
        program.end()

    def test_nesting_beyond_what_protobuf_reads_ends_the_stream(
        self, daemon: FakeDaemon, endpoint: RemoteEndpoint
    ) -> None:
        hello = pb.AttachRequest(hello=pb.Hello(name="arm")).SerializeToString()
        data = b""
        for _ in range(500):
            # A Value with a ListValue with one Value.
            data = part(6, part(1, data))
        messages = [hello, part(3, part(2, data))]
        channel: Any
        with grpc.insecure_channel(endpoint.address) as channel:
            call = channel.stream_stream("/robosc_api.v1.BridgeService/Attach")(iter(messages), timeout=PATIENCE_S)
            with pytest.raises(grpc.RpcError) as caught:
                list(call)
        assert caught.value.code() is grpc.StatusCode.INVALID_ARGUMENT
        assert wait_until(lambda: daemon.of(programs.Detached))
        assert not daemon.of(programs.MessageReceived)

    def test_a_program_that_vanishes_is_gone_for_the_loop(self, daemon: FakeDaemon, endpoint: RemoteEndpoint) -> None:
        with connected(endpoint.address) as stub:
            attached(stub, serves=["open"])
            daemon.program()
        # Its connection is closed, without a word.
        assert wait_until(lambda: daemon.of(programs.Detached))[0].program is daemon.program()
        # Later messages of the loop go nowhere.
        daemon.program().send(programs.CallMade("open", 1, None))

    def test_a_program_that_hangs_with_its_whole_machine_is_taken_for_gone(
        self, daemon: FakeDaemon, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        assert endpoint_module.PING_S + endpoint_module.PING_LIMIT_S <= 8.0
        monkeypatch.setattr(endpoint_module, "PING_S", 0.05)
        # One that is slow is taken for gone as well as one that hangs, and comes again.
        monkeypatch.setattr(endpoint_module, "PING_LIMIT_S", 0.5)
        text = (
            "import contextlib, sys; from support.remote import *\n"
            "while True:\n"
            "    with contextlib.suppress(grpc.RpcError), connected(sys.argv[1]) as stub:\n"
            "        program = Attachment(stub, name='far away')\n"
            "        program.receive(); program.receive()\n"
        )
        with served(daemon) as endpoint:
            environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
            process = subprocess.Popen([sys.executable, "-c", text, endpoint.address], env=environment)
            try:
                daemon.program()
                process.send_signal(signal.SIGSTOP)
                assert wait_until(lambda: daemon.of(programs.Detached))
            finally:
                process.kill()
                process.wait()

    def test_a_program_that_floods_is_held_back_at_its_end(self, daemon: FakeDaemon, stub: Any) -> None:
        program = attached(stub)
        daemon.program()
        daemon.turns = False
        for number in range(5000):
            program.send(give=pb.Message(identifier="/order", data=value_of(number)))
        wait_until(lambda: daemon.waiting >= session.MESSAGES_PER_CYCLE - 1)
        time.sleep(0.2)
        # The loop's thread has taken one more, and shown nothing since.
        assert daemon.waiting <= session.MESSAGES_PER_CYCLE + 1
        stub.Stop(pb.StopRequest(), timeout=PATIENCE_S)
        assert daemon.orders
        daemon.turns = True
        wait_until(lambda: len(daemon.of(programs.MessageReceived)) == 5000)
        program.end()

    @pytest.mark.parametrize("size", [200, 20_000])
    def test_a_program_that_does_not_read_is_ended_with_a_clear_status(
        self, size: int, daemon: FakeDaemon, stub: Any
    ) -> None:
        program = attached(stub, serves=["open"])
        known = daemon.program()
        data = "x" * size
        end_s = time.monotonic() + PATIENCE_S
        while not daemon.of(programs.Detached):
            known.send(programs.PassedOn("/scan", data))
            assert time.monotonic() < end_s
        code, details = program.failure()
        assert code is grpc.StatusCode.RESOURCE_EXHAUSTED
        assert details == "more than 1000 messages or 4 MB wait for this program to read them"
        program.end()

    def test_memory_of_what_waits_for_a_program_is_bounded(self, daemon: FakeDaemon) -> None:
        waiting: list[session.ProgramSession] = []

        async def fill(data: list[float], times: int) -> int:
            made = session.ProgramSession(daemon.operations, pb.Hello(name="arm"), "arm", None)
            waiting.append(made)
            for _ in range(times):
                made._send(programs.PassedOn("/scan", list(data)))
            return len(made._waiting)

        large = [float(number) for number in range(10_000)]
        # 24 bytes a number, 8 for its place.
        assert asyncio.run(fill(large, 30)) == session.MAXIMUM_WAITING_BYTES // 320_056
        assert asyncio.run(fill(large * 20, 2)) == 1
        assert asyncio.run(fill([], 2000)) == session.MAXIMUM_WAITING

    def test_what_has_been_read_weighs_nothing(self, daemon: FakeDaemon, stub: Any) -> None:
        program = attached(stub)
        large = [0.5] * 10_000
        for _ in range(3 * session.MAXIMUM_WAITING_BYTES // 320_056):
            daemon.program().send(programs.PassedOn("/scan", list(large)))
            assert len(program.receive().passed_on.data.list_value.values) == 10_000
        program.end()

    def test_a_program_that_floods_with_large_messages_is_held_back_at_its_end(
        self, daemon: FakeDaemon, stub: Any
    ) -> None:
        program = attached(stub)
        daemon.program()
        daemon.turns = False
        data = value_of("x" * 50_000)
        for _ in range(12):
            program.send(give=pb.Message(identifier="/order", data=data))
        # The third goes beyond the limit; the loop's thread may have taken one.
        wait_until(lambda: daemon.waiting >= 2)
        time.sleep(0.2)
        assert daemon.waiting <= 3
        daemon.turns = True
        wait_until(lambda: len(daemon.of(programs.MessageReceived)) == 12)
        program.end()

    def test_the_end_of_the_bridge_is_reported(self, daemon: FakeDaemon, monkeypatch: pytest.MonkeyPatch) -> None:
        # However long a busy machine takes for it.
        monkeypatch.setattr(endpoint_module, "_GRACE_S", PATIENCE_S)
        with served(daemon) as endpoint, connected(endpoint.address) as stub:
            program = attached(stub)
            endpoint.stop()
            assert program.failure() == (grpc.StatusCode.UNAVAILABLE, "the bridge ends")
            assert wait_until(lambda: daemon.of(programs.Detached))
            program.end()
