"""The contract of a serial line, over real pseudo-terminals."""

import contextlib
import errno
import fcntl
import os
import resource
import termios
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import serial.serialposix

from robosc_bridge.errors import BridgeError, LineBusyError, LineDeniedError, LineError, LineLostError, LineMissingError
from robosc_bridge.transport.serial_line import SerialLine
from support.descriptors import open_descriptors
from support.pty_end import LIMIT_S, PtyEnd
from support.waiting import PATIENCE_S

NEVER_S = 3600.0
"""Longer than any test waits."""


@pytest.fixture
def pty() -> Iterator[PtyEnd]:
    end = PtyEnd()
    yield end
    end.unplug()


@pytest.fixture
def line(pty: PtyEnd) -> Iterator[SerialLine]:
    with SerialLine(pty.path, 115200) as opened:
        yield opened


def test_an_adapter_is_asked_to_keep_no_bytes_back(pty: PtyEnd, monkeypatch: pytest.MonkeyPatch) -> None:
    """The setting of a UART's driver, `struct serial_struct` of the kernel: a pseudo-terminal has none."""
    wanted = []

    def ioctl(file: int, request: int, argument: Any = 0, mutate: bool = True) -> Any:
        if request == termios.TIOCGSERIAL:
            return 0
        if request == termios.TIOCSSERIAL:
            wanted.append(argument[4] & 0x2000)  # ASYNC_LOW_LATENCY among its flags
            return 0
        return real(file, request, argument, mutate)

    real = fcntl.ioctl
    monkeypatch.setattr(serial.serialposix.fcntl, "ioctl", ioctl)
    with SerialLine(pty.path, 1_000_000):
        assert wanted == [0x2000]


def _everything(line: SerialLine, length: int) -> bytes:
    found = b""
    end_s = time.monotonic() + LIMIT_S
    while len(found) < length and time.monotonic() < end_s:
        found += line.read(LIMIT_S)
    return found


class Background:
    """A call in another thread."""

    def __init__(self, call: Callable[[], bytes]) -> None:
        self.result: bytes | BridgeError | None = None
        self._call = call
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            self.result = self._call()
        except BridgeError as error:
            self.result = error

    def end(self) -> bytes | BridgeError | None:
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive()
        return self.result


def test_bytes_arrive_as_they_were_sent_in_both_directions(pty: PtyEnd, line: SerialLine) -> None:
    every = bytes(range(256))
    pty.send(every)
    assert _everything(line, 256) == every
    line.write(every)
    assert pty.receive(256) == every
    assert pty.is_silent()


def test_reading_waits_for_the_first_byte_and_not_for_more(pty: PtyEnd, line: SerialLine) -> None:
    reading = Background(lambda: line.read(NEVER_S))
    pty.send(b"x")
    assert reading.end() == b"x"


def test_reading_gives_up_at_its_limit(line: SerialLine) -> None:
    begin_s = time.monotonic()
    assert line.read(0.05) == b""
    assert time.monotonic() - begin_s >= 0.049


def test_a_line_that_becomes_free_takes_the_rest(pty: PtyEnd, line: SerialLine) -> None:
    data = os.urandom(20_000)
    found = b""

    def receive() -> bytes:
        nonlocal found
        while len(found) < len(data):
            found += os.read(pty.master, 1000)
        return found

    reading = Background(receive)
    line.write(data, PATIENCE_S)
    assert reading.end() == data


def test_discarded_input_does_not_come(pty: PtyEnd, line: SerialLine) -> None:
    pty.send(b"old")
    assert _everything(line, 3) == b"old"
    pty.taken = 3
    pty.send(b"older")
    # Bytes that the kernel still carries have not come yet.
    pty.settle()
    line.discard_input()
    pty.send(b"new")
    assert _everything(line, 3) == b"new"


def test_wake_lets_a_waiting_read_return(line: SerialLine) -> None:
    reading = Background(lambda: line.read(NEVER_S))
    line.wake()
    assert reading.end() == b""


