"""Tests of failures while a simulator serves: they are reported, and nothing continues silently."""

import io
import signal
import sys
import threading
from pathlib import Path

import pytest

from robosc_simulated import OpenCr
from robosc_simulated.__main__ import main
from robosc_simulated.error_monitor import ErrorMonitor
from robosc_simulated.output import Output

FULL = Path("/dev/full")


def test_a_file_on_a_full_disk_is_reported_once_also_if_it_is_noticed_at_the_end() -> None:
    reported: list[str] = []
    output = Output(FULL, reported.append)
    output.write("a few letters")
    assert reported == []
    output.close()
    output.close()
    assert len(reported) == 1
    output = Output(FULL, reported.append)
    output.write("x")
    output.flush()
    output.write("y" * 100_000)
    output.flush()
    output.close()
    assert len(reported) == 2


def test_what_was_written_is_there(tmp_path: Path) -> None:
    error_monitor = ErrorMonitor()
    output = Output(tmp_path / "file", error_monitor.report)
    output.write("one\n")
    output.flush()
    assert (tmp_path / "file").read_text() == "one\n"
    output.close()
    assert error_monitor.status == 0


def test_a_thread_that_fails_ends_the_program(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(signal, "signal", lambda number, handler: None)
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    before = threading.excepthook

    def fail(self: OpenCr, began_s: float, now_s: float) -> None:
        raise ZeroDivisionError("a battery of no cells")

    monkeypatch.setattr(OpenCr, "_cycle", fail)
    assert main([]) == 1
    reported = capsys.readouterr().err
    assert "in fail" in reported
    assert reported.splitlines()[-1].startswith("the simulation ends, because the thread 'simulated line ")
    assert reported.endswith("has failed: ZeroDivisionError: a battery of no cells\n")
    assert threading.excepthook is before


def test_a_thread_that_means_to_end_is_no_mishap() -> None:
    with ErrorMonitor() as error_monitor:
        thread = threading.Thread(target=sys.exit)
        thread.start()
        thread.join()
    assert (error_monitor.has_crashed, error_monitor.status) == (False, 0)
