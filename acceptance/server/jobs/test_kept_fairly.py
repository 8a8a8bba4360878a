"""Owners that give something back where too much is kept: as in an obvious twin, and no owner at another's cost."""

import asyncio
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import func, select

from robosc_server.store import open_store, result_rows
from robosc_server.store import store as store_module
from robosc_server.tasks.task import Result
from support.job_parts import Times
from support.sweep_twin import KIND, Kept, check_against_twin, fill


def test_it_is_the_same_in_postgresql(database_url: str) -> None:
    times = Times()
    results = [("a", 9, 1), ("a", 9, 2), ("b", 3, 1), ("b", 3, 3), ("", 1, 1), ("c", 9, 1), ("a", 5, 1)]
    jobs = [("c", 5), ("a", 0), ("a", 0), ("c", 5), ("b", 0), ("c", 2)]
    store = open_store(Path("/nowhere"), database_url, times.wall)
    try:
        asyncio.run(check_against_twin(store, times, results, jobs, 20))
    finally:
        store.close()


def test_a_result_that_two_servers_have_made_is_kept_once(database_url: str) -> None:
    first, second = (open_store(Path("/nowhere"), database_url) for _ in range(2))

    async def test() -> None:
        for store, text in ((first, b"first"), (second, b"second")):
            await store.keep_results([("k", KIND, Result((text,)), "me")])
            assert await store.find_result("k") == (KIND, Result((b"first",)))

    try:
        asyncio.run(test())
    finally:
        first.close()
        second.close()


def test_two_servers_that_sweep_at_once_give_back_no_more_than_one(
    database_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second one has seen how much there is before the first one sweeps."""
    monkeypatch.setattr("robosc_server.store.store._EVICTED_AT_ONCE", 2)
    times = Times()
    results = [Kept(f"{number:02}", "ab"[number % 2], 10, float(number)) for number in range(12)]
    first, second = (open_store(Path("/nowhere"), database_url, times.wall) for _ in range(2))

    async def test() -> None:
        await fill(first, times, results, [])
        read = second._database.read

        async def read_before_it_sweeps(work: Any) -> Any:
            seen = await read(work)
            if work is result_rows.sizes_by_owner:
                await first.sweep(70)
            return seen

        monkeypatch.setattr(second._database, "read", read_before_it_sweeps)
        await second.sweep(70)
        monkeypatch.undo()
        left = [result for result in results if await first.find_result(result.key) is not None]
        assert left == results[5:]

        # The holder of the lock does the work; the other leaves it.
        with first._database._engine.connect() as connection, connection.begin():
            connection.execute(select(func.pg_advisory_xact_lock(store_module._SWEEP_LOCK)))
            await second.sweep(0)
        assert [await first.find_result(result.key) is not None for result in left] == [True] * 7
        await second.sweep(0)
        assert [await first.find_result(result.key) is not None for result in left] == [False] * 7

    try:
        asyncio.run(test())
    finally:
        first.close()
        second.close()
