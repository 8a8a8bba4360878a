"""Faults of the line to a MAVLink rover, and signing."""

import math
from pathlib import Path

import pytest

from robosc_bridge.devices import mavlink_rover
from robosc_bridge.devices.robots import Body
from robosc_bridge.driver_registry import make_drive_base, make_range_scanner
from robosc_bridge.errors import DeviceError, DeviceSilentError, LineBusyError, LineLostError, LineMissingError
from robosc_bridge.protocol.mavlink_signing import Signing
from robosc_simulated import SimulatedLine, VirtualHost
from support.rovers import BODY, FORWARD, KEY, Bench, rig


@pytest.mark.parametrize("values", [(0.0, 1.0, 0.3), (0.5, math.nan, 0.3), (0.5, 1.0, -1.0)])
def test_a_body_needs_numbers(values: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="must be a positive number"):
        Body(*values)


def test_lost_heartbeats_are_reported_though_telemetry_goes_on(bench: Bench) -> None:
    bench.start()
    bench.rover._due_s[0] = math.inf
    begin_s = bench.host.monotonic()
    with pytest.raises(DeviceSilentError, match=r"no heartbeat of the rover for 3\.5 s"):
        bench.drive(FORWARD, 6.0)
    assert 3.0 < bench.host.monotonic() - begin_s < 4.0


def test_a_vehicle_that_starts_anew_must_be_opened_again(bench: Bench) -> None:
    bench.start()
    bench.drive(FORWARD, 2.5)
    with bench.time.lock:
        bench.rover.restart()
        # A fast one, which goes on sending what it was asked for.
        bench.rover._after_interval(30, 0.05)
    with pytest.raises(DeviceError, match="has restarted"):
        bench.drive(FORWARD, 2.0)
    bench.start()
    assert bench.drive(FORWARD, 0.2).is_torque_on


def test_an_unplugged_line_is_reported_at_once_and_can_be_plugged_in_again(bench: Bench) -> None:
    assert isinstance(bench.line, SimulatedLine)
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.line.disconnect()
    begin_s = bench.host.monotonic()
    with pytest.raises(LineLostError, match=bench.path):
        bench.drive(FORWARD, 1.0)
    assert bench.host.monotonic() - begin_s < 0.2
    with pytest.raises(LineMissingError):
        bench.base.open()
    bench.line.reconnect()
    bench.base.open()
    assert not bench.drive(FORWARD, 0.1).is_torque_on
    assert not bench.rover.is_armed


def test_nobody_at_the_other_end_of_udp_is_silence() -> None:
    with VirtualHost() as host:
        base = make_drive_base("mavlink-rover", path="udpout:127.0.0.1:9", robot=BODY, host=host)
        begin_s = host.monotonic()
        with pytest.raises(DeviceSilentError, match=r"no heartbeat of a rover within 3\.5 s"):
            base.open()
        assert host.monotonic() - begin_s == pytest.approx(3.5)


@pytest.mark.parametrize("fault", ["corrupt_share", "drop_share"])
def test_a_disturbed_line_is_driven_on(bench: Bench, fault: str) -> None:
    bench.start()
    setattr(bench.line.faults, fault, 0.2)
    for _ in range(5):
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


def test_a_busy_port_is_reported(bench: Bench) -> None:
    bench.base.open()
    other = make_drive_base("mavlink-rover", path=bench.path, robot=BODY)
    with pytest.raises(LineBusyError, match="another drive base of this program uses this port"):
        other.open()
    stranger = make_range_scanner("mavlink-rover", path=bench.path, baud=9600)
    with pytest.raises(LineBusyError, match="with other settings"):
        stranger.open()
    assert not bench.drive(FORWARD).is_torque_on


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
