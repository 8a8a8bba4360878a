"""Keys of a real terminal, one by one."""

import os
import pty
import queue
import termios

from robosc_bridge.daemon.keyboard import Keyboard

LIMIT_S = 10.0


def test_keys_are_read_one_by_one_and_the_terminal_is_as_before() -> None:
    host, terminal = pty.openpty()
    before = termios.tcgetattr(terminal)
    keys: queue.SimpleQueue[str] = queue.SimpleQueue()
    with Keyboard(keys.put, terminal) as keyboard:
        assert keyboard.is_there
        os.write(host, b" r")
        assert [keys.get(timeout=LIMIT_S) for _ in range(2)] == ["space", "r"]
        assert not termios.tcgetattr(terminal)[3] & termios.ICANON
    assert termios.tcgetattr(terminal) == before
    os.close(host)
    os.close(terminal)


def test_without_a_terminal_nothing_is_read() -> None:
    reading, writing = os.pipe()
    os.write(writing, b"x")
    with Keyboard(lambda key: None, reading) as keyboard:
        assert not keyboard.is_there
    assert os.read(reading, 1) == b"x"
    os.close(reading)
    os.close(writing)


def test_a_terminal_that_goes_away_is_no_error() -> None:
    host, terminal = pty.openpty()
    with Keyboard(lambda key: None, terminal):
        os.close(host)
    os.close(terminal)
