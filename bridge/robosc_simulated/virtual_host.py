"""A host whose time passes only while everybody waits, for whole bridges in tests: exact, and as fast as they compute.

Its threads run one at a time: one of them runs until it waits, then another one whose wait is over, in the order in
which they began to wait. Where nobody's is, time jumps to the moment at which the first one is. So a run is the same
each time, whatever else the computer does. This is what `trio.testing.MockClock` with its `autojump_threshold` of 0
does for tasks (N. J. Smith, trio), here for threads.

Its serial ports and its network are memory: what one end writes, the other end can read at once.
"""

import math
import queue
import threading
from collections import deque
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any

from robosc_bridge.errors import LineBusyError, LineLostError, LineMissingError
from robosc_bridge.host import NetworkPort
from robosc_simulated.closing import Closing
from robosc_simulated.virtual_network import VirtualNetwork, VirtualServer

_END_S = 10.0
"""A thread that does not end within so long by the computer's clock waits for something that is not of this host."""


_VAIN_S = 3600.0
"""Time after which a wait without a limit is in vain, though others go on."""


class VirtualTimeError(Exception):
    """A wait will never end."""


class _Ended(BaseException):
    """The host was closed while a thread waited."""


class _Slot:
    """A thread's place among those that run one at a time.

    Args:
        name: Name of the thread.
    """

    def __init__(self, name: str = "") -> None:
        self.name = name
        # Taken by whoever waits for its slot, released by whoever gives it: of all waits, the fastest.
        self.given = threading.Lock()
        self.given.acquire()
        self.end_s = math.inf
        self.is_ready: Callable[[], bool] = lambda: False
        self.is_over = False


class VirtualHost(Closing):
    """A host on virtual time. The thread that makes it alternates with those that are made by it.

    Args:
        now_s: First reading of its clock.
        epoch_s: Seconds that are added to a reading for the wall clock.
    """

    def __init__(self, now_s: float = 1000.0, epoch_s: float = 1_000_000.0) -> None:
        self._now_s = now_s
        self._epoch_s = epoch_s
        self._maker = self._running = _Slot()
        self._until_s = math.inf
        self._is_stuck = False
        self._waiting: deque[_Slot] = deque()
        self._threads: list[threading.Thread] = []
        self._is_closed = False
        self.ports: dict[str, _End] = {}
        self._network = VirtualNetwork(self.wait)

    def monotonic(self) -> float:
        """Return the time in seconds."""
        return self._now_s

    def wall(self) -> float:
        """Return the time in seconds since 1970."""
        return self._epoch_s + self._now_s

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        self.wait(lambda: False, seconds)

    def suspend(self, seconds: float, *names: str) -> None:
        """Let time pass in which the threads of these names stand still, as those of a process that is halted."""
        held = [slot for slot in self._waiting if slot.name in names]
        for slot in held:
            self._waiting.remove(slot)
        try:
            self.sleep(seconds)
        finally:
            self._waiting.extendleft(reversed(held))

    def wait(self, is_ready: Callable[[], bool], limit_s: float) -> bool:
        """Let others run until something holds, or for a time; whether it holds.

        Raises:
            VirtualTimeError: Nothing will ever happen any more, or the time of the thread that has made the host is
                long over. The error is raised in the thread that has made the host, since errors that end other
                threads are not seen by anybody.
        """
        if self._is_closed:
            raise _Ended
        slot = self._running
        slot.is_ready, slot.end_s = is_ready, self._now_s + max(limit_s, 0.0)
        if slot is self._maker:
            self._until_s = self._now_s + _VAIN_S if math.isinf(slot.end_s) else slot.end_s
        self._waiting.append(slot)
        self._pass_on(slot)
        return is_ready()

    def condition(self) -> "_Condition":
        """Return a new condition variable."""
        return _Condition(self)

    def queue(self) -> "_Queue":
        """Return a new queue."""
        return _Queue(self)

    def thread(self, run: Callable[[], None], name: str) -> "_Thread":
        """Return a new thread that alternates with the others."""
        return _Thread(self, run, name)

    def open_port(self, path: str, baud: int) -> "_Port":
        """Open a serial port.

        Raises:
            LineMissingError: There is no such port.
            LineBusyError: It is open already.
        """
        end = self.ports.get(path)
        if end is None or not end.is_connected:
            raise LineMissingError(path, "there is no such port; is the device plugged in?")
        if end.port is not None:
            raise LineBusyError(path, "another program uses this port")
        return _Port(self, end, baud)

    def new_end(self, link: Path | None) -> "_End":
        """Return the device's end of a new cable.

        Raises:
            FileExistsError: There is a port of that name already.
        """
        path = f"/virtual/port{len(self.ports)}" if link is None else str(link)
        if path in self.ports:
            raise FileExistsError(path)
        return _End(self, path)

    def open_network(self, address: str) -> NetworkPort:
        """Open a line over its network, which reaches this host alone, whatever an address says.

        Raises:
            LineMissingError: The address has no server.
            LineBusyError: The port is in use.
        """
        return self._network.open(address)

    def serve(self, port: int = 0) -> VirtualServer:
        """Return a server that takes connections on a port of its network; 0: any.

        Raises:
            LineBusyError: The port is in use.
        """
        return self._network.serve(port)

    def close(self) -> None:
        """End all threads that still wait."""
        self._is_closed = True
        while self._waiting:
            self._waiting.popleft().given.release()
        for thread in self._threads:
            thread.join(_END_S)

    def _pass_on(self, slot: _Slot) -> None:
        """Give the processor to the thread whose wait is over first, and wait for the own one."""
        following = self._next()
        if following is not slot:
            self._running = following
            following.given.release()
            slot.given.acquire()
        if self._is_closed:
            raise _Ended
        if self._is_stuck:
            self._is_stuck = False
            raise VirtualTimeError(f"everybody waits for ever, or this thread in vain; it is {self._now_s:g} s")

    def _next(self) -> _Slot:
        for slot in self._waiting:
            # Waiters whose time is over go first, so that every run can be shown to end.
            if slot.end_s <= self._now_s or slot.is_ready():
                break
        else:
            slot = min(self._waiting, key=lambda slot: slot.end_s)
            if not math.isinf(slot.end_s):
                self._now_s = max(self._now_s, slot.end_s)
            if math.isinf(slot.end_s) or self._now_s > self._until_s:
                self._is_stuck = True
                slot = self._maker
        self._waiting.remove(slot)
        return slot

    def _start(self, slot: _Slot, run: Callable[[], None], name: str) -> int | None:
        def work() -> None:
            slot.given.acquire()
            try:
                if not self._is_closed:
                    run()
            except _Ended:
                pass
            finally:
                slot.is_over = True
                if not self._is_closed:
                    self._running = self._next()
                    self._running.given.release()

        slot.is_ready = lambda: True
        self._waiting.append(slot)
        thread = threading.Thread(target=work, name=name, daemon=True)
        self._threads.append(thread)
        thread.start()
        return thread.ident


