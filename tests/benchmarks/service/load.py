"""The synthesis service under load: calls a second beside those of an empty server, memory, and many who watch.

The empty server gets the same requests by the same kind of call, and answers with as many bytes. Client and server are
on the same machine and share its processors, in every row alike. A call's time of a processor says on a machine with
other work, too, how much less the empty server does.
"""

import asyncio
import contextlib
import itertools
import os
import resource
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import grpc.aio

from figures import text_table
from robosc.language import load_bundle
from robosc_api.security import Credentials
from robosc_api.v1 import jobs_pb2, jobs_pb2_grpc
from robosc_client import Check, Client, SynthesisOptions, Synthesize
from robosc_client.commands.bench import varied
from robosc_client.convert.requests import request_of
from robosc_client.load_measurement import Load, Measured, measure
from service.echo import METHOD, echo_server
from support.long_work import long_work
from support.models import EXAMPLES, bundle_of
from support.service import server_process

MODEL = EXAMPLES / "line_follower" / "line_follower.rscd"
CLIENTS = (1, 8, 64)
CALLS = 10_000
WATCHERS = 1_000

_SECONDS = 4.0
_TURNS = 4
_CONNECTIONS = (20, WATCHERS)
_WARM_UP = 20
_DISTINCT = 2_000
_NOBODY = Credentials()
_SERVICE = "/robosc_api.v1.SynthesisService/"
_WATCHED_S = 10.0
# No model comes twice in one run: its result would be kept.
_NUMBERS = itertools.count()


def table() -> str:
    """All tables, of one run."""
    with (
        server_process("--worker-processes", "2", "--log-level", "warning") as (process, address),
        echo_server(answer_sizes(address)) as (echo_process, echo_address),
    ):
        echo, service = Server(echo_process.pid, echo_address), Server(process.pid, address)
        parts = [_calls("The synthesis service under load", echo, service)]
        with _busy_core():
            parts.append(_calls("The same with a busy loop on one core", echo, service))
        parts += [_memory(address, process.pid), _watchers(address, process.pid)]
    return "\n\n".join(parts)


@dataclass(frozen=True, slots=True)
class Server:
    """A server that is measured."""

    pid: int
    address: str


def answer_sizes(address: str) -> dict[str, int]:
    """Return the sizes of the answers of a service by method, in bytes."""
    loads = (load(1) for load in call_kinds().values())
    return {load.method.removeprefix(_SERVICE): run_load(address, load, count=1).answer_bytes for load in loads}


@contextmanager
def _busy_core() -> Iterator[None]:
    """Another program that takes all that it gets of one core."""
    core = min(os.sched_getaffinity(0))
    code = f"import os\nos.sched_setaffinity(0, {{{core}}})\nwhile True: pass"
    process = subprocess.Popen([sys.executable, "-c", code])
    try:
        yield
    finally:
        process.kill()
        process.wait()


def _calls(title: str, echo: Server, service: Server) -> str:
    kinds = call_kinds()
    rows = []
    for load in kinds.values():
        run_load(service.address, load(1), count=_WARM_UP)
    for clients in CLIENTS:
        asked = {
            echo_name(method): (echo, as_echo(kinds[f"{method}, cached"](clients)))
            for method in ("Check", "Synthesize")
        } | {name: (service, load(clients)) for name, load in kinds.items()}
        found: dict[str, list[Measured]] = {name: [] for name in asked}
        used_s = dict.fromkeys(asked, 0.0)
        # By turns, since other guests of the same machine make it faster and slower all the time.
        for _ in range(_TURNS):
            for name, (server, chosen) in asked.items():
                before_s = processor_s(server.pid)
                found[name].append(run_load(server.address, chosen, duration_s=_SECONDS / _TURNS))
                used_s[name] += processor_s(server.pid) - before_s
        measured = {name: together(parts) for name, parts in found.items()}
        rows += [_row(name, clients, measured, used_s) for name in asked]
    header = [
        *("line follower", "clients", "calls/s", "p50 ms", "p99 ms", "of the echo"),
        *("server's CPU us", "of the echo", "errors"),
    ]
    return text_table(title, header, rows)


def call_kinds() -> dict[str, Callable[[int], Load]]:
    bundle = load_bundle(MODEL)
    options = SynthesisOptions()
    check, synthesize = (request_of(task).SerializeToString() for task in (Check(bundle), Synthesize(bundle, options)))

    def other_check(number: int) -> bytes:
        return request_of(Check(varied(bundle, next(_NUMBERS)))).SerializeToString()

    def other_synthesis(number: int) -> bytes:
        return request_of(Synthesize(varied(bundle, next(_NUMBERS)), options)).SerializeToString()

    def of(method: str, request: Callable[[int], bytes]) -> Callable[[int], Load]:
        is_stream = method == "Synthesize"
        return lambda clients: Load(_SERVICE + method, is_stream, request, clients, channels=min(clients, 4))

    return {
        "Check, cached": of("Check", lambda number: check),
        "Synthesize, cached": of("Synthesize", lambda number: synthesize),
        "Check": of("Check", other_check),
        "Synthesize": of("Synthesize", other_synthesis),
    }


def together(parts: Sequence[Measured]) -> Measured:
    """Measurements that were made one after the other, as one."""
    errors: Counter[str] = Counter()
    for part in parts:
        errors.update(part.errors)
    return Measured(
        sum(part.seconds for part in parts),
        tuple(sorted(time_s for part in parts for time_s in part.times_s)),
        sum(part.answer_bytes for part in parts),
        dict(errors),
    )


