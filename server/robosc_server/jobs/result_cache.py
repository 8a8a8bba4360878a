"""Cache of results by the key of their task, in memory and in the database."""

import asyncio
import contextlib
import logging
from collections import OrderedDict
from collections.abc import Callable
from types import TracebackType
from typing import Self

from robosc_server.store import Store, StoreUnavailableError
from robosc_server.tasks.task import Result, TaskKind

_log = logging.getLogger(__name__)

_OVERHEAD_BYTES = 500
_UNWRITTEN_BYTES = 128 * 2**20
_AT_ONCE = 100
_AT_ONCE_BYTES = 4 * 2**20
_TOUCHED = 10_000
_TOUCH_S = 30.0
_GATHER_S = 0.1
"""Time that a result waits for others written with it, in seconds: a transaction costs as much as a small task."""


def _unchanged(kind: TaskKind, result: Result) -> Result:
    return result


class ResultCache:
    """Cache of results; while the database is unavailable, the results in memory remain.

    Inside the context, new results are written to the database in the background; outside, they stay in memory.

    Args:
        store: The database.
        memory_bytes: Maximum bytes of results in memory, the most recently used ones.
        finish: Function that is applied to a result before it is sent; the database has the result as it was made.
    """

    def __init__(
        self, store: Store, memory_bytes: int, finish: Callable[[TaskKind, Result], Result] = _unchanged
    ) -> None:
        self._store, self._memory_bytes, self._finish = store, memory_bytes, finish
        self._memory: OrderedDict[str, Result] = OrderedDict()
        self._taken_bytes = 0
        self._unwritten: OrderedDict[str, tuple[TaskKind, Result, str]] = OrderedDict()
        self._unwritten_bytes = 0
        self._has_unwritten = asyncio.Event()
        self._writes_singly = False
        self._touched: set[str] = set()
        self._tasks: list[asyncio.Task[None]] = []

    async def __aenter__(self) -> Self:
        self._tasks = [asyncio.create_task(self._write()), asyncio.create_task(self._touch())]
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._tasks = []
        # A last attempt to store results that were made shortly before the shutdown.
        with contextlib.suppress(StoreUnavailableError):
            while self._unwritten:
                await self._write_some()

    def in_memory(self, key: str) -> Result | None:
        """Return a result that is in memory."""
        found = self._memory.get(key)
        if found is not None:
            self._memory.move_to_end(key)
            self._note_use(key)
        return found

    async def find(self, key: str) -> Result | None:
        """Find a result in memory or in the database; None also while the database is unavailable."""
        found = self.in_memory(key)
        if found is not None:
            return found
        unwritten = self._unwritten.get(key)
        if unwritten is not None:
            return self.remember(key, *unwritten[:2])
        there = None
        # An unavailable database is not queried: its timeout may take longer than the task.
        if self._store.is_readable:
            with contextlib.suppress(StoreUnavailableError):
                there = await self._store.find_result(key)
        if there is None:
            return None
        self._note_use(key)
        return self.remember(key, *there)

    def unwritten(self, key: str) -> Result | None:
        """Return a result that waits to be written to the database, in the form in which it was made."""
        found = self._unwritten.get(key)
        return None if found is None else found[1]

    def keep(self, key: str, kind: TaskKind, result: Result, owner: str) -> Result:
        """Keep a new result in memory, and soon in the database, unless too much waits to be written there.

        Args:
            key: Key of its task.
            kind: Kind of its task.
            result: Result as it was made.
            owner: Caller who requested it.

        Returns:
            The result as it is sent.
        """
        finished = self.remember(key, kind, result)
        size = _size_of(result)
        if key not in self._unwritten and self._unwritten_bytes + size <= _UNWRITTEN_BYTES:
            self._unwritten[key] = kind, result, owner
            self._unwritten_bytes += size
            self._has_unwritten.set()
        return finished

    def remember(self, key: str, kind: TaskKind, result: Result) -> Result:
        """Keep a result in memory only.

        Returns:
            The result as it is sent.
        """
        known = self._memory.get(key)
        if known is not None:
            return known
        finished = self._finish(kind, result)
        size = _size_of(finished)
        if size > self._memory_bytes:
            return finished
        self._memory[key] = finished
        self._taken_bytes += size
        while self._taken_bytes > self._memory_bytes:
            self._taken_bytes -= _size_of(self._memory.popitem(last=False)[1])
        return finished

    def _note_use(self, key: str) -> None:
        if len(self._touched) < _TOUCHED:
            self._touched.add(key)

    async def _write(self) -> None:
        """Write new results to the database in their order."""
        while True:
            await self._has_unwritten.wait()
            await asyncio.sleep(_GATHER_S)
            try:
                await self._write_some()
            except StoreUnavailableError as error:
                await asyncio.sleep(error.retry_after_s or 1.0)
            except Exception:
                _log.exception("storing a result in the database failed")
                await asyncio.sleep(1.0)

    async def _write_some(self) -> None:
        """Write what waits, many in one transaction; after one that failed, a single one."""
        some = self._next_keys()
        try:
            await self._store.keep_results([(key, *self._unwritten[key]) for key in some])
        except StoreUnavailableError:
            # Other results go first: one of these may be the cause of the error.
            self._writes_singly = True
            for key in some:
                self._unwritten.move_to_end(key)
            raise
        except Exception:
            if len(some) == 1:
                self._forget(some[0])
                raise
            self._writes_singly = True
            return
        self._writes_singly = False
        for key in some:
            self._forget(key)

    def _next_keys(self) -> list[str]:
        """Keys of what is written next."""
        found: list[str] = []
        size = 0
        for key, (_, result, _) in self._unwritten.items():
            size += _size_of(result)
            if found and (self._writes_singly or len(found) >= _AT_ONCE or size > _AT_ONCE_BYTES):
                break
            found.append(key)
        return found

    def _forget(self, key: str) -> None:
        _, result, _ = self._unwritten.pop(key)
        self._unwritten_bytes -= _size_of(result)
        if not self._unwritten:
            self._has_unwritten.clear()

    async def _touch(self) -> None:
        """Note in the database periodically which results were used."""
        while True:
            await asyncio.sleep(_TOUCH_S)
            touched, self._touched = self._touched, set()
            if touched:
                with contextlib.suppress(StoreUnavailableError):
                    await self._store.touch(touched)


def _size_of(result: Result) -> int:
    return _OVERHEAD_BYTES + sum(len(message) + 50 for message in result.messages)
