"""Faults of the line to a MAVLink rover, and signing."""

import threading
import time

import pytest

from robosc_bridge.devices import mavlink_rover
from robosc_bridge.devices.registry import make_drive_base
from robosc_bridge.errors import (
    DeviceSilentError,
)
from support.descriptors import open_descriptors
from support.rovers import BODY, FORWARD, Bench, rig
from support.waiting import wait_until

pytestmark = pytest.mark.real_time


@pytest.mark.real_time
def test_silence_is_told_in_time(any_bench: Bench) -> None:
    bench = any_bench
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.rover.is_silent = True
    begin_s = time.monotonic()
    with pytest.raises(DeviceSilentError, match="has not told its motion for 1 s"):
        bench.drive(FORWARD, 3.0)
    wait_until(lambda: bench.speed_m_s == 0.0)
    assert 0.8 < time.monotonic() - begin_s < 1.4


def test_nobody_at_the_other_end_of_udp_is_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mavlink_rover, "_FIRST_HEARTBEAT_LIMIT_S", 0.2)
    base = make_drive_base("mavlink-rover", path="udpout:127.0.0.1:9", robot=BODY)
    with pytest.raises(DeviceSilentError):
        base.open()


@pytest.mark.parametrize("fault", ["corrupt_share", "drop_share"])
@pytest.mark.parametrize("kind", ["pty", "udpout"])
def test_a_disturbed_line_is_driven_on(kind: str, fault: str) -> None:
    with rig(kind) as bench:
        bench.start()
        setattr(bench.line.faults, fault, 0.2)
        reading = bench.drive(FORWARD, 1.0)
        assert reading.is_torque_on
        assert reading.velocity.linear_m_s == pytest.approx(0.2, abs=0.001)
        assert bench.base._link is not None
        assert (bench.base._link.counts.bad_frames > 0) == (fault == "corrupt_share")


def test_nothing_is_left_behind(any_bench: Bench) -> None:
    def count() -> tuple[int, int]:
        return open_descriptors(), threading.active_count()

    before = count()
    for _ in range(2):
        any_bench.base.open()
        any_bench.base.close()
    assert count() == before
