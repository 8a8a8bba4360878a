"""Simulated time as the executor's clock: what has passed, and when it has gone back."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from robosc.targets.ros2.runtime.node_time import SimulatedClock, SteadyClock


class World:
    """The time of ROS, in nanoseconds."""

    def __init__(self) -> None:
        self.now_ns = 0

    def read(self) -> int:
        return self.now_ns


def test_no_time_passes_before_the_first_message_on_clock() -> None:
    world = World()
    clock = SimulatedClock(world.read)
    assert clock.monotonic() == 0.0
    assert not clock.has_begun
    world.now_ns = 1_700_000_000_000_000_000
    assert clock.monotonic() == 0.0
    assert clock.has_begun
    world.now_ns += 250_000_000
    assert clock.monotonic() == 0.25


def test_a_paused_simulation_stands() -> None:
    world = World()
    world.now_ns = 7
    clock = SimulatedClock(world.read)
    assert {clock.monotonic() for _ in range(3)} == {0.0}


def test_a_jump_back_is_reported_once_and_time_goes_on() -> None:
    world = World()
    world.now_ns = 10_000_000_000
    clock = SimulatedClock(world.read)
    clock.monotonic()
    world.now_ns = 12_000_000_000
    assert clock.monotonic() == 2.0
    world.now_ns = 1_000_000_000
    assert clock.monotonic() == 2.0
    world.now_ns = 1_500_000_000
    assert clock.monotonic() == 2.5
    assert (clock.take_jump(), clock.take_jump()) == (11.0, 0.0)


@given(st.lists(st.integers(0, 2**62), max_size=20))
def test_it_never_goes_back_and_counts_every_step_forward(readings: list[int]) -> None:
    world = World()
    clock = SimulatedClock(world.read)
    times = []
    for world.now_ns in readings:
        times.append(clock.monotonic())
    assert times == sorted(times)
    steps = [after - before for before, after in pairwise(reading for reading in readings if reading)]
    assert clock.monotonic() == sum(step for step in steps if step > 0) * 1e-9
    assert clock.take_jump() == -sum(step for step in steps if step < 0) * 1e-9


def test_a_steady_clock_never_jumps() -> None:
    clock = SteadyClock()
    assert clock.monotonic() <= clock.monotonic()
    assert (clock.has_begun, clock.take_jump()) == (True, 0.0)
