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
from robosc_bridge.daemon.states import Command
from robosc_bridge.terminal.teleop import LAPSE_S
from support.remote import FakeDaemon, served
from support.terminals import Terminal
from support.waiting import PATIENCE_S, wait_until

pytestmark = pytest.mark.real_time


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


def test_keys_drive_and_it_is_said_again_while_wished(daemon: FakeDaemon) -> None:
    with driving(daemon) as terminal:
        assert daemon.program().may_request
        terminal.type("w\x1b[D")
        wait_until(lambda: ("/cmd_vel", 0.02, 0.2) in wishes(daemon))
        begin_s, count = time.monotonic(), len(wishes(daemon))

        def go_on() -> bool:
            terminal.type("k")
            time.sleep(0.05)
            return time.monotonic() - begin_s > 2 * LAPSE_S

        wait_until(go_on)
        assert len(wishes(daemon)) >= count + 5
        assert set(wishes(daemon)[count:]) == {("/cmd_vel", 0.02, 0.2)}


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


def test_without_a_terminal_that_answers_there_is_no_sign_of_life(daemon: FakeDaemon) -> None:
    with driving(daemon) as terminal:
        seen = daemon.seen
        wait_until(lambda: daemon.seen > seen)
        terminal.answers = False
        asked = terminal.asked
        wait_until(lambda: terminal.asked >= asked + 5)
        seen, asked = daemon.seen, terminal.asked
        wait_until(lambda: terminal.asked >= asked + 3)
        assert daemon.seen == seen
        terminal.type("?")
        wait_until(lambda: daemon.seen > seen)


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


def test_a_resume_without_an_answer_does_not_keep_a_stop_from_being_typed(daemon: FakeDaemon) -> None:
    daemon.refusal = None
    with driving(daemon) as terminal:
        terminal.type("r")
        wait_until(lambda: daemon.commands() == [Command.RESUME])
        begin_s = time.monotonic()
        terminal.type(" ")
        wait_until(lambda: daemon.commands() == [Command.RESUME, Command.STOP])
        assert time.monotonic() - begin_s < 5.0
        terminal.type("q")
        assert terminal.process.wait(PATIENCE_S) == 0


def test_q_ends_with_a_stop_of_the_motion(daemon: FakeDaemon) -> None:
    with driving(daemon) as terminal:
        terminal.type("www")
        wait_until(lambda: ("/cmd_vel", 0.06, 0) in wishes(daemon))
        terminal.type("q")
        assert terminal.process.wait(PATIENCE_S) == 0
        wait_until(lambda: daemon.of(programs.Detached))
        assert wishes(daemon)[-1] == ("/cmd_vel", 0, 0)


def test_what_was_wished_ends_with_zeros_and_the_link_stays(daemon: FakeDaemon) -> None:
    with driving(daemon) as terminal:
        terminal.type("wx")
        wait_until(lambda: wishes(daemon)[-1:] == [("/cmd_vel", 0, 0)])
        seen, count = daemon.seen, len(wishes(daemon))
        wait_until(lambda: daemon.seen >= seen + 5)
        assert len(wishes(daemon)) <= count + 3
        assert not daemon.of(programs.Detached)


def test_the_space_bar_stops_the_robot_and_r_lets_it_go_on(daemon: FakeDaemon) -> None:
    with driving(daemon) as terminal:
        terminal.type("w ")
        wait_until(lambda: daemon.commands() == [Command.STOP])
        wait_until(lambda: "stopped: r lets it go on" in terminal.seen)
        wait_until(lambda: wishes(daemon)[-1:] == [("/cmd_vel", 0, 0)])
        daemon.refusal = "a button that stops is pressed"
        terminal.type("r")
        wait_until(lambda: "a button that stops is pressed" in terminal.seen)
        assert daemon.commands() == [Command.STOP, Command.RESUME]


def test_what_is_blocked_and_refused_is_shown(daemon: FakeDaemon) -> None:
    with driving(daemon) as terminal:
        terminal.type("w")
        daemon.program().tell(programs.Blocked("/cmd_vel"))
        wait_until(lambda: "BLOCKED /cmd_vel" in terminal.seen)
        daemon.program().tell(programs.Refused("who are you?\x1b[2J"))
        wait_until(lambda: "who are you?" in terminal.seen)
        assert "\x1b[2J" not in terminal.seen


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
