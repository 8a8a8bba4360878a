"""Other end of the connection of the current call, in gRPC's words (`ipv4:127.0.0.1:4711`).

gRPC makes a new text for each question, and the layers around a handler ask several times.
"""

from contextvars import ContextVar
from typing import Any

_PEER: ContextVar[str | None] = ContextVar("peer", default=None)
"""Peer of the current call; empty: not asked yet; None: no call has begun here, so that nothing is kept."""


def begin_call() -> None:
    """Forget the peer, at the beginning of a call in its own task."""
    _PEER.set("")


def peer_of(context: Any) -> str:
    """Return the peer of the call of this task.

    Args:
        context: Context of the call (of grpc.aio).
    """
    known = _PEER.get()
    if known:
        return known
    peer: str = context.peer()
    if known is not None:
        _PEER.set(peer)
    return peer
