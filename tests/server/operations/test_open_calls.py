"""Tests of the limit on open calls, with real calls: silent ones, watches, answers that are not read."""

import gc
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import grpc
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc

from robosc_api.calls import begin_call
from robosc_api.connection_ledger import CallsSince
from robosc_api.connection_watch import Arrivals
from robosc_api.failures import reason_of
from robosc_api.request_timeouts import RequestTimeouts
from robosc_api.security import Quota, Scope, make_token
from robosc_api.v1 import jobs_pb2, jobs_pb2_grpc, synthesis_pb2_grpc
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server import application
from robosc_server.operations.interceptor import CallInterceptor
from robosc_server.operations.metrics import Metrics
from robosc_server.operations.open_calls import HEALTH_CALLS, HEALTH_CALLS_PER_CALLER, CallLimits, OpenCalls
from robosc_server.tasks.task import Reason, RefusedError
from support.job_workers import StartedWorkers
from support.service import served
from support.small_server import answer, call, small_server
from support.strangers import Stranger, strangers
from support.waiting import PATIENCE_S, eventually

STUB: Any = synthesis_pb2_grpc.SynthesisServiceStub
JOBS: Any = jobs_pb2_grpc.JobServiceStub
GET_VERSION = "/robosc_api.v1.SynthesisService/GetVersion"
HEALTH = "/grpc.health.v1.Health/Check"
INITIAL_WINDOW = 4


@contextmanager
def looked_into(**settings: Any) -> Iterator[tuple[str, Callable[[], bool]]]:
    """Run a server that waits for requests as long as a test takes.

    Yields:
        Its address, and a function that returns True once no call is open there: a server sees the end of a call, and
        of a connection, only after its caller.
    """
    made: list[OpenCalls] = []

    def noted(*arguments: Any, **more: Any) -> OpenCalls:
        made.append(OpenCalls(*arguments, **more))
        return made[0]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(application, "OpenCalls", noted)
        server = served(given_workers=StartedWorkers(), request_seconds=600.0, **settings)
        with server as address:
            patch.undo()
            yield address, lambda: eventually(lambda: made[0].count == 0)


@pytest.fixture(scope="module")
def shared() -> Iterator[tuple[str, Callable[[], bool]]]:
    """A server with few places."""
    with looked_into(open_calls=6, open_calls_per_caller=4) as server:
        yield server


@pytest.fixture
def all_are_free(shared: tuple[str, Callable[[], bool]]) -> Callable[[], bool]:
    """A function that returns True once all places of that server are free."""
    return shared[1]


@pytest.fixture
def small(shared: tuple[str, Callable[[], bool]], all_are_free: Callable[[], bool]) -> str:
    """The address of that server, whose places are free whatever other tests took."""
    assert all_are_free()
    return shared[0]


def version(address: str, **more: Any) -> Any:
    with grpc.insecure_channel(address) as channel:
        stub = STUB(channel)
        return stub.GetVersion(pb.GetVersionRequest(), timeout=PATIENCE_S, **more)


def is_answered(address: str, **more: Any) -> bool:
    try:
        version(address, **more)
    except grpc.RpcError:
        return False
    return True


def refusal(address: str, **more: Any) -> tuple[str, str]:
    """Reason and words of a call that must be refused, and may be worth another try."""
    with pytest.raises(grpc.RpcError) as caught:
        version(address, **more)
    error: Any = caught.value
    assert error.code() is grpc.StatusCode.RESOURCE_EXHAUSTED
    assert float(dict(error.trailing_metadata())["retry-after"]) > 0
    return reason_of(error.trailing_metadata()), error.details()


def health(address: str) -> Any:
    with grpc.insecure_channel(address) as channel:
        return health_pb2_grpc.HealthStub(channel).Check(health_pb2.HealthCheckRequest(), timeout=PATIENCE_S)


def hold(stranger: Stranger, count: int, path: str = GET_VERSION, metadata: dict[str, str] | None = None) -> None:
    """Begin calls without a request."""
    for number in range(count):
        stranger.call(2 * number + 1, path, metadata)


