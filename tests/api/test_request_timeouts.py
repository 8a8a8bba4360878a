"""Calls of each kind that begin and say nothing, or say it late, over real sockets."""

import asyncio
from collections.abc import AsyncIterator
from functools import partial
from typing import Any

import grpc
import pytest

from robosc_api.layers import LayeredServices
from robosc_api.request_timeouts import RequestTimeouts
from support.held_time import HeldLoop
from support.small_server import SERVICE, call, small_server
from support.waiting import PATIENCE_S, until

LIMIT_S = 0.25
LONG_S = 60.0


async def answer(request: bytes, context: Any) -> bytes:
    return request


async def generator(request: bytes, context: Any) -> AsyncIterator[bytes]:
    yield request
    yield b"end"


async def writer(request: bytes, context: Any) -> None:
    await context.write(request)
    await context.write(b"end")


async def echo(requests: AsyncIterator[bytes], context: Any) -> AsyncIterator[bytes]:
    async for request in requests:
        yield request


async def collect(requests: AsyncIterator[bytes], context: Any) -> bytes:
    return b"".join([request async for request in requests])


def with_all_kinds(services: LayeredServices) -> None:
    handlers: dict[str, Any] = {
        "Unary": grpc.unary_unary_rpc_method_handler(answer),
        "Generator": grpc.unary_stream_rpc_method_handler(generator),
        "Writer": grpc.unary_stream_rpc_method_handler(writer),
        "Both": grpc.stream_stream_rpc_method_handler(echo),
        "Collect": grpc.stream_unary_rpc_method_handler(collect),
    }
    services.add_generic_rpc_handlers((grpc.method_handlers_generic_handler("test.Kinds", handlers),))


def silent(channel: Any, name: str) -> Any:
    """A call that has begun, with a stream of requests that nothing is written to."""
    return channel.stream_stream(f"/test.Kinds/{name}")(timeout=PATIENCE_S)


def waits(timeouts: RequestTimeouts, stream: str = "") -> int:
    """Return the number of calls waiting for their first request, or of those of a kind waiting for a further one."""
    return len((timeouts._next[stream] if stream else timeouts._first)._since_s)


def is_waiting(timeouts: RequestTimeouts, stream: str = "", count: int = 1) -> bool:
    return waits(timeouts, stream) == count


async def refusal(made: Any) -> tuple[Any, str]:
    """Status and words of a call that must end."""
    found = await made.code(), await made.details()
    assert b"MALFORMED_REQUEST" in dict(await made.trailing_metadata())["grpc-status-details-bin"]
    return found


@pytest.mark.parametrize("name", ["Unary", "Generator", "Writer"])
async def test_a_request_comes_in_time_or_the_call_ends(name: str, loop: HeldLoop) -> None:
    timeouts = RequestTimeouts(LIMIT_S)
    async with small_server(layers=[timeouts], setup=with_all_kinds) as (channel, _):
        made = [silent(channel, name) for _ in range(3)]
        await until(lambda: waits(timeouts) == 3)
        await loop.passed(LIMIT_S / 2)
        assert waits(timeouts) == 3
        await loop.passed(LIMIT_S / 2)
        for each in made:
            assert await refusal(each) == (
                grpc.StatusCode.INVALID_ARGUMENT,
                "the request did not arrive within 0.25 seconds",
            )
        # One that ends its requests without any need not be waited for, and the next ones are answered.
        spoken: Any = channel.stream_stream(f"/test.Kinds/{name}")(timeout=PATIENCE_S)
        await spoken.write(b"said")
        assert await spoken.read() == b"said"


@pytest.mark.parametrize("name", ["Unary", "Writer"])
async def test_an_end_without_a_request_is_reported_at_once(name: str) -> None:
    async with small_server(layers=[RequestTimeouts(LONG_S)], setup=with_all_kinds) as (channel, _):
        made = silent(channel, name)
        await made.done_writing()
        assert (await refusal(made))[0] is grpc.StatusCode.INVALID_ARGUMENT


