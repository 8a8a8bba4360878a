"""Tests of the caller who gives back where too much is kept: as in an obvious twin, and no caller at another's cost."""

import asyncio
import contextlib
from dataclasses import replace
from pathlib import Path

import hypothesis.strategies as st
import pytest
from hypothesis import given, settings
from sqlalchemy import CursorResult

from robosc_server.jobs import Caller, JobLimits, retention
from robosc_server.store import JobState, open_store
from robosc_server.store.eviction import choose_evicted
from robosc_server.tasks.task import Reason, RefusedError, Result
from support.effort import examples
from support.job_parts import ME, Choices, Times, ended, is_in, parts, sweep_by_hand
from support.job_workers import task_of
from support.sweep_twin import KIND, check_against_twin
from support.waiting import until

_NEVER = "until /nowhere/never"

_THINGS = st.dictionaries(st.sampled_from("abcd"), st.lists(st.integers(0, 5), max_size=8))


def twin_of_given_back(
    fixed: dict[str, int], things: dict[str, list[int]], excess: int, limit: int
) -> list[tuple[str, int]]:
    """Looks through everything each time: owner and number of what goes."""
    gone: list[tuple[str, int]] = []
    left = {owner: list(enumerate(sizes)) for owner, sizes in things.items()}
    while excess > 0 and len(gone) < limit:
        holders = [owner for owner in left if left[owner]]
        if not holders:
            break
        held = {owner: fixed[owner] + sum(size for _, size in left[owner]) for owner in holders}
        owner = min(holders, key=lambda name: (-held[name], name))
        number, size = left[owner].pop(0)
        gone.append((owner, number))
        excess -= size
    return gone


@given(_THINGS, st.dictionaries(st.sampled_from("abcd"), st.integers(0, 20)), st.integers(-1, 60), st.integers(0, 20))
def test_whoever_holds_most_gives_first(
    things: dict[str, list[int]], more: dict[str, int], excess: int, limit: int
) -> None:
    fixed = {owner: more.get(owner, 0) for owner in things}
    held = {owner: fixed[owner] + sum(sizes) for owner, sizes in things.items()}
    gone, left = choose_evicted(
        held, lambda owner: ((f"{owner}{n}", size) for n, size in enumerate(things[owner])), excess, limit
    )
    expected = twin_of_given_back(fixed, things, excess, limit)
    assert gone == [f"{owner}{number}" for owner, number in expected]
    for owner, sizes in things.items():
        assert left[owner] == fixed[owner] + sum(
            size for number, size in enumerate(sizes) if (owner, number) not in expected
        )


_OWNERS = st.sampled_from(["", "a", "b", "c"])

_RESULTS = st.lists(st.tuples(_OWNERS, st.integers(1, 9), st.integers(1, 5)), min_size=1, max_size=14)

_JOBS = st.lists(st.tuples(_OWNERS, st.integers(0, 13)), max_size=14)


@settings(max_examples=examples(20))
@given(_RESULTS, _JOBS, st.integers(1, 40), st.integers(1, 4))
def test_what_is_swept_is_what_the_twin_sweeps(
    tmp_path_factory: pytest.TempPathFactory,
    some_results: list[tuple[str, int, int]],
    some_jobs: list[tuple[str, int]],
    bound: int,
    at_once: int,
) -> None:
    times = Times()
    store = open_store(tmp_path_factory.mktemp("store"), wall_clock=times.wall)
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("robosc_server.store.store._EVICTED_AT_ONCE", at_once)
            asyncio.run(check_against_twin(store, times, some_results, some_jobs, bound))
    finally:
        store.close()


async def test_room_is_made_as_soon_as_somebody_needs_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(retention, "_SHORTEST_PAUSE_S", 0.01)
    choices = Choices(limits=JobLimits(results_bytes=250_000, sweep_s=3600.0))
    async with parts(tmp_path, choices) as made:
        for number in range(10):
            # One caller fills what was freed, again and again.
            for part in range(2):
                choices.times.wall_s += 1.0
                with contextlib.suppress(RefusedError):
                    job, _ = await made.manager.submit(task_of(f"big 100000\n{number} {part}", KIND), ME)
                    await ended(made.manager, job.id)

            async def is_accepted(number: int = number) -> bool:
                with contextlib.suppress(RefusedError):
                    await made.manager.submit(task_of(f"more {number}"), Caller("you"))
                    return True
                return False

            await until(is_accepted)


