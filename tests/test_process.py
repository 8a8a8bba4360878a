"""Programs that tests start: one that does not end says where it hangs."""

import os
import sys
from pathlib import Path

import pytest

from support.process import Process
from support.waiting import wait_until

_HANGS = """
import threading
def waits_for_ever():
    print("ready", flush=True)
    threading.Event().wait()
waits_for_ever()
"""


def test_a_program_that_does_not_end_says_where_it_is(tmp_path: Path) -> None:
    with Process([sys.executable, "-c", _HANGS], os.environ, tmp_path) as process:
        wait_until(lambda: process.stdout == "ready\n", "the program")
        with pytest.raises(AssertionError, match=r"did not end within 0.0 s\n(.*\n)*.* in waits_for_ever\n"):
            process.wait(0.0)
        assert not process.is_running
