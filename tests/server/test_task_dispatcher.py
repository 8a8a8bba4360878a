"""Tests of the dispatcher from which tasks of calls get their results: what is counted, and what is not done twice."""

import asyncio
from pathlib import Path
from typing import Any

import pytest

from robosc_api.security import Entry, Quota, Scope
from robosc_server.jobs import QueueLimits
from robosc_server.operations.metrics import Metrics
from robosc_server.operations.quotas import Quotas
from robosc_server.task_dispatcher import TaskDispatcher
from robosc_server.tasks.task import Reason, RefusedError, Report, Result, TaskLimits
from support.job_parts import Choices, Parts, parts
from support.job_workers import task_of
from support.waiting import limited, until


class OneToken:
    """A file of tokens with one that may ask for three tasks in a minute."""

    def named(self, name: str) -> Entry:
        return Entry(name, frozenset({Scope.SYNTHESIZE}), "", Quota(per_minute=3))


def dispatcher_of(made: Parts) -> TaskDispatcher:
    tokens: Any = OneToken()
    quotas = Quotas(tokens, lambda: 0.0)
    return TaskDispatcher(made.results, made.scheduler, quotas, TaskLimits(), Metrics("of a test"))


async def drop(report: Report) -> None:
    """Drop a report."""


def test_equal_calls_that_wait_are_answered_by_the_first(tmp_path: Path) -> None:
    async def test() -> None:
        async with parts(tmp_path, Choices(capacity=1)) as made:
            dispatcher, task = dispatcher_of(made), task_of(f"until {tmp_path / 'go'}\nthe same")
            calls = [asyncio.create_task(dispatcher.result(task, "me", drop)) for _ in range(3)]
            await until(lambda: made.scheduler.waiting == 2)
            (tmp_path / "go").touch()
            results = await asyncio.gather(*calls)
            assert len(made.workers.begun) == 1
            assert all(result == results[0] for result in results)
            assert isinstance(results[0], Result)
            assert made.scheduler.running == 0

    limited(test())


def test_what_is_refused_since_there_is_too_much_to_do_is_not_counted(tmp_path: Path) -> None:
    async def test() -> None:
        choices = Choices(capacity=1, queue=QueueLimits(waiting=1, waiting_per_caller=1))
        async with parts(tmp_path, choices) as made:
            dispatcher = dispatcher_of(made)

            def call(number: int) -> asyncio.Task[Result]:
                return asyncio.create_task(dispatcher.result(task_of(f"until {tmp_path / 'go'}\n{number}"), "me", drop))

            under_way = [call(0), call(1)]
            await until(lambda: made.scheduler.waiting == 1)
            for number in range(2, 7):
                with pytest.raises(RefusedError) as refused:
                    await call(number)
                assert refused.value.reason is Reason.SERVER_BUSY
            (tmp_path / "go").touch()
            await asyncio.gather(*under_way)
            # The third of three.
            await call(7)
            with pytest.raises(RefusedError) as refused:
                await call(8)
            assert refused.value.reason is Reason.QUOTA_EXCEEDED

    limited(test())


def test_an_answer_from_the_cache_counts_for_the_quota(tmp_path: Path) -> None:
    async def test() -> None:
        async with parts(tmp_path) as made:
            dispatcher, task = dispatcher_of(made), task_of("the same")
            await dispatcher.result(task, "me", drop)
            assert dispatcher.cached(task.key, "me") is not None
            await dispatcher.result(task, "me", drop)
            with pytest.raises(RefusedError) as refused:
                dispatcher.cached(task.key, "me")
            assert refused.value.reason is Reason.QUOTA_EXCEEDED
            with pytest.raises(RefusedError):
                await dispatcher.result(task, "me", drop)

    limited(test())
