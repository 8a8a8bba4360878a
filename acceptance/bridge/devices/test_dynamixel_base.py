"""Two servos as wheels: what they are told byte for byte, and what can be wrong with them."""

import time
from collections.abc import Iterator

import pytest

from robosc_bridge.devices.dynamixel import DynamixelBase
from robosc_bridge.devices.interface import MotorFault, Velocity
from robosc_bridge.devices.robots import BURGER
from robosc_bridge.errors import DeviceFaultError, DeviceSilentError
from support.drive import PATIENT_S, Rig, rig

ZERO = "ff ff fd 00 fe 11 00 83 68 00 04 00 01 00 00 00 00 02 00 00 00 00 e4 d0"

HARDWARE = "ff ff fd 00 01 07 00 02 46 00 01 00 3c a3"

FORWARD = Velocity(0.15)


@pytest.fixture
def bench() -> Iterator[Rig]:
    with rig("dynamixel") as found:
        yield found


@pytest.mark.real_time
def test_the_wheels_speed_up_as_wanted(bench: Rig) -> None:
    bench.base = DynamixelBase(bench.robot.base_path, BURGER, acceleration_rad_s2=5.0, answer_limit_s=PATIENT_S)
    bench.start()
    assert bench.robot.left.table["profile acceleration"] == 13
    begin_s = time.monotonic()
    bench.drive_until(lambda reading: reading.wheels_m_s[0] > 0.145, FORWARD)
    assert 0.5 < time.monotonic() - begin_s < 1.5
    assert bench.drive(FORWARD).faults == frozenset()
    bench.base.close()


@pytest.mark.real_time
@pytest.mark.parametrize(
    ("provoke", "fault"),
    [("overload", MotorFault.OVERLOAD), ("overheat", MotorFault.OVERHEATING)],
)
def test_a_motor_that_shuts_down_stops_the_other_one_at_once(bench: Rig, provoke: str, fault: MotorFault) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    getattr(bench.robot.left, provoke)()
    bench.tap.packets.clear()
    reading = bench.base.exchange(FORWARD)
    assert fault in reading.faults
    assert not reading.is_torque_on
    assert bench.stops_within(0.1)
    assert bench.tap.packets[2] == HARDWARE
    assert bench.tap.packets[3] == ZERO
    # Whatever is wanted then, nothing moves.
    assert fault in bench.drive(FORWARD, 0.2).faults
    assert bench.goals_rad_s() == (0.0, 0.0)
    with pytest.raises(DeviceFaultError, match=rf"motor 1 \(left\) tells {fault}; it must be reset"):
        bench.base.set_torque(True)


@pytest.mark.real_time
def test_a_watchdog_that_trips_unseen_is_told_soon(bench: Rig) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.robot.right.table["bus watchdog"] = 0xFF
    begin_s = time.monotonic()
    bench.drive_until(lambda reading: MotorFault.WATCHDOG in reading.faults, FORWARD)
    assert time.monotonic() - begin_s < 0.3


@pytest.mark.real_time
def test_torque_that_is_lost_without_a_word_is_told_soon(bench: Rig) -> None:
    bench.start()
    bench.drive(FORWARD, 0.2)
    bench.robot.right.write(64, b"\0")
    begin_s = time.monotonic()
    reading = bench.drive_until(lambda reading: MotorFault.TORQUE_LOST in reading.faults, FORWARD)
    assert time.monotonic() - begin_s < 0.3
    assert not reading.is_torque_on
    assert bench.stops_within(0.1)
    assert MotorFault.TORQUE_LOST in bench.drive(FORWARD, 0.2).faults
    assert bench.goals_rad_s() == (0.0, 0.0)


@pytest.mark.real_time
@pytest.mark.parametrize("turns", [-3, 0, 7])
def test_a_motor_that_restarts_in_motion_has_not_jumped_and_stops_both(turns: int) -> None:
    with rig("dynamixel") as bench:
        bench.robot.left.set_position(4096 * turns + 1000)
        bench.start()
        bench.drive(FORWARD, 0.3)
        bench.hurry()
        bench.robot.left.reboot()
        told_at_s = time.monotonic()
        with pytest.raises(DeviceSilentError, match=r"motor 1 \(left\)"):
            bench.drive(FORWARD, 1.0)
        assert time.monotonic() - told_at_s < 0.3
        assert bench.stops_within(0.2)
        reading = None
        while reading is None:
            try:
                reading = bench.base.exchange(FORWARD)
            except DeviceSilentError:
                assert time.monotonic() - told_at_s < 5.0
                assert bench.goals_rad_s() == (0.0, 0.0)
        assert MotorFault.TORQUE_LOST in reading.faults
        assert not reading.is_torque_on
        assert reading.pose.x_m == pytest.approx(bench.robot.world.pose[0], abs=0.01)
        # The wheel rolls on unseen for a part of the time above; a jump would be a turn of it, 0.7 rad.
        assert reading.pose.heading_rad == pytest.approx(bench.robot.world.pose[2], abs=0.2)
        assert bench.goals_rad_s() == (0.0, 0.0)
        bench.take_time()
        bench.base.reset()
        bench.base.set_torque(True)
        assert bench.drive(FORWARD, 0.2).velocity.linear_m_s == pytest.approx(0.15, abs=0.001)


@pytest.mark.real_time
def test_a_restart_without_any_silence_is_found_where_the_position_jumps(bench: Rig) -> None:
    bench.robot.left.set_position(50_000)
    bench.start()
    bench.drive(Velocity(0.02), 0.2)
    bench.robot.left._boot()
    assert MotorFault.TORQUE_LOST in bench.base.exchange(Velocity(0.02)).faults
    assert bench.stops_within(0.2)
    assert bench.base.exchange(Velocity()).pose.x_m == pytest.approx(bench.robot.world.pose[0], abs=0.002)
