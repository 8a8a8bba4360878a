"""Asynchronous access to a database: transactions run in a few threads, bounded in number and time.

A transaction that exceeds its time is abandoned: its connection is closed, so that its thread is free again, and the
caller gets StoreUnavailableError at once. After a failed connection, transactions are refused for a moment without
another attempt, since connecting to a lost host takes long.
"""

import asyncio
import contextlib
import logging
import os
import socket
import sqlite3
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from sqlalchemy import Connection, Engine
from sqlalchemy.exc import DataError, DBAPIError, IntegrityError, ProgrammingError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError

from robosc_server.clock import monotonic
from robosc_server.store.errors import StoreUnavailableError

_log = logging.getLogger(__name__)

_PENDING = 2048
"""Transactions that may wait for a thread."""

_TRIES = 3
"""Attempts of a transaction that conflicts with another one."""

_PROGRESS_STEPS = 100_000
"""Steps of SQLite's virtual machine, some milliseconds, between checks whether a transaction was abandoned."""

_PAUSE_S = 0.5
"""Time without further attempts after a failed connection, in seconds."""

_PROGRAMMING_ERRORS = (IntegrityError, ProgrammingError, DataError)
_CONFLICTS = frozenset({"40001", "40P01"})  # serialization_failure, deadlock_detected


class FileGoneError(Exception):
    """The file of a database is no longer in its place: changes would be stored nowhere that outlives the server."""

    def __init__(self) -> None:
        super().__init__("its file was removed or replaced: put it back, or restart the server to begin with a new one")


def _in_place() -> bool:
    """Return True: a database behind a network keeps its own files."""
    return True


class _Transaction[T]:
    """One unit of work, which another thread may cut off.

    Args:
        engine: Engine of the database.
        work: Function that does the work; it may be done again after a collision.
        is_write: True if it changes anything.
        is_in_place: Function that returns True if the file of the database is still where it was opened.
    """

    def __init__(
        self, engine: Engine, work: Callable[[Connection], T], is_in_place: Callable[[], bool], *, is_write: bool
    ) -> None:
        self._engine, self._work, self._is_in_place, self._is_write = engine, work, is_in_place, is_write
        self._lock = threading.Lock()
        self._driver_connection: Any = None
        self._is_abandoned = False

    def run(self) -> T:
        """Return the result of the work; called in a thread.

        Raises:
            DBAPIError: As the database says.
            PoolTimeoutError: No connection is free.
            FileGoneError: The file of the database is gone; work that only reads goes on.
        """
        if self._is_write and not self._is_in_place():
            raise FileGoneError
        for tries_left in reversed(range(_TRIES)):
            try:
                return self._run_once()
            except DBAPIError as error:
                if self._is_abandoned or not tries_left or not _is_conflict(error):
                    raise
        raise AssertionError("unreachable: the last try returns or raises")

    def abandon(self) -> None:
        """Abandon the transaction, if it is running; may be called in any thread."""
        with self._lock:
            self._is_abandoned = True
            if self._driver_connection is not None:
                _abort_connection(self._driver_connection)

    def _run_once(self) -> T:
        if self._is_abandoned:
            raise PoolTimeoutError
        with self._engine.connect() as connection:
            connection = connection.execution_options(robosc_write=self._is_write)
            driver_connection: Any = connection.connection.driver_connection
            is_sqlite = isinstance(driver_connection, sqlite3.Connection)
            if is_sqlite:
                # An interrupt between two statements is lost: the next statement must end as well.
                driver_connection.set_progress_handler(lambda: self._is_abandoned, _PROGRESS_STEPS)
            with self._lock:
                self._driver_connection = driver_connection
            try:
                with connection.begin():
                    return self._work(connection)
            finally:
                with self._lock:
                    self._driver_connection = None
                if is_sqlite:
                    driver_connection.set_progress_handler(None, 0)


def _abort_connection(driver_connection: Any) -> None:
    if isinstance(driver_connection, sqlite3.Connection):
        driver_connection.interrupt()
        return
    with contextlib.suppress(Exception):  # The connection may be closing.
        duplicate = socket.socket(fileno=os.dup(driver_connection.fileno()))
        try:
            duplicate.shutdown(socket.SHUT_RDWR)
        finally:
            duplicate.close()


def _is_conflict(error: DBAPIError) -> bool:
    return isinstance(error, IntegrityError) or getattr(error.orig, "sqlstate", None) in _CONFLICTS


