"""A device that answers as a test says, on a virtual host or a real pseudo-terminal."""

import contextlib
import math
import os
import select
import threading
import time
import tty
from collections.abc import Callable, Iterable
from types import TracebackType
from typing import Self

from robosc_simulated.closing import Closing
from robosc_simulated.virtual_host import VirtualHost

Answers = Iterable[bytes | float]
"""Data to send, in order; a number is a pause in seconds."""


def _obey(peer: "VirtualPeer | Peer", heard: bytes, sleep: Callable[[float], object]) -> bytes:
    """Have a peer answer all whole requests; return the bytes behind them, without what is before them."""
    # Zeros that fill what a device may wait for.
    heard = heard.lstrip(b"\0")
    while len(heard) >= 7 and len(heard) >= (length := 7 + int.from_bytes(heard[5:7], "little")):
        request, heard = heard[:length], heard[length:]
        peer.requests.append(request)
        for sending in peer._answer(request):
            if isinstance(sending, bytes):
                peer.send(sending)
            else:
                sleep(sending)
    return heard


class VirtualPeer:
    """The far end of a line on a virtual host, served by one of its threads until it is closed.

    The host ends with it.

    Args:
        answer: Function called with every whole request of protocol 2.0.

    Attributes:
        time: The virtual host.
        path: Path of the near end.
        requests: Requests that have come.
    """

    def __init__(self, answer: Callable[[bytes], Answers]) -> None:
        self.requests: list[bytes] = []
        self.time = VirtualHost()
        self._answer = answer
        self._end = self.time.new_end(None)
        self.path = self._end.path
        self.time.thread(self._serve, "peer").start()

    def _serve(self) -> None:
        heard = b""
        while True:
            self._end.wait(math.inf)
            heard += self._end.read()
            heard = _obey(self, heard, self.time.sleep)

    def send(self, data: bytes) -> None:
        """Send something."""
        self._end.write(data)

    def unplug(self) -> None:
        """Hang up."""
        self._end.disconnect()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.time.close()


class Peer(Closing):
    """The far end of a real line, served by a thread until it is closed.

    Args:
        answer: Function called with every whole request of protocol 2.0.

    Attributes:
        path: Path of the near end.
        requests: Requests that have come.
    """

    def __init__(self, answer: Callable[[bytes], Answers]) -> None:
        self.requests: list[bytes] = []
        self._answer = answer
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._woken, self._waker = os.pipe()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        heard = b""
        while True:
            ready, _, _ = select.select([self._master, self._woken], [], [])
            if self._woken in ready:
                return
            with contextlib.suppress(OSError):
                heard += os.read(self._master, 4096)
            heard = _obey(self, heard, time.sleep)

    def send(self, data: bytes) -> None:
        """Send something; what does not fit into the buffer of the line is lost."""
        with contextlib.suppress(BlockingIOError):
            os.write(self._master, data)

    def close(self) -> None:
        os.write(self._waker, b"\0")
        self._thread.join()
        for file in (self._master, self._slave, self._woken, self._waker):
            os.close(file)


def crc(data: bytes) -> int:
    """CRC-16 of protocol 2.0, bit by bit: the twin of the table that the SDK has."""
    found = 0
    for byte in data:
        found ^= byte << 8
        for _ in range(8):
            found = (found << 1 ^ 0x8005 if found & 0x8000 else found << 1) & 0xFFFF
    return found


def packet(device: int, body: bytes) -> bytes:
    """A packet around an instruction and its parameters, stuffed."""
    body = body.replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")
    head = b"\xff\xff\xfd\x00" + bytes((device,)) + (len(body) + 2).to_bytes(2, "little") + body
    return head + crc(head).to_bytes(2, "little")


def status(device: int, data: bytes = b"", error: int = 0) -> bytes:
    """A status packet."""
    return packet(device, bytes((0x55, error)) + data)


def asked(request: bytes) -> tuple[int, int, int, int]:
    """Device, instruction, address and length of a request to read; zeros where it has none."""
    return (
        request[4],
        request[7],
        int.from_bytes(request[8:10], "little") if len(request) > 11 else 0,
        int.from_bytes(request[10:12], "little") if len(request) > 13 else 0,
    )
