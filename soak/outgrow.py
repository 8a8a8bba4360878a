"""Runs thousands of jobs on a service that has outgrown one machine, while its parts are killed at random.

    python soak/outgrow.py --jobs 10000 --seed 1
    python soak/outgrow.py --throughput 1 2 4 --jobs 1000

Three servers, PostgreSQL and a Dask cluster of four workers run on this machine, under one proxy (haproxy). Callers
submit jobs of mixed size; meanwhile a worker, a server, the scheduler or the database is killed with SIGKILL every
`--kill-every` seconds on average, and started again a second later. Every result is compared with what this program
works out for the same model without a server. The ledger records how many jobs were accepted, answered, wrong, lost or
ended twice. A job that has lost its worker or its server too often fails, as documented, since it may be the cause; it
is counted as given up and submitted again under another key.

With `--throughput`, nothing is killed, and the same jobs run once for each number of workers: jobs a second, processor
time a job in each part and of the work itself, and memory of the processes that do the tasks.

Exit status: 0 every accepted job ended once with its right result, 1 not, 2 wrong use, 130 Ctrl-C.
"""

import argparse
import asyncio
import contextlib
import json
import math
import multiprocessing
import os
import random
import shutil
import signal
import statistics
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from robosc.json_documents import json_text  # noqa: E402  # found through the path above
from robosc_client import AsyncClient, ClientError, Job, JobState, RetryPolicy  # noqa: E402
from support.job_ledger import GIVEN_UP, Ledger, StoredJob, note_ends, stored_jobs  # noqa: E402
from support.job_mix import MixedJob, digest_of, mixed_job, right_digest  # noqa: E402
from support.outgrown_site import Kind, Site, proxy_program, site, tree_of  # noqa: E402
from support.postgresql import missing_for_postgresql  # noqa: E402

SERVERS = 3
WORKERS = 4
KILL_EVERY_S = 15.0
AT_ONCE = 150
"""Jobs that callers wait for at a time: many more than workers, so that these stay busy while some jobs wait for the
lease of a dead server to expire."""

GIVE_UP_S = 300.0
"""Time without any answer after which callers give up, and the run has failed."""

_MESSAGE = 100
PAUSE_S = 0.5
REPORT_S = 10.0
SAMPLE_S = 0.1
TICKS = os.sysconf("SC_CLK_TCK")

RETRIES = RetryPolicy(attempts=20, watch_attempts=20, longest_s=3.0)


def main(argv: Sequence[str] | None = None) -> int:
    """Run as the arguments say."""
    parser = make_parser()
    arguments = parser.parse_args(argv)
    # SIGTERM ends all parts, as Ctrl-C does.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    if min(arguments.jobs, arguments.workers or WORKERS, *(arguments.throughput or [1])) < 1:
        parser.error("--jobs, --workers and --throughput take numbers above 0")
    if arguments.kill_every is not None and not 0 <= arguments.kill_every < math.inf:
        parser.error("--kill-every takes a number of seconds, or 0 to kill nothing")
    if arguments.throughput and not (arguments.workers is arguments.kill_every is None):
        parser.error(
            "--throughput kills nothing and has its own numbers of workers: without --kill-every and --workers"
        )
    if proxy_program() is None:
        parser.error("haproxy is not installed (Debian's package: haproxy)")
    if missing := missing_for_postgresql():
        parser.error(missing)
    try:
        # Found out now, and not after the run.
        if arguments.json is not None:
            arguments.json.touch()
        folder = (arguments.folder or Path(tempfile.mkdtemp(prefix="outgrow-"))).resolve()
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        parser.error(f"{error.filename}: {error.strerror}")
    try:
        runs = list(run_all(arguments, folder))
    except KeyboardInterrupt:
        return 130
    document: Any = {"throughput": runs} if arguments.throughput else runs[0]
    if arguments.json is not None:
        arguments.json.write_text(json_text(document))
    sys.stdout.write(json.dumps(document, indent=2) + "\n")
    if any(run["problems"] for run in runs):
        sys.stderr.write(f"the logs of all parts are in {folder}\n")
        return 1
    if arguments.folder is None:
        shutil.rmtree(folder, ignore_errors=True)
    return 0


