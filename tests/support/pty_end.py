"""The device's end of a line, in the hands of a test."""

import fcntl
import os
import select
import sys
import termios
import threading
import time

from robosc_bridge.transport.serial_line import SerialLine
from robosc_bridge.transport.system_host import SystemHost
from support.waiting import wait_until

LIMIT_S = 10.0
"""Longer than anything takes that works."""


class PtyEnd:
    """A pseudo-terminal; what opens `path` talks to the test.

    Attributes:
        master: Descriptor of the test's end.
        path: Of the port.
        sent: Number of bytes that were sent to the port.
        taken: Number of those that were read there or discarded; for who reads to count.
    """

    def __init__(self) -> None:
        # The slave stays open here: the master would see a hang-up whenever the port is not open.
        self.master, self._slave = os.openpty()
        self.path = os.ttyname(self._slave)
        self._is_open = True
        self.sent = self.taken = 0

    def send(self, data: bytes) -> None:
        """Send all of it; the other end must read what does not fit the line."""
        while data:
            written = os.write(self.master, data)
            self.sent += written
            data = data[written:]

    def settle(self) -> None:
        """Wait until what was sent and not taken can be read or flushed: the kernel carries it when it has time."""
        wait_until(self._has_settled)

    def receive(self, length: int) -> bytes:
        """Read `length` bytes that were written to the port."""
        found = b""
        while len(found) < length:
            assert self._is_readable(LIMIT_S), f"only {found.hex(' ')} came"
            found += os.read(self.master, length - len(found))
        return found

    def is_silent(self) -> bool:
        """Return True if nothing that was written to the port waits."""
        return not self._is_readable(0.0)

    def baud_constant(self) -> int:
        """Speed that the port was set to: one of `termios`'s."""
        return int(termios.tcgetattr(self.master)[5])

    def unplug(self) -> None:
        """Hang up; may be called again."""
        if self._is_open:
            self._is_open = False
            os.close(self.master)
            os.close(self._slave)

    def _has_settled(self) -> bool:
        try:
            unread = int.from_bytes(fcntl.ioctl(self._slave, termios.FIONREAD, bytes(4)), sys.byteorder)
        except OSError:
            return True  # It has been unplugged meanwhile.
        return not self._is_open or unread >= self.sent - self.taken

    def _is_readable(self, limit_s: float) -> bool:
        poll = select.poll()
        poll.register(self.master, select.POLLIN)
        return bool(poll.poll(limit_s * 1000))


class HeldHost(SystemHost):
    """This computer, on a clock of its own: time passes when a test skips some, and where a line is waited for in vain.

    A slow machine makes nothing late, and what the kernel is still carrying to the port is waited for.

    Args:
        end: Far end of the only port that is opened.
    """

    def __init__(self, end: PtyEnd) -> None:
        self._end = end
        self._now_s = 1000.0
        self._lock = threading.Lock()

    def monotonic(self) -> float:
        """Return the time."""
        return self._now_s

    __call__ = monotonic

    def skip(self, seconds: float) -> None:
        """Let time pass."""
        with self._lock:
            self._now_s += seconds

    def open_port(self, path: str, baud: int) -> SerialLine:
        """Open the port."""
        return _HeldLine(path, baud, self._end, self)


class _HeldLine(SerialLine):
    def __init__(self, path: str, baud: int, end: PtyEnd, host: HeldHost) -> None:
        super().__init__(path, baud)
        self._end = end
        self._host = host
        self._end.taken = self._end.sent

    def read(self, limit_s: float) -> bytes:
        self._end.settle()
        begin_s = time.monotonic()
        found = super().read(limit_s)
        self._end.taken += len(found)
        # Else it was woken.
        if not found and time.monotonic() - begin_s >= limit_s:
            self._host.skip(max(limit_s, 0.0))
        return found

    def discard_input(self) -> None:
        self._end.settle()
        super().discard_input()
        self._end.taken = self._end.sent
