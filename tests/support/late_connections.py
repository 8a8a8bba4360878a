"""Attempts to connect on this machine that the kernel drops, or answers."""

import select
import socket

from support.waiting import PATIENCE_S

_OTHER_SOURCE = "127.0.0.9"


def is_late(port: int, source: str, to: str = "127.0.0.1") -> bool:
    """Return True if an attempt to connect is dropped, though a later one of another host is answered.

    Args:
        port: Port that listens.
        source: Address of the host that connects.
        to: Address of the host that listens.
    """
    with socket.socket(socket.AF_INET6 if ":" in to else socket.AF_INET) as line:
        line.bind((source, 0))
        line.setblocking(False)
        line.connect_ex((to, port))
        # On one machine the kernel answers attempts in their order, mostly before they return.
        with socket.create_connection(("127.0.0.1", port), PATIENCE_S, (_OTHER_SOURCE, 0)):
            return not select.select((), (line,), (), 0)[1]
