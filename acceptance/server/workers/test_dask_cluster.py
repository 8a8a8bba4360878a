"""Workers of a real Dask cluster: a scheduler and workers as processes, which are lost and come back."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from robosc_server.tasks.task import Failure, Outcome, Reason, Report, Result, TaskKind, TaskLimits
from robosc_server.workers import WorkersError
from robosc_server.workers.dask_cluster import DaskWorkers
from support.background import BackgroundLoop, is_running, parent_of
from support.dask_clusters import Cluster, dask_cluster, kill
from support.fake_tasks import TASK_FUNCTION, fake_task, said
from support.waiting import eventually

LIMITS = TaskLimits(seconds=60, cpu_seconds=20, memory_bytes=512 * 2**20, result_bytes=10**6)
KILLED_WITHIN_S = 1.0
"""A fifth of that where they have a processor: the server, the scheduler and the worker have a part in it."""


class Running:
    """Workers of a cluster, and what their tasks report."""

    def __init__(self, loop: BackgroundLoop, workers: DaskWorkers) -> None:
        self.workers = workers
        self._loop = loop
        self.spent: list[float] = []

    def start(self, text: str, limits: TaskLimits = LIMITS, kind: TaskKind = TaskKind.CHECK) -> Future[Outcome]:
        self.reports: list[Report] = []
        reports = self.reports

        async def note(report: Report) -> None:
            reports.append(report)

        return self._loop.start(self.workers.run(fake_task(text, kind), limits, note, self.spent.append))

    def run(self, text: str, limits: TaskLimits = LIMITS) -> Outcome:
        return self.start(text, limits).result(60)

    def failure(self, text: str, limits: TaskLimits = LIMITS) -> Failure:
        outcome = self.run(text, limits)
        assert isinstance(outcome, Failure), outcome
        return outcome

    def begun(self, text: str) -> tuple[Future[Outcome], int]:
        """A task under way, and the number of its process."""
        future = self.start(f"pid\n{text}")
        return future, self.next_pid(1)

    def holder(self, cluster: Cluster) -> "subprocess.Popen[bytes]":
        """The Dask worker that a task was handed to; it need not have begun it."""
        found: list[subprocess.Popen[bytes]] = []

        def is_handed() -> bool:
            client = self.workers._client
            if client is not None:
                handed = self._ask(client.processing)
                holders = {self.pids[address] for address, tasks in handed.items() if tasks}
                # For a moment the scheduler still counts on one that was killed.
                found[:] = [worker for worker in cluster.workers if worker.pid in holders]
            return bool(found)

        assert eventually(is_handed)
        return found[0]

    def note_pids(self) -> None:
        """Learn which process each Dask worker is."""
        self.pids: dict[str, int] = dict(self._ask(self.workers._client.run, os.getpid))

    def _ask(self, question: Callable[..., Any], *words: Any) -> Any:
        async def answer() -> Any:
            return await question(*words)

        return self._loop.run(answer())

    def next_pid(self, count: int) -> int:
        """The number of the process that is at the task the so-manieth time."""
        assert eventually(lambda: len(self.reports) == count)
        return int(self.reports[-1].message)


@contextmanager
def running_on(address: str, capacity: int) -> Iterator[Running]:
    with BackgroundLoop() as loop:
        workers = DaskWorkers(address, TASK_FUNCTION)
        loop.run(workers.__aenter__())
        try:
            assert eventually(lambda: workers.capacity == capacity), workers.fault
            yield Running(loop, workers)
        finally:
            loop.run(workers.__aexit__())


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    with dask_cluster(tmp_path_factory.mktemp("cluster"), workers=2) as cluster:
        yield cluster


@pytest.fixture(scope="module")
def running(cluster: Cluster) -> Iterator[Running]:
    with running_on(cluster.address, 2) as running:
        yield running


def dask_worker_of(cluster: Cluster, pid: int) -> "subprocess.Popen[bytes]":
    """The worker of the cluster that a task's process belongs to: the parent of its fork_server."""
    for _ in range(2):
        pid = parent_of(pid)
    return next(worker for worker in cluster.workers if worker.pid == pid)


