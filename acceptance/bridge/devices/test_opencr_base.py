"""A stock TurtleBot3 through its OpenCR: what it is told byte for byte, and what can be wrong with it."""

import time
from collections.abc import Iterator

import pytest

from robosc_bridge.devices.interface import MotorFault, Velocity
from robosc_bridge.errors import DeviceFaultError
from support.drive import Rig, rig


@pytest.fixture
def bench() -> Iterator[Rig]:
    with rig("opencr") as found:
        yield found


@pytest.mark.real_time
def test_torque_that_is_gone_is_a_fault_that_stays_until_torque_is_switched_on_anew(bench: Rig) -> None:
    bench.start()
    bench.drive(Velocity(0.1), 0.2)
    bench.robot.left.overload()
    begin_s = time.monotonic()
    reading = bench.drive_until(lambda reading: MotorFault.TORQUE_LOST in reading.faults, Velocity(0.1))
    assert time.monotonic() - begin_s < 0.2
    assert not reading.is_torque_on
    assert bench.stops_within(0.1)
    # Whatever is wanted then, nothing moves.
    reading = bench.drive(Velocity(0.1), 0.2)
    assert reading.faults == {MotorFault.TORQUE_LOST}
    assert bench.goals_rad_s() == (0.0, 0.0)
    with pytest.raises(DeviceFaultError, match="a wheel motor does not hold; switch the robot off and on"):
        bench.base.set_torque(True)
    assert not bench.robot.right.table["torque enable"]
    with pytest.raises(DeviceFaultError, match="does not hold"):
        bench.base.reset()
