"""The contract of a serial line, over real pseudo-terminals."""

import time
from collections.abc import Iterator

import pytest

from robosc_bridge.errors import LineLostError
from robosc_bridge.transport.serial_line import SerialLine
from support.pty_end import LIMIT_S, PtyEnd


@pytest.fixture
def pty() -> Iterator[PtyEnd]:
    end = PtyEnd()
    yield end
    end.unplug()


@pytest.fixture
def line(pty: PtyEnd) -> Iterator[SerialLine]:
    with SerialLine(pty.path, 115200) as opened:
        yield opened


@pytest.mark.real_time
def test_without_a_limit_reading_does_not_wait(pty: PtyEnd, line: SerialLine) -> None:
    for limit_s in (0.0, -1.0):
        begin_s = time.monotonic()
        assert line.read(limit_s) == b""
        assert time.monotonic() - begin_s < 1.0
        pty.send(b"x")
        pty.settle()
        assert line.read(limit_s) == b"x"
        pty.taken += 1


@pytest.mark.real_time
def test_a_full_line_is_an_error_after_the_limit(line: SerialLine) -> None:
    begin_s = time.monotonic()
    with pytest.raises(LineLostError, match="takes no more bytes"):
        line.write(b"x" * 1_000_000, 0.1)
    assert 0.09 <= time.monotonic() - begin_s < LIMIT_S
