"""The bridge's computer: clocks, waiting, threads, serial ports and network, as one value.

Whatever waits or measures time does so through a `Host`, so that a test can put the whole bridge on a clock of its own:
`robosc_simulated.virtual_host`. The real one is `robosc_bridge.transport.system_host`. Readings are in seconds.
"""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from types import TracebackType
from typing import Any, Protocol

from robosc.execution.runtime.clock import Clock


def monotonic() -> float:
    """Return this computer's monotonic time in seconds; it includes the time in suspension where the system has that.

    Without it, scans and commands from before a suspension would look fresh after it.
    """
    return time.clock_gettime(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else time.monotonic()


class Condition(Protocol):
    """A condition variable with its lock, as `threading.Condition`."""

    def __enter__(self) -> bool:
        """Take the lock."""

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None:
        """Give it back."""

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for `notify` without the lock; False: the time is over."""

    def wait_for(self, predicate: Callable[[], bool], timeout: float | None = None) -> bool:
        """Wait until something holds after a `notify`; whether it holds."""

    def notify(self) -> None:
        """Wake one that waits."""

    def notify_all(self) -> None:
        """Wake all that wait."""


class Thread(Protocol):
    """A thread, as `threading.Thread`."""

    @property
    def ident(self) -> int | None:
        """A number; None: it was not started."""

    def start(self) -> None:
        """Begin."""

    def join(self, timeout: float | None = None) -> None:
        """Wait for its end."""

    def is_alive(self) -> bool:
        """Return True if it has begun and not ended."""


class Queue[Item](Protocol):
    """A queue that threads and signal handlers put items into, as `queue.SimpleQueue`."""

    def put(self, item: Item) -> None:
        """Add an item; never waits."""

    def get(self, block: bool = True, timeout: float | None = None) -> Item:
        """Take the first item, waiting for it.

        Raises:
            queue.Empty: None came in time.
        """

    def get_nowait(self) -> Item:
        """Take the first item.

        Raises:
            queue.Empty: There is none.
        """

    def qsize(self) -> int:
        """Return the number of items."""


class Port(Protocol):
    """An open serial port: `SerialLine` says what each of these does."""

    @property
    def path(self) -> str:
        """Its name."""

    @property
    def baud(self) -> int:
        """Bits per second."""

    def read(self, limit_s: float) -> bytes:
        """Return what has come, waiting for the first byte."""

    def write(self, data: bytes, limit_s: float = 0.1) -> None:
        """Send all of it."""

    def discard_input(self) -> None:
        """Forget what has come and was not read."""

    def set_baud(self, baud: int) -> None:
        """Go on at another speed."""

    def set_dtr(self, is_on: bool) -> None:
        """Set the modem line "data terminal ready"."""

    def wake(self) -> None:
        """Let a `read` that waits in another thread return."""

    def close(self) -> None:
        """Give it back."""


class NetworkPort(ABC):
    """An open line over a network: `NetworkLine` says what each of these does.

    Attributes:
        path: The address.
        is_datagram: True if a read is one whole datagram.
    """

    path: str
    is_datagram: bool

    @property
    @abstractmethod
    def port(self) -> int:
        """Address of its own end."""

    @property
    @abstractmethod
    def is_stranger(self) -> bool:
        """Return whether the last datagram came from elsewhere than where what is written goes."""

    @abstractmethod
    def read(self, limit_s: float) -> bytes:
        """Return what has come, waiting for the first of it."""

    @abstractmethod
    def reply(self, data: bytes) -> None:
        """Send one datagram to where the last one came from."""

    @abstractmethod
    def answer_sender(self) -> None:
        """From now on, what is written goes to where the last datagram came from."""

    @abstractmethod
    def write(self, data: bytes, limit_s: float = 0.1) -> None:
        """Send all of it."""

    @abstractmethod
    def wake(self) -> None:
        """Let a `read` that waits in another thread return."""

    @abstractmethod
    def close(self) -> None:
        """Give it back."""


class Host(Clock, Protocol):
    """A computer, as far as the bridge and its devices need it."""

    def sleep(self, seconds: float) -> None:
        """Let time pass."""

    def condition(self) -> Condition:
        """Return a new condition variable."""

    def queue(self) -> Queue[Any]:
        """Return a new queue."""

    def thread(self, run: Callable[[], None], name: str) -> Thread:
        """Return a new thread that does not keep the process from ending."""

    def open_port(self, path: str, baud: int) -> Port:
        """Open a serial port.

        Raises:
            LineError: It cannot be used.
        """

    def open_network(self, address: str) -> NetworkPort:
        """Open a line over a network; `transport.network_line` says how addresses are written.

        Raises:
            LineError: It cannot be used.
        """
