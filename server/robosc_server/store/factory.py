"""Factory of the store: SQLite in the server's own folder, or PostgreSQL by URL.

SQLite uses a write-ahead log and waits for the disk at each commit, so that accepted jobs survive a power failure; a
lock file excludes other servers. Checkpoints truncate the log to 16 MiB, and free pages are returned to the disk in
small steps (sqlite.org: wal.html, pragma.html).
"""

import fcntl
import os
import sqlite3
import struct
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError

from robosc_server.clock import wall_clock_s
from robosc_server.store.database import Database
from robosc_server.store.errors import StoreError
from robosc_server.store.migrate import prepare
from robosc_server.store.store import Store

DATABASE_FILE = "jobs.sqlite"
_LOG_BYTES = 16 * 2**20
_BUSY_S = 5.0
_INCREMENTAL = 2
"""Value of PRAGMA auto_vacuum: free pages are released on request."""

_FLOCK = "hhqqi"

_POSTGRESQL_OPTIONS = {
    "connect_timeout": 3,
    "keepalives_idle": 10,
    "keepalives_interval": 5,
    "keepalives_count": 3,
    "tcp_user_timeout": 8000,
    "application_name": "robosc-server",
    "options": "-c statement_timeout=7000 -c lock_timeout=5000 -c idle_in_transaction_session_timeout=15000",
}
_POSTGRESQL_THREADS = 4

_held: set[Path] = set()
_held_lock = threading.Lock()


def open_store(
    state_dir: Path, database_url: str | None = None, wall_clock: Callable[[], float] = wall_clock_s
) -> Store:
    """Return the server's database, with its tables; blocks until the database has answered.

    Args:
        state_dir: Folder for SQLite; made where it is missing.
        database_url: `postgresql://USER:PASSWORD@HOST:PORT/NAME`, or `sqlite:///FILE`; None: a file in the folder.
        wall_clock: Seconds since 1970.

    Raises:
        StoreError: The database cannot be used.
    """
    path = state_dir / DATABASE_FILE
    if database_url:
        try:
            url = make_url(database_url)
        except ArgumentError as error:
            # The message does not have the URL, which may hold a password.
            raise StoreError(
                "the database URL is invalid: it must have the form postgresql://USER:PASSWORD@HOST:PORT/NAME"
            ) from error
        if url.drivername in {"postgresql", "postgresql+psycopg"}:
            return Store(_open_postgresql(url), wall_clock=wall_clock)
        if url.drivername not in {"sqlite", "sqlite+pysqlite"}:
            raise StoreError(f"the database '{url.drivername}' is not supported: use postgresql or sqlite")
        if not url.database or url.database == ":memory:" or url.query:
            raise StoreError("an SQLite URL must name a file: sqlite:///FILE")
        path = Path(url.database)
    database, lock = _open_sqlite(path)
    return Store(database, lambda: _unlock(lock), wall_clock)


def _open_postgresql(url: URL) -> Database:
    try:
        engine = create_engine(
            url.set(drivername="postgresql+psycopg"),
            pool_size=2 * _POSTGRESQL_THREADS,
            max_overflow=0,
            pool_timeout=1.0,
            pool_pre_ping=True,
            hide_parameters=True,
            connect_args=_POSTGRESQL_OPTIONS,
        )
    except (ImportError, NoSuchModuleError) as error:
        raise StoreError("PostgreSQL needs the extra `postgresql`: pip install 'robosc[postgresql]'") from error
    _prepare(engine, f"the database {url.render_as_string(hide_password=True)}")
    return Database(engine, readers=_POSTGRESQL_THREADS, writers=_POSTGRESQL_THREADS)


