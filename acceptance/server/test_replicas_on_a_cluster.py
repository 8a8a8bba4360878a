"""Whole servers as processes that share one PostgreSQL and one Dask cluster; what is killed is made up for."""

import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from robosc.cli.main import main
from robosc.language import load_bundle
from robosc.source import Bundle
from robosc.targets import write_files
from robosc_client import Client
from robosc_client.jobs import JobState
from robosc_client.results import Generation, Synthesis
from robosc_client.tasks import Generate, Synthesize, Task
from support.background import children_of, cpu_ticks, is_running
from support.dask_clusters import Cluster, dask_cluster, kill
from support.hostile_models import bounded_products, products
from support.models import EXAMPLES
from support.postgresql import postgresql
from support.service import bundle_of, server_process
from support.waiting import eventually

_WORKERS = 2

_BUSY_TICKS = 20
"""A process that has taken so much time of a processor is at a task: one that stands ready takes none."""

_LONG_BITS = 10
"""Number of bits of the factors: their product takes some seconds, and is known then."""


@dataclass(frozen=True)
class Site:
    """Resources that servers share.

    Attributes:
        cluster: Cluster that works for them.
        database: The URL of their database.
    """

    cluster: Cluster
    database: str


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    with postgresql() as database, dask_cluster(tmp_path_factory.mktemp("cluster"), _WORKERS) as cluster:
        yield Site(cluster, database.new_database().replace("postgresql://", "postgresql+psycopg://"))


@contextmanager
def server_at(site: Site) -> Iterator[tuple[subprocess.Popen[str], Client]]:
    """One more server there, and a client of it."""
    workers = site.cluster.address.replace("tcp://", "dask://")
    with (
        server_process("--workers", workers, "--database-url", site.database) as (process, address),
        Client(address) as client,
    ):
        yield process, client


@pytest.fixture(scope="module")
def ours(site: Site) -> Iterator[Client]:
    with server_at(site) as (_, client):
        yield client


@pytest.fixture(scope="module")
def theirs(site: Site) -> Iterator[Client]:
    with server_at(site) as (_, client):
        yield client


def busy(cluster: Cluster) -> dict[int, "subprocess.Popen[bytes]"]:
    """The processes that are at tasks, and the worker of the cluster that each belongs to."""
    found = {}
    for worker in cluster.workers:
        for fork_server in children_of(worker.pid):
            for pid in children_of(fork_server):
                try:
                    if cpu_ticks(pid) >= _BUSY_TICKS:
                        found[pid] = worker
                except (FileNotFoundError, ProcessLookupError):
                    continue
    return found


def long_bundle(name: str) -> Bundle:
    """A model that takes some seconds; under another name it is another one, and worked out anew."""
    return bundle_of(bounded_products(_LONG_BITS), name)


def supervisor_of(model: Path, folder: Path) -> bytes:
    """Return the content of the file that `robosc synth` writes."""
    file = folder / f"{model.stem}.rsup"
    assert main(["synth", str(model), "-o", str(file)]) == 0
    return file.read_bytes()


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def done_elsewhere(ours: Client, theirs: Client, task: Task) -> Synthesis | Generation:
    """The result of a job that is submitted to one server, and watched and read at the other; twice."""
    key = type(task).__name__
    submitted = ours.submit(task, idempotency_key=key).job
    same = theirs.submit(task, idempotency_key=key)
    assert (same.job.id, same.existed) == (submitted.id, True)
    seen = list(theirs.watch(submitted.id))
    revisions = [job.revision for job in seen]
    assert revisions == sorted(set(revisions))
    assert (seen[-1].id, seen[-1].state, seen[-1].attempts) == (submitted.id, JobState.SUCCEEDED, 1)
    assert not seen[-1].from_store
    result = theirs.job_result(submitted.id)
    assert isinstance(result, Synthesis | Generation)
    # A result of one server is known to the other one, which ends a job at once.
    again = theirs.submit(task).job
    assert (again.state, again.from_store, again.attempts) == (JobState.SUCCEEDED, True, 0)
    assert ours.get_job(again.id) == again
    assert ours.job_result(again.id) == result
    return result


