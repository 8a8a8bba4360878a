"""A record of all bytes on the lines, from a simulator as a program."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from robosc_simulated import Record, read_records
from support.wire import Host

PING = bytes.fromhex("fffffd0001030001194e")
PONG = bytes.fromhex("fffffd00010700550024042df4df")


def test_all_bytes_are_recorded_with_their_times(tmp_path: Path) -> None:
    file = tmp_path / "record"
    command = [sys.executable, "-m", "robosc_simulated", "--base", "dynamixel", "--record", str(file)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        base, scanner = (process.stdout.readline().split()[1] for _ in range(2))
        with Host(base) as host, Host(scanner, 230_400) as laser:
            begin_s = time.monotonic()
            host.send(PING)
            assert host.receive(len(PONG)) == PONG
            end_s = time.monotonic()
            seen = laser.receive(500)
        process.send_signal(signal.SIGTERM)
        assert process.wait(10) == 0
    records = list(read_records(file.read_text(encoding="ascii").splitlines()))
    asked, answered = [record for record in records if record.line == "base"]
    assert (asked.is_from_host, asked.data) == (True, PING)
    assert (answered.is_from_host, answered.data) == (False, PONG)
    assert begin_s - 1e-5 <= asked.time_s <= answered.time_s <= end_s + 1e-5
    sent = b"".join(record.data for record in records if record.line == "scanner" and not record.is_from_host)
    assert seen in sent


def test_a_record_is_read() -> None:
    assert list(read_records(["12.500000 scanner < 542c\n", "13.000000 base > ff\n"])) == [
        Record(12.5, "scanner", False, b"\x54\x2c"),
        Record(13.0, "base", True, b"\xff"),
    ]


def test_what_is_no_record_is_refused() -> None:
    with pytest.raises(ValueError):
        list(read_records(["base > ff"]))


def test_a_record_that_cannot_be_written_is_one_message(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "robosc_simulated", "--record", str(tmp_path / "missing" / "record")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=30)
    assert done.returncode == 1
    assert done.stdout == ""
    assert "No such file" in done.stderr
    assert done.stderr.count("\n") == 1
