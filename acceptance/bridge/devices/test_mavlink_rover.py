"""A MAVLink rover as a drive base, over a real pseudo-terminal and real UDP."""

import math

import pytest

from robosc_bridge.devices.interface import STANDSTILL, Velocity
from robosc_simulated.rover import GUIDED
from support.rovers import FORWARD, POSE, Bench

pytestmark = pytest.mark.real_time


def test_it_opens_disarmed_and_drives_as_commanded(any_bench: Bench) -> None:
    bench = any_bench
    bench.base.open()
    reading = bench.drive(FORWARD, 0.2)
    assert not reading.is_torque_on
    assert not bench.rover.is_armed
    assert bench.rover.targets == []
    assert reading.battery_v is None or reading.battery_v == pytest.approx(12.0)
    bench.base.set_torque(True)
    assert bench.rover.is_armed
    assert bench.rover.mode == GUIDED
    reading = bench.drive(Velocity(0.2, 0.5), 0.6)
    assert reading.is_torque_on
    assert reading.faults == frozenset()
    assert reading.velocity.linear_m_s == pytest.approx(0.2, abs=0.001)
    assert reading.velocity.angular_rad_s == pytest.approx(0.5, abs=0.01)
    assert reading.wheels_m_s == pytest.approx((0.16, 0.24), abs=0.002)
    bench.drive_until(lambda reading: reading.velocity == STANDSTILL)
    reading = bench.drive(seconds=0.2)
    x_m, y_m, heading_rad = bench.world.pose
    # The distance ahead, seen from its first place.
    ahead_m = (x_m - POSE[0]) * math.cos(POSE[2]) + (y_m - POSE[1]) * math.sin(POSE[2])
    left_m = (y_m - POSE[1]) * math.cos(POSE[2]) - (x_m - POSE[0]) * math.sin(POSE[2])
    assert (reading.pose.x_m, reading.pose.y_m) == pytest.approx((ahead_m, left_m), abs=0.001)
    assert reading.pose.heading_rad == pytest.approx(heading_rad - POSE[2], abs=0.001)
    assert reading.pose.heading_rad > 0.2
    assert reading.battery_v == pytest.approx(12.0)
    assert reading.battery_share == pytest.approx(0.77)
    bench.base.close()
    assert not bench.rover.is_armed
    bench.base.close()
