"""The calls of the bridge service, with their limits and status codes; the daemon does their work."""

import asyncio
import contextlib
import logging
import secrets
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import grpc
import grpc.aio

from robosc_api.malformed import MalformedError
from robosc_api.security import Rule, Scope, token_name
from robosc_bridge.daemon import states
from robosc_bridge.daemon.operations import UNDONE_BY, Operations
from robosc_bridge.remote import convert
from robosc_bridge.remote.operator_presence import FloodError
from robosc_bridge.remote.session import ProgramSession, TooSlowError
from robosc_bridge.remote.watchers import Watchers

_log = logging.getLogger(__name__)

MAXIMUM_WATCHERS = 100
"""Streams of `Watch` at the same time."""

MAXIMUM_PROGRAMS = 16
"""Streams of `Attach` at the same time."""

MAXIMUM_COMMANDS = 32
"""Commands that wait for their answer at the same time; a stop waits for none."""

DEFAULT_RATE_HZ, LEAST_RATE_HZ, MOST_RATE_HZ = 10.0, 0.1, 100.0
"""Responses of `Watch` a second."""

SIGN_OF_LIFE_S = 1.0
"""A watcher hears something at least so often, also of a loop that hangs."""

COMMAND_LIMIT_S = 20.0
"""Longer than the motors may take to be restarted."""

HELLO_LIMIT_S = 5.0
"""Time for the first message of a program."""

_WATCH, _OPERATE = Rule(frozenset({Scope.WATCH, Scope.OPERATE})), Rule(frozenset({Scope.OPERATE}), is_open=False)

_RULES = {
    "GetDefinition": _WATCH,
    "GetStatus": _WATCH,
    "Watch": _WATCH,
    # Every client that sees the robot may stop it: a stop in vain is a nuisance, a refused one is an accident, also
    # where the new token was forgotten.
    "Stop": Rule(admits_expired=True),
    "Command": _OPERATE,
    "Attach": _OPERATE,
}
RULES = {f"/{convert.SERVICE_NAME}/{name}": _RULES[name] for name in convert.METHODS}
"""Rules for who may call what."""

Context = grpc.aio.ServicerContext[Any, Any]


