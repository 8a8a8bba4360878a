"""Tests of the daemon's telemetry messages: bytes, signs, units, and the ring of obstacles against a slow twin."""

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from robosc_bridge.daemon.states import State
from robosc_bridge.daemon.threads.reports import Device
from robosc_bridge.devices.interface import BINS, MotorFault, Pose, Velocity
from robosc_bridge.ground_station import telemetry
from robosc_bridge.ground_station.command_handler import ReceivedCommand, acknowledgement
from robosc_bridge.ground_station.status import status_of
from robosc_bridge.ground_station.status_texts import Chunk, Severity, status_text
from robosc_bridge.ground_station.telemetry import Make
from robosc_bridge.ground_station.values import named_value
from robosc_bridge.protocol.mavlink import Codec
from robosc_bridge.protocol.mavlink_messages import Mode, Result
from robosc_bridge.protocol.mavlink_obstacles import ring_distances_cm
from robosc_bridge.safety import Caution, Reason
from support.ground import STANDBY, Station, reading_of, scan_of

_ZEROS = (0.0,) * 6


def _bytes(make: Make, sequence: int) -> str:
    """Return the bytes of component 191 of system 1."""
    codec = Codec(1, 191)
    for _ in range(sequence):
        codec.encode(lambda library: library.heartbeat_encode(10, 0, 0, 0, 0))
    return codec.encode(make).hex(" ")


def _message(make: Make | None) -> Any:
    assert make is not None
    (message,) = Station().hear(Codec(1, 1).encode(make))
    return message


def test_the_worked_packets() -> None:
    assert _bytes(named_value("state", 3, 1000), 4) == (
        "fd 0d 00 00 04 01 bf fc 00 00 e8 03 00 00 03 00 00 00 73 74 61 74 65 37 f9"
    )
    assert _bytes(status_text(Severity.INFO, Chunk(b"plain", 0, 0)), 1) == (
        "fd 06 00 00 01 01 bf fd 00 00 06 70 6c 61 69 6e 85 41"
    )
    asked = ReceivedCommand((255, 190), 400, (1.0, *_ZEROS))
    assert _bytes(acknowledgement(asked, Result.ACCEPTED), 7) == (
        "fd 0a 00 00 07 01 bf 4d 00 00 90 01 00 00 00 00 00 00 ff be 90 1a"
    )


@pytest.mark.parametrize(
    ("values", "is_layer", "expected"),
    [
        ({"state": State.STARTING}, False, (False, Mode.INITIALISING, 1, 1)),
        ({}, False, (False, Mode.AUTO, 1 | 4, 3)),
        ({}, True, (False, Mode.GUIDED, 1 | 8 | 64, 3)),
        ({"state": State.RUNNING}, False, (True, Mode.AUTO, 1 | 4 | 128, 4)),
        ({"state": State.RUNNING}, True, (True, Mode.GUIDED, 1 | 8 | 64 | 128, 4)),
        ({"state": State.RUNNING, "reasons": (Reason.TORQUE_AWAITED,)}, False, (True, Mode.AUTO, 133, 4)),
        ({"state": State.RUNNING, "reasons": (Reason.OPERATOR_STOP,)}, False, (True, Mode.HOLD, 129, 5)),
        ({"state": State.RUNNING, "reasons": (Reason.SCAN_STALE,)}, False, (True, Mode.AUTO, 133, 5)),
        ({"state": State.RUNNING, "stops": ("/scan is stale",)}, False, (True, Mode.AUTO, 133, 5)),
        ({"state": State.STOPPING, "reading": reading_of(is_torque_on=True)}, False, (True, Mode.AUTO, 133, 3)),
        ({"state": State.FAULT, "problem": "x", "reasons": (Reason.MOTOR_FAULT,)}, False, (False, Mode.AUTO, 5, 6)),
        ({"state": State.FAULT, "problem": "x", "devices": {Device.DRIVE: False}}, False, (False, Mode.AUTO, 5, 6)),
        ({"state": State.FAULT, "problem": "x", "reasons": (Reason.SUPERVISOR_FAULT,)}, False, (False, 10, 5, 5)),
        ({"state": State.FAULT, "problem": "x", "reasons": (Reason.PAUSED,)}, False, (False, 10, 5, 5)),
        ({"state": State.OVER}, False, (False, Mode.AUTO, 5, 7)),
    ],
)
def test_the_heartbeat_reports_the_state(values: dict[str, Any], is_layer: bool, expected: tuple[int, ...]) -> None:
    status = status_of(replace(STANDBY, **values), is_layer=is_layer, is_stale=False)
    assert (status.is_armed, status.mode, status.base_mode, status.system_status) == expected
    message = _message(telemetry.heartbeat(status))
    _, mode, base_mode, system_status = expected
    assert (message.type, message.autopilot) == (10, 0)
    assert (message.base_mode, message.custom_mode, message.system_status) == (base_mode, mode, system_status)


def test_a_loop_that_hangs_is_an_emergency() -> None:
    running = replace(STANDBY, state=State.RUNNING)
    assert status_of(running, is_layer=False, is_stale=True).system_status == 6
    assert status_of(None, is_layer=False, is_stale=True).system_status == 6
    assert status_of(None, is_layer=False, is_stale=False).system_status == 1


