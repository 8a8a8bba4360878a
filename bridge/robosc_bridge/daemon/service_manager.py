"""Notifications to systemd: the bridge is ready, is alive, ends.

The protocol is that of sd_notify(3): datagrams to the socket that `NOTIFY_SOCKET` names. It has been the same since
2010; the package `sdnotify` is no longer kept and does no more than this, and `systemd-python` needs a compiler and the
headers of libsystemd on the robot.
"""

import logging
import os
import socket
from collections.abc import Callable, Mapping

_log = logging.getLogger(__name__)

_BEATS = 3
"""Signs of life in the time of the watchdog."""


class ServiceManager:
    """The service manager that has started this process; without one, nothing is sent.

    Args:
        is_working: Function that takes a time and returns True if all required threads are alive then.
        environment: Environment of the process.
        process: Number of the process.
    """

    def __init__(
        self,
        is_working: Callable[[float], bool] = lambda now_s: True,
        environment: Mapping[str, str] = os.environ,
        process: int | None = None,
    ) -> None:
        self._is_working = is_working
        address = environment.get("NOTIFY_SOCKET", "")
        # An abstract socket's name begins with a zero.
        self._address = "\0" + address[1:] if address.startswith("@") else address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) if address else None
        if self._socket is not None:
            self._socket.setblocking(False)
        self.watchdog_s = _watchdog_s(environment, os.getpid() if process is None else process)
        self._due_s = 0.0
        self._state = ""
        self._is_well = True

    def ready(self) -> None:
        """Report that the bridge has started; its devices may still be awaited."""
        self._send("READY=1")

    def stopping(self) -> None:
        """Report that the bridge ends."""
        self._send("STOPPING=1")

    def beat(self, now_s: float, state: str) -> None:
        """Send the sign of life when it is due and the bridge is well; called in each cycle of the loop.

        Args:
            now_s: Time in seconds.
            state: State of the bridge, for `systemctl status`.
        """
        if self._socket is None:
            return
        if state != self._state:
            self._state = state
            self._send(f"STATUS={state}")
        if self.watchdog_s is None or now_s < self._due_s:
            return
        is_well = self._is_working(now_s)
        if is_well:
            self._due_s = now_s + self.watchdog_s / _BEATS
            self._send("WATCHDOG=1")
        elif self._is_well:
            _log.error("the drive base's thread hangs: the service manager gets no more keep-alive messages")
        self._is_well = is_well

    def _send(self, text: str) -> None:
        if self._socket is None:
            return
        try:
            self._socket.sendto(text.encode(), self._address)
        except OSError as error:
            _log.debug("the service manager does not hear: %s", error)

    def close(self) -> None:
        """Give the socket back."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def _watchdog_s(environment: Mapping[str, str], process: int) -> float | None:
    """Return the time of the watchdog; None: there is none, or it is another process's."""
    text = environment.get("WATCHDOG_USEC", "")
    if environment.get("WATCHDOG_PID", str(process)) != str(process) or not text.isascii() or not text.isdecimal():
        return None
    return int(text) / 1e6 or None
