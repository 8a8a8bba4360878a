"""Ports of the loopback interface that stay free for a program that starts, dies and comes back."""

import random
import socket

_PORTS = range(20_000, 30_000)


def lasting_port() -> socket.socket:
    """A socket that keeps a free port, so that it is still free when its program begins, and when it comes back.

    The system gives the port to nobody who asks for any, and a server of another suite finds that it is taken.
    """
    for port in random.SystemRandom().sample(_PORTS, len(_PORTS)):
        keeper = socket.socket()
        try:
            keeper.bind(("127.0.0.1", port))
        except OSError:
            keeper.close()
            continue
        # The program may listen there, since this one does not.
        keeper.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        return keeper
    raise AssertionError("no port is free")


def port_of(keeper: socket.socket) -> int:
    """The port that such a socket keeps."""
    return int(keeper.getsockname()[1])
