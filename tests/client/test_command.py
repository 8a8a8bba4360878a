"""The installed command, from its first moment on."""

import subprocess
import sys

import pytest

from support.answers import job, watched
from support.scripted_service import scripted

CODE = """
import os, signal, sys
class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == {moment!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupt())
sys.argv = ['robosc-client', 'check', 'model.rscd', '--server', '127.0.0.1:1']
from robosc_client.command import entry
entry()
"""


@pytest.mark.parametrize("moment", ["robosc_client.main", "grpc", "robosc_api.v1"])
def test_ctrl_c_while_modules_are_loaded(moment: str) -> None:
    """The interrupt comes in the very moment in which a module is looked for."""
    result = subprocess.run(
        [sys.executable, "-c", CODE.format(moment=moment)], capture_output=True, text=True, timeout=60, check=False
    )
    assert result.returncode == 130
    assert result.stderr == "robosc-client: interrupted\n"


BEGINNING = """
import sys
import grpc._channel
def interrupted(*arguments):
    raise KeyboardInterrupt
grpc._channel._run_channel_spin_thread = interrupted
sys.argv = ['robosc-client', 'watch', 'job-1', '--server', {address!r}]
from robosc_client.command import entry
entry()
"""


def test_ctrl_c_while_a_call_begins() -> None:
    """The interrupt comes when gRPC knows of the call, and nobody is there yet who would see its end."""
    with scripted(WatchJob=[watched(job(1))]) as (address, _):
        result = subprocess.run(
            [sys.executable, "-c", BEGINNING.format(address=address)],
            capture_output=True,
            text=True,
            timeout=30,
            check=False,
        )
    assert (result.returncode, result.stdout, result.stderr) == (130, "", "robosc-client: interrupted\n")


def test_the_exit_status_is_the_commands() -> None:
    command = [sys.executable, "-m", "robosc_client.command", "check", "/nothing.rscd", "--server", "127.0.0.1:1"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == "robosc-client: there is no file /nothing.rscd\n"
