"""Requests and answers over a real pseudo-terminal, and every way in which an answer can be wrong."""

import itertools
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from robosc_bridge.devices.dynamixel_bus import DynamixelBus
from robosc_bridge.errors import DeviceSilentError
from robosc_bridge.transport.serial_line import SerialLine
from support.peer import Answers, Peer, status

LIMIT_S = 0.1


@contextmanager
def _bus(peer: Peer, limit_s: float = LIMIT_S) -> Iterator[DynamixelBus]:
    with SerialLine(peer.path, 1_000_000) as line:
        bus = DynamixelBus(line, lambda device: f"device {device}", limit_s)
        bus.begin(10.0)
        yield bus


@pytest.mark.real_time
def test_silence_is_told_in_time_and_names_who_answers_instead() -> None:
    with Peer(lambda request: [status(7, b"1234")]) as peer, _bus(peer) as bus:
        begin_s = time.monotonic()
        with pytest.raises(DeviceSilentError, match="device 1 does not answer, but device 7 does"):
            bus.read(1, 132, 4)
        assert LIMIT_S < time.monotonic() - begin_s < 5 * LIMIT_S
        # The next device is not held up: the port is not busy, and nothing waits.
        assert bus.read(7, 132, 4).data == b"1234"


@pytest.mark.real_time
def test_all_requests_of_a_cycle_end_with_it() -> None:
    with Peer(lambda request: []) as peer, _bus(peer) as bus:
        begin_s = time.monotonic()
        bus.begin(1.5 * LIMIT_S, repeats=5)
        with pytest.raises(DeviceSilentError):
            bus.read(1, 132, 4)
        with pytest.raises(DeviceSilentError, match="no time is left"):
            bus.write(1, 64, b"\1")
        assert 1.4 * LIMIT_S < time.monotonic() - begin_s < 3 * LIMIT_S


@pytest.mark.real_time
def test_a_clock_that_is_set_back_prolongs_no_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time, "time", itertools.count(1e9, -1.0).__next__)
    with Peer(lambda request: []) as peer, _bus(peer) as bus:
        bus.begin(1.0, repeats=0)
        begin_s = time.monotonic()
        with pytest.raises(DeviceSilentError):
            bus.ping(1)
        assert time.monotonic() - begin_s < 3 * LIMIT_S


@pytest.mark.real_time
def test_an_endless_stream_of_foreign_bytes_ends_the_wait_all_the_same() -> None:
    flood = [status(7, b"1234"), b"\xff\xff\xfd\x00" * 50]

    def babble(request: bytes) -> Answers:
        end_s = time.monotonic() + 5 * LIMIT_S
        while time.monotonic() < end_s:
            yield from flood
            yield 0.001

    with Peer(babble) as peer, _bus(peer) as bus:
        bus.begin(1.0, repeats=0)
        begin_s = time.monotonic()
        with pytest.raises(DeviceSilentError):
            bus.ping(1)
        assert time.monotonic() - begin_s < 3 * LIMIT_S
