"""Results on their way: counted until they are read, and no longer."""

import asyncio
import gc
from collections.abc import AsyncIterator
from typing import Any

import grpc
import pytest

from robosc_api.calls import begin_call
from robosc_server.result_sender import SMALL_BYTES, ResultSender
from robosc_server.tasks.task import Reason, RefusedError
from support.small_server import SERVICE, small_server
from support.waiting import PATIENCE_S, until

SIZE = SMALL_BYTES + 1


class Call:
    """A call of a host whose messages are taken when the test says so."""

    def __init__(self, host: str = "192.0.2.1") -> None:
        self._host = host
        self._room = asyncio.Semaphore(0)
        self._ended = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self.written = 0

    def peer(self) -> str:
        return f"ipv4:{self._host}:1"

    def auth_context(self) -> dict[str, Any]:
        return {}

    async def write(self, message: bytes) -> None:
        await self._room.acquire()
        self.written += 1

    def read(self, count: int = 1) -> None:
        for _ in range(count):
            self._room.release()

    async def reserve(self, sender: ResultSender, size: int) -> None:
        """Reserve room for a result in a task of its own, which goes on until the call's end."""
        is_reserved = asyncio.Event()

        async def handle() -> None:
            begin_call()
            sender.reserve(self, (bytes(size),))
            is_reserved.set()
            await self._ended.wait()

        self._task = asyncio.create_task(handle())
        await until(lambda: is_reserved.is_set() or self._has_ended)
        if self._has_ended:
            await self._task

    def send(self, sender: ResultSender, count: int) -> None:
        """Begin to send so many messages."""

        async def handle() -> None:
            begin_call()
            await sender.send_stream(self, chunks(count))
            await self._ended.wait()

        self._task = asyncio.create_task(handle())

    @property
    def _has_ended(self) -> bool:
        return self._task is not None and self._task.done()

    async def end(self) -> None:
        assert self._task is not None
        self._ended.set()
        await self._task

    async def lose(self) -> None:
        """End the call as gRPC does when its connection is lost."""
        assert self._task is not None
        self._task.cancel()
        await asyncio.wait([self._task])


async def chunks(count: int) -> AsyncIterator[bytes]:
    for _ in range(count):
        yield bytes(SIZE)


async def test_who_reads_gets_any_number_of_messages() -> None:
    # Two may be unread; a hundred are sent to each of two calls.
    sender = ResultSender(5 * SIZE, 100 * SIZE)
    calls = [Call(), Call()]
    for call in calls:
        call.send(sender, 100)
    for _ in range(100):
        for call in calls:
            call.read()
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        assert sender.unread_bytes <= 4 * SIZE
    await until(lambda: [call.written for call in calls] == [100, 100])
    # The last one of each may still be on its way.
    assert sender.unread_bytes == 2 * SIZE
    for call in calls:
        await call.end()
    assert sender.unread_bytes == 0


async def test_a_lost_call_is_sent_nothing_more() -> None:
    sender = ResultSender(5 * SIZE, 100 * SIZE)
    call = Call()
    call.send(sender, 10)
    call.read(3)
    await until(lambda: call.written == 3)
    await until(lambda: sender.unread_bytes == 2 * SIZE)
    await call.lose()
    assert sender.unread_bytes == 0


async def test_who_reads_nothing_is_sent_nothing_more() -> None:
    sender = ResultSender(2 * SIZE, 100 * SIZE)
    deaf = [Call(), Call()]
    for call in deaf:
        await call.reserve(sender, SIZE)
    with pytest.raises(RefusedError) as refused:
        await Call().reserve(sender, SIZE)
    assert refused.value.reason is Reason.SERVER_BUSY
    # Others have room, and small results are not counted.
    other, small = Call("192.0.2.2"), Call()
    await other.reserve(sender, SIZE)
    await small.reserve(sender, SMALL_BYTES)
    await deaf.pop().end()
    deaf.append(Call())
    await deaf[-1].reserve(sender, SIZE)
    assert sender.unread_bytes == 3 * SIZE
    for call in (*deaf, other, small):
        await call.end()
    assert sender.unread_bytes == 0


async def test_all_callers_together_fill_the_room_and_no_more() -> None:
    sender = ResultSender(5 * SIZE, 2 * SIZE)
    calls = [Call(f"192.0.2.{number}") for number in range(3)]
    for call in calls[:2]:
        await call.reserve(sender, SIZE)
    with pytest.raises(RefusedError) as refused:
        await calls[2].reserve(sender, SIZE)
    assert refused.value.reason is Reason.SERVER_BUSY
    for call in calls[:2]:
        await call.end()
    # A single result may be larger than the limits.
    await calls[2].reserve(sender, 6 * SIZE)
    assert sender.unread_bytes == 6 * SIZE
    await calls[2].end()
    assert sender.unread_bytes == 0


@pytest.mark.parametrize("is_stream", [False, True])
async def test_a_large_result_leaves_nothing_to_the_garbage_collector(is_stream: bool) -> None:
    sender = ResultSender(100 * SIZE, 100 * SIZE)

    async def whole(request: bytes, context: Any) -> bytes:
        sender.reserve(context, (bytes(SIZE),))
        return bytes(SIZE)

    async def in_parts(request: bytes, context: Any) -> None:
        await sender.send_stream(context, chunks(3))

    async with small_server(unary=whole, stream=in_parts) as (channel, _):
        method: Any = channel.unary_stream(f"/{SERVICE}/{'Stream' if is_stream else 'Unary'}")

        async def call() -> None:
            assert {len(message) async for message in method(b"")} == {SIZE}

        await call()
        await until(lambda: not sender.unread_bytes)
        gc.collect()
        gc.disable()
        try:
            before = calls_alive()
            for _ in range(10):
                await call()
            await until(lambda: not sender.unread_bytes)
            # A server waits for further calls with one or two of them.
            await until(lambda: calls_alive() < before + 5)
        finally:
            gc.enable()


def calls_alive() -> int:
    """Number of the objects that gRPC makes for a call of a server."""
    return sum(type(item).__name__ in ("RPCState", "_ServicerContext") for item in gc.get_objects())


async def test_a_result_that_is_not_read_stays_counted_though_its_handler_has_ended() -> None:
    sender, size = ResultSender(2**24, 2**24), 2**22
    has_returned = asyncio.Event()
    ports: list[int] = []

    async def whole(request: bytes, context: Any) -> bytes:
        sender.reserve(context, (bytes(size),))
        has_returned.set()
        return bytes(size)

    def listen(server: grpc.aio.Server) -> None:
        ports.append(server.add_insecure_port("127.0.0.1:0"))

    async with small_server(unary=whole, listen=listen) as _:
        options = [("grpc.http2.lookahead_bytes", 65535), ("grpc.http2.bdp_probe", 0)]
        async with grpc.aio.insecure_channel(f"127.0.0.1:{ports[0]}", options) as channel:
            method: Any = channel.unary_stream(f"/{SERVICE}/Unary")
            reader = method(b"")
            await has_returned.wait()
            # Others are answered meanwhile: what was sent has arrived as far as it is taken.
            other: Any = channel.unary_unary(f"/{SERVICE}/Unary")
            assert await other(b"", timeout=PATIENCE_S) == bytes(size)
            assert sender.unread_bytes == size
            assert [len(message) async for message in reader] == [size]
            await until(lambda: not sender.unread_bytes)
