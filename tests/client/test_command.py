"""The installed command, from its first moment on."""

import subprocess
import sys

from support.answers import job, watched
from support.scripted_service import scripted

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
    """The interrupt comes when gRPC knows of the call, and its end would not be seen yet."""
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