def test_wake_before_a_read_is_not_lost_and_holds_once(line: SerialLine) -> None:
    line.wake()
    line.wake()
    assert Background(lambda: line.read(NEVER_S)).end() == b""
    begin_s = time.monotonic()
    assert line.read(0.05) == b""
    assert time.monotonic() - begin_s >= 0.049


def test_waking_a_line_that_nobody_reads_never_blocks(pty: PtyEnd, line: SerialLine) -> None:
    for _ in range(100_000):  # More than the pipe holds.
        line.wake()
    pty.send(b"x")
    assert _everything(line, 1) == b"x"


def test_a_signal_handler_may_wake_a_line_that_its_own_thread_is_waking(
    line: SerialLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = os.write
    handled: list[bytes] = []

    def interrupted(file: int, data: bytes) -> int:
        if not handled:
            handled.append(data)
            # The handler would do this, in the midst of it.
            line.wake()
        return real(file, data)

    monkeypatch.setattr(os, "write", interrupted)
    line.wake()
    assert handled == [b"\0"]
    assert line.read(LIMIT_S) == b""


def test_wake_does_not_take_bytes_along(pty: PtyEnd, line: SerialLine) -> None:
    pty.send(b"x")
    line.wake()
    assert _everything(line, 1) == b"x"


def test_a_missing_port() -> None:
    with pytest.raises(LineMissingError, match=r"^/dev/no-such-port: there is no such port; is the device plugged in"):
        SerialLine("/dev/no-such-port", 115200)


def test_a_port_in_use(pty: PtyEnd, line: SerialLine) -> None:
    with pytest.raises(LineBusyError, match="another program uses this port"):
        SerialLine(pty.path, 115200)
    line.close()
    SerialLine(pty.path, 115200).close()


@pytest.mark.parametrize(
    ("number", "kind"),
    [
        (errno.EACCES, LineDeniedError),
        (errno.EPERM, LineDeniedError),
        (errno.EBUSY, LineBusyError),
        (errno.ENXIO, LineMissingError),
        (errno.ENODEV, LineMissingError),
    ],
)
def test_what_the_system_refuses(
    pty: PtyEnd, monkeypatch: pytest.MonkeyPatch, number: int, kind: type[LineError]
) -> None:
    """Refused as the system would: root, as which tests often run, is refused nothing."""

    def refuse(*_: object) -> int:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("serial.serialposix.os.open", refuse)
    with pytest.raises(LineError) as found:
        SerialLine(pty.path, 115200)
    assert type(found.value) is kind
    assert found.value.path == pty.path


@pytest.mark.skipif(os.geteuid() == 0, reason="root may open everything")
def test_a_port_of_somebody_else(pty: PtyEnd) -> None:
    Path(pty.path).chmod(0)
    with pytest.raises(LineDeniedError, match="group dialout"):
        SerialLine(pty.path, 115200)


def test_no_serial_port(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_bytes(b"")
    for path in (file, tmp_path, Path("/dev/null")):
        with pytest.raises(LineError, match="cannot be opened as a serial port") as found:
            SerialLine(str(path), 115200)
        assert type(found.value) is LineError


@pytest.mark.parametrize("baud", [-1, 2**40])
def test_a_speed_that_cannot_be(pty: PtyEnd, baud: int) -> None:
    with pytest.raises(LineError):
        SerialLine(pty.path, baud)
    with SerialLine(pty.path, 115200) as line:
        with pytest.raises(LineError, match=f"cannot be set to {baud} baud"):
            line.set_baud(baud)
        assert line.baud == 115200


def test_the_speed_is_set_and_can_be_changed(pty: PtyEnd) -> None:
    with SerialLine(pty.path, 115200) as line:
        assert pty.baud_constant() == termios.B115200
        line.set_baud(230400)
        assert line.baud == 230400
        assert pty.baud_constant() == termios.B230400
        pty.send(b"x")
        assert line.read(LIMIT_S) == b"x"


def test_a_pseudo_terminal_has_no_modem_lines(line: SerialLine) -> None:
    line.set_dtr(False)


def test_a_line_that_is_lost_while_a_thread_reads(pty: PtyEnd, line: SerialLine) -> None:
    reading = Background(lambda: line.read(NEVER_S))
    pty.unplug()
    result = reading.end()
    assert isinstance(result, LineLostError)
    assert str(result).startswith(f"{pty.path}: ")


def test_what_came_before_the_line_was_lost_is_read_or_lost_but_the_loss_is_reported(
    pty: PtyEnd, line: SerialLine
) -> None:
    pty.send(b"x")
    pty.unplug()
    with pytest.raises(LineLostError):
        for _ in range(3):
            assert line.read(LIMIT_S) in (b"x", b"")


@pytest.mark.parametrize(
    "use",
    [
        lambda line: line.write(b"x"),
        lambda line: line.read(LIMIT_S),
        lambda line: line.discard_input(),
        lambda line: line.set_baud(230400),
        lambda line: line.set_dtr(False),
    ],
    ids=["write", "read", "discard", "baud", "dtr"],
)
@pytest.mark.parametrize("is_closed", [False, True])
def test_every_use_of_a_line_that_is_gone_says_so(
    pty: PtyEnd, line: SerialLine, use: Callable[[SerialLine], object], is_closed: bool
) -> None:
    if is_closed:
        line.close()
    else:
        pty.unplug()
    with pytest.raises(LineError):
        use(line)


def test_a_closed_line_reads_nobody_elses_file(line: SerialLine) -> None:
    line.close()
    pipes = [os.pipe() for _ in range(8)]
    try:
        for _, writer in pipes:
            os.write(writer, b"theirs")
        with pytest.raises(LineLostError, match="closed"):
            line.read(0.0)
        for reader, _ in pipes:
            assert os.read(reader, 100) == b"theirs"
    finally:
        for end in (end for pipe in pipes for end in pipe):
            os.close(end)


def test_closing_again_and_waking_a_closed_line_do_nothing(pty: PtyEnd, line: SerialLine) -> None:
    line.close()
    line.close()
    line.wake()
    pty.unplug()
    line.close()


def test_a_line_that_is_gone_can_be_closed(pty: PtyEnd, line: SerialLine) -> None:
    pty.unplug()
    line.close()


def test_no_descriptor_is_left(pty: PtyEnd, tmp_path: Path) -> None:
    before = open_descriptors()
    for _ in range(20):
        with SerialLine(pty.path, 115200) as line:
            line.wake()
            with pytest.raises(LineBusyError):
                SerialLine(pty.path, 115200)
        for path, baud in (("/dev/no-such-port", 9600), ("/dev/null", 9600), (str(tmp_path), 9600), (pty.path, 2**40)):
            with pytest.raises(LineError):
                SerialLine(path, baud)
    assert open_descriptors() <= before


def test_a_file_number_above_1024_does_not_matter() -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = 1400
    if hard != resource.RLIM_INFINITY and hard < wanted:
        pytest.skip("this system does not allow so many open files")
    with contextlib.ExitStack() as stack:
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, wanted), hard))
        stack.callback(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        while True:
            number = os.open(os.devnull, os.O_RDONLY)
            stack.callback(os.close, number)
            if number > 1100:
                break
        pty = PtyEnd()
        stack.callback(pty.unplug)
        line = stack.enter_context(SerialLine(pty.path, 115200))
        pty.send(b"x")
        assert line.read(LIMIT_S) == b"x"
        with pytest.raises(LineLostError, match="takes no more bytes"):
            line.write(b"x" * 1_000_000, 0.01)
        reading = Background(lambda: line.read(NEVER_S))
        line.wake()
        assert reading.end() == b""