def test_a_caller_has_its_places_and_no_more(small: str, all_are_free: Callable[[], bool]) -> None:
    with strangers(small, 2, source="127.0.0.2") as (first, second):
        hold(first, 4)
        hold(second, 3)
        assert eventually(lambda: first.ended + second.ended == 3)
        assert any(each.has_received(b"limit of 4 open calls") for each in (first, second))
        # Another one, by its address.
        assert is_answered(small)
    assert all_are_free()
    with strangers(small, 1) as (ours,):
        # One more than there are places for: when it is refused, the others have theirs.
        hold(ours, 5)
        assert eventually(lambda: ours.ended == 1)
        words = "the caller has reached its limit of 4 open calls, watches included; try again later"
        assert refusal(small) == ("QUOTA_EXCEEDED", words)
        assert health(small)
    assert eventually(lambda: is_answered(small))


def test_all_places_are_bounded_and_health_is_answered_all_the_same(small: str) -> None:
    with strangers(small, 1, source="127.0.0.2") as (one,), strangers(small, 1, source="127.0.0.3") as (other,):
        hold(one, 4)
        hold(other, 3)
        assert eventually(lambda: one.ended + other.ended == 1)
        assert not is_answered(small)
        assert refusal(small)[0] == "SERVER_BUSY"
        assert health(small)
    assert eventually(lambda: is_answered(small))


def test_health_has_places_for_each_host(small: str) -> None:
    with strangers(small, 1, source="127.0.0.2") as (stranger,):
        hold(stranger, HEALTH_CALLS_PER_CALLER + 1, HEALTH)
        assert eventually(lambda: stranger.ended == 1)
        assert health(small)
        assert is_answered(small)


class Call:
    """Context of a call, which ends with its test."""

    def __init__(self, host: str) -> None:
        self._host = host

    def peer(self) -> str:
        return f"ipv6:[{self._host}]:1"

    def auth_context(self) -> dict[str, object]:
        return {}


def begin(handler: Any, context: Call) -> None:
    """Begin a call of a handler."""
    begin_call()
    handler.unary_unary(None, context)


@pytest.mark.parametrize("limits", [CallLimits(9, 1), CallLimits(1, 9)], ids=["of the caller", "of the server"])
async def test_refused_calls_explain_the_bytes_of_their_connection_and_health_checks_do_not(limits: CallLimits) -> None:
    arrivals = Arrivals()
    calls = OpenCalls(limits, health=limits, arrivals=arrivals)
    handler: Any = grpc.unary_unary_rpc_method_handler(lambda request, context: None)
    for method in (GET_VERSION, HEALTH):
        layered = calls.wrap(handler, method)
        begin(layered, Call("2001:db8::1"))
        for _ in range(3):
            with pytest.raises(RefusedError):
                begin(layered, Call("2001:db8::1"))
    peer = "ipv6:[2001:db8::1]:1"
    assert arrivals.take() == CallsSince(ended={peer: 3}, open={peer: 2})


async def test_nobody_from_elsewhere_takes_the_places_of_this_machines_health_checks() -> None:
    calls = OpenCalls(CallLimits(1, 1), health=CallLimits(3, 1))
    layered = calls.wrap(grpc.unary_unary_rpc_method_handler(lambda request, context: None), HEALTH)
    # One machine with many addresses of its network, then others.
    begin(layered, Call("2001:db8::1"))
    with pytest.raises(RefusedError) as refused:
        begin(layered, Call("2001:db8::2"))
    assert refused.value.reason is Reason.QUOTA_EXCEEDED
    for number in range(1, 3):
        begin(layered, Call(f"2001:db8:{number}::"))
    with pytest.raises(RefusedError) as refused:
        begin(layered, Call("2001:db8:9::"))
    assert refused.value.reason is Reason.SERVER_BUSY
    begin(layered, Call("::1"))


