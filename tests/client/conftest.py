"""Commands of the client in this process."""

from functools import partial

import pytest

from support import client_commands
from support.client_commands import Run


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Run:
    """Run a command, and return its exit status, output and errors."""
    return partial(client_commands.run, capfd)
