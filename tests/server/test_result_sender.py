"""Results on their way: counted until they are read, and no longer."""

import asyncio
from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest

from robosc_server.result_sender import SMALL_BYTES, ResultSender
from robosc_server.tasks.task import Reason, RefusedError

SIZE = SMALL_BYTES + 1


class Call:
    """A call of a host whose messages are taken when the test says so."""

    def __init__(self, host: str = "192.0.2.1") -> None:
        self._host = host
        self._room = asyncio.Semaphore(0)
        self._callbacks: list[Callable[[Any], None]] = []
        self.written = 0

    def peer(self) -> str:
        return f"ipv4:{self._host}:1"

    def auth_context(self) -> dict[str, Any]:
        return {}

    def add_done_callback(self, callback: Callable[[Any], None]) -> None:
        self._callbacks.append(callback)

    async def write(self, message: bytes) -> None:
        await self._room.acquire()
        self.written += 1

    def read(self, count: int = 1) -> None:
        for _ in range(count):
            self._room.release()

    def end(self) -> None:
        for callback in self._callbacks:
            callback(self)


async def chunks(count: int) -> AsyncIterator[bytes]:
    for _ in range(count):
        yield bytes(SIZE)


def test_who_reads_gets_any_number_of_messages() -> None:
    async def test() -> None:
        # Two may be unread; a hundred are sent to each of two calls.
        sender = ResultSender(5 * SIZE, 100 * SIZE)
        calls = [Call(), Call()]
        sending = [asyncio.create_task(sender.send_stream(call, chunks(100))) for call in calls]
        for _ in range(100):
            for call in calls:
                call.read()
            await asyncio.sleep(0)
            await asyncio.sleep(0)
            assert sender.unread_bytes <= 4 * SIZE
        await asyncio.wait_for(asyncio.gather(*sending), 60)
        assert [call.written for call in calls] == [100, 100]
        # The last one of each may still be on its way.
        assert sender.unread_bytes == 2 * SIZE
        for call in calls:
            call.end()
        assert sender.unread_bytes == 0

    asyncio.run(test())


def test_who_reads_nothing_is_sent_nothing_more() -> None:
    async def test() -> None:
        sender = ResultSender(2 * SIZE, 100 * SIZE)
        deaf = [Call(), Call()]
        for call in deaf:
            sender.reserve(call, (bytes(SIZE),))
        with pytest.raises(RefusedError) as refused:
            sender.reserve(Call(), (bytes(SIZE),))
        assert refused.value.reason is Reason.SERVER_BUSY
        # Others have room, and small results are not counted.
        sender.reserve(Call("192.0.2.2"), (bytes(SIZE),))
        sender.reserve(Call(), (bytes(SMALL_BYTES),))
        deaf[0].end()
        is_read = sender.reserve(Call(), (bytes(SIZE),))
        is_read()
        is_read()
        assert sender.unread_bytes == 2 * SIZE

    asyncio.run(test())