def test_turning_left_is_negative_there() -> None:
    reading = reading_of(12.5, pose=Pose(1.0, 2.0, math.pi / 2), velocity=Velocity(0.1, 0.5))
    message = _message(telemetry.odometry(reading))
    assert (message.frame_id, message.child_frame_id, message.estimator_type) == (20, 12, 1)
    assert (message.x, message.y, message.z) == (1.0, -2.0, 0.0)
    assert message.q == pytest.approx([math.sqrt(0.5), 0.0, 0.0, -math.sqrt(0.5)])
    assert (message.vx, message.vy, message.yawspeed) == pytest.approx((0.1, 0.0, -0.5))
    assert math.isnan(message.pose_covariance[0])
    assert math.isnan(message.velocity_covariance[0])
    assert message.time_usec == 12_500_000
    message = _message(telemetry.attitude(reading, 7))
    assert (message.time_boot_ms, message.yaw, message.yawspeed) == pytest.approx((7, -math.pi / 2, -0.5))
    message = _message(telemetry.local_position(reading, 7))
    assert (message.x, message.y, message.vx, message.vy) == pytest.approx((1.0, -2.0, 0.0, -0.1))


def test_the_battery() -> None:
    full = replace(STANDBY, reading=reading_of(battery_v=12.1, battery_share=0.774), overruns=3)
    message = _message(telemetry.sys_status(full, 70_000))
    assert (message.voltage_battery, message.battery_remaining, message.current_battery) == (12100, 77, -1)
    assert (message.errors_comm, message.errors_count1) == (65535, 3)
    message = _message(telemetry.battery_status(full))
    assert (message.voltages, message.battery_remaining, message.charge_state) == ([12100] + [65535] * 9, 77, 1)
    assert (message.current_battery, message.current_consumed, message.energy_consumed, message.temperature) == (
        -1,
        -1,
        -1,
        32767,
    )
    low = replace(full, warnings=(Caution.BATTERY,))
    assert _message(telemetry.battery_status(low)).charge_state == 2
    empty = replace(low, reasons=(Reason.BATTERY_LOW,))
    assert _message(telemetry.battery_status(empty)).charge_state == 3
    assert telemetry.battery_status(STANDBY) is None
    message = _message(telemetry.sys_status(STANDBY, 0))
    assert (message.voltage_battery, message.battery_remaining) == (65535, -1)
    for volts in (math.nan, -1.0, 1e9):
        assert telemetry.battery_status(replace(STANDBY, reading=reading_of(battery_v=volts))) is None


@pytest.mark.parametrize(
    ("values", "health"),
    [
        ({}, 0x8000 | 0x4000000),
        ({"devices": {Device.DRIVE: False, Device.SCANNER: True}}, 0x4000000),
        ({"devices": {Device.DRIVE: True, Device.SCANNER: False}}, 0x8000),
        ({"reasons": (Reason.SCAN_STALE,)}, 0x8000),
        ({"reading": reading_of(faults=frozenset({MotorFault.OVERLOAD}))}, 0x4000000),
        ({"reading": reading_of(battery_v=12.0)}, 0x8000 | 0x4000000 | 0x2000000),
        ({"reading": reading_of(battery_v=9.0), "reasons": (Reason.BATTERY_LOW,)}, 0x8000 | 0x4000000),
    ],
)
def test_the_health_of_the_devices(values: dict[str, Any], health: int) -> None:
    message = _message(telemetry.sys_status(replace(STANDBY, **values), 0))
    assert message.onboard_control_sensors_health == health | dialect.MAV_SYS_STATUS_GEOFENCE
    assert message.onboard_control_sensors_present == message.onboard_control_sensors_enabled
    assert message.onboard_control_sensors_present & health == health
    assert message.onboard_control_sensors_present & 0x4008000 == 0x4008000


def test_a_robot_without_a_scanner_reports_none() -> None:
    message = _message(telemetry.sys_status(replace(STANDBY, devices={Device.DRIVE: True}), 0))
    assert message.onboard_control_sensors_present == 0x8000


def test_obstacles_go_clockwise_from_the_front() -> None:
    # Ahead, to the left and to the right; too near, too far.
    message = _message(
        telemetry.obstacle_distance(scan_of({0: 1.0, 90: 2.0, 268: 0.299, 180: 0.05, 135: 9.0}), 0.12, 3.5)
    )
    assert (message.frame, message.increment, message.increment_f, message.angle_offset) == (12, 5, 5.0, 0.0)
    assert (message.min_distance, message.max_distance, message.time_usec) == (12, 350, 100_000_000)
    near = {place: value for place, value in enumerate(message.distances) if value != 65535}
    assert near == {0: 100, 54: 200, 18: 29, 36: 12, 45: 351}


def _slow_ring(ranges_m: list[float], least_cm: int, most_cm: int) -> list[int]:
    """Every bin goes to the entry that is nearest to it, clockwise; what touches is as near as can be."""
    nearest: list[float | None] = [None] * 72
    for degrees, range_m in enumerate(ranges_m):
        if math.isnan(range_m):
            continue
        entry = round(-degrees / 5) % 72
        before = nearest[entry]
        nearest[entry] = range_m if before is None else min(before, range_m)
    found = []
    for value in nearest:
        if value is None:
            found.append(65535)
        elif value * 100 >= most_cm + 1:
            found.append(most_cm + 1)
        else:
            found.append(max(math.floor(value * 100 + 1e-6), least_cm))
    return found


@given(
    st.lists(
        st.one_of(st.just(math.nan), st.just(0.0), st.just(math.inf), st.floats(0.001, 20.0)),
        min_size=BINS,
        max_size=BINS,
    )
)
def test_the_ring_is_that_of_the_slow_twin(ranges_m: list[float]) -> None:
    assert list(ring_distances_cm(ranges_m, 12, 350)) == _slow_ring(ranges_m, 12, 350)


def test_the_dialect_is_the_one_whose_numbers_are_used() -> None:
    assert dialect.WIRE_PROTOCOL_VERSION == "2.0"
    assert (dialect.MAV_SYS_STATUS_SENSOR_PROXIMITY, dialect.MAV_SYS_STATUS_SENSOR_BATTERY) == (0x4000000, 0x2000000)
    assert dialect.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS == 0x8000
