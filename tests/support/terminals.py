"""The command `robosc-bridge teleop` on a pseudo-terminal, in the hands of a test."""

import os
import pty
import subprocess
import sys
import threading

from support.remote import PATIENCE_S


class Terminal:
    """The command on a pseudo-terminal."""

    def __init__(self, address: str) -> None:
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
                self._seen += os.read(self._number, 4096)
            except OSError:
                return

    @property
    def seen(self) -> str:
        return self._seen.decode()

    def type(self, keys: str) -> None:
        os.write(self._number, keys.encode())

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self._thread.join(PATIENCE_S)
        os.close(self._number)
