"""A MAVLink rover as a source of obstacles over real UDP."""

import pytest

from robosc_bridge.driver_registry import make_range_scanner
from robosc_bridge.host import monotonic
from support.rovers import rig

pytestmark = pytest.mark.real_time


def test_obstacles_come_and_it_is_reported_that_somebody_is_there() -> None:
    with rig("udpin") as bench:
        scanner = make_range_scanner("mavlink-rover", path=bench.path)
        scanner.open()
        try:
            begin_s = monotonic()
            scan = scanner.receive(3.0)
            assert scan is not None
            assert begin_s < scan.time_s <= monotonic()
            while (254, 191) not in bench.rover.heartbeats:
                assert monotonic() < begin_s + 5.0
                scanner.receive(0.1)
        finally:
            scanner.close()