class Database:
    """An engine, and threads for it.

    Args:
        engine: Engine of the database; `close` disposes of it.
        readers: Number of threads for transactions that only read.
        writers: Number of threads for transactions that write.
        answer_s: Maximum duration of a transaction, in seconds.
        clock: Seconds of a monotonic clock.
        is_in_place: Function that returns True if the file of the database is still where it was opened; called in a
            thread before each transaction that writes.
    """

    def __init__(
        self,
        engine: Engine,
        *,
        readers: int,
        writers: int,
        answer_s: float = 8.0,
        clock: Callable[[], float] = monotonic,
        is_in_place: Callable[[], bool] = _in_place,
    ) -> None:
        self._engine, self._is_in_place = engine, is_in_place
        self._readers = ThreadPoolExecutor(readers, thread_name_prefix="store-reader")
        self._writers = ThreadPoolExecutor(writers, thread_name_prefix="store-writer")
        self._answer_s = answer_s
        self._clock = clock
        self._pending = 0
        self._paused_until_s = 0.0
        # True for reads and writes that failed last.
        self._is_failing = {False: False, True: False}

    @property
    def dialect(self) -> str:
        """`sqlite` or `postgresql`."""
        return self._engine.dialect.name

    @property
    def is_available(self) -> bool:
        """True if the last read and the last write worked."""
        return not any(self._is_failing.values())

    @property
    def is_readable(self) -> bool:
        """True if the last read worked, whether or not writes work."""
        return not self._is_failing[False]

    async def read[T](self, work: Callable[[Connection], T]) -> T:
        """Run work that only reads in a transaction, and return its result.

        Raises:
            StoreUnavailableError: The database is unavailable or too slow.
        """
        return await self._run(work, is_write=False)

    async def write[T](self, work: Callable[[Connection], T]) -> T:
        """Run work that writes in a transaction, which may be tried twice; its changes are stored when this returns.

        Raises:
            StoreUnavailableError: The database is unavailable, too slow or full, or its file is gone.
        """
        return await self._run(work, is_write=True)

    def close(self) -> None:
        """Close connections and threads, after the end or the time limit of running transactions."""
        self._readers.shutdown(cancel_futures=True)
        self._writers.shutdown(cancel_futures=True)
        self._engine.dispose()

    async def _run[T](self, work: Callable[[Connection], T], *, is_write: bool) -> T:
        if self._pending >= _PENDING or self._clock() < self._paused_until_s:
            raise StoreUnavailableError
        transaction = _Transaction(self._engine, work, self._is_in_place, is_write=is_write)
        threads = self._writers if is_write else self._readers
        self._pending += 1
        future = asyncio.get_running_loop().run_in_executor(threads, transaction.run)
        future.add_done_callback(self._count_down)
        try:
            # The caller may be cancelled; the transaction continues.
            result = await asyncio.wait_for(asyncio.shield(future), self._answer_s)
        except _PROGRAMMING_ERRORS:
            raise
        except (DBAPIError, PoolTimeoutError, TimeoutError, FileGoneError) as error:
            if isinstance(error, TimeoutError):
                future.add_done_callback(_consume_outcome)
                future.cancel()
                transaction.abandon()
            self._note_failure(error, is_write=is_write)
            raise StoreUnavailableError from error
        except asyncio.CancelledError:
            future.add_done_callback(_consume_outcome)
            raise
        self._note_success(is_write=is_write)
        return result

    def _count_down(self, _future: asyncio.Future[Any]) -> None:
        self._pending -= 1

    def _note_failure(self, error: Exception, *, is_write: bool) -> None:
        if self.is_available:
            # The parameters of the statement come from a caller and are left out.
            reason = error.orig if isinstance(error, DBAPIError) else type(error).__name__
            if isinstance(error, FileGoneError):
                reason = error
            _log.error("the database is unavailable: %s", reason)
        self._is_failing[is_write] = True
        if self.dialect != "sqlite":
            self._paused_until_s = self._clock() + _PAUSE_S

    def _note_success(self, *, is_write: bool) -> None:
        if self.is_available:
            return
        # A database that can be changed can be read.
        self._is_failing = {False: False, True: self._is_failing[True] and not is_write}
        if self.is_available:
            _log.warning("the database is available again")


def _consume_outcome(future: asyncio.Future[Any]) -> None:
    """Retrieve the exception of an abandoned transaction, so that asyncio does not log it."""
    if not future.cancelled():
        future.exception()
