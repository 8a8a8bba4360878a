"""Fixtures that tests of the remote endpoint share."""

from collections.abc import Iterator
from typing import Any

import pytest

from robosc_bridge.remote import RemoteEndpoint
from support.remote import FakeDaemon, connected, served


@pytest.fixture
def daemon() -> Iterator[FakeDaemon]:
    with FakeDaemon() as made:
        yield made


@pytest.fixture
def endpoint(daemon: FakeDaemon) -> Iterator[RemoteEndpoint]:
    with served(daemon) as made:
        yield made


@pytest.fixture
def stub(endpoint: RemoteEndpoint) -> Iterator[Any]:
    with connected(endpoint.address) as made:
        yield made