def test_calls_that_a_server_refuses_are_bounded_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(application, "_REFUSED_CALLS", -2 * HEALTH_CALLS)
    with looked_into(open_calls=3, open_calls_per_caller=3) as (address, all_are_free):
        with strangers(address, 1) as (one,):
            # One more than there are places for: when it is refused, the others have theirs.
            hold(one, 4)
            assert eventually(lambda: one.ended == 1)
            words = "the server has too many calls to refuse; try again later"
            assert refusal(address) == ("SERVER_BUSY", words)
        assert all_are_free()
        assert is_answered(address)


def test_calls_that_are_over_give_their_places_back(small: str, all_are_free: Callable[[], bool]) -> None:
    bundle = pb.Bundle(main=pb.SourceFile(name="robot.rscd", text="until /nowhere/at all"))
    with grpc.insecure_channel(small) as channel:
        stub = STUB(channel)
        jobs = JOBS(channel)

        def has_room() -> bool:
            try:
                stub.GetVersion(pb.GetVersionRequest(), timeout=PATIENCE_S)
            except grpc.RpcError:
                return False
            return True

        for _ in range(10):
            # Answered, refused, past its deadline, cancelled.
            assert has_room()
            with pytest.raises(grpc.RpcError, match="there is no job"):
                next(jobs.WatchJob(jobs_pb2.WatchJobRequest(id="none"), timeout=PATIENCE_S))
            with pytest.raises(grpc.RpcError, match="DEADLINE_EXCEEDED"):
                stub.Check(pb.CheckRequest(bundle=bundle), timeout=0.01)
            stub.Synthesize(pb.SynthesizeRequest(bundle=bundle), timeout=PATIENCE_S).cancel()
            # The server has met all of these when it answers another one on their line, and sees their ends later.
            assert eventually(has_room)
            assert all_are_free()


def test_an_answer_that_nobody_reads_keeps_its_place(small: str) -> None:
    with strangers(small, 1, source="127.0.0.2", settings={INITIAL_WINDOW: 0}) as (deaf,):
        for number in range(5):
            deaf.call(2 * number + 1, GET_VERSION)
            deaf.message(2 * number + 1, b"")
        assert eventually(lambda: deaf.has_received(b"limit of 4 open calls"))


def test_a_token_says_how_many(tmp_path: Path) -> None:
    tokens, entries = [], []
    for name, quota in (("few", Quota(calls=2)), ("usual", Quota())):
        token, line = make_token(name, (Scope.SYNTHESIZE,), quota)
        tokens.append({"authorization": f"Bearer {token}"})
        entries.append(line)
    file = tmp_path / "tokens"
    file.write_text("\n".join(entries))
    file.chmod(0o600)
    with looked_into(open_calls_per_caller=4, tokens=file) as (address, all_are_free):
        few, usual = (tuple(token.items()) for token in tokens)
        with strangers(address, 1) as (stranger,):
            hold(stranger, 3, metadata=tokens[0])
            assert eventually(lambda: stranger.ended == 1)
            assert "limit of 2 open calls" in refusal(address, metadata=few)[1]
            assert is_answered(address, metadata=usual)
        assert all_are_free()
        with strangers(address, 1) as (stranger,):
            hold(stranger, 5, metadata=tokens[1])
            assert eventually(lambda: stranger.ended == 1)
            assert "limit of 4 open calls" in refusal(address, metadata=usual)[1]
            assert is_answered(address, metadata=few)


async def test_a_call_leaves_nothing_to_the_garbage_collector() -> None:
    layers = (CallInterceptor(Metrics("1")), OpenCalls(CallLimits(9, 9)), RequestTimeouts(PATIENCE_S))
    async with small_server(layers=layers, unary=answer) as (channel, _):
        await call(channel)
        gc.collect()
        gc.set_debug(gc.DEBUG_SAVEALL)
        try:
            for _ in range(10):
                await call(channel)
            gc.collect()
            left = Counter(type(item).__name__ for item in gc.garbage)
        finally:
            gc.set_debug(0)
            gc.garbage.clear()
    assert not {"RPCState", "_ServicerContext"} & left.keys(), left
