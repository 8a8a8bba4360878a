"""Tests of results that were worked out before: in memory, in the database, and without the database."""

import asyncio
from collections.abc import Sequence
from pathlib import Path

import pytest

from robosc_server.jobs import ResultCache
from robosc_server.store import Store, StoreUnavailableError, open_store
from robosc_server.tasks.task import Result, TaskKind
from support.job_parts import Times
from support.waiting import until

_KIND = TaskKind.SYNTHESIZE


async def is_written(store: Store, key: str) -> bool:
    return await store.find_result(key) is not None


async def test_what_is_kept_is_written_beside_as_it_was_made_and_sent_as_it_is_finished(tmp_path: Path) -> None:
    def finish(kind: TaskKind, result: Result) -> Result:
        assert kind is _KIND
        return Result((*result.messages, b"signed"))

    store = open_store(tmp_path)
    made, sent = Result((b"a", b"")), Result((b"a", b"", b"signed"))
    async with ResultCache(store, 10_000, finish) as results:
        assert await results.find("k") is None
        assert results.keep("k", _KIND, made, "me") == sent
        assert results.unwritten("k") == made
        assert results.in_memory("k") == await results.find("k") == sent
        await until(lambda: is_written(store, "k"))
        assert await store.find_result("k") == (_KIND, made)
    async with ResultCache(store, 10_000, finish) as results:
        assert results.in_memory("k") is None
        assert await results.find("k") == sent
        assert results.in_memory("k") == sent
    store.close()


async def test_memory_is_bounded_and_what_was_asked_for_last_stays(tmp_path: Path) -> None:
    store = open_store(tmp_path)
    results = ResultCache(store, 5_000)
    for key in "abc":
        results.remember(key, _KIND, Result((bytes(1000),)))
    assert results.in_memory("a") is not None
    results.remember("d", _KIND, Result((bytes(1000),)))
    assert [key for key in "abcd" if results.in_memory(key)] == ["a", "c", "d"]
    results.remember("large", _KIND, Result((bytes(5_000),)))
    assert results.in_memory("large") is None
    assert [key for key in "abcd" if results.in_memory(key)] == ["a", "c", "d"]
    # One takes the place of several.
    results.remember("e", _KIND, Result((bytes(3_500),)))
    assert [key for key in "abcde" if results.in_memory(key)] == ["e"]
    store.close()


async def test_without_the_database_it_goes_on_and_writes_when_it_is_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = open_store(tmp_path)
    tried = asyncio.Event()
    keep = store.keep_results

    async def away(*_: object) -> None:
        tried.set()
        error = StoreUnavailableError()
        error.retry_after_s = 0.01
        raise error

    async with ResultCache(store, 0) as results:
        monkeypatch.setattr(store, "keep_results", away)
        monkeypatch.setattr(store, "find_result", away)
        results.keep("k", _KIND, Result((b"a",)), "me")
        await tried.wait()
        assert await results.find("other") is None
        assert await results.find("k") == Result((b"a",))
        monkeypatch.undo()
        assert store.keep_results == keep
        await until(lambda: is_written(store, "k"))
    store.close()


async def test_what_was_kept_shortly_before_the_end_is_there_after_it(tmp_path: Path) -> None:
    store = open_store(tmp_path)
    async with ResultCache(store, 0) as results:
        for number in range(20):
            results.keep(str(number), _KIND, Result((bytes(number),)), "me")
    for number in range(20):
        assert await store.find_result(str(number)) == (_KIND, Result((bytes(number),)))
    store.close()


async def test_one_that_cannot_be_written_takes_no_other_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = open_store(tmp_path)
    keep = store.keep_results
    sizes: list[int] = []

    async def choosy(results: Sequence[tuple[str, TaskKind, Result, str]]) -> None:
        sizes.append(len(results))
        if any(key == "bad" for key, *_ in results):
            raise ValueError("cannot be written")
        await keep(results)

    monkeypatch.setattr(store, "keep_results", choosy)
    async with ResultCache(store, 0) as results:
        for key in ("a", "bad", "c", "d"):
            results.keep(key, _KIND, Result((key.encode(),)), "me")
        await until(lambda: is_written(store, "d"))
        assert [await is_written(store, key) for key in ("a", "bad", "c")] == [True, False, True]
        assert max(sizes) > 1
        assert results.unwritten("bad") is None
    store.close()


async def test_what_waits_to_be_written_is_bounded_and_what_is_beyond_stays_in_memory_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("robosc_server.jobs.result_cache._UNWRITTEN_BYTES", 3_500)
    store = open_store(tmp_path)
    results = ResultCache(store, 10**6)
    for key in "abcd":
        for _ in range(2):  # The second time it is known.
            results.keep(key, _KIND, Result((bytes(1000),)), "me")
    assert [results.unwritten(key) is not None for key in "abcd"] == [True, True, False, False]
    assert all(results.in_memory(key) for key in "abcd")
    async with results:
        await until(lambda: is_written(store, "b"))
    # Written results make room.
    results.keep("e", _KIND, Result((bytes(1000),)), "me")
    assert results.unwritten("e") is not None
    assert await store.find_result("c") is None
    store.close()


async def test_the_last_use_of_results_is_written_to_the_database_now_and_then(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("robosc_server.jobs.result_cache._TOUCH_S", 0.01)
    times = Times()
    store = open_store(tmp_path, wall_clock=times.wall)
    for key in "abc":
        await store.keep_results([(key, _KIND, Result((bytes(100),)), "me")])
        times.wall_s += 1.0
    touched: list[set[str]] = []
    touch = store.touch

    async def noted(keys: set[str]) -> None:
        await touch(keys)
        touched.append(keys)

    monkeypatch.setattr(store, "touch", noted)
    async with ResultCache(store, 10**6) as results:
        # Once from the database, and from memory.
        for _ in range(2):
            assert await results.find("a") is not None
            number = len(touched)

            async def is_touched(number: int = number) -> bool:
                return len(touched) > number

            await until(is_touched)
        assert touched == [{"a"}, {"a"}]
    await store.sweep(200)
    assert [await is_written(store, key) for key in "abc"] == [True, False, True]
    store.close()