class _Condition:
    """A condition variable; its lock is that one thread runs at a time."""

    def __init__(self, host: VirtualHost) -> None:
        self._host = host
        self._calls: deque[list[None]] = deque()

    def __enter__(self) -> bool:
        return True

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        pass

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for `notify`; False: the time is over."""
        call: list[None] = []
        self._calls.append(call)
        is_called = self._host.wait(lambda: bool(call), math.inf if timeout is None else timeout)
        if not is_called:
            self._calls.remove(call)
        return is_called

    def wait_for(self, predicate: Callable[[], bool], timeout: float | None = None) -> bool:
        """Wait until something holds; whether it holds."""
        return self._host.wait(predicate, math.inf if timeout is None else timeout)

    def notify(self) -> None:
        """Wake the one that has waited longest."""
        if self._calls:
            self._calls.popleft().append(None)

    def notify_all(self) -> None:
        """Wake all that wait."""
        while self._calls:
            self.notify()


class _Queue:
    """A queue."""

    def __init__(self, host: VirtualHost) -> None:
        self._host = host
        self._items: deque[Any] = deque()

    def put(self, item: Any) -> None:
        """Add an item."""
        self._items.append(item)

    def get(self, block: bool = True, timeout: float | None = None) -> Any:
        """Take the first item, waiting for it.

        Raises:
            queue.Empty: None came in time.
        """
        if block:
            self._host.wait(lambda: bool(self._items), math.inf if timeout is None else timeout)
        return self.get_nowait()

    def get_nowait(self) -> Any:
        """Take the first item.

        Raises:
            queue.Empty: There is none.
        """
        if not self._items:
            raise queue.Empty
        return self._items.popleft()

    def qsize(self) -> int:
        """Return how many items are there."""
        return len(self._items)


class _Thread:
    """A thread that alternates with the others."""

    def __init__(self, host: VirtualHost, run: Callable[[], None], name: str) -> None:
        self.ident: int | None = None
        self._host = host
        self._run = run
        self._name = name
        self._turn = _Slot(name)

    def start(self) -> None:
        """Begin when the others wait."""
        self.ident = self._host._start(self._turn, self._run, self._name)

    def join(self, timeout: float | None = None) -> None:
        """Wait for its end."""
        self._host.wait(lambda: self._turn.is_over, math.inf if timeout is None else timeout)

    def is_alive(self) -> bool:
        """Return True if it has begun and not ended."""
        return self.ident is not None and not self._turn.is_over


class _End:
    """The device's end of a cable: see `TerminalEnd`."""

    def __init__(self, host: VirtualHost, path: str) -> None:
        self.path = path
        self.is_connected = True
        self.port: _Port | None = None
        self.baud = 0
        self.to_device = bytearray()
        self.to_host = bytearray()
        self._host = host
        self._is_woken = False
        host.ports[path] = self

    def now_s(self) -> float:
        """Return the host's time."""
        return self._host.monotonic()

    def thread(self, run: Callable[[], None], name: str) -> _Thread:
        """Return a new thread that can wait here."""
        return self._host.thread(run, name)

    def connect(self) -> None:
        """Plug it in."""
        self.is_connected = True

    def disconnect(self) -> None:
        """Pull the plug."""
        self.is_connected = False
        self.port = None
        self.to_device.clear()
        self.to_host.clear()

    def wait(self, limit_s: float) -> bool:
        """Wait until something comes, `wake` is called or the time is over; whether something has come."""
        self._host.wait(lambda: bool(self.to_device) or self._is_woken, limit_s)
        self._is_woken = False
        return bool(self.to_device)

    def wake(self) -> None:
        """Let `wait` return."""
        self._is_woken = True

    def read(self) -> bytes:
        """Return what the host has sent."""
        data = bytes(self.to_device)
        self.to_device.clear()
        return data

    def write(self, data: bytes) -> int:
        """Send to the host; how many bytes went."""
        self.to_host += data
        return len(data)

    def unread(self) -> int:
        """Return how many bytes the host has not read."""
        return len(self.to_host)

    def host_baud(self) -> int:
        """Return the speed that the host has set last, as a closed port keeps it."""
        return self.baud

    def close(self) -> None:
        """Let it be gone for good."""
        self.disconnect()
        self._host.ports.pop(self.path, None)


