"""The device's end of a cable to this computer: a pseudo-terminal, and the thread that waits at it."""

import contextlib
import fcntl
import math
import os
import select
import sys
import tempfile
import termios
import threading
import time
import tty
from collections.abc import Callable
from pathlib import Path

_CHUNK = 4096
# `poll` knows whole milliseconds only.
_FINE_S = 0.001
_BAUDS = {
    getattr(termios, f"B{baud}"): baud
    for baud in (
        9600, 19200, 38400, 57600, 115200, 230400, 460800, 500000, 576000, 921600, 1000000, 1152000, 1500000, 2000000,
        2500000, 3000000, 3500000, 4000000,
    )
}  # fmt: skip


class TerminalEnd:
    """A pseudo-terminal under a stable name, as a udev rule makes it. Used under a lock of its owner, but for `wait`.

    Args:
        link: The name, a symbolic link; None: in a folder of its own.

    Attributes:
        path: The name.

    Raises:
        FileExistsError: There is something of that name already.
    """

    now_s = staticmethod(time.monotonic)

    def __init__(self, link: Path | None) -> None:
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        if link is None:
            self._folder = tempfile.TemporaryDirectory(prefix="robosc-port-")
            link = Path(self._folder.name) / "port"
        self._link = link
        self.path = str(link)
        self._master = self._slave = -1
        self._woken, self._waker = os.pipe()
        os.set_blocking(self._woken, False)
        os.set_blocking(self._waker, False)
        try:
            self.connect()
        except BaseException:
            self.close()
            raise

    @property
    def is_connected(self) -> bool:
        """True if the port is there."""
        return self._master >= 0

    def thread(self, run: Callable[[], None], name: str) -> threading.Thread:
        """Return a new thread that can wait here."""
        return threading.Thread(target=run, name=name, daemon=True)

    def connect(self) -> None:
        """Make the port."""
        master, slave = os.openpty()
        try:
            tty.setraw(slave)
            os.set_blocking(master, False)
            self._link.symlink_to(os.ttyname(slave))
        except BaseException:
            os.close(master)
            os.close(slave)
            raise
        # The slave stays open here: the master would see an error whenever no host has the port open.
        self._master, self._slave = master, slave

    def disconnect(self) -> None:
        """Let the port be gone: a program that has it open sees a hang-up."""
        self._link.unlink(missing_ok=True)
        os.close(self._master)
        os.close(self._slave)
        self._master = self._slave = -1

    def wait(self, limit_s: float) -> bool:
        """Wait until something comes, `wake` is called or the time is over; whether something may have come."""
        if 0.0 < limit_s < _FINE_S:
            time.sleep(limit_s)
            return False
        # It may be pulled meanwhile; its number may be another file's then.
        master = self._master
        poll = select.poll()
        poll.register(self._woken, select.POLLIN)
        if master >= 0:
            poll.register(master, select.POLLIN)
        ready = dict(poll.poll(None if math.isinf(limit_s) else max(limit_s, 0.0) * 1000))
        if self._woken in ready:
            with contextlib.suppress(BlockingIOError):
                os.read(self._woken, _CHUNK)
        return master in ready and master == self._master

    def wake(self) -> None:
        """Let `wait` return; from any thread."""
        # A full pipe: it is awake already. A closed one: it has ended.
        with contextlib.suppress(OSError):
            os.write(self._waker, b"\0")

    def read(self) -> bytes:
        """Return what the host has sent."""
        if self._master < 0:
            return b""
        try:
            return os.read(self._master, _CHUNK)
        except OSError:
            return b""

    def write(self, data: bytes) -> int:
        """Send to the host; how many bytes went."""
        try:
            return os.write(self._master, data)
        except OSError:
            return 0

    def unread(self) -> int:
        """Return how many bytes the host has not read."""
        if self._slave < 0:
            return 0
        return int.from_bytes(fcntl.ioctl(self._slave, termios.FIONREAD, bytes(4)), sys.byteorder)

    def host_baud(self) -> int:
        """Return the speed that the host has set; 0: an unusual one."""
        return _BAUDS.get(termios.tcgetattr(self._slave)[5], 0)

    def close(self) -> None:
        """Give everything back."""
        if self._master >= 0:
            self.disconnect()
        os.close(self._woken)
        os.close(self._waker)
        if self._folder is not None:
            self._folder.cleanup()
