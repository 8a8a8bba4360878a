"""Driving by keys: the command as a program on a real pseudo-terminal."""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from robosc_bridge.daemon import programs
from robosc_bridge.terminal.teleop import LAPSE_S
from support.remote import FakeDaemon, served
from support.terminals import Terminal
from support.waiting import PATIENCE_S, wait_until


@pytest.fixture
def daemon() -> Any:
    with FakeDaemon(is_layer=True) as made:
        yield made


@contextmanager
def driving(daemon: FakeDaemon) -> Iterator[Terminal]:
    with served(daemon) as face:
        terminal = Terminal(face.address)
        try:
            wait_until(lambda: "w/s or up/down" in terminal.seen)
            yield terminal
        finally:
            terminal.close()


def wishes(daemon: FakeDaemon) -> list[tuple[str, float, float]]:
    found = daemon.of(programs.Requested)
    return [(item.identifier, item.data["linear"]["x"], item.data["angular"]["z"]) for item in found]


@pytest.mark.real_time
def test_without_a_key_it_halts_by_itself(daemon: FakeDaemon) -> None:
    with driving(daemon) as terminal:
        terminal.type("www")
        wait_until(lambda: ("/cmd_vel", 0.06, 0) in wishes(daemon))
        begin_s = time.monotonic()
        wait_until(lambda: wishes(daemon)[-1] == ("/cmd_vel", 0, 0))
        assert time.monotonic() - begin_s < 5 * LAPSE_S
        # The operator is there, and wishes nothing.
        seen, count = daemon.seen, len(wishes(daemon))
        wait_until(lambda: daemon.seen >= seen + 5)
        assert len(wishes(daemon)) <= count + 3
        assert not daemon.of(programs.Detached)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_it_in_order(number: int, daemon: FakeDaemon) -> None:
    with driving(daemon) as terminal:
        assert terminal.is_raw
        terminal.type("w")
        wait_until(lambda: ("/cmd_vel", 0.02, 0) in wishes(daemon))
        terminal.process.send_signal(number)
        assert terminal.process.wait(PATIENCE_S) == 128 + number
        assert not terminal.is_raw
        wait_until(lambda: daemon.of(programs.Detached))
        assert wishes(daemon)[-1] == ("/cmd_vel", 0, 0)


def test_the_end_of_the_bridge_is_told(daemon: FakeDaemon) -> None:
    with served(daemon) as face:
        terminal = Terminal(face.address)
        try:
            wait_until(lambda: "w/s or up/down" in terminal.seen)
            face.stop()
            assert terminal.process.wait(PATIENCE_S) == 2
            wait_until(lambda: "the bridge ends" in terminal.seen)
        finally:
            terminal.close()


def test_a_controller_is_not_driven() -> None:
    with FakeDaemon() as daemon, served(daemon) as face:
        terminal = Terminal(face.address)
        try:
            assert terminal.process.wait(PATIENCE_S) == 1
            wait_until(lambda: "the supervisor of Porter is a controller and drives by itself" in terminal.seen)
        finally:
            terminal.close()


def test_without_a_terminal_it_is_wrong_use(daemon: FakeDaemon) -> None:
    with served(daemon) as face:
        command = [sys.executable, "-m", "robosc_bridge.command", "teleop", "--address", face.address]
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (2, "robosc-bridge: keys are typed in a terminal, and there is none\n")
    assert not daemon.told