def test_a_supervisor_is_submitted_at_one_server_and_read_at_the_other(
    ours: Client, theirs: Client, tmp_path: Path
) -> None:
    model = EXAMPLES / "maze_solver" / "maze_solver.rscd"
    result = done_elsewhere(ours, theirs, Synthesize(load_bundle(model)))
    assert isinstance(result, Synthesis)
    assert result.supervisor == supervisor_of(model, tmp_path)
    # A call is answered from there, too, statistics of the work and all.
    assert theirs.synthesize(load_bundle(model)) == result


def test_a_package_is_submitted_at_one_server_and_read_at_the_other(
    ours: Client, theirs: Client, tmp_path: Path
) -> None:
    model = EXAMPLES / "line_follower" / "line_follower.rscd"
    result = done_elsewhere(theirs, ours, Generate(load_bundle(model), "ros2"))
    assert isinstance(result, Generation)
    assert result.files is not None
    write_files(result.files, tmp_path / "served")
    assert main(["generate", str(model), "--target", "ros2", "-o", str(tmp_path / "made")]) == 0
    assert contents(tmp_path / "served") == contents(tmp_path / "made") != {}


def test_a_worker_of_the_cluster_is_killed_in_the_middle_of_a_job(
    site: Site, ours: Client, theirs: Client, tmp_path: Path
) -> None:
    submitted = ours.submit(Synthesize(long_bundle("lost.rscd"))).job
    assert eventually(lambda: len(busy(site.cluster)) == 1)
    ((pid, worker),) = busy(site.cluster).items()
    kill(worker)
    site.cluster.workers.remove(worker)
    assert theirs.get_job(submitted.id).state is JobState.RUNNING
    # Its process goes with it, and another one's begins.
    assert eventually(lambda: not is_running(pid))
    assert eventually(lambda: len(busy(site.cluster)) == 1)
    site.cluster.start_worker()
    done = theirs.wait(submitted.id)
    assert (done.state, done.failure, done.attempts) == (JobState.SUCCEEDED, None, 1)
    model = tmp_path / "lost.rscd"
    model.write_text(bounded_products(_LONG_BITS))
    result = ours.job_result(submitted.id)
    assert isinstance(result, Synthesis)
    assert result.supervisor == supervisor_of(model, tmp_path)


def test_a_server_is_killed_and_the_others_finish_its_jobs(site: Site, ours: Client, theirs: Client) -> None:
    bundle = load_bundle(EXAMPLES / "line_follower" / "line_follower_layer.rscd")
    tasks = [Generate(bundle, target) for target in ("python", "c99", "cif")]
    with server_at(site) as (process, dying), ThreadPoolExecutor() as threads:
        long = dying.submit(Synthesize(long_bundle("interrupted.rscd"))).job
        endless = dying.submit(Synthesize(bundle_of(products(), "endless.rscd"))).job
        waiting = [dying.submit(task).job for task in tasks]
        assert eventually(lambda: len(busy(site.cluster)) == _WORKERS)
        pids = busy(site.cluster).keys()
        watched = [threads.submit(theirs.wait, job.id) for job in (long, *waiting)]
        process.kill()
        process.wait()
        # Its workers have ended, and others take its jobs once they take it for dead.
        assert eventually(lambda: not any(map(is_running, pids)))
        states = [theirs.get_job(job.id).state for job in (long, endless, *waiting)]
        assert states == [JobState.RUNNING] * 2 + [JobState.QUEUED] * len(waiting)
        assert ours.cancel_job(endless.id).state is JobState.CANCELLED
        done = [job.result() for job in watched]
    assert [(job.state, job.failure) for job in done] == [(JobState.SUCCEEDED, None)] * len(done)
    assert [job.attempts for job in done] == [2] + [1] * len(waiting)
    assert theirs.get_job(endless.id).state is JobState.CANCELLED
    for job, task in zip(waiting, tasks, strict=True):
        # A job's result does not say what it was asked for.
        assert ours.job_result(job.id) == replace(theirs.generate(task.model, task.target), target="")
    assert eventually(lambda: not busy(site.cluster))
