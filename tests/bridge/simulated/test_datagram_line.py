"""The wire of a device that talks over UDP: real datagrams, lost, damaged and from the beginning."""

import socket
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import pytest

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import DatagramLine, Timebase
from robosc_simulated.line import Sending
from support.waiting import PATIENCE_S, wait_until


class Echo:
    """A device that answers each datagram with its bytes in reverse, and says `tick` every second by itself."""

    baud = None

    def __init__(self, time: Timebase) -> None:
        self.heard: list[bytes] = []
        self.lives = 0
        self._time = time
        self._next_s = time.now_s() + 1.0

    def receive(self, data: bytes, baud: int) -> Iterable[Sending]:
        self.heard.append(data)
        return [Sending(data[::-1])]

    def update(self) -> Iterable[Sending]:
        self.lives += 1
        if self._time.now_s() < self._next_s:
            return []
        self._next_s += 1.0
        return [Sending(b"tick")]

    def due_s(self) -> float:
        return self._next_s

    def plug_in(self) -> None:
        pass


@pytest.fixture
def time() -> Timebase:
    return Timebase(ManualClock())


@contextmanager
def host(line: DatagramLine | None = None) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        found.settimeout(PATIENCE_S)
        if line is not None:
            found.connect(("127.0.0.1", line.port))
        yield found


def test_it_answers_whoever_was_heard_last(time: Timebase) -> None:
    with DatagramLine(Echo(time), time) as line, host(line) as first, host(line) as second:
        # No sender was heard: it has nowhere to send to.
        time.advance(1.5)
        first.send(b"abc")
        assert first.recv(100) == b"cba"
        second.send(b"de")
        assert second.recv(100) == b"ed"
        time.advance(1.5)
        assert second.recv(100) == b"tick"


def test_it_begins_with_a_host_that_has_said_nothing(time: Timebase) -> None:
    with host() as waiting, DatagramLine(Echo(time), time, waiting.getsockname()[1]):
        time.advance(1.5)
        assert waiting.recv(100) == b"tick"


def test_it_lives_by_itself_where_time_passes_by_itself() -> None:
    passing = Timebase()
    with host() as waiting, DatagramLine(Echo(passing), passing, waiting.getsockname()[1]):
        assert waiting.recv(100) == b"tick"


def test_a_host_that_is_gone_does_not_end_it(time: Timebase) -> None:
    device = Echo(time)
    with DatagramLine(device, time) as line, host(line) as other:
        with host(line) as gone:
            gone.send(b"abc")
            assert gone.recv(100) == b"cba"
        # The system reports that there is no listener.
        time.advance(3.0)
        other.send(b"de")
        assert other.recv(100) == b"ed"
        assert device.heard == [b"abc", b"de"]


def test_faults_on_the_way(time: Timebase) -> None:
    device = Echo(time)
    with DatagramLine(device, time, seed=1) as line, host(line) as near:
        # It lives before it waits for a datagram, and after each.
        wait_until(lambda: device.lives == 1)
        line.faults.is_deaf = True
        near.send(b"unheard")
        wait_until(lambda: device.lives == 2)
        assert device.heard == []
        line.faults.is_deaf = False
        line.faults.corrupt_share = 1.0
        near.send(b"abc")
        damaged = near.recv(100)
        assert len(damaged) == 3
        assert sum(one != other for one, other in zip(damaged, b"cba", strict=True)) == 1
        line.faults.corrupt_share, line.faults.drop_share = 0.0, 1.0
        near.send(b"lost")
        # An answer is lost after the question was heard, and before it lives again.
        wait_until(lambda: device.lives == 4)
        assert device.heard == [b"abc", b"lost"]
        line.faults.drop_share = 0.0
        near.send(b"de")
        assert near.recv(100) == b"ed"


def test_it_is_closed_once_and_for_all(time: Timebase) -> None:
    line = DatagramLine(Echo(time), time)
    line.close()
    line.close()
    # It lives no more.
    time.advance(2.0)
