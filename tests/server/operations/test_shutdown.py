"""A server that is asked to end does, whatever hangs: what its signals set going, on held time."""

import asyncio
import faulthandler
import logging
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from robosc_server.operations.shutdown import ShutdownSignals
from support.held_time import HeldLoop, on_held_time
from support.waiting import PATIENCE_S, until


@pytest.fixture
def forced(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Forced end of the process, recorded instead of executed."""
    found: dict[str, Any] = {}

    def later(seconds: float, *, exit: bool, file: Any) -> None:  # noqa: A002  # its name there
        found.update(after_s=seconds, exits=exit)

    def leave(status: int) -> None:
        found["status"] = status

    monkeypatch.setattr(faulthandler, "dump_traceback_later", later)
    monkeypatch.setattr(faulthandler, "cancel_dump_traceback_later", found.clear)
    monkeypatch.setattr(os, "_exit", leave)
    return found


def run_on_held_time(test: Callable[[HeldLoop, ShutdownSignals], Coroutine[Any, Any, None]]) -> None:
    async def run(loop: HeldLoop) -> None:
        shutdown = ShutdownSignals(30.0)
        shutdown.listen()
        await test(loop, shutdown)

    on_held_time(run)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_an_end_that_hangs_is_reported_and_will_be_forced(
    forced: dict[str, Any], caplog: pytest.LogCaptureFixture, number: signal.Signals
) -> None:
    async def hanging() -> None:
        await asyncio.Event().wait()

    async def test(loop: HeldLoop, shutdown: ShutdownSignals) -> None:
        task = asyncio.create_task(hanging(), name="what hangs")
        os.kill(os.getpid(), number)
        await shutdown.requested()
        assert forced == {"after_s": 50.0, "exits": True}
        await loop.passed(49.4)
        assert "takes too long" not in caplog.text
        await loop.passed(0.2)
        assert "the shutdown takes too long: what hangs waits at test_shutdown.py:" in caplog.text
        task.cancel()
        shutdown.finished()
        assert not forced

    with caplog.at_level(logging.ERROR):
        run_on_held_time(test)


def test_a_second_interrupt_ends_it_at_once(forced: dict[str, Any], caplog: pytest.LogCaptureFixture) -> None:
    async def test(loop: HeldLoop, shutdown: ShutdownSignals) -> None:
        # Another request to end gracefully changes nothing, also one that comes while it ends.
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGTERM):
            os.kill(os.getpid(), number)
        await shutdown.requested()
        assert "status" not in forced
        os.kill(os.getpid(), signal.SIGINT)
        await until(lambda: "status" in forced)
        assert (forced["status"], shutdown._interrupts) == (128 + signal.SIGINT, 2)

    run_on_held_time(test)
    assert "exiting immediately after a second interrupt" in caplog.text


_HANGING = """
import asyncio, os, signal, time
from robosc_server.operations.shutdown import ShutdownSignals

async def main():
    shutdown = ShutdownSignals(0.0, end_s=0.01)
    shutdown.listen()
    os.kill(os.getpid(), signal.SIGTERM)
    await shutdown.requested()
    time.sleep(3600)

asyncio.run(main())
"""


def test_a_process_that_hangs_is_ended_and_reports_where() -> None:
    done = subprocess.run(
        [sys.executable, "-c", _HANGING], capture_output=True, text=True, check=False, timeout=PATIENCE_S
    )
    assert done.returncode == 1, done.stderr
    assert "Timeout" in done.stderr
    # The place where it hangs is in this program, which is no file.
    assert "<string>" in done.stderr
