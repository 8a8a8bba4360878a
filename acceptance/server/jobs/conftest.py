"""One PostgreSQL server for all tests of a process."""

from collections.abc import Iterator

import pytest

from support.postgresql import Postgresql, postgresql


@pytest.fixture(scope="session")
def database_server() -> Iterator[Postgresql]:
    """A server that runs."""
    with postgresql() as server:
        yield server


@pytest.fixture
def database_url(database_server: Postgresql) -> str:
    """A database of its own."""
    return database_server.new_database()
