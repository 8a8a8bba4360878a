"""Errors while a simulator serves: each is reported, and nothing goes on silently."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from support.wire import Host

FULL = Path("/dev/full")


@pytest.mark.parametrize("option", ["--record", "--motion"])
def test_on_a_full_disk_the_robot_goes_on_and_it_is_reported(option: str) -> None:
    command = [sys.executable, "-m", "robosc_simulated", "--base", "dynamixel", option, str(FULL)]
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
