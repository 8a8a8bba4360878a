"""Faults of the line to a MAVLink rover, and signing."""

import math
import threading
import time
from pathlib import Path

import pytest

from robosc_bridge.devices import mavlink_rover
from robosc_bridge.devices.registry import make_drive_base, make_range_scanner
from robosc_bridge.errors import (
    DeviceError,
    DeviceSilentError,
    LineBusyError,
    LineLostError,
    LineMissingError,
)
from robosc_bridge.protocol.mavlink_signing import Signing
from robosc_bridge.simulated import SimulatedLine
from support.descriptors import open_descriptors
from support.rovers import BODY, FORWARD, KEY, Bench, rig
from support.wire import wait_until

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
    wait_until(lambda: bench.speed_m_s == 0.0, 0.5)
    assert 0.8 < time.monotonic() - begin_s < 1.4


@pytest.mark.real_time
def test_lost_heartbeats_are_told_though_telemetry_goes_on(bench: Bench) -> None:
    bench.start()
    bench.rover._due_s[0] = math.inf
    begin_s = time.monotonic()
    with pytest.raises(DeviceSilentError, match=r"no heartbeat of the rover for 3\.5 s"):
        bench.drive(FORWARD, 6.0)
    assert 3.0 < time.monotonic() - begin_s < 4.0


def test_a_vehicle_that_starts_anew_must_be_opened_again(bench: Bench) -> None:
    bench.start()
    bench.drive(FORWARD, 2.5)
    with bench.time.lock:
        bench.rover.restart()
        # A fast one, which goes on telling what it was asked for.
        bench.rover._after_interval(30, 0.05)
    with pytest.raises(DeviceError, match="has started anew"):
        bench.drive(FORWARD, 2.0)
    bench.start()
    assert bench.drive(FORWARD, 0.2).is_torque_on


@pytest.mark.real_time
def test_an_unplugged_line_is_told_at_once_and_can_be_plugged_in_again(bench: Bench) -> None:
    assert isinstance(bench.line, SimulatedLine)
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.line.disconnect()
    begin_s = time.monotonic()
    with pytest.raises(LineLostError, match=bench.path):
        bench.drive(FORWARD, 1.0)
    assert time.monotonic() - begin_s < 0.2
    with pytest.raises(LineMissingError):
        bench.base.open()
    bench.line.reconnect()
    bench.base.open()
    assert not bench.drive(FORWARD, 0.1).is_torque_on
    assert not bench.rover.is_armed


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


def test_noise_before_every_packet_is_dropped(bench: Bench) -> None:
    assert isinstance(bench.line, SimulatedLine)
    bench.line.faults.garbage = bytes.fromhex("fd ff 00 00 01 01 01 00 00 00 fe")
    bench.start()
    assert bench.drive(FORWARD, 0.3).velocity.linear_m_s == pytest.approx(0.2, abs=0.001)


def test_a_busy_port_is_told(bench: Bench) -> None:
    bench.base.open()
    other = make_drive_base("mavlink-rover", path=bench.path, robot=BODY)
    with pytest.raises(LineBusyError, match="another drive base of this program uses this port"):
        other.open()
    stranger = make_range_scanner("mavlink-rover", path=bench.path, baud=9600)
    with pytest.raises(LineBusyError, match="with other settings"):
        stranger.open()
    assert not bench.drive(FORWARD).is_torque_on


def test_nothing_is_left_behind(any_bench: Bench) -> None:
    def count() -> tuple[int, int]:
        return open_descriptors(), threading.active_count()

    before = count()
    for _ in range(2):
        any_bench.base.open()
        any_bench.base.close()
    assert count() == before


def test_a_signed_vehicle_is_driven_with_its_key_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mavlink_rover, "_FIRST_HEARTBEAT_LIMIT_S", 1.0)
    key_file = tmp_path / "key"
    key_file.write_text(KEY.hex())
    with rig(key=KEY, signing_key=str(key_file)) as bench:
        # Its clock does not go back to when it was built.
        bench.rover._encoder.timestamp = Signing(key_file).begin().timestamp()
        bench.start()
        assert bench.drive(FORWARD, 0.3).velocity.linear_m_s == pytest.approx(0.2, abs=0.001)
        assert bench.rover.parser.rejected == 0
        bench.base.close()
        key_file.write_bytes(bytes(32))
        with pytest.raises(DeviceSilentError, match="the same signing key"):
            bench.base.open()
