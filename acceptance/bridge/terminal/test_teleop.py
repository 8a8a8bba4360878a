"""Driving by keys in real time: the command as a program on a real pseudo-terminal."""

import time
from collections.abc import Iterator

import pytest

from robosc_bridge.daemon.programs import items as programs
from robosc_bridge.terminal.teleop import EXPIRY_S
from support.remote import FakeDaemon
from support.terminals import driving, requested_velocities
from support.waiting import wait_until


@pytest.fixture
def daemon() -> Iterator[FakeDaemon]:
    with FakeDaemon(is_layer=True) as made:
        yield made


@pytest.mark.real_time
def test_without_a_key_it_halts_by_itself(daemon: FakeDaemon) -> None:
    with driving(daemon) as terminal:
        terminal.type("www")
        wait_until(lambda: ("/cmd_vel", 0.06, 0) in requested_velocities(daemon))
        begin_s = time.monotonic()
        wait_until(lambda: requested_velocities(daemon)[-1] == ("/cmd_vel", 0, 0))
        assert time.monotonic() - begin_s < 5 * EXPIRY_S
        # The operator is there, and requests nothing.
        seen, count = daemon.seen, len(requested_velocities(daemon))
        wait_until(lambda: daemon.seen >= seen + 5)
        assert len(requested_velocities(daemon)) <= count + 3
        assert not daemon.of(programs.Detached)