@pytest.mark.parametrize("name", ["Both", "Collect"])
async def test_a_stream_of_requests_goes_on_as_long_as_they_come(name: str, loop: HeldLoop) -> None:
    path = f"/test.Kinds/{name}"
    for limits, words in (
        ((LIMIT_S, LONG_S), "within 0.25 s"),
        ((LONG_S, LIMIT_S), "each further one within 0.25"),
    ):
        timeouts = RequestTimeouts(limits[0], {path: limits[1]})
        async with small_server(layers=[timeouts], setup=with_all_kinds) as (channel, _):
            made = silent(channel, name)
            if limits[0] == LONG_S:
                for text in (b"a", b"b"):
                    await made.write(text)
                    assert name == "Collect" or await made.read() == text
                await until(partial(is_waiting, timeouts, path))
            else:
                await until(partial(is_waiting, timeouts))
            await loop.passed(LIMIT_S)
            code, message = await refusal(made)
            assert code is grpc.StatusCode.INVALID_ARGUMENT
            assert words in message
            open_stream: Any = channel.stream_stream(path)
            whole = open_stream(iter([b"a", b"b"]), timeout=PATIENCE_S)
            assert b"".join([each async for each in whole]) == b"ab"


async def test_streams_that_nothing_is_said_of_are_left_alone(loop: HeldLoop) -> None:
    timeouts = RequestTimeouts(LIMIT_S)
    async with small_server(layers=[timeouts], setup=with_all_kinds) as (channel, _):
        quiet, other = silent(channel, "Both"), silent(channel, "Unary")
        await until(lambda: waits(timeouts) == 1)
        await loop.passed(LIMIT_S)
        await refusal(other)
        await quiet.write(b"at last")
        assert await quiet.read() == b"at last"


async def test_the_wait_is_for_the_request_alone(loop: HeldLoop) -> None:
    """Check that handling a request may take any time, and that a caller may go at any time."""
    goes_on = asyncio.Event()
    begun: list[str] = []
    cancelled: list[str] = []

    async def slow(request: bytes, context: Any) -> bytes:
        begun.append(request.decode())
        try:
            await goes_on.wait()
        except asyncio.CancelledError:
            cancelled.append(request.decode())
            raise
        return request

    timeouts = RequestTimeouts(LIMIT_S)
    async with small_server(layers=[timeouts], unary=slow) as (channel, _):
        made: Any = channel.unary_unary(f"/{SERVICE}/Unary")
        stays, goes = made(b"stays", timeout=PATIENCE_S), made(b"goes", timeout=PATIENCE_S)
        late: Any = channel.stream_unary(f"/{SERVICE}/Unary")(timeout=PATIENCE_S)
        await until(lambda: len(begun) == 2 and waits(timeouts) == 1)
        await loop.passed(LIMIT_S)
        assert await late.code() is grpc.StatusCode.INVALID_ARGUMENT
        goes.cancel()
        await until(lambda: bool(cancelled))
        assert cancelled == ["goes"]
        goes_on.set()
        assert await stays == b"stays"
        assert (await call(channel, b"x")).answer == b"x"


async def test_who_cancels_at_the_same_moment_is_obeyed() -> None:
    timeout = RequestTimeouts(LIMIT_S)._first
    never: asyncio.Future[None] = asyncio.get_running_loop().create_future()
    task: asyncio.Task[Any] = asyncio.create_task(timeout.wait(asyncio.shield(never)))
    while not timeout._since_s:
        await asyncio.sleep(0)
    timeout._since_s[task] -= LIMIT_S
    timeout._cancel_overdue()
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert not timeout._since_s and not timeout._overdue
    never.cancel()


async def test_those_that_begin_while_others_wait_are_looked_for_later(loop: HeldLoop) -> None:
    timeouts = RequestTimeouts(LIMIT_S)
    async with small_server(layers=[timeouts], setup=with_all_kinds) as (channel, _):
        made = []
        for number in range(1, 4):
            made.append(silent(channel, "Unary"))
            await until(partial(is_waiting, timeouts, count=number))
            await loop.passed(LIMIT_S / 4)
        assert waits(timeouts) == 3
        for left in (2, 1, 0):
            await loop.passed(LIMIT_S / 4)
            assert waits(timeouts) == left
        for each in made:
            assert (await refusal(each))[0] is grpc.StatusCode.INVALID_ARGUMENT
