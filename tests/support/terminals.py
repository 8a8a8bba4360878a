"""The command `robosc-bridge teleop` on a pseudo-terminal, in the hands of a test."""

import os
import pty
import subprocess
import sys
import termios
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from robosc_bridge.daemon.programs import items as programs
from support.remote import FakeDaemon, served
from support.waiting import PATIENCE_S, wait_until


class Terminal:
    """The command on a pseudo-terminal.

    Args:
        address: Address of the bridge.

    Attributes:
        answers: True if it reports that it is there when it is asked (DSR 5), as real ones do.
        asked: Number of times that it was asked.
    """

    def __init__(self, address: str) -> None:
        self.answers = True
        self.asked = 0
        self._number, inner = pty.openpty()
        command = [sys.executable, "-m", "robosc_bridge.command", "teleop", "--address", address]
        self.process = subprocess.Popen(command, stdin=inner, stdout=inner, stderr=inner)
        os.close(inner)
        self._seen = b""
        self._thread = threading.Thread(target=self._read)
        self._thread.start()

    def _read(self) -> None:
        while True:
            try:
                text = os.read(self._number, 4096)
                if b"\x1b[5n" in text:
                    self.asked += 1
                    if self.answers:
                        os.write(self._number, b"\x1b[0n")
            except OSError:
                return
            self._seen += text

    @property
    def seen(self) -> str:
        return self._seen.decode()

    def type(self, keys: str) -> None:
        os.write(self._number, keys.encode())

    @property
    def is_raw(self) -> bool:
        """True if keys are given one by one and not shown."""
        return not termios.tcgetattr(self._number)[3] & (termios.ICANON | termios.ECHO)

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self._thread.join(PATIENCE_S)
        os.close(self._number)


@contextmanager
def driving(daemon: FakeDaemon) -> Iterator[Terminal]:
    """The command, ready for keys, with a daemon to drive."""
    with served(daemon) as endpoint:
        terminal = Terminal(endpoint.address)
        try:
            wait_until(lambda: "w/s or up/down" in terminal.seen)
            yield terminal
        finally:
            terminal.close()


def requested_velocities(daemon: FakeDaemon) -> list[tuple[str, float, float]]:
    """The velocities that the operator has asked for: on which topic, ahead, to the left."""
    found = daemon.of(programs.MessageRequested)
    return [(item.identifier, item.data["linear"]["x"], item.data["angular"]["z"]) for item in found]