class TestTasks:
    @pytest.mark.smoke
    def test_a_task_is_answered_after_its_reports(self, running: Running) -> None:
        future = running.start("reports 3\nsleep 0.3\necho hello")
        assert said(future.result(60)) == "hello"
        assert running.reports == [Report("synthesis", f"step {number}") for number in range(3)]

    def test_the_last_of_very_many_reports_arrive(self, running: Running) -> None:
        future = running.start("reports 900\nsleep 0.3\necho done")
        assert said(future.result(60)) == "done"
        assert running.reports[-1] == Report("synthesis", "step 899")
        assert len(running.reports) < 500

    @pytest.mark.parametrize("kind", [TaskKind.SYNTHESIZE, TaskKind.FORMAT])
    def test_kinds_reach_the_function(self, running: Running, kind: TaskKind) -> None:
        outcome = running.start("echo here", kind=kind).result(60)
        assert isinstance(outcome, Result)
        assert b"here" in outcome.messages[0]

    def test_limits_hold_there_as_well(self, running: Running) -> None:
        assert said(running.run("limits")) == f"20 0 0 {LIMITS.memory_bytes}"
        assert running.failure("allocate").reason is Reason.MEMORY_LIMIT
        assert running.failure("spin", replace(LIMITS, cpu_seconds=0.1)).reason is Reason.CPU_LIMIT
        assert running.failure("stop", replace(LIMITS, seconds=0.2)).reason is Reason.TIME_LIMIT
        assert running.failure("size 1000000").reason is Reason.RESULT_TOO_LARGE

    def test_what_tasks_take_of_processors_is_reported_however_they_end(self, running: Running) -> None:
        for text in ("work 0.4", "work 0.4\ndie 9", "work 0.4\npid\nsleep 600"):
            running.spent = []
            future = running.start(text)
            if "sleep" in text:
                running.next_pid(1)
                future.cancel()
            else:
                future.result(60)
            assert eventually(lambda: bool(running.spent))
            assert 0.4 <= running.spent[0] < 5.0
            assert len(running.spent) == 1

    def test_deaths_and_faults_are_reported_there_as_well(self, running: Running) -> None:
        failure = running.failure("die 11")
        assert failure.reason is Reason.WORKER_DIED
        assert failure.message == "the worker process was ended by SIGSEGV"
        assert running.failure("raise").details.rstrip().endswith("ValueError: a fault, on purpose")

    @pytest.mark.real_time
    @pytest.mark.parametrize("text", ["stuck", "stop", "sleep 600"])
    def test_a_cancelled_task_is_gone_in_time(
        self, running: Running, text: str, record_property: Callable[[str, object], None]
    ) -> None:
        future, pid = running.begun(text)
        begin = time.monotonic()
        future.cancel()
        assert eventually(lambda: not is_running(pid))
        taken_s = time.monotonic() - begin
        record_property(f"a cancelled task on Dask ({text}) was gone after", f"{taken_s * 1e3:.0f} ms")
        assert taken_s < KILLED_WITHIN_S
        with pytest.raises(CancelledError):
            future.result(60)

    def test_no_task_outlives_the_server(self, cluster: Cluster) -> None:
        with running_on(cluster.address, 2) as other:
            future, pid = other.begun("stuck")
        assert eventually(lambda: not is_running(pid))
        with pytest.raises(WorkersError, match="was lost"):
            future.result(60)
        with BackgroundLoop() as loop, pytest.raises(WorkersError, match="workers are shut down"):
            loop.run(other.workers.run(fake_task("echo"), LIMITS, None))  # type: ignore[arg-type]  # never called


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("import robosc\nrobosc.__version__ = '0.0.1'\n", "has RoboSC 0.0.1, but this server"),
        ("import sys\nsys.modules['robosc_server'] = None\n", "cannot load RoboSC: "),
    ],
)
def test_a_worker_of_another_version_is_reported_and_left_out(
    cluster: Cluster, running: Running, tmp_path: Path, caplog: pytest.LogCaptureFixture, change: str, words: str
) -> None:
    (tmp_path / "sitecustomize.py").write_text(change)
    path = os.pathsep.join((str(tmp_path), *(path for path in sys.path if path)))
    worker = cluster.start_worker(environment={"PYTHONPATH": path})
    assert eventually(lambda: words in caplog.text)
    assert running.workers.capacity == 2
    for _ in range(4):
        assert said(running.run("echo fine")) == "fine"
    kill(worker)
    cluster.workers.remove(worker)


