"""Drive bases over real pseudo-terminals, by the computer's clock.

They are the witness that what `tests/bridge/devices/test_drive_bases.py` shows on a virtual host is so in real time.
"""

import time
from collections.abc import Iterator

import pytest

from robosc_bridge.devices.interface import Velocity
from robosc_bridge.errors import DeviceSilentError, LineLostError
from robosc_bridge.transport.system_host import SYSTEM_HOST
from support.descriptors import open_descriptors
from support.drive import Rig, rig

pytestmark = pytest.mark.real_time

FORWARD = Velocity(0.15, 0.0)


@pytest.fixture(params=("opencr", "dynamixel"))
def bench(request: pytest.FixtureRequest) -> Iterator[Rig]:
    with rig(request.param, host=SYSTEM_HOST) as found:
        yield found


def test_silence_is_reported_in_time_and_a_driver_that_dies_stops_the_wheels(bench: Rig) -> None:
    bench.start()
    assert bench.drive(FORWARD, 0.4).velocity.linear_m_s == pytest.approx(0.15, abs=0.001)
    bench.hurry()
    bench.robot.base_faults.is_deaf = True
    begin_s = time.monotonic()
    with pytest.raises(DeviceSilentError, match="not answer"):
        bench.base.exchange(FORWARD)
    assert time.monotonic() - begin_s < 0.3
    assert bench.stops_within(0.7)


def test_an_unplugged_line_is_reported_at_once_and_no_descriptor_is_left(bench: Rig) -> None:
    before = open_descriptors()
    bench.start()
    bench.robot.base_line.disconnect()
    begin_s = time.monotonic()
    with pytest.raises(LineLostError, match=bench.robot.base_path):
        bench.base.exchange(FORWARD)
    assert time.monotonic() - begin_s < 0.1
    bench.base.close()
    assert open_descriptors() <= before
