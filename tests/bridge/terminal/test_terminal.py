"""Driving by keys: the command as a program on a real pseudo-terminal."""

import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from robosc_bridge.daemon.programs import items as programs
from robosc_bridge.remote import endpoint as endpoint_module
from support.remote import FakeDaemon, served
from support.terminals import Terminal, driving, requested_velocities
from support.waiting import PATIENCE_S, wait_until


@pytest.fixture
def daemon() -> Iterator[FakeDaemon]:
    with FakeDaemon(is_layer=True) as made:
        yield made


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_it_in_order(number: int, daemon: FakeDaemon) -> None:
    with driving(daemon) as terminal:
        assert terminal.is_raw
        # Again and again: a busy machine may let the time of a key pass before it is requested.
        wait_until(lambda: ("/cmd_vel", 0.02, 0) in requested_velocities(daemon), repeat=lambda: terminal.type("xw"))
        terminal.process.send_signal(number)
        assert terminal.process.wait(PATIENCE_S) == 128 + number
        assert not terminal.is_raw
        wait_until(lambda: daemon.of(programs.Detached))
        assert requested_velocities(daemon)[-1] == ("/cmd_vel", 0, 0)


def test_the_end_of_the_bridge_is_reported(daemon: FakeDaemon, monkeypatch: pytest.MonkeyPatch) -> None:
    # However long a busy machine takes for it.
    monkeypatch.setattr(endpoint_module, "_GRACE_S", PATIENCE_S)
    with served(daemon) as endpoint:
        terminal = Terminal(endpoint.address)
        try:
            # Its display says that it has called, not that the bridge has heard it.
            daemon.program()
            endpoint.stop()
            assert terminal.process.wait(PATIENCE_S) == 2
            wait_until(lambda: "the bridge ends" in terminal.seen)
        finally:
            terminal.close()


def test_a_controller_is_not_driven() -> None:
    with FakeDaemon() as daemon, served(daemon) as endpoint:
        terminal = Terminal(endpoint.address)
        try:
            assert terminal.process.wait(PATIENCE_S) == 1
            wait_until(lambda: "the supervisor of Porter is a controller and drives by itself" in terminal.seen)
        finally:
            terminal.close()


def test_without_a_terminal_it_is_wrong_use(daemon: FakeDaemon) -> None:
    with served(daemon) as endpoint:
        command = [sys.executable, "-m", "robosc_bridge.command", "teleop", "--address", endpoint.address]
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (2, "robosc-bridge: keys need a terminal, and there is none\n")
    assert not daemon.received
