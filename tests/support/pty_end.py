"""The device's end of a line, in the hands of a test."""

import os
import select
import termios
import time

from robosc_bridge.transport.system_host import SystemHost

LIMIT_S = 10.0
"""Longer than anything takes that works."""


class PtyEnd:
    """A pseudo-terminal; what opens `path` talks to the test.

    Attributes:
        master: Descriptor of the test's end.
        path: Of the port.
    """

    def __init__(self) -> None:
        # The slave stays open here: the master would see a hang-up whenever nobody has the port open.
        self.master, self._slave = os.openpty()
        self.path = os.ttyname(self._slave)
        self._is_open = True

    def send(self, data: bytes) -> None:
        """Send all of it; the other end must read what does not fit the line."""
        while data:
            data = data[os.write(self.master, data) :]

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

    def _is_readable(self, limit_s: float) -> bool:
        poll = select.poll()
        poll.register(self.master, select.POLLIN)
        return bool(poll.poll(limit_s * 1000))


class SkippingClock(SystemHost):
    """This computer, with its clock and what a test skips of it."""

    def __init__(self) -> None:
        self._skipped_s = 0.0

    def monotonic(self) -> float:
        """Return the time."""
        return time.monotonic() + self._skipped_s

    __call__ = monotonic

    def skip(self, seconds: float) -> None:
        """Let time pass."""
        self._skipped_s += seconds
