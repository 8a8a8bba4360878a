"""Tests that any printed output arrives, or its loss is reported; a reader who left is no fault."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

COMMANDS = {
    "list": ["robosc", "generate", "--list-targets"],
    "list of the client": ["robosc-client", "generate", "--list-targets"],
    "help": ["robosc", "generate", "--help"],
    "server's example": ["robosc-server", "example-config"],
    "server's check": ["robosc-server", "check-config", "--port", "0", "--json"],
    "server's token": ["robosc-server", "token", "somebody"],
    "server's version": ["robosc-server", "--version"],
}
"""The first word is the program's."""

# Output that fails at once, and output that fails when all that was kept is written at the end.
BUFFERED = {True: "", False: "1"}
EACH = [*((command, True) for command in COMMANDS), ("list", False)]
EACH_OTHER = [*((command, False) for command in COMMANDS), ("list", True)]


def run(command: str, is_buffered: bool, place: int) -> "subprocess.CompletedProcess[str]":
    program, *words = COMMANDS[command]
    return subprocess.run(
        [str(Path(sys.executable).with_name(program)), *words],
        stdout=place,
        stderr=subprocess.PIPE,
        env=os.environ | {"PYTHONUNBUFFERED": BUFFERED[is_buffered]},
        text=True,
        timeout=60,
        check=False,
    )


@pytest.mark.parametrize(("command", "is_buffered"), EACH)
def test_a_full_disk_is_reported(command: str, is_buffered: bool) -> None:
    with Path("/dev/full").open("w") as full:
        found = run(command, is_buffered, full.fileno())
    assert found.returncode == 2
    assert found.stderr == f"{COMMANDS[command][0]}: cannot write the results: No space left on device\n"


@pytest.mark.parametrize(("command", "is_buffered"), EACH_OTHER)
def test_a_reader_who_left_is_no_fault(command: str, is_buffered: bool) -> None:
    read, write = os.pipe()
    os.close(read)
    try:
        found = run(command, is_buffered, write)
    finally:
        os.close(write)
    assert (found.returncode, found.stderr) == (0, "")


def test_a_server_serves_though_nobody_takes_where_it_listens(tmp_path: Path) -> None:
    command = [str(Path(sys.executable).with_name("robosc-server")), "--port", "0", "--state-dir", str(tmp_path)]
    with Path("/dev/full").open("w") as full:
        process = subprocess.Popen(command, stdout=full, stderr=subprocess.PIPE, text=True)
    with process:
        assert process.stderr is not None
        try:
            lines = iter(process.stderr.readline, "")
            address = next((line for line in lines if "listening on 127.0.0.1:" in line), None)
        finally:
            process.terminate()
        rest = process.stderr.read()
    assert address is not None
    assert "No space left on device" in address
    assert (process.returncode, "Exception" in rest) == (0, False)
