"""Load test of a server, like `ghz` for gRPC in general.

Calls are made from one event loop with serialized messages, and answers are not parsed, so that the server is measured
and not the client. Each concurrent caller has one open call at any time (a closed loop), so that the request rate
adapts to the server; the times say nothing about a server with a fixed request rate.
"""

import asyncio
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import grpc
import grpc.aio

from robosc_api.security import Credentials, open_async_channel
from robosc_client.calls import CHANNEL_OPTIONS
from robosc_client.convert.failures import failure_of

MAXIMUM_CONCURRENCY = 10_000

_CONNECT_S = 30.0


@dataclass(frozen=True, slots=True)
class Load:
    """Definition of a load test.

    Attributes:
        method: Full name of the method, such as `/robosc_api.v1.SynthesisService/Check`.
        is_stream: True if it answers with a stream.
        request: Function that returns the serialized request of a call, by its number.
        concurrency: Number of callers, each with one call at a time.
        count: Total number of calls; None: limited only by the duration.
        duration_s: Seconds after which no more calls start; None: unlimited.
        channels: Number of connections that the callers share.
        timeout_s: Time limit of one call, in seconds.
    """

    method: str
    is_stream: bool
    request: Callable[[int], bytes]
    concurrency: int = 1
    count: int | None = None
    duration_s: float | None = None
    channels: int = 1
    timeout_s: float = 60.0


@dataclass(frozen=True, slots=True)
class Measured:
    """Result of a load test.

    Attributes:
        seconds: Time from the first call's beginning to the last one's end.
        times_s: Duration of each successful call, sorted.
        answer_bytes: Bytes of all answers.
        errors: Number of failed calls, by the server's reason or the gRPC status.
        is_interrupted: True if the test was cancelled; calls that were open then do not count.
    """

    seconds: float
    times_s: tuple[float, ...]
    answer_bytes: int
    errors: dict[str, int]
    is_interrupted: bool = False

    @property
    def calls_per_second(self) -> float:
        """Number of successful calls per second."""
        return len(self.times_s) / self.seconds if self.seconds else 0.0

    def percentile_s(self, percent: float) -> float | None:
        """Return a percentile of the durations of calls (nearest rank); None: there were no calls."""
        if not self.times_s:
            return None
        rank = -(-len(self.times_s) * percent // 100)
        return self.times_s[max(int(rank), 1) - 1]

    def document(self) -> dict[str, Any]:
        """Return JSON values; times in milliseconds."""

        def milliseconds(percent: float) -> float | None:
            found = self.percentile_s(percent)
            return None if found is None else round(found * 1e3, 3)

        return {
            "calls": len(self.times_s),
            "seconds": round(self.seconds, 3),
            "calls_per_second": round(self.calls_per_second, 1),
            "answer_bytes": self.answer_bytes,
            "milliseconds": {f"p{percent:g}": milliseconds(percent) for percent in (50, 90, 99, 100)},
            "errors": dict(sorted(self.errors.items())),
            "interrupted": self.is_interrupted,
        }


async def measure(address: str, credentials: Credentials, load: Load) -> Measured:
    """Run a load test; if it is cancelled after the first answer, return the measurements so far.

    Raises:
        SecurityError: A certificate, key or token cannot be used.
    """
    # Channels with the same options would share one connection.
    options = [(*CHANNEL_OPTIONS, ("robosc.bench", number)) for number in range(load.channels)]
    channels = [open_async_channel(address, credentials, chosen) for chosen in options]
    try:
        await _connected(channels)
        return await _measured(channels, load)
    finally:
        for channel in channels:
            await channel.close()


async def _connected(channels: list[grpc.aio.Channel]) -> None:
    """Wait for connections; without a server, the calls fail later."""
    ready = asyncio.gather(*(channel.channel_ready() for channel in channels))
    try:
        await asyncio.wait_for(ready, _CONNECT_S)
    except TimeoutError:
        return


async def _measured(channels: list[grpc.aio.Channel], load: Load) -> Measured:
    begun_s = time.perf_counter()
    numbers = _numbers(load, begun_s)
    times_s: list[float] = []
    errors: Counter[str] = Counter()
    size = 0

    async def caller(place: int) -> None:
        nonlocal size
        call = _call(channels[place % len(channels)], load)
        for number in numbers:
            request = load.request(number)
            before_s = time.perf_counter()
            try:
                size += await call(request)
            except grpc.RpcError as error:
                failure = failure_of(error)
                errors[failure.reason or failure.code.name] += 1
                # Avoid a tight loop against a server that refuses at once.
                await asyncio.sleep(0.001)
            else:
                times_s.append(time.perf_counter() - before_s)

    is_interrupted = False
    try:
        async with asyncio.TaskGroup() as callers:
            for place in range(load.concurrency):
                callers.create_task(caller(place))
    except asyncio.CancelledError:
        if not (times_s or errors):
            raise
        is_interrupted = True
    return Measured(time.perf_counter() - begun_s, tuple(sorted(times_s)), size, dict(errors), is_interrupted)


def _numbers(load: Load, begun_s: float) -> Iterator[int]:
    """Yield the numbers of the calls, shared by all callers."""
    number = 0
    while load.count is None or number < load.count:
        if load.duration_s is not None and time.perf_counter() - begun_s >= load.duration_s:
            return
        yield number
        number += 1


def _call(channel: grpc.aio.Channel, load: Load) -> Callable[[bytes], Any]:
    """Return a function that makes one call and returns the size of its answer."""
    if not load.is_stream:
        unary: Any = channel.unary_unary(load.method)

        async def answer(request: bytes) -> int:
            return len(await unary(request, timeout=load.timeout_s))

        return answer
    streamed: Any = channel.unary_stream(load.method)

    async def answer_stream(request: bytes) -> int:
        size = 0
        async for message in streamed(request, timeout=load.timeout_s):
            size += len(message)
        return size

    return answer_stream