class _Port:
    """The host's end of a cable: see `SerialLine`."""

    def __init__(self, host: VirtualHost, end: _End, baud: int) -> None:
        self.path = end.path
        self._host = host
        self._end = end
        self._is_woken = False
        end.port = self
        end.baud = baud

    @property
    def baud(self) -> int:
        """Bits per second."""
        return self._end.baud

    def read(self, limit_s: float) -> bytes:
        """Return what has come, waiting for the first byte.

        Raises:
            LineLostError: The line is gone.
        """
        end = self._attached()
        self._host.wait(lambda: bool(end.to_host) or self._is_woken or end.port is not self, limit_s)
        self._attached()
        self._is_woken = False
        data = bytes(end.to_host)
        end.to_host.clear()
        return data

    def write(self, data: bytes, limit_s: float = 0.1) -> None:
        """Send all of it.

        Raises:
            LineLostError: The line is gone.
        """
        self._attached().to_device += data

    def discard_input(self) -> None:
        """Forget what has come and was not read.

        Raises:
            LineLostError: The line is gone.
        """
        self._attached().to_host.clear()

    def set_baud(self, baud: int) -> None:
        """Go on at another speed.

        Raises:
            LineLostError: The line is gone.
        """
        self._attached().baud = baud

    def set_dtr(self, is_on: bool) -> None:
        """Do nothing: such a port has no modem lines."""
        self._attached()

    def wake(self) -> None:
        """Let a `read` that waits in another thread return."""
        self._is_woken = True

    def close(self) -> None:
        """Give it back; may be called again."""
        if self._end.port is self:
            self._end.port = None

    def _attached(self) -> _End:
        if self._end.port is not self:
            raise LineLostError(self.path, "the line is gone: the device has hung up")
        return self._end
