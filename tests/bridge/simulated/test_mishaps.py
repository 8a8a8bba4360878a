"""What goes wrong while a simulator serves: it is told, and nothing goes on mute."""

import io
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from robosc_bridge.simulated import OpenCr
from robosc_bridge.simulated.__main__ import main
from robosc_bridge.simulated.mishaps import Mishaps
from robosc_bridge.simulated.output import Output
from support.wire import Host

FULL = Path("/dev/full")


@pytest.mark.parametrize("option", ["--record", "--motion"])
def test_on_a_full_disk_the_robot_goes_on_and_it_is_told(option: str) -> None:
    command = [sys.executable, "-m", "robosc_bridge.simulated", "--base", "dynamixel", option, str(FULL)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        base, scanner = (process.stdout.readline().split()[1] for _ in range(2))
        with Host(scanner, 115_200) as host:
            # More than is kept before it is written.
            host.receive(10_000)
        assert process.stderr.readline() == (
            "/dev/full is not whole, because it cannot be written to any more: No space left on device\n"
        )
        with Host(base) as host:
            assert host.ask("ff ff fd 00 01 03 00 01 19 4e") == "ff ff fd 00 01 07 00 55 00 24 04 2d f4 df"
        with Host(scanner, 115_200) as host:
            assert b"\x54\x2c" in host.receive(200)
        process.send_signal(signal.SIGTERM)
        assert process.wait(10) == 1
        assert process.stderr.read() == ""


def test_a_file_on_a_full_disk_is_told_of_once_also_if_it_is_noticed_at_the_end() -> None:
    told: list[str] = []
    output = Output(FULL, told.append)
    output.write("a few letters")
    assert told == []
    output.close()
    output.close()
    assert len(told) == 1
    output = Output(FULL, told.append)
    output.write("x")
    output.flush()
    output.write("y" * 100_000)
    output.flush()
    output.close()
    assert len(told) == 2


def test_what_was_written_is_there(tmp_path: Path) -> None:
    mishaps = Mishaps()
    output = Output(tmp_path / "file", mishaps.tell)
    output.write("one\n")
    output.flush()
    assert (tmp_path / "file").read_text() == "one\n"
    output.close()
    assert mishaps.status == 0


def test_a_thread_that_fails_ends_the_program(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(signal, "signal", lambda number, handler: None)
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    before = threading.excepthook

    def fail(self: OpenCr, now_s: float) -> None:
        raise ZeroDivisionError("a battery of no cells")

    monkeypatch.setattr(OpenCr, "_cycle", fail)
    assert main([]) == 1
    told = capsys.readouterr().err
    assert "in fail" in told
    assert told.splitlines()[-1].startswith("the simulation ends, because the thread 'simulated line ")
    assert told.endswith("has failed: ZeroDivisionError: a battery of no cells\n")
    assert threading.excepthook is before


def test_a_thread_that_means_to_end_is_no_mishap() -> None:
    with Mishaps() as mishaps:
        thread = threading.Thread(target=sys.exit)
        thread.start()
        thread.join()
    assert (mishaps.has_crashed, mishaps.status) == (False, 0)
