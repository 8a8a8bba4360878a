"""Tests of the work around every call, over a real server."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import grpc
import pytest
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter

from robosc_api.security import Guard, Rule, Scope, TokenFile, make_token
from robosc_server.operations.interceptor import CallInterceptor
from robosc_server.operations.metrics import Metrics
from robosc_server.operations.settings import LogLevel
from robosc_server.operations.tracing import OtlpTracing
from support.held_time import HeldLoop
from support.small_server import MARKER, SERVICE, Ended, answer, call, logged, small_server
from support.waiting import PATIENCE_S, limited, until


def outcome(request: bytes, metrics: Metrics | None = None, unary: Any = answer, **more: Any) -> Ended:
    async def run() -> Ended:
        calls = CallInterceptor(metrics or Metrics("1"))
        async with small_server(layers=[calls], unary=unary) as (channel, _):
            ended = await call(channel, request, **more)
            await until(lambda: not calls.under_way())
            assert isinstance(ended, Ended)
            return ended

    return limited(run())


def counted(metrics: Metrics, text: str) -> bool:
    return text in metrics.text().decode().splitlines()


def test_a_request_id_is_made_seen_by_the_handler_and_logged() -> None:
    with logged() as log:
        ended = outcome(b"")
    assert ended.code is grpc.StatusCode.OK
    assert ended.answer is not None
    (line,) = log.lines("call")
    assert line["request"] == ended.answer.decode()
    assert line["level"] == "info"
    assert line["method"] == f"/{SERVICE}/Unary"
    assert line["code"] == "OK"
    assert 0 < line["seconds"] < PATIENCE_S
    assert line["peer"].startswith("ipv4:127.0.0.1:")


def test_the_callers_request_id_is_taken() -> None:
    assert outcome(b"", metadata=[("x-request-id", "abc-1/2")]).answer == b"abc-1/2"


@pytest.mark.parametrize("given", [["a b"], ["x" * 129], [""], ["one", "two"], ['"\\']])
def test_an_odd_request_id_is_not(given: list[str]) -> None:
    made = outcome(b"", metadata=[("x-request-id", value) for value in given]).answer
    assert made is not None
    assert made.decode() not in given
    assert len(made) == 16


def test_a_refusal_is_reported_with_its_reason_and_when_to_come_again() -> None:
    metrics = Metrics("1")
    with logged() as log:
        ended = outcome(b"busy", metrics)
    assert (ended.code, ended.message) == (grpc.StatusCode.RESOURCE_EXHAUSTED, "come again")
    assert (ended.reason, ended.retry_delay_s, ended.trailing["retry-after"]) == ("SERVER_BUSY", 1.5, "1.500")
    (line,) = log.lines("call")
    assert (line["reason"], line["request"]) == ("SERVER_BUSY", ended.trailing["x-request-id"])
    assert counted(metrics, 'robosc_server_failures_total{reason="SERVER_BUSY"} 1.0')
    assert counted(metrics, f'robosc_server_calls_total{{code="RESOURCE_EXHAUSTED",method="/{SERVICE}/Unary"}} 1.0')


def test_a_fault_is_reported_by_its_id_alone() -> None:
    with logged(LogLevel.INFO) as log:
        ended = outcome(b"fault")
    assert (ended.code, ended.reason) == (grpc.StatusCode.INTERNAL, "INTERNAL_FAULT")
    (line,) = log.lines("fault")
    assert line["fault"] in ended.message
    assert line["error"] == "KeyError"
    assert "small_server.py" in line["places"][-1]
    assert line["request"] == ended.trailing["x-request-id"]
    assert MARKER not in log.text + ended.message


def test_a_fault_stands_in_words_at_the_level_debug() -> None:
    with logged(LogLevel.DEBUG) as log:
        outcome(b"fault")
    (line,) = log.lines("fault in full")
    assert MARKER in line["traceback"]


def test_what_handlers_say_themselves_stays() -> None:
    metrics = Metrics("1")
    with logged() as log:
        assert outcome(b"abort", metrics).message == "lost"
        assert outcome(b"code", metrics).code is grpc.StatusCode.ABORTED
    assert [line["code"] for line in log.lines("call")] == ["DATA_LOSS", "ABORTED"]


def test_a_deadline_that_passes() -> None:
    """Only the server has a timer: it is given a deadline that its caller has not set.

    One that passes before the call has reached the handler says nothing: a longer one is given then.
    """
    entered: list[bytes] = []

    async def stuck(request: bytes, context: Any) -> bytes:
        entered.append(request)
        return await answer(request, context)

    for limit_ms in (2**number for number in range(20)):
        with logged() as log:
            ended = outcome(b"stuck", unary=stuck, metadata=[("grpc-timeout", f"{limit_ms}m")], timeout=None)
        assert ended.code is grpc.StatusCode.DEADLINE_EXCEEDED
        if entered:
            break
    assert [line["code"] for line in log.lines("call")] == ["DEADLINE_EXCEEDED"]


class CancelledContext:
    """The context of a call that is cancelled while its handler waits.

    Args:
        left_s: Time left when it is cancelled, in seconds; None: it has no deadline.
    """

    def __init__(self, left_s: float | None) -> None:
        self._left_s = left_s

    def time_remaining(self) -> float | None:
        return self._left_s

    def trailing_metadata(self) -> tuple[()]:
        return ()

    def peer(self) -> str:
        return "ipv4:127.0.0.1:4711"


@pytest.mark.parametrize(
    ("given_s", "left_s", "code"),
    [
        (None, None, "CANCELLED"),
        (0.2, 0.0, "DEADLINE_EXCEEDED"),
        (0.2, 0.003, "DEADLINE_EXCEEDED"),  # The caller's timer was the first one.
        (1.01, 0.007, "DEADLINE_EXCEEDED"),  # 1.003 s, rounded up on the line.
        (600.0, 6.0, "DEADLINE_EXCEEDED"),
        (600.0, 7.0, "CANCELLED"),
        (60.0, 0.8, "CANCELLED"),
        (0.2, 0.15, "CANCELLED"),
        (0.01, 0.009, "CANCELLED"),
    ],
)
async def test_a_call_that_is_cancelled_where_its_deadline_passes_has_reached_it(
    loop: HeldLoop, given_s: float | None, left_s: float | None, code: str
) -> None:
    async def stuck(request: bytes, context: Any) -> bytes:
        await loop.passed(1.0 if given_s is None or left_s is None else given_s - left_s)
        raise asyncio.CancelledError

    with logged() as log, pytest.raises(asyncio.CancelledError):
        handler = CallInterceptor(Metrics("1")).wrap(grpc.unary_unary_rpc_method_handler(stuck), f"/{SERVICE}/Unary")
        await handler.unary_unary(b"", CancelledContext(left_s))
    assert [line["code"] for line in log.lines("call")] == [code]


async def test_a_caller_that_goes_away_is_counted_and_no_longer_under_way() -> None:
    metrics = Metrics("1")
    calls = CallInterceptor(metrics)
    async with small_server(layers=[calls], unary=answer) as (channel, _):
        method: Any = channel.unary_unary(f"/{SERVICE}/Unary")
        made = method(b"stuck")
        await until(lambda: calls.under_way() == 1)
        assert counted(metrics, "robosc_server_calls_under_way 1.0")
        made.cancel()
        await until(lambda: not calls.under_way())
    assert counted(metrics, f'robosc_server_calls_total{{code="CANCELLED",method="/{SERVICE}/Unary"}} 1.0')


def test_streams_of_either_kind_and_a_generator_is_closed_with_its_call() -> None:
    closed: list[str] = []

    async def generator(request: bytes, context: Any) -> AsyncIterator[bytes]:
        try:
            for number in range(1000 if request else 3):
                yield b"%d" % number
            await asyncio.Event().wait() if request else None
        finally:
            closed.append("closed")

    async def writer(request: bytes, context: Any) -> None:
        for number in range(3):
            await context.write(b"%d" % number)

    async def run(handler: Any) -> None:
        calls = CallInterceptor(Metrics("1"))
        async with small_server(layers=[calls], stream=handler) as (channel, _):
            made: Any = channel.unary_stream(f"/{SERVICE}/Stream")
            responses = made(b"")
            assert [response async for response in responses] == [b"0", b"1", b"2"]
            if handler is generator:
                assert closed == ["closed"]
                stuck = made(b"long")
                await stuck.read()
                stuck.cancel()
                await until(lambda: not calls.under_way())
                assert closed == ["closed"] * 2

    for handler in (generator, writer):
        limited(run(handler))


async def test_methods_that_there_are_not_are_counted_without_their_names() -> None:
    metrics = Metrics("1")
    async with small_server(layers=[CallInterceptor(metrics)], unary=answer) as (channel, _):
        made: Any = channel.unary_unary(f"/{MARKER}/Unary")
        with pytest.raises(grpc.aio.AioRpcError):
            await made(b"")
    assert counted(metrics, 'robosc_server_calls_total{code="UNIMPLEMENTED",method="unknown"} 1.0')
    assert MARKER not in metrics.text().decode()


def test_what_a_guard_refuses_is_logged_with_a_reason_and_whom_it_lets_in_by_name(tmp_path: Path) -> None:
    token, line = make_token("laptop", (Scope.SYNTHESIZE,))
    file = tmp_path / "tokens"
    file.write_text(line)
    file.chmod(0o600)

    async def run() -> list[Ended]:
        guard = Guard({f"/{SERVICE}/Unary": Rule(frozenset({Scope.SYNTHESIZE}))}, TokenFile(file))
        calls = CallInterceptor(Metrics("1"))
        async with small_server(layers=[calls, guard], unary=answer) as (channel, _):
            return [
                await call(channel),
                await call(channel, metadata=[("authorization", f"Bearer {token}x")]),
                await call(channel, metadata=[("authorization", f"Bearer {token}")]),
            ]

    with logged() as log:
        missing, wrong, right = asyncio.run(run())
    assert [ended.code.name for ended in (missing, wrong, right)] == ["UNAUTHENTICATED", "UNAUTHENTICATED", "OK"]
    assert missing.reason == wrong.reason == "UNAUTHENTICATED"
    assert "x-request-id" in missing.trailing
    lines = log.lines("call")
    assert [line.get("caller") for line in lines] == [None, None, "laptop"]
    assert lines[0]["reason"] == "UNAUTHENTICATED"
    assert token not in log.text


async def test_a_call_is_a_span_that_continues_its_callers_trace_and_holds_no_message() -> None:
    exporter, provider = InMemorySpanExporter(), TracerProvider()
    provider.add_span_processor(SimpleSpanProcessor(exporter))
    tracing = OtlpTracing(provider)
    trace, parent = "0af7651916cd43dd8448eb211c80319c", "b7ad6b7169203331"

    async def inside(request: bytes, context: Any) -> bytes:
        with tracing.span("worker run", {"task.kind": "check"}):
            return await answer(request, context)

    calls = CallInterceptor(Metrics("1"), tracing)
    async with small_server(layers=[calls], unary=inside) as (channel, _):
        await call(channel, metadata=[("traceparent", f"00-{trace}-{parent}-01")])
        await call(channel, b"fault", metadata=[("x-request-id", "mine")])
    tracing.close()
    run_span, call_span, failed_run, failed_call = exporter.get_finished_spans()
    assert (call_span.name, run_span.name) == (f"{SERVICE}/Unary", "worker run")
    assert f"{call_span.context.trace_id:032x}" == trace
    assert call_span.parent is not None
    assert run_span.parent is not None
    assert f"{call_span.parent.span_id:016x}" == parent
    assert run_span.parent.span_id == call_span.context.span_id
    assert failed_call.attributes is not None
    assert failed_call.attributes["error.type"] == "KeyError"
    assert failed_call.attributes["request.id"] == "mine"
    assert not failed_run.status.is_ok
    assert MARKER not in failed_call.to_json() + failed_run.to_json()