def test_a_task_is_not_tied_to_workers_that_are_gone(tmp_path: Path) -> None:
    """While some workers cannot be used the others are named to the scheduler, and it would wait for them alone."""
    (tmp_path / "sitecustomize.py").write_text("import robosc\nrobosc.__version__ = '0.0.1'\n")
    path = os.pathsep.join((str(tmp_path), *(path for path in sys.path if path)))
    with dask_cluster(tmp_path, workers=1) as cluster, running_on(cluster.address, 1) as running:
        cluster.start_worker(environment={"PYTHONPATH": path})
        assert eventually(lambda: bool(running.workers._refused))
        future, pid = running.begun("sleep 1\necho again")
        kill(dask_worker_of(cluster, pid))
        cluster.start_worker()
        assert said(future.result(60)) == "again"
        assert len({report.message for report in running.reports}) == 2


def test_losses(tmp_path: Path) -> None:
    """Workers are killed in the middle of tasks, then the scheduler; each comes back."""
    with dask_cluster(tmp_path, workers=2) as cluster, running_on(cluster.address, 2) as running:
        # A worker: another one does its task.
        future, pid = running.begun("sleep 1\necho again")
        kill(dask_worker_of(cluster, pid))
        assert said(future.result(60)) == "again"
        assert eventually(lambda: not is_running(pid))
        assert len({report.message for report in running.reports}) == 2

        # Two of them, under one task.
        assert eventually(lambda: running.workers.capacity == 1)
        cluster.start_worker()
        assert eventually(lambda: running.workers.capacity == 2)
        future, pid = running.begun("sleep 600")
        for count in (2, 3):
            kill(dask_worker_of(cluster, pid))
            cluster.start_worker()
            if count == 2:
                pid = running.next_pid(count)
        outcome = future.result(60)
        assert outcome == Failure(Reason.WORKER_DIED, "two workers of the cluster were lost during this task")

        # The scheduler, under a task.
        assert eventually(lambda: running.workers.capacity == 2)
        future, pid = running.begun("stuck")
        assert cluster.scheduler is not None
        kill(cluster.scheduler)
        with pytest.raises(WorkersError, match=f"the Dask scheduler at {cluster.address} was lost"):
            future.result(60)
        assert eventually(lambda: not is_running(pid))
        assert eventually(lambda: bool(running.workers.fault))
        with pytest.raises(WorkersError, match="cannot be reached"):
            running.run("echo")

        cluster.start_scheduler()
        cluster.start_worker()
        assert eventually(lambda: running.workers.capacity == 1)
        assert said(running.run("echo back")) == "back"
        assert running.workers.fault == ""


def test_workers_that_are_lost_before_they_begin_are_not_the_tasks_fault(tmp_path: Path) -> None:
    # The scheduler itself does not try again.
    patience = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
    with dask_cluster(tmp_path, workers=3, environment=patience) as cluster, running_on(cluster.address, 3) as running:

        def stop_all() -> None:
            """They take tasks, and do not begin them."""
            running.note_pids()
            for worker in cluster.workers:
                worker.send_signal(signal.SIGSTOP)

        def lose_holder() -> None:
            worker = running.holder(cluster)
            kill(worker)
            cluster.workers.remove(worker)

        stop_all()
        future = running.start("echo at last")
        for _ in range(2):
            lose_holder()
        (last,) = cluster.workers
        assert running.holder(cluster) is last
        last.send_signal(signal.SIGCONT)
        assert said(future.result(60)) == "at last"

        # The server's knowledge of its workers is as old as its last look: losses are seen, then those that come.
        assert eventually(lambda: running.workers.capacity == 1)
        for _ in range(2):
            cluster.start_worker()
        assert eventually(lambda: running.workers.capacity == 3)
        stop_all()
        future = running.start("echo never")
        for _ in range(3):
            lose_holder()
        with pytest.raises(WorkersError, match="loses its workers before they start a task"):
            future.result(60)
        assert running.reports == []


def test_a_cluster_that_is_away_is_waited_for(tmp_path: Path) -> None:
    cluster = Cluster(tmp_path)
    problem = f"the Dask scheduler at {cluster.address} cannot be reached"
    with running_on(cluster.address, 0) as running, pytest.raises(WorkersError, match=problem):
        running.run("echo")
