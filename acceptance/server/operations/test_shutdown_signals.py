"""A server that is asked to end does, whatever hangs: whole processes, in which something is made to hang."""

import contextlib
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from support.waiting import PATIENCE_S

# The bound of the end is cut short, and its first step never returns.
_HANGING = """
import asyncio, sys, time
import robosc_server.application as application
import robosc_server.operations.shutdown as shutdown
from robosc_server.main import main

async def waiting(*_):
    await asyncio.Event().wait()

async def working(*_):
    time.sleep(3600)

begin = shutdown.ShutdownSignals.__init__
shutdown.ShutdownSignals.__init__ = lambda self, drain_s: begin(self, drain_s, LIMIT)
application.drain = HOW
main(["--port", "0", "--worker-processes", "1", "--state-dir", sys.argv[1], "--drain-seconds", "0"])
"""


@contextmanager
def hanging(how: str, limit_s: float, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """A server that has begun to serve, and will hang when it is asked to end."""
    program = _HANGING.replace("LIMIT", str(limit_s)).replace("HOW", how)
    command = [sys.executable, "-c", program, str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline().startswith("robosc-server listening on ")
            yield process
        finally:
            process.kill()


@pytest.mark.parametrize(("how", "words"), [("waiting", "waits at "), ("working", " in working")])
def test_an_end_that_hangs_is_forced_and_reported(how: str, words: str, tmp_path: Path) -> None:
    with hanging(how, 1.0, tmp_path) as process:
        process.send_signal(signal.SIGTERM)
        _, log = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1, log
    assert words in log
    # The place where it hangs is in the program of this test, which is no file.
    assert "<string>" in log


def test_a_second_interrupt_ends_it_at_once(tmp_path: Path) -> None:
    with hanging("waiting", 3600.0, tmp_path) as process:
        process.send_signal(signal.SIGINT)
        # Another request to end gracefully changes nothing, also one that comes while it ends.
        process.send_signal(signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(0.3)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        _, log = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 128 + signal.SIGINT, log
    assert "exiting immediately after a second interrupt" in log
