"""Processes of this machine: they do what they are asked to, die of what they may not, and are killed in time."""

import asyncio
import os
import signal
import threading
import time
from concurrent.futures import CancelledError
from dataclasses import replace

import pytest

from robosc_server.tasks.task import Report
from support.background import cpu_ticks, is_running, parent_of
from support.fake_tasks import said
from support.waiting import eventually
from support.worker_runs import LIMITS, Running

KILLED_WITHIN_S = 0.2


class TestSpending:
    """Processor time of a task, which is reported however the task ends."""

    @staticmethod
    def spent(running: Running, count: int = 1) -> list[float]:
        assert eventually(lambda: len(running.spent) >= count)
        spent, running.spent = running.spent, []
        assert len(spent) == count
        return spent

    @pytest.fixture(autouse=True)
    def nothing_spent(self, running: Running) -> None:
        # Those of earlier tests are reported when their processes are gone.
        assert eventually(lambda: len(running.local.pids) == 2)
        running.spent = []

    def test_work_counts_and_waiting_does_not(self, running: Running) -> None:
        running.run("work 0.4")
        assert 0.4 <= self.spent(running)[0] < 5.0
        begun_s = time.monotonic()
        running.run("sleep 1")
        assert self.spent(running)[0] < time.monotonic() - begun_s - 0.5

    def test_waiting_is_not_limited_as_work_is(self, running: Running) -> None:
        assert said(running.run("sleep 1.2\nsleep 0", replace(LIMITS, cpu_seconds=1))) == "done"

    @pytest.mark.parametrize(
        "text", ["raise", "die 9", "exit 3", "refuse it", "claim 18446744073709551615", "garbage", "stop", "spin"]
    )
    def test_work_counts_also_when_it_was_in_vain(self, running: Running, text: str) -> None:
        limits = replace(LIMITS, seconds=2.0) if text == "stop" else replace(LIMITS, cpu_seconds=1.0)
        running.failure(f"work 0.3\n{text}", limits)
        assert 0.3 <= self.spent(running)[0] < 5.0

    def test_work_counts_that_was_cancelled(self, running: Running) -> None:
        future, reports = running.start("work 0.3\npid\nsleep 600")
        assert eventually(lambda: bool(reports))
        future.cancel()
        assert 0.3 <= self.spent(running)[0] < 5.0

    def test_work_that_nobody_could_measure_counts_by_the_clock(self, running: Running) -> None:
        future, reports = running.start("pid\nsleep 0.4\npid\nsleep 0.3\necho twice")
        assert eventually(lambda: len(reports) == 2)
        os.kill(parent_of(int(reports[0].message)), signal.SIGKILL)
        assert said(future.result(60)) == "twice"
        first, second = self.spent(running, 2)
        assert first >= 0.4 > second


class TestKills:
    @pytest.mark.real_time
    @pytest.mark.parametrize("text", ["spin", "stuck", "stop", "sleep 600", "allocate\nstuck"])
    def test_a_cancelled_task_is_gone_in_time(self, running: Running, text: str) -> None:
        future, pid = running.begun(text)
        begin = time.monotonic()
        future.cancel()
        assert eventually(lambda: not is_running(pid))
        assert time.monotonic() - begin < KILLED_WITHIN_S
        with pytest.raises(CancelledError):
            future.result(60)

    def test_a_worker_that_reports_too_much_has_to_wait(self, running: Running) -> None:
        reports: list[Report] = []
        may_go_on = threading.Event()

        async def slow(report: Report) -> None:
            reports.append(report)
            while len(reports) > 1 and not may_go_on.is_set():
                await asyncio.sleep(0.01)

        future, _ = running.start("pid\nlong reports 900", on_report=slow)
        assert eventually(lambda: len(reports) == 2)
        pid = int(reports[0].message)
        seen: list[int] = []

        def rests() -> bool:
            time.sleep(0.02)
            seen.append(cpu_ticks(pid))
            return len(seen) > 15 and len(set(seen[-15:])) == 1

        assert eventually(rests)
        assert is_running(pid)
        assert len(reports) == 2
        may_go_on.set()
        assert said(future.result(60)) == "done"
        assert len(reports) == 901
