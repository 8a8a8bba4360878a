"""The device's end of a line over UDP: each thing that it sends is a datagram of its own."""

import contextlib
import math
import os
import random
import select
import socket
import threading
from collections.abc import Iterable
from dataclasses import dataclass

from robosc_simulated.closing import Closing
from robosc_simulated.line import Device, Sending
from robosc_simulated.timebase import Timebase

_DATAGRAM = 65535


@dataclass
class DatagramFaults:
    """Faults on the way; may be changed at any time.

    Attributes:
        drop_share: Share of datagrams to the host that are lost.
        corrupt_share: Share that have a wrong byte.
        is_deaf: True if nothing from the host reaches the device.
    """

    drop_share: float = 0.0
    corrupt_share: float = 0.0
    is_deaf: bool = False


class DatagramLine(Closing):
    """Line that serves a device on a UDP port of this computer until it is closed.

    It is for devices whose answers take no time.

    Args:
        device: Device that answers.
        time: Time that it lives by.
        host_port: Port of the host, to which it sends at first; None: it sends to whoever was heard last.
        seed: Seed of the faults that come by chance.

    Attributes:
        port: Its own port.
        faults: Faults on the way.
    """

    def __init__(self, device: Device, time: Timebase, host_port: int | None = None, seed: int = 0) -> None:
        self.device = device
        self.faults = DatagramFaults()
        self._time = time
        self._chance = random.Random(seed)  # noqa: S311 (faults are no secrets)
        self._host = None if host_port is None else ("127.0.0.1", host_port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self.port = int(self._socket.getsockname()[1])
        self._woken, self._waker = os.pipe()
        self._is_open = True
        time.join(self._live)
        self._thread = threading.Thread(target=self._serve, name=f"simulated UDP port {self.port}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End it; may be called again."""
        if not self._is_open:
            return
        self._is_open = False
        os.write(self._waker, b"\0")
        self._thread.join()
        self._time.leave(self._live)
        self._socket.close()
        os.close(self._woken)
        os.close(self._waker)

    def _serve(self) -> None:
        poll = select.poll()
        poll.register(self._socket.fileno(), select.POLLIN)
        poll.register(self._woken, select.POLLIN)
        while self._is_open:
            self._live()
            with self._time.lock:
                due_s = math.inf if self._time.is_manual else self.device.due_s() - self._time.now_s()
            ready = dict(poll.poll(None if math.isinf(due_s) else math.ceil(max(due_s, 0.0) * 1000)))
            if self._socket.fileno() in ready:
                self._hear()

    def _hear(self) -> None:
        try:
            data, self._host = self._socket.recvfrom(_DATAGRAM)
        except OSError:
            # The address that it has sent to has no listener.
            return
        if not self.faults.is_deaf:
            with self._time.lock:
                self._send(self.device.receive(data, 0))

    def _live(self) -> None:
        with self._time.lock:
            self._send(self.device.update())

    def _send(self, sendings: Iterable[Sending]) -> None:
        for sending in sendings:
            data = sending.data
            if self._host is None or self._chance.random() < self.faults.drop_share:
                continue
            if self._chance.random() < self.faults.corrupt_share:
                index = self._chance.randrange(len(data))
                data = data[:index] + bytes((data[index] ^ self._chance.randrange(1, 256),)) + data[index + 1 :]
            with contextlib.suppress(OSError):
                self._socket.sendto(data, self._host)