def run_all(arguments: argparse.Namespace, folder: Path) -> Iterator[dict[str, Any]]:
    """Run as the arguments say, and yield the ledger of each run."""
    kill_every_s = KILL_EVERY_S if arguments.kill_every is None else arguments.kill_every
    if arguments.throughput:
        kill_every_s = 0.0
    for workers in arguments.throughput or [arguments.workers or WORKERS]:
        ledger = Chaos(arguments.jobs, arguments.seed, kill_every_s, workers, folder / f"workers{workers}").run()
        sys.stderr.write(f"{workers} workers: {ledger['jobs_per_s']} jobs a second\n")
        yield ledger


def make_parser() -> argparse.ArgumentParser:
    """The parser of the command line."""
    parser = argparse.ArgumentParser(prog="outgrow.py", description=__doc__.partition("\n\n")[0])
    parser.add_argument("--jobs", type=int, default=200, metavar="N", help="number of jobs (default: 200)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the jobs and of the kills (default: 1)")
    parser.add_argument(
        "--kill-every",
        type=float,
        metavar="SECONDS",
        help=f"mean time between two kills; 0: kill nothing (default: {KILL_EVERY_S:g})",
    )
    parser.add_argument("--workers", type=int, metavar="N", help=f"number of Dask workers (default: {WORKERS})")
    parser.add_argument(
        "--throughput",
        type=int,
        nargs="+",
        metavar="N",
        help="kill nothing, and measure with these numbers of workers, one after the other",
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the ledger to this file, too")
    parser.add_argument("--folder", type=Path, metavar="DIR", help="folder of the logs (default: a temporary one)")
    return parser


@dataclass
class Chaos:
    """One run.

    Attributes:
        jobs: Number of jobs.
        seed: Seed of the jobs and of the kills.
        kill_every_s: Mean time between two kills, in seconds; 0: kill nothing.
        workers: Number of workers.
        folder: Folder of the logs.
        ledger: Fate of the jobs.
        errors: Errors that callers have seen after all retries of the client, by their reason or message.
        latencies: Time from the acceptance to the answer of each job, in seconds.
        numbers: Number of the job of each id.
        task_bytes: Most memory of its own that each process of a task was seen with.
        work_s: Processor time that the work of each job takes without a service, in seconds.
    """

    jobs: int
    seed: int
    kill_every_s: float
    workers: int
    folder: Path
    ledger: Ledger = field(default_factory=Ledger)
    errors: Counter[str] = field(default_factory=Counter)
    latencies: list[float] = field(default_factory=list)
    numbers: dict[str, int] = field(default_factory=dict)
    task_bytes: dict[int, int] = field(default_factory=dict)
    work_s: list[float] = field(default_factory=list)
    _answered_at: float = 0.0
    _done: int = 0

    def run(self) -> dict[str, Any]:
        """Run the jobs, check what came of them, and return the ledger as a document."""
        self.folder.mkdir(parents=True, exist_ok=True)
        measured, stored = asyncio.run(self._run_jobs())
        self._work_out_right_results()
        return {
            "jobs": self.jobs,
            "seed": self.seed,
            "kill_every_s": self.kill_every_s,
            "workers": self.workers,
            **self.ledger.counted(stored),
            **measured,
            "work_cpu_ms_per_job": quantiles([1000 * seconds for seconds in self.work_s]),
            "problems": self.ledger.problems[:100],
        }

    async def _run_jobs(self) -> tuple[dict[str, Any], list[StoredJob]]:
        async with (
            site(self.folder, SERVERS, self.workers) as made,
            AsyncClient(made.address, retries=RETRIES) as client,
        ):
            await self._ready(client)
            await asyncio.to_thread(note_ends, psycopg_url(made.database))
            self._answered_at = begun_at = time.monotonic()
            before = cpu_seconds(made)
            background = [asyncio.create_task(self._report(made, begun_at))]
            if self.kill_every_s:
                dice = random.Random(f"kills {self.seed}")
                background.append(asyncio.create_task(made.kill_at_random(self.kill_every_s, dice)))
            else:
                background.append(asyncio.create_task(self._watch_memory(made)))
            try:
                await self._call_all(client, [made.keeper, *background])
                seconds = time.monotonic() - begun_at
                spent = {kind: total - before[kind] for kind, total in cpu_seconds(made).items()}
            finally:
                for task in background:
                    task.cancel()
                await asyncio.gather(*background, return_exceptions=True)
            memory = {} if self.kill_every_s else self._memory(made)
            stored = await self._stored(made)
        measured: dict[str, Any] = {
            "seconds": round(seconds, 1),
            "jobs_per_s": round(self.jobs / seconds, 2),
            "latency_s": quantiles(self.latencies),
            "errors_seen_by_callers": dict(sorted(self.errors.items())),
        }
        if self.kill_every_s:
            measured["kills"] = {kind: made.kills[kind] for kind in Kind}
            measured["starts"] = {kind: sum(part.starts for part in made.of(kind)) for kind in Kind}
        else:
            measured["cpu_ms_per_job"] = {kind: round(1000 * total / self.jobs, 1) for kind, total in spent.items()}
            total_s = sum(spent.values())
            measured["jobs_per_s_per_core"] = round(self.jobs / total_s, 2)
            measured["memory_mb"] = memory
        return measured, stored

    async def _ready(self, client: AsyncClient) -> None:
        """Wait until each server has done a job, so that what is measured does not begin with a start."""
        end = time.monotonic() + GIVE_UP_S
        done = 0
        while done < 2 * SERVERS:
            try:
                await client.synthesize(mixed_job(self.seed, 0).task.model)  # type: ignore[union-attr]
                done += 1
            except ClientError:
                if time.monotonic() > end:
                    raise
                await asyncio.sleep(PAUSE_S)

    async def _call_all(self, client: AsyncClient, background: Iterable[asyncio.Task[None]]) -> None:
        """Do all jobs, as many callers at once, as long as all else goes on."""
        numbers = iter(range(self.jobs))
        async with asyncio.TaskGroup() as group:
            callers = [group.create_task(self._call(client, numbers)) for _ in range(min(AT_ONCE, self.jobs))]
            awaited: list[asyncio.Future[Any]] = [asyncio.gather(*callers), *background]
            await asyncio.wait(awaited, return_when=asyncio.FIRST_COMPLETED)
            for task in background:
                if task.done():
                    task.result()
                    raise RuntimeError("what goes on beside the jobs has ended")

    async def _call(self, client: AsyncClient, numbers: Iterable[int]) -> None:
        """Do one job after the other, as one of many callers."""
        for number in numbers:
            job = mixed_job(self.seed, number)
            for attempt in range(self.jobs):
                if await self._do(client, job, f"{self.seed}-{number}-{attempt}"):
                    break
            self._done += 1

    async def _do(self, client: AsyncClient, job: MixedJob, key: str) -> bool:
        """Submit a job, wait for its end, and note its result; False: the service has given it up."""
        begun_at = time.monotonic()
        submitted = await self._insist(partial(client.submit, job.task, idempotency_key=key, label=job.size))
        self.ledger.accept(key, submitted.job.id)
        ended: Job = await self._insist(partial(client.wait, submitted.job.id))
        if ended.state is JobState.SUCCEEDED:
            result = await self._insist(partial(client.job_result, ended.id))
            self.ledger.results[ended.id] = digest_of(result)
        else:
            self.ledger.failures[ended.id] = ended.failure.reason if ended.failure else str(ended.state)
        self.numbers[ended.id] = job.number
        self.latencies.append(time.monotonic() - begun_at)
        return self.ledger.failures.get(ended.id) not in GIVEN_UP

    async def _insist(self, call: Any) -> Any:
        """Make a call until it is answered."""
        while True:
            try:
                answer = await call()
            except ClientError as error:
                self.errors[error.reason or f"{type(error).__name__}: {str(error)[:_MESSAGE]}"] += 1
                if time.monotonic() - self._answered_at > GIVE_UP_S:
                    raise
                await asyncio.sleep(PAUSE_S)
            else:
                self._answered_at = time.monotonic()
                return answer

    async def _report(self, made: Site, begun_at: float) -> None:
        """Print the progress every `REPORT_S`."""
        while True:
            await asyncio.sleep(REPORT_S)
            seconds = time.monotonic() - begun_at
            kills = ", ".join(f"{number} {kind}" for kind, number in sorted(made.kills.items())) or "none"
            sys.stderr.write(
                f"{seconds:5.0f} s: {self._done} of {self.jobs} jobs, {self._done / seconds:.1f} a second; "
                f"killed: {kills}\n"
            )

    async def _watch_memory(self, made: Site) -> None:
        """Note the memory of the processes that do tasks."""
        while True:
            await asyncio.sleep(SAMPLE_S)
            for worker in made.of(Kind.WORKER):
                for pid in tree_of(worker.pid)[2:] if worker.pid else ():
                    own = own_bytes(pid)
                    if own is not None:
                        self.task_bytes[pid] = max(own, self.task_bytes.get(pid, 0))

    def _memory(self, made: Site) -> dict[str, Any]:
        """Return memory in megabytes: of each process of a task what it has alone, of each part what it shares, too."""
        of_kind: dict[str, Any] = {}
        for kind in Kind:
            sizes = [sum(shared_bytes(pid) for pid in tree_of(part.pid)) for part in made.of(kind) if part.pid]
            of_kind[kind] = round(max(sizes, default=0) / 1e6)
        return {"task": quantiles([size / 1e6 for size in self.task_bytes.values()]), **of_kind}

    async def _stored(self, made: Site) -> list[StoredJob]:
        """Return the jobs of the database, which may be on its way up."""
        while True:
            try:
                return await asyncio.to_thread(stored_jobs, psycopg_url(made.database))
            except OSError:
                await asyncio.sleep(PAUSE_S)

    def _work_out_right_results(self) -> None:
        """Work out here what the results have to be."""
        ids = list(self.ledger.results)
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(os.cpu_count(), mp_context=context) as pool:
            digests = pool.map(partial(right_digest_of, self.seed), [self.numbers[one] for one in ids], chunksize=8)
            for place, (one, (found, seconds)) in enumerate(zip(ids, digests, strict=True)):
                self.ledger.expected[one] = found
                self.work_s.append(seconds)
                if place % 500 == 499:
                    sys.stderr.write(f"compared: {place + 1} of {len(ids)} results\n")


def right_digest_of(seed: int, number: int) -> tuple[str, float]:
    """Digest of the right result of a job, and the processor time that it takes in seconds."""
    task = mixed_job(seed, number).task
    begun_s = time.process_time()
    found = right_digest(task)
    return found, time.process_time() - begun_s


def psycopg_url(url: str) -> str:
    """The URL of a database as libpq reads it."""
    return url.replace("postgresql+psycopg://", "postgresql://")


def quantiles(values: Sequence[float]) -> dict[str, float]:
    """Mean, median, 99th percentile and maximum of some values."""
    if not values:
        return {}
    ordered = sorted(values)
    return {
        "mean": round(statistics.mean(ordered), 2),
        "p50": round(statistics.median(ordered), 2),
        "p99": round(ordered[min(len(ordered) - 1, len(ordered) * 99 // 100)], 2),
        "max": round(ordered[-1], 2),
    }


def cpu_seconds(made: Site) -> dict[str, float]:
    """Processor time that the parts of each kind and the proxy have taken, with all their processes, in seconds."""
    found = {str(kind): sum(map(_tree_seconds, (part.pid for part in made.of(kind)))) for kind in Kind}
    return {**found, "proxy": _tree_seconds(made.proxy.pid)}


def _tree_seconds(root: int | None) -> float:
    ticks = 0
    for pid in tree_of(root) if root is not None else ():
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
            # Its own, and that of the children that it has waited for.
            ticks += sum(map(int, fields[11:15]))
    return ticks / TICKS


def own_bytes(pid: int) -> int | None:
    """Memory that a process shares with no other, in bytes; None: it has ended."""
    return _rollup(pid, "Private_Dirty:", "Private_Clean:")


def shared_bytes(pid: int) -> int:
    """Memory of a process in bytes, of what it shares with others its part."""
    return _rollup(pid, "Pss:") or 0


def _rollup(pid: int, *names: str) -> int | None:
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except (FileNotFoundError, ProcessLookupError, PermissionError):
        return None
    return sum(int(line.split()[1]) * 1024 for line in lines if line.startswith(names))


if __name__ == "__main__":
    sys.exit(main())
