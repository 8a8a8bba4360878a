"""This computer as a host: its clocks, threads, serial ports and network."""

import queue
import threading
import time
from collections.abc import Callable
from typing import Any

from robosc.execution.runtime.clock import SystemClock
from robosc_bridge.host import Host, NetworkPort, Port, monotonic
from robosc_bridge.transport.network_line import NetworkLine, is_network_address
from robosc_bridge.transport.serial_line import SerialLine

type Line = Port | NetworkPort


class SystemHost(SystemClock):
    """This computer."""

    monotonic = staticmethod(monotonic)
    sleep = staticmethod(time.sleep)

    def condition(self) -> threading.Condition:
        """Return a new condition variable."""
        return threading.Condition()

    def queue(self) -> queue.SimpleQueue[Any]:
        """Return a new queue; a signal handler may put into it while the same thread takes from it."""
        return queue.SimpleQueue()

    def thread(self, run: Callable[[], None], name: str) -> threading.Thread:
        """Return a new thread that does not keep the process from ending."""
        return threading.Thread(target=run, name=name, daemon=True)

    def open_port(self, path: str, baud: int) -> SerialLine:
        """Open a serial port.

        Raises:
            LineError: The line cannot be used.
        """
        return SerialLine(path, baud)

    def open_network(self, address: str) -> NetworkLine:
        """Open a line over a network.

        Raises:
            LineError: The line cannot be used.
        """
        return NetworkLine(address)


SYSTEM_HOST = SystemHost()
"""This computer: what is used where nothing else is said."""


def open_line(address: str, baud: int, host: Host = SYSTEM_HOST) -> Line:
    """Open a line.

    Args:
        address: Address for `transport.network_line`, or the path of a serial port.
        baud: Baud rate of a serial port.
        host: Host with these serial ports and this network.

    Raises:
        LineError: It cannot be used.
    """
    return host.open_network(address) if is_network_address(address) else host.open_port(address, baud)