class BridgeService(convert.BridgeServiceServicer):
    """Servicer of the bridge service; lives in the endpoint's event loop.

    Args:
        operations: The daemon.
        operator_timeout_s: Time without the operator after which the robot stops, in seconds; None: none is needed.
    """

    def __init__(self, operations: Operations, operator_timeout_s: float | None) -> None:
        self._operations = operations
        self._operator_timeout_s = operator_timeout_s
        self._definition = convert.definition(operations)
        self._snapshots = convert.SnapshotEncoder()
        self._watchers = Watchers(operations.feed)
        self._counts = {"watchers": 0, "programs": 0, "commands": 0}
        self._closing = asyncio.Event()

    def close(self) -> None:
        """End every call."""
        self._closing.set()
        self._watchers.wake()

    async def GetDefinition(  # noqa: N802  # named by the .proto file
        self, request: convert.GetDefinitionRequest, context: Context
    ) -> convert.GetDefinitionResponse:
        """Return everything that does not change while the bridge runs."""
        return self._definition

    async def GetStatus(  # noqa: N802
        self, request: convert.GetStatusRequest, context: Context
    ) -> convert.GetStatusResponse:
        """Return the state of the bridge."""
        response = convert.GetStatusResponse()
        snapshot = self._operations.feed.snapshot
        if snapshot is not None:
            self._snapshots.put(response.snapshot, snapshot)
        return response

    async def Stop(  # noqa: N802
        self, request: convert.StopRequest, context: Context
    ) -> convert.StopResponse:
        """Stop the robot: the stop takes effect before the call returns, and waits for no other call."""
        by = _caller(context)
        # The stop first; whatever may fail comes later.
        self._operations.order(states.OperatorCommand.STOP, by)
        _log.warning("%s has stopped the robot", by)
        return convert.StopResponse()

    async def Command(  # noqa: N802
        self, request: convert.CommandRequest, context: Context
    ) -> convert.CommandResponse:
        """Give a command to the bridge, and return when it is done or refused."""
        async with self._translated(context), self._counted("commands", MAXIMUM_COMMANDS, context):
            command, by = convert.command_of(request), _caller(context)
            _log.info("%s wants: %s", by, command)
            return convert.CommandResponse(refusal=await self._order(command, by))
        raise AssertionError("unreachable: a failed call is aborted")

    async def _order(self, command: states.OperatorCommand, by: str) -> str:
        """Return the reason why the command cannot be; empty: it is done.

        It is taken back if there is no answer, or if its caller has gone.

        Raises:
            TimeoutError: The loop does not answer.
            _ClosingError: The bridge ends.
        """
        loop = asyncio.get_running_loop()
        answered = asyncio.Event()
        future = self._operations.order(command, by)

        def answer(_: Any) -> None:
            with contextlib.suppress(RuntimeError):  # The endpoint is closed.
                loop.call_soon_threadsafe(answered.set)

        # Not `wrap_future`: a caller that goes away would cancel the future under the loop's hands.
        future.add_done_callback(answer)
        waits = [asyncio.ensure_future(answered.wait()), asyncio.ensure_future(self._closing.wait())]
        try:
            async with asyncio.timeout(COMMAND_LIMIT_S):
                await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
        except (TimeoutError, asyncio.CancelledError):
            self._take_back(command, by)
            raise
        finally:
            for wait in waits:
                wait.cancel()
        if not future.done():
            raise _ClosingError
        return future.result()

    def _take_back(self, command: states.OperatorCommand, by: str) -> None:
        undone_by = UNDONE_BY.get(command)
        if undone_by is not None:
            self._operations.order(undone_by, by)
            _log.warning(
                "%s was not answered, or its caller has disconnected: %s is followed by %s", by, command, undone_by
            )

    async def Watch(  # noqa: N802
        self, request: convert.WatchRequest, context: Context
    ) -> None:
        """Stream the snapshots and events of the bridge."""
        async with self._translated(context), self._counted("watchers", MAXIMUM_WATCHERS, context):
            rate_hz = convert.rate_hz_of(request, DEFAULT_RATE_HZ, LEAST_RATE_HZ, MOST_RATE_HZ)
            watcher = self._watchers.join(with_events=not request.without_events)
            scan_s = -1.0
            try:
                while True:
                    is_last = self._closing.is_set()
                    begin_s = time.monotonic()
                    events, lost = watcher.take()
                    response = convert.WatchResponse(events=events, lost_events=lost)
                    snapshot = self._operations.feed.snapshot
                    if snapshot is not None:
                        self._snapshots.put(response.snapshot, snapshot)
                        if request.with_scans and snapshot.scan is not None and snapshot.scan.time_s != scan_s:
                            scan_s = snapshot.scan.time_s
                            convert.put_scan(response.scan, snapshot.scan)
                    convert.put_sent(response)
                    await context.write(response)
                    if is_last:
                        raise _ClosingError
                    await self._pause(1.0 / rate_hz - (time.monotonic() - begin_s))
                    await watcher.wait(SIGN_OF_LIFE_S)
            finally:
                self._watchers.leave(watcher)

    async def _pause(self, pause_s: float) -> None:
        """Wait, but not while the bridge ends."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(max(pause_s, 0.0)):
                await self._closing.wait()

    async def Attach(  # noqa: N802
        self, requests: AsyncIterator[convert.AttachRequest], context: Context
    ) -> None:
        """Connect a program of the model, or the caller of a supervision layer."""
        async with self._translated(context), self._counted("programs", MAXIMUM_PROGRAMS, context):
            hello = await self._hello(requests)
            name = f"{hello.name} ({_caller(context)})"
            session = ProgramSession(self._operations, hello, name, self._operator_timeout_s)
            running = asyncio.ensure_future(session.run(requests, context.write))
            closing = asyncio.ensure_future(self._closing.wait())
            try:
                await asyncio.wait((running, closing), return_when=asyncio.FIRST_COMPLETED)
                if not running.done():
                    raise _ClosingError
                running.result()
            finally:
                closing.cancel()
                running.cancel()
                await asyncio.gather(running, return_exceptions=True)

    async def _hello(self, requests: AsyncIterator[convert.AttachRequest]) -> convert.Hello:
        """Return the message in which a program says who it is.

        Raises:
            RequestError: It does not say so.
        """
        try:
            async with asyncio.timeout(HELLO_LIMIT_S):
                request = await anext(aiter(requests))
        except (TimeoutError, StopAsyncIteration):
            request = None
        if request is None or request.WhichOneof("message") != "hello":
            raise convert.RequestError(f"the first message must be 'hello', within {HELLO_LIMIT_S:g} seconds")
        return request.hello

    @asynccontextmanager
    async def _counted(self, what: str, most: int, context: Context) -> AsyncIterator[None]:
        if self._counts[what] >= most:
            await context.abort(grpc.StatusCode.RESOURCE_EXHAUSTED, f"there are {most} {what} already")
        self._counts[what] += 1
        try:
            # Metadata sent with the first message count as sent only after it: a call that is ended in between could
            # not be given a status any more.
            await context.send_initial_metadata(())
            yield
        finally:
            self._counts[what] -= 1

    @asynccontextmanager
    async def _translated(self, context: Context) -> AsyncIterator[None]:
        """End a call with the right status for what goes wrong inside."""
        try:
            yield
        except convert.RequestError as error:
            await context.abort(grpc.StatusCode.INVALID_ARGUMENT, str(error))
        except (TooSlowError, FloodError) as error:
            await context.abort(grpc.StatusCode.RESOURCE_EXHAUSTED, str(error))
        except _ClosingError:
            await context.abort(grpc.StatusCode.UNAVAILABLE, "the bridge ends")
        except TimeoutError:
            await context.abort(
                grpc.StatusCode.DEADLINE_EXCEEDED, f"the bridge's loop has not answered for {COMMAND_LIMIT_S:g} seconds"
            )
        except (grpc.aio.AbortError, MalformedError):
            raise
        except Exception as error:
            fault = secrets.token_hex(4)
            _log.error("fault %s", fault, exc_info=error)
            await context.abort(
                grpc.StatusCode.INTERNAL, f"internal error {fault}, please report it with the bridge's log"
            )


class _ClosingError(Exception):
    """The bridge ends."""


def _caller(context: Context) -> str:
    """Return the caller's name, for the log."""
    name = token_name()
    return f"'{name}' at {context.peer()}" if name else str(context.peer())
