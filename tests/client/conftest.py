"""Commands of the client in this process, and both clients in conversation with a scripted server."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import pytest

from support import client_commands
from support.both_clients import KINDS, QUICK, Talk, client_of
from support.client_commands import Run
from support.scripted_service import scripted


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Run:
    """Run a command, and return its exit status, output and errors."""
    return partial(client_commands.run, capfd)


@pytest.fixture(params=KINDS)
def connect(request: Any) -> Any:
    """Open a client of either kind that tries again quickly."""
    return lambda address, **options: client_of(request.param, address, **{"retries": QUICK, **options})


@pytest.fixture
def talk(connect: Any) -> Talk:
    """Open a client, of either kind, of a scripted server."""

    @contextmanager
    def opened(**answers: Any) -> Iterator[tuple[Any, Any]]:
        with scripted(**answers) as (address, script), connect(address) as client:
            yield client, script

    return opened
