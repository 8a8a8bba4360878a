"""Inspection of a database, without changing it: whether a server of this version can use it."""

from pathlib import Path

from sqlalchemy import URL, Engine, create_engine, text
from sqlalchemy.exc import DBAPIError
from sqlalchemy.pool import NullPool

from robosc_server.store.errors import StoreError
from robosc_server.store.migrate import version_of

_BUSY_S = 1.0


def inspect_sqlite(file: Path) -> int | None:
    """Inspect an existing file, which a server may have open, and return its schema version; None: it has no tables.

    Raises:
        StoreError: A server of this version cannot use the file.
    """
    # Reading a database with a write-ahead log creates shared files, which a reader without write access cannot delete
    # again. Without a log, no process uses the database, and the file alone is complete.
    has_log = _has_content(file.with_name(f"{file.name}-wal"))
    options = {"uri": "true", "mode": "ro"} | ({} if has_log else {"immutable": "1"})
    url = URL.create("sqlite+pysqlite", database=file.as_uri(), query=options)
    return _query(create_engine(url, poolclass=NullPool, connect_args={"timeout": _BUSY_S}))[1]


def inspect_postgresql(url: URL, connect_s: float) -> tuple[str, int | None]:
    """Inspect a PostgreSQL database; return the version of its server and its schema version; None: it has no tables.

    Args:
        url: URL of the database.
        connect_s: Time that a connection may take, in seconds.

    Raises:
        StoreError: The database cannot be reached, or a server of this version cannot use it.
        ImportError: The driver is missing.
        NoSuchModuleError: The driver is missing.
    """
    engine = create_engine(
        url.set(drivername="postgresql+psycopg"),
        poolclass=NullPool,
        connect_args={"connect_timeout": round(connect_s)},
        hide_parameters=True,
    )
    return _query(engine, "SHOW server_version")


def _query(engine: Engine, statement: str = "SELECT sqlite_version()") -> tuple[str, int | None]:
    """Return a database's answer to a statement, and its schema version, if its tables are missing or ours."""
    try:
        with engine.connect() as connection:
            answer = str(connection.scalar(text(statement)))
            version = version_of(connection)
    except DBAPIError as error:
        raise StoreError(" ".join(str(error.orig).split())) from error
    finally:
        engine.dispose()
    return answer, version


def _has_content(file: Path) -> bool:
    try:
        return file.stat().st_size > 0
    except FileNotFoundError:
        return False
