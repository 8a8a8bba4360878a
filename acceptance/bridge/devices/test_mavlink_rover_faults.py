"""Faults of a real line to a MAVLink rover."""

import threading

import pytest

from support.descriptors import open_descriptors
from support.rovers import FORWARD, rig

pytestmark = pytest.mark.real_time


def test_a_disturbed_line_is_driven_on_and_nothing_is_left_behind() -> None:
    def count() -> tuple[int, int]:
        return open_descriptors(), threading.active_count()

    with rig("udpout") as bench:
        before = count()
        bench.start()
        bench.line.faults.corrupt_share = 0.2
        reading = bench.drive(FORWARD, 1.0)
        assert reading.is_torque_on
        assert reading.velocity.linear_m_s == pytest.approx(0.2, abs=0.001)
        assert bench.base._link is not None
        assert bench.base._link.counts.bad_frames > 0
        bench.base.close()
        bench.base.open()
        bench.base.close()
        assert count() == before
