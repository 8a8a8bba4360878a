"""A program's stream in both directions, at a rate that the loop can follow."""

import asyncio
import logging
import threading
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable

from robosc_bridge.daemon.operations import Operations
from robosc_bridge.daemon.programs.items import Attached, Detached, Program, ToProgram
from robosc_bridge.remote import convert
from robosc_bridge.remote.loop_call import LoopCall
from robosc_bridge.remote.operator_presence import OperatorPresence

_log = logging.getLogger(__name__)

MAXIMUM_WAITING = 1000
"""Messages that wait for a program to read them."""

MAXIMUM_WAITING_BYTES = 4_000_000
"""Maximum memory for the data of waiting messages, in bytes; one message may wait whatever its size."""

MESSAGES_PER_CYCLE = 64
"""Number of messages that a program may send to the loop before the loop has shown its next snapshot.

The rest waits at the program's end.
"""

BYTES_PER_CYCLE = 128 * 1024
"""Maximum size of these messages as they arrive, in bytes; the message that exceeds it is the last one."""

_LOOK_S = 0.005


class TooSlowError(Exception):
    """The program does not read the items that are sent to it."""


class ProgramSession:
    """Session of an attached program.

    Args:
        operations: The daemon.
        hello: First message of the program.
        name: Name for the log.
        operator_timeout_s: Time without the operator after which the robot stops, in seconds; None: none is needed.

    Raises:
        RequestError: The first message is malformed.
    """

    def __init__(
        self, operations: Operations, hello: convert.Hello, name: str, operator_timeout_s: float | None
    ) -> None:
        self._operations = operations
        self._operator_timeout_s = operator_timeout_s
        self._is_operator = hello.is_operator
        self._presence = OperatorPresence(asyncio.get_running_loop().time)
        # The control loop's thread announces the items that it has put.
        self._put_call = LoopCall(self._called)
        self._news = asyncio.Event()
        self._overflow = asyncio.Event()
        # Filled by the loop's thread and this one.
        self._lock = threading.Lock()
        self._waiting: deque[ToProgram | str] = deque()
        self._waiting_bytes = 0
        self._is_full = False
        self._is_over = False
        self._taken = self._taken_bytes = 0
        self._seen_number = -1
        self._program: Program = convert.program_of(hello, name, self._send, operations)

    async def run(
        self, requests: AsyncIterator[convert.AttachRequest], write: Callable[[convert.AttachResponse], Awaitable[None]]
    ) -> None:
        """Exchange items until the program ends its stream.

        Raises:
            TooSlowError: The program does not read the items that are sent to it.
            FloodError: The program is an operator, and sends more messages than a person could give.
        """
        self._operations.post(Attached(self._program))
        _log.info("%s is attached", self._program.name)
        tasks: list[asyncio.Future[None]] = []
        try:
            # Before anything is read: while its first words are on their way, gRPC cannot refuse what it cannot read.
            await write(convert.welcome(self._operator_timeout_s))
            work = (self._read(requests), self._write(write), self._fall_behind())
            tasks += [asyncio.ensure_future(item) for item in work]
            if self._is_operator:
                self._operations.operator_seen()
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            self._is_over = True
            # Posted before anything is awaited, so that the loop learns of it even if this task is cancelled.
            self._operations.post(Detached(self._program))
            _log.info("%s is gone", self._program.name)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _read(self, requests: AsyncIterator[convert.AttachRequest]) -> None:
        async for request in requests:
            # Before it waits: an operator that has just sent something is there in any case.
            if self._is_operator and self._presence.message_received():
                self._operations.operator_seen()
            await self._turn()
            try:
                item = convert.item_of(request, self._program)
            except convert.RequestError as error:
                self._put(str(error))
                continue
            if item is not None:
                self._taken_bytes += request.ByteSize()
                self._operations.post(item)

    async def _turn(self) -> None:
        """Wait while the loop has not handled what came before; meanwhile gRPC holds the program back."""
        while True:
            snapshot = self._operations.feed.snapshot
            number = -1 if snapshot is None else snapshot.number
            if number != self._seen_number:
                self._seen_number, self._taken, self._taken_bytes = number, 0, 0
            if self._taken < MESSAGES_PER_CYCLE and self._taken_bytes < BYTES_PER_CYCLE:
                self._taken += 1
                return
            await asyncio.sleep(_LOOK_S)

    async def _write(self, write: Callable[[convert.AttachResponse], Awaitable[None]]) -> None:
        while True:
            await self._news.wait()
            self._news.clear()
            while self._waiting:
                with self._lock:
                    item = self._waiting.popleft()
                    self._waiting_bytes -= _weight_bytes(item)
                await write(convert.refused(item) if isinstance(item, str) else convert.response_of(item))

    async def _fall_behind(self) -> None:
        await self._overflow.wait()
        megabytes = MAXIMUM_WAITING_BYTES // 1_000_000
        raise TooSlowError(f"more than {MAXIMUM_WAITING} messages or {megabytes} MB wait for this program to read them")

    def _send(self, item: ToProgram) -> None:
        """From the loop's thread."""
        self._put(item)

    def _put(self, item: ToProgram | str) -> None:
        if self._is_over or self._is_full:
            return
        weight = _weight_bytes(item)
        with self._lock:
            is_too_heavy = self._waiting and self._waiting_bytes + weight > MAXIMUM_WAITING_BYTES
            if len(self._waiting) >= MAXIMUM_WAITING or is_too_heavy:
                self._is_full = True
            else:
                self._waiting.append(item)
                self._waiting_bytes += weight
        self._put_call.ask()

    def _called(self) -> None:
        if self._is_full:
            self._overflow.set()
        self._news.set()


def _weight_bytes(item: ToProgram | str) -> int:
    """Return the size of the data of a message, in bytes; a message that has none is small."""
    return int(getattr(item, "weight_bytes", 0))
