"""Call under way, as the layers around its handler know it.

All of it is in one context variable, since each variable that is set makes every call slower. gRPC's context makes a
new text for each question about the peer, and layers ask several times.
"""

import asyncio
import logging
from collections.abc import Callable
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from robosc_api.security.tokens import Entry

_log = logging.getLogger(__name__)


REQUEST_ID_HEADER = "x-request-id"
"""Metadata with the identifier of a call: of its caller, who may choose it, and of the answer to one that failed."""


class Call:
    """Call of a server of grpc.aio.

    Attributes:
        request_id: Its identifier; empty: it has none.
        entry: Entry of its token; None: no token is required.
        caller: Name that distinguishes its caller; empty: not asked yet.
        peer: Other end of its connection, in gRPC's words (`ipv4:127.0.0.1:4711`); empty: not asked yet.
        at_end: Functions to call when it has ended for gRPC as well, and its response is on its way.
    """

    __slots__ = ("at_end", "caller", "entry", "peer", "request_id")

    def __init__(self) -> None:
        self.request_id = self.caller = self.peer = ""
        self.entry: Entry | None = None
        self.at_end: list[Callable[[], None]] = []

    def end(self, task: Any = None) -> None:
        """Call the functions that wait for the end, each of them whatever becomes of the others."""
        for function in self.at_end:
            try:
                function()
            except Exception:  # The others give back what the call has taken.
                _log.exception("a function at the end of a call failed")


CALL: ContextVar[Call | None] = ContextVar("call", default=None)
"""Call under way; None: there is none, such as in work of the server itself."""


def begin_call() -> Call:
    """Begin a call in its own task, in which gRPC runs its handler."""
    call = Call()
    CALL.set(call)
    # gRPC's context has callbacks as well, but then refers to itself: the context, its metadata and its state in gRPC
    # would stay until the garbage collector finds them, and each call would take new memory.
    task: Any = asyncio.current_task()
    task.add_done_callback(call.end)
    return call


def call_under_way() -> Call:
    """Return the call under way.

    Raises:
        LookupError: There is none.
    """
    call = CALL.get()
    if call is None:
        raise LookupError("no call is under way")
    return call


def request_id() -> str:
    """Return the identifier of the call under way; empty: there is none."""
    call = CALL.get()
    return "" if call is None else call.request_id


def peer_of(context: Any) -> str:
    """Return the peer of the call of this task.

    Args:
        context: Context of the call (of grpc.aio).
    """
    call = CALL.get()
    if call is None:
        peer: str = context.peer()
        return peer
    if not call.peer:
        call.peer = context.peer()
    return call.peer
