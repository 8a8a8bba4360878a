"""Databases of every schema version that there has been, and what becomes of them."""

import asyncio
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from sqlalchemy import Connection, inspect, text

from robosc_server.store import JobState, Store
from robosc_server.store.migrate import VERSION_TABLE, latest_version
from robosc_server.store.schema import METADATA
from robosc_server.tasks.task import Result, TaskKind

_FOLDER = Path(__file__).parent / "databases"

VERSIONS = tuple(range(1, latest_version() + 1))

TABLES = ("replicas", "results", "result_blocks", "jobs", "job_requests")

type Rows = dict[str, list[dict[str, Any]]]


def script_of(version: int, dialect: str) -> str:
    """SQL that makes the database of a version."""
    return (_FOLDER / f"version_{version}.{dialect}.sql").read_text("utf-8")


def rows_of(connection: Connection) -> Rows:
    """Rows of all tables."""
    return {
        table: [dict(row) for row in connection.execute(text(f"SELECT * FROM {table} ORDER BY 1, 2")).mappings()]
        for table in TABLES
    }


def kept(before: Rows, after: Rows) -> Rows:
    """Rows of a migrated database, with the columns that they had before alone."""
    return {table: [{name: row[name] for name in before[table][0]} for row in rows] for table, rows in after.items()}


def differences(connection: Connection) -> object:
    """Differences of the tables from what the server takes them for, as Alembic finds them."""
    options = {"version_table": VERSION_TABLE}
    return compare_metadata(MigrationContext.configure(connection, opts=options), METADATA)


def structure_of(connection: Connection) -> object:
    """Columns and indexes of all tables."""
    tables = inspect(connection)
    return {
        name: (
            {column["name"]: (str(column["type"]), column["nullable"]) for column in tables.get_columns(name)},
            {index["name"]: index["column_names"] for index in tables.get_indexes(name)},
        )
        for name in tables.get_table_names()
    }


def read[T](store: Store, work: Callable[[Connection], T]) -> T:
    """Return the result of work in a transaction."""
    return asyncio.run(store._database.read(work))


def check(store: Store) -> None:
    """See that all is there, and that what is new works."""

    async def test() -> None:
        done = await store.find("done")
        assert done is not None and (done.state, done.result_key, done.losses) == (JobState.SUCCEEDED, "k", 0)
        assert await store.find_result("k") == (TaskKind.CHECK, Result((b"",)))
        waits = await store.find_by_key("me", "i")
        assert waits is not None and waits.id == "waits"
        owners = await store._database.read(lambda connection: connection.execute(_OWNERS).all())
        # The first by name of several callers.
        assert {row.key: row.owner for row in owners} == {"k": "me", "l": "", "large": "ann"}
        await store.keep_results([("new", TaskKind.CHECK, Result((b"x",)), "you")])
        # A server of the first version may go on for a while.
        await store._database.write(lambda connection: connection.execute(_OLD_INSERT) and None)
        await store.sweep(6)
        assert await store.find_result("k") is not None

    asyncio.run(test())


def migrations_in(caplog: pytest.LogCaptureFixture) -> list[str]:
    """Lines of the log that report a migration; they are cleared."""
    found = [record.getMessage() for record in caplog.records if "is migrated from" in record.getMessage()]
    caplog.clear()
    return found


def log_migrations(caplog: pytest.LogCaptureFixture) -> None:
    """Have the log keep what reports migrations."""
    caplog.set_level(logging.INFO, "robosc_server.store.migrate")


_OWNERS = sqlalchemy.text("SELECT key, owner FROM results")

_OLD_INSERT = sqlalchemy.text("INSERT INTO results (key, kind, size, used_us) VALUES ('old', 'check', 1, 1)")
