"""Scans brought to degrees, against a twin that looks at every beam for every degree."""

import math
import struct
from array import array
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from robosc.targets.ros.runtime.scans import BIN_COUNT, Resampler, bin_numbers

NAN, INFINITY = math.nan, math.inf


def single(value: float) -> float:
    """A number as a 32-bit field of a message holds it."""
    return float(struct.unpack("f", struct.pack("f", value))[0])


def distance_deg(left: float, right: float) -> float:
    return abs((left - right + 180.0) % 360.0 - 180.0)


def slow_twin(angle_min: float, increment: float, ranges: list[float], low: float, high: float) -> list[float]:
    result = []
    for degree in range(360):
        near = [
            distance
            for index, distance in enumerate(ranges)
            if distance_deg(math.degrees(angle_min + index * increment), degree) < 0.5
            and math.isfinite(distance)
            and low <= distance <= high
        ]
        result.append(min(near) if near else NAN)
    return result


def same(left: Any, right: Any) -> bool:
    return len(left) == len(right) and all(a == b or (a != a and b != b) for a, b in zip(left, right, strict=True))


distances = st.one_of(
    st.floats(0, 20, width=32), st.sampled_from([NAN, INFINITY, -INFINITY, -1.0, 0.0, single(0.12), 3.5, single(1e30)])
)


@given(
    angle_min=st.floats(-10, 10, width=32),
    increment=st.floats(-0.25, 0.25, width=32),
    ranges=st.lists(distances, max_size=60),
    low=st.sampled_from([0.0, single(0.12), 1.0, NAN]),
    high=st.sampled_from([0.0, 3.5, 100.0, INFINITY, NAN]),
)
def test_it_is_what_the_slow_twin_finds(
    angle_min: float, increment: float, ranges: list[float], low: float, high: float
) -> None:
    degrees = [math.degrees(angle_min + index * increment) for index in range(len(ranges))]
    # On the border of two bins, rounding decides.
    assume(all(abs(degree % 1.0 - 0.5) > 1e-6 for degree in degrees))
    found = Resampler().ranges(angle_min, increment, array("f", ranges), low, high)
    assert same(found, slow_twin(angle_min, increment, ranges, low, high))


LIDARS = {
    "from ahead, counter-clockwise": (0.0, math.radians(1), 360),
    "one beam twice": (0.0, 2 * math.pi / 359, 360),
    "from behind": (-math.pi, 2 * math.pi / 720, 720),
    "clockwise": (math.pi, -2 * math.pi / 1440, 1440),
    "from the left, more than once around": (math.pi / 2, math.radians(1), 450),
    "the right half": (-math.pi, math.radians(0.25), 720),
}


@pytest.mark.parametrize("name", LIDARS)
def test_an_obstacle_at_270_degrees_is_at_270_on_every_lidar(name: str) -> None:
    angle_min, increment, count = LIDARS[name]
    angle_min, increment = single(angle_min), single(increment)
    ranges = [
        0.5 if distance_deg(math.degrees(angle_min + index * increment), 270) < 0.3 else 2.0 for index in range(count)
    ]
    found = Resampler().ranges(angle_min, increment, array("f", ranges), 0.1, 10.0)
    assert found[270] == 0.5
    assert all(distance != 0.5 for degree, distance in enumerate(found) if degree != 270)
    if name == "the right half":
        assert all(math.isnan(found[degree]) for degree in range(2, 179))


def test_angles_that_are_no_numbers_give_nothing() -> None:
    for angles in ((NAN, 0.1), (0.0, NAN), (INFINITY, 0.1), (0.0, -INFINITY)):
        assert bin_numbers(*angles, 10) == []
        assert all(math.isnan(item) for item in Resampler().ranges(*angles, array("f", [1.0] * 10), 0.0, 9.0))
    assert all(0 <= number < BIN_COUNT for number in bin_numbers(3e38, 3e38, 100))
    assert bin_numbers(-1e-30, 0.0, 1) == [0]


def test_other_angles_on_the_same_topic_are_heeded() -> None:
    resampler = Resampler()
    assert resampler.ranges(0.0, 0.1, array("f", [1.0]), 0.0, 9.0)[0] == 1.0
    assert resampler.ranges(math.pi, 0.1, array("f", [1.0]), 0.0, 9.0)[180] == 1.0


def test_a_message_stays_a_valid_scan() -> None:
    messages = pytest.importorskip("sensor_msgs.msg", reason="ROS 2 is not installed")
    scan = messages.LaserScan(
        angle_min=-1.0,
        angle_max=1.0,
        angle_increment=0.5,
        time_increment=0.1,
        scan_time=0.2,
        range_min=0.25,
        range_max=8.0,
        ranges=array("f", [1.0, 2.0, 3.0, 4.0, 5.0]),
        intensities=array("f", [1.0] * 5),
    )
    scan.header.frame_id = "laser"
    changed = Resampler().resample(scan)
    assert len(changed.ranges) == 360 and changed.ranges[0] == 3.0
    assert changed.angle_min + 359 * changed.angle_increment == pytest.approx(changed.angle_max)
    assert math.degrees(changed.angle_increment) == pytest.approx(1.0)
    assert (changed.range_min, changed.range_max, changed.scan_time) == (0.25, 8.0, 0.2)
    assert changed.header.frame_id == "laser"
    assert len(changed.intensities) == 0 and changed.time_increment == 0.0


def test_a_resampled_copy_leaves_the_scan_as_it_is() -> None:
    scan = SimpleNamespace(
        ranges=array("f", [2.0, 1.0]),
        intensities=array("f", [3.0, 4.0]),
        angle_min=0.0,
        angle_max=0.1,
        angle_increment=0.1,
        time_increment=0.5,
        range_min=0.0,
        range_max=9.0,
    )
    before = dict(vars(scan))
    resampler = Resampler()
    seen = resampler.resampled(scan)
    assert vars(scan) == before
    assert len(seen.ranges) == 360
    assert (seen.ranges[0], seen.ranges[6]) == (2.0, 1.0)
    assert resampler.resampled(scan) is seen
    assert resampler.resampled(SimpleNamespace(**before)) is not seen