async def test_a_greedy_caller_pushes_out_nothing_of_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sweep_by_hand(monkeypatch)
    limits = JobLimits(results_bytes=500_000, sweep_s=3600.0)
    choices = Choices(limits=limits)
    async with parts(tmp_path, choices) as made:
        you = Caller("you")
        theirs, _ = await made.manager.submit(task_of("big 100000", KIND), you)
        await ended(made.manager, theirs.id, you)
        made.results.keep("of a call", KIND, Result((bytes(50_000),)), "you")
        greedy = []
        for number in range(4):
            choices.times.wall_s += 1.0
            job, _ = await made.manager.submit(task_of(f"big 100000\n{number}", KIND), ME)
            greedy.append(await ended(made.manager, job.id))
            made.results.keep(f"greedy {number}", KIND, Result((bytes(100_000),)), "me")

        async def is_written() -> bool:
            return await made.store.find_result("greedy 3") is not None

        await until(is_written)
        # Jobs refer to as much as may stay: new jobs wait until there is room, which is soon.
        with pytest.raises(RefusedError, match="storage for job results is full") as refused:
            await made.manager.submit(task_of("more"), you)
        assert refused.value.reason is Reason.SERVER_BUSY
        await made.manager.sweep()
        await made.manager.submit(task_of("more"), you)
        assert (await made.manager.get(theirs.id, you)).state is JobState.SUCCEEDED
        assert await made.store.find_result("of a call") is not None
        with pytest.raises(RefusedError, match="no job with this id"):
            await made.manager.get(greedy[0].id, ME)
        for job in greedy[1:]:
            assert (await made.manager.get(job.id, ME)).state is JobState.SUCCEEDED
        assert [await made.store.find_result(f"greedy {n}") is not None for n in range(4)] == [False] * 4


async def test_beyond_the_bound_of_jobs_those_of_a_caller_are_forgotten_that_ended_first(tmp_path: Path) -> None:
    choices = Choices(limits=JobLimits(jobs_per_owner=3, sweep_s=3600.0), capacity=4)
    async with parts(tmp_path, choices) as made:
        gate, you = tmp_path / "gate", Caller("you")
        theirs, _ = await made.manager.submit(task_of("theirs"), you)
        await ended(made.manager, theirs.id, you)
        slow, _ = await made.manager.submit(task_of(f"until {gate}"), ME, idempotency_key="k")
        first, _ = await made.manager.submit(task_of("first"), ME)
        await ended(made.manager, first.id)
        choices.times.wall_s += 1.0
        second, _ = await made.manager.submit(task_of("fail CPU_LIMIT"), ME)
        await ended(made.manager, second.id)
        # The third one began first, but has not ended.
        third, _ = await made.manager.submit(task_of(_NEVER), ME)
        with pytest.raises(RefusedError, match="no job with this id"):
            await made.manager.get(first.id, ME)
        assert await is_in(made.manager, second.id, JobState.FAILED)
        fourth, _ = await made.manager.submit(task_of(f"{_NEVER}\n4"), ME)
        with pytest.raises(RefusedError, match="no job with this id"):
            await made.manager.get(second.id, ME)
        # Now nothing has ended.
        with pytest.raises(RefusedError, match="3 unfinished jobs") as refused:
            await made.manager.submit(task_of("more"), ME)
        assert refused.value.reason is Reason.QUOTA_EXCEEDED
        assert await made.manager.submit(task_of(f"until {gate}"), ME, idempotency_key="k")
        for job in (slow, third, fourth):
            assert not (await made.manager.get(job.id, ME)).state.has_ended
        assert (await made.manager.get(theirs.id, you)).state is JobState.SUCCEEDED
        gate.touch()
        await ended(made.manager, slow.id)
        more, _ = await made.manager.submit(task_of("more"), ME)
        assert (await ended(made.manager, more.id)).state is JobState.SUCCEEDED


async def test_a_result_that_is_there_is_kept_whatever_its_driver_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The driver of PostgreSQL says -1, and its blocks must not be written again."""
    store = open_store(tmp_path)
    monkeypatch.setattr(CursorResult, "rowcount", property(lambda result: -1))
    for text in (b"first", b"second"):
        await store.keep_results([("k", KIND, Result((text,)), "me")])
    assert await store.find_result("k") == (KIND, Result((b"first",)))
    store.close()


async def test_a_result_is_the_owners_who_asked_first(tmp_path: Path) -> None:
    store = open_store(tmp_path)
    result = Result((bytes(10),))
    await store.keep_results([("k", KIND, result, "first")])
    await store.keep_results([("k", KIND, replace(result), "second"), ("l", KIND, Result((b"abc",)), "second")])
    await store.sweep(12)
    assert await store.find_result("k") is None
    assert await store.find_result("l") is not None
    store.close()


def test_there_is_room_until_the_results_reach_the_limit() -> None:
    kept = retention.Retention(None, JobLimits(results_bytes=10))  # type: ignore[arg-type]  # the database is not asked
    kept.note(Result((b"12345", b"6789")))
    kept.admit()
    kept.note(Result((b"0",)))
    with pytest.raises(RefusedError, match="the storage for job results is full"):
        kept.admit()