def _open_sqlite(given: Path) -> tuple[Database, tuple[Path, int]]:
    try:
        given.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        path = given.resolve()
        lock = _locked(path)
    except OSError as error:
        raise StoreError(f"the database {given} cannot be used: {error.strerror}") from error
    try:
        # The file is private, since it holds data of callers.
        os.close(os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600))
        engine = create_engine(
            URL.create("sqlite+pysqlite", database=str(path)),
            pool_size=3,
            max_overflow=0,
            pool_timeout=_BUSY_S,
            hide_parameters=True,
            connect_args={"check_same_thread": False, "timeout": _BUSY_S},
        )
        event.listen(engine, "connect", _set_up_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
        _prepare(engine, f"the database {path}")
        opened = _file_at(path)
    except OSError as error:
        _unlock(lock)
        raise StoreError(f"the database {path} cannot be used: {error.strerror}") from error
    except StoreError:
        _unlock(lock)
        raise
    # One writer thread: SQLite permits one at a time, and here they wait in a fair queue.
    return Database(engine, readers=2, writers=1, is_in_place=lambda: _file_at(path) == opened), lock


def _file_at(path: Path) -> tuple[int, int] | None:
    """Return what tells the file at a path from every other; None: there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def _prepare(engine: Engine, what: str) -> None:
    try:
        with engine.connect().execution_options(robosc_write=True) as connection, connection.begin():
            prepare(connection)
    except DBAPIError as error:
        engine.dispose()
        reason = " ".join(str(error.orig).split())
        raise StoreError(f"{what} cannot be used: {reason}") from error
    except StoreError as error:
        engine.dispose()
        raise StoreError(f"{what} cannot be used: {error}") from error


def _set_up_sqlite(connection: sqlite3.Connection, _record: Any) -> None:
    # Disable the implicit transactions of the driver.
    connection.isolation_level = None
    cursor = connection.cursor()
    cursor.execute(f"PRAGMA busy_timeout = {round(_BUSY_S * 1000)}")
    # The setting has an effect only before there is any table. Later it is a transaction that writes all the same: a
    # reader's connection could not be made while the disk is full, or while another connection writes.
    if cursor.execute("PRAGMA auto_vacuum").fetchone() != (_INCREMENTAL,):
        cursor.execute(f"PRAGMA auto_vacuum = {_INCREMENTAL}")
    for setting in (
        "journal_mode = WAL",
        "synchronous = FULL",
        "foreign_keys = ON",
        "trusted_schema = OFF",
        f"journal_size_limit = {_LOG_BYTES}",
    ):
        cursor.execute(f"PRAGMA {setting}")
    cursor.close()


def _begin_sqlite(connection: Connection) -> None:
    # A write transaction takes the lock at once: upgrading a read transaction may fail.
    is_write = connection.get_execution_options().get("robosc_write", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if is_write else "BEGIN")


def _locked(path: Path) -> tuple[Path, int]:
    """Lock a database file for this process, by a lock file that children do not inherit, and by `_held`.

    Raises:
        StoreError: Another server has the lock.
        OSError: The file cannot be made.
    """
    taken = StoreError(f"the database {path} is in use by another robosc-server")
    with _held_lock:
        if path in _held:
            raise taken
        descriptor = os.open(_lock_of(path), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError) as error:
            os.close(descriptor)
            raise taken from error
        except OSError:
            os.close(descriptor)
            raise
        _held.add(path)
    return path, descriptor


def _lock_of(path: Path) -> Path:
    return path.with_name(f"{path.name}.lock")


def is_in_use(given: Path) -> bool:
    """Return True if a server uses an SQLite file now; the lock is only tested, and nothing is created.

    Raises:
        OSError: It cannot be determined.
    """
    path = given.resolve()
    with _held_lock:
        # The file is not even opened then: a process that closes a file loses its locks there, and cannot see its own
        # locks (POSIX, fcntl).
        if path in _held:
            return True
        try:
            descriptor = os.open(_lock_of(path), os.O_RDONLY | os.O_CLOEXEC)
        except FileNotFoundError:
            return False
        try:
            # struct flock: what kind of lock, from where, the first byte, how many (0: all), who has it.
            wanted = struct.pack(_FLOCK, fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
            kind, *_ = struct.unpack(_FLOCK, fcntl.fcntl(descriptor, fcntl.F_GETLK, wanted))
        finally:
            os.close(descriptor)
    return bool(kind != fcntl.F_UNLCK)


def _unlock(lock: tuple[Path, int]) -> None:
    path, descriptor = lock
    with _held_lock:
        _held.discard(path)
        os.close(descriptor)