def echo_name(method: str) -> str:
    return f"empty echo of {method}"


def as_echo(load: Load) -> Load:
    """Return the same load for the empty server."""
    return replace(load, method=METHOD + load.method.removeprefix(_SERVICE))


def run_load(address: str, load: Load, credentials: Credentials = _NOBODY, **amount: Any) -> Measured:
    return asyncio.run(measure(address, credentials, replace(load, **amount)))


def _row(name: str, clients: int, measured: dict[str, Measured], used_s: dict[str, float]) -> list[str]:
    echo = name if name.startswith("empty") else echo_name(name.partition(",")[0])
    found, empty = measured[name], measured[echo]
    times = [found.percentile_s(percent) for percent in (50, 99)]
    shown_ms = ["" if time_s is None else f"{time_s * 1e3:.2f}" for time_s in times]
    own_s, echo_s = (used_s[each] / max(1, len(measured[each].times_s)) for each in (name, echo))
    return [
        *(name, str(clients), f"{found.calls_per_second:,.0f}", *shown_ms),
        _share(found.calls_per_second, empty.calls_per_second),
        f"{own_s * 1e6:.0f}",
        _share(echo_s, own_s),
        str(sum(found.errors.values())),
    ]


def _share(part: float, whole: float) -> str:
    return f"{part / whole:.0%}" if whole else ""


def _memory(address: str, pid: int) -> str:
    """Memory of the server's process, beginning when all has been used once."""
    load = call_kinds()["Synthesize, cached"](8)
    rows = [["before", _megabytes(_resident_bytes(pid))]]
    for number in range(1, 5):
        found = run_load(address, load, count=CALLS // 4)
        assert len(found.times_s) == CALLS // 4, found.errors
        rows.append([f"after {number * CALLS // 4:,} calls", _megabytes(_resident_bytes(pid))])
    # The memory kept for each request is bounded, too.
    found = run_load(address, call_kinds()["Check"](8), count=_DISTINCT)
    assert len(found.times_s) == _DISTINCT, found.errors
    rows.append([f"after {_DISTINCT:,} different ones (Check)", _megabytes(_resident_bytes(pid))])
    return text_table("Memory of the server", ["Synthesize, cached", "MB"], rows)


def _watchers(address: str, pid: int) -> str:
    """Many who watch a job that goes on, on few connections and each on an own one."""
    columns = []
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (limits[1], limits[1]))
    with Client(address) as client:
        for connections in _CONNECTIONS:
            job = client.submit(Synthesize(bundle_of(long_work(9)))).job
            before = _resident_bytes(pid)
            rows = asyncio.run(_watched(address, pid, job.id, connections))
            client.cancel_job(job.id)
            rows.insert(1, ["memory for each, kB", f"{(int(rows.pop()[1]) - before) / WATCHERS / 1e3:.1f}"])
            columns.append(rows)
    rows = [[name, *(column[place][1] for column in columns)] for place, (name, _) in enumerate(columns[0])]
    return text_table(f"{WATCHERS:,} who watch a job", ["connections", *map(str, _CONNECTIONS)], rows)


async def _watched(address: str, pid: int, job_id: str, connections: int) -> list[list[str]]:
    ended: list[float] = []
    revisions: list[int] = [0] * WATCHERS
    messages = 0
    channels = [grpc.aio.insecure_channel(address, (("robosc.bench", number),)) for number in range(connections)]
    request = jobs_pb2.WatchJobRequest(id=job_id)

    async def watch(place: int) -> None:
        nonlocal messages
        stub = jobs_pb2_grpc.JobServiceStub(channels[place % connections])  # type: ignore[no-untyped-call]
        async for response in stub.WatchJob(request):
            revisions[place] = response.job.revision
            messages += 1
        ended.append(time.perf_counter())

    begun_s = time.perf_counter()
    tasks = [asyncio.create_task(watch(place)) for place in range(WATCHERS)]
    while not all(revisions):
        await asyncio.sleep(0.01)
    opened_s = time.perf_counter() - begun_s
    resident = _resident_bytes(pid)
    used_s, before = processor_s(pid), messages
    await asyncio.sleep(_WATCHED_S)
    used_s, reports = processor_s(pid) - used_s, messages - before
    async with grpc.aio.insecure_channel(address) as channel:
        stub = jobs_pb2_grpc.JobServiceStub(channel)  # type: ignore[no-untyped-call]
        cancelled_s = time.perf_counter()
        await stub.CancelJob(jobs_pb2.CancelJobRequest(id=job_id))
        await asyncio.gather(*tasks)
    for channel in channels:
        await channel.close()
    return [
        ["seconds until all received the state", f"{opened_s:.2f}"],
        ["messages of progress a second to all", f"{reports / _WATCHED_S:,.0f}"],
        ["server's processor meanwhile", f"{used_s / _WATCHED_S:.1%}"],
        ["seconds until all received the end", f"{max(ended) - cancelled_s:.2f}"],
        ["", str(resident)],
    ]


def _resident_bytes(pid: int) -> int:
    (line,) = [line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("VmRSS:")]
    return int(line.split()[1]) * 1024


def processor_s(pid: int) -> float:
    """Time of a processor that a process has used, without its children's."""
    # A thread that ends meanwhile is an idle one of gRPC.
    used_ns = 0
    for thread in Path(f"/proc/{pid}/task").iterdir():
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            used_ns += int((thread / "schedstat").read_text().split()[0])
    return used_ns / 1e9


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f}"
