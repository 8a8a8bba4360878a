"""Sender of results with a limit on unread bytes.

gRPC holds a message in memory until its caller has read it or the connection is lost. Without a limit, callers that do
not read large results would fill the memory of the server.
"""

from collections import Counter
from collections.abc import AsyncIterable, Callable
from typing import Any

from robosc_api.calls import call_under_way
from robosc_api.security import caller_of
from robosc_server.tasks.task import Reason, RefusedError

SMALL_BYTES = 64 * 1024
"""Maximum size of results that are not counted, since the number of open calls bounds them."""

_RETRY_S = 5.0


class ResultSender:
    """Sender of results, which counts unread bytes.

    Args:
        per_caller_bytes: Limit for the results of one caller; a single result may be larger.
        bytes_in_all: Limit for all results; a single result may be larger.
    """

    def __init__(self, per_caller_bytes: int, bytes_in_all: int) -> None:
        self._per_caller_bytes = per_caller_bytes
        self._bytes_in_all = bytes_in_all
        self._unread: Counter[str] = Counter()

    @property
    def unread_bytes(self) -> int:
        """Bytes of results that were sent and are not read yet."""
        return self._unread.total()

    async def send_stream(self, context: Any, messages: AsyncIterable[bytes]) -> None:
        """Send the messages of a result as fast as they are read.

        Args:
            context: Context of the call (of grpc.aio), whose responses are bytes.
            messages: Serialized messages, each made when the one before it has been sent.

        Raises:
            RefusedError: Too many bytes that were sent before are not read yet.
        """
        # The last message, and the one before it until gRPC accepts the last.
        unread: list[Callable[[], None]] = []
        call_under_way().at_end.append(lambda: _call_each(unread))
        async for message in messages:
            unread.append(self._count(context, (message,)))
            await context.write(message)
            # gRPC accepts a message once it has sent the one before.
            _call_each(unread[:-1])
            del unread[:-1]

    def reserve(self, context: Any, messages: tuple[bytes, ...]) -> None:
        """Count a result until its call is over; it may have to wait before it can be sent.

        Args:
            context: Context of the call (of grpc.aio), whose handler runs.
            messages: Serialized messages of the result.

        Raises:
            RefusedError: Too many bytes that were sent before are not read yet.
        """
        forget = self._count(context, messages)
        if forget is not _do_nothing:
            # The call must have ended for gRPC, too: a handler that has ended has only handed its messages over.
            call_under_way().at_end.append(forget)

    def _count(self, context: Any, messages: tuple[bytes, ...]) -> Callable[[], None]:
        """Count messages, and return the function to call once when they are read, or never will be.

        Raises:
            RefusedError: Too many bytes that were sent before are not read yet.
        """
        size = sum(map(len, messages))
        if size <= SMALL_BYTES:
            return _do_nothing
        caller = caller_of(context)
        unread = self._unread[caller]
        if unread and unread + size > self._per_caller_bytes:
            raise RefusedError(
                Reason.SERVER_BUSY, "the caller has not read its earlier results yet: read them first", _RETRY_S
            )
        if self._unread and self.unread_bytes + size > self._bytes_in_all:
            raise RefusedError(
                Reason.SERVER_BUSY, "too many results of other callers are still unread; try again later", _RETRY_S
            )
        self._unread[caller] += size

        def forget() -> None:
            self._unread[caller] -= size
            if not self._unread[caller]:
                del self._unread[caller]

        return forget


def _do_nothing() -> None:
    """Do nothing."""


def _call_each(functions: list[Callable[[], None]]) -> None:
    for function in functions:
        function()
