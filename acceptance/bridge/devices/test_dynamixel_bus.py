"""Requests without an answer over a real pseudo-terminal: reported in time, and nothing is computed meanwhile.

It is the witness that what `tests/bridge/devices/test_dynamixel_bus.py` shows on a virtual host is so in real time.
"""

import resource
import time

import pytest

from robosc_bridge.devices.dynamixel_bus import DynamixelBus
from robosc_bridge.errors import DeviceSilentError
from robosc_bridge.transport.serial_line import SerialLine
from support.peer import Peer, status

LIMIT_S = 0.1


@pytest.mark.real_time
def test_silence_is_reported_in_time_and_waiting_costs_nothing() -> None:
    with Peer(lambda request: [status(7, b"1234")]) as peer, SerialLine(peer.path, 1_000_000) as line:
        bus = DynamixelBus(line, lambda device: f"device {device}", LIMIT_S)
        bus.begin(10.0)
        begin_s, begin = time.monotonic(), resource.getrusage(resource.RUSAGE_THREAD)
        with pytest.raises(DeviceSilentError, match="device 1 does not answer, but device 7 does"):
            bus.read(1, 132, 4)
        end = resource.getrusage(resource.RUSAGE_THREAD)
        assert LIMIT_S < time.monotonic() - begin_s < 5 * LIMIT_S
        assert end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime < 0.05
        # The next device is not held up: the port is not busy, and nothing waits.
        assert bus.read(7, 132, 4).data == b"1234"
