"""The synthesis service under load: calls a second beside those of an empty server, memory, and many who watch.

Client and server are on the same machine and share its processors, in every row alike.
"""

import asyncio
import time
from collections import Counter
from collections.abc import Callable, Sequence
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
from service.echo import METHOD, REQUEST, echo_server
from support.long_work import long_work
from support.models import EXAMPLES, bundle_of
from support.service import server_process

MODEL = EXAMPLES / "line_follower" / "line_follower.rscd"
CLIENTS = (1, 8, 64)
CALLS = 10_000
WATCHERS = 1_000

_SECONDS = 4.0
_TURNS = 4
_CONNECTIONS = 20
_WARM_UP = 20
_DISTINCT = 2_000
_SERVICE = "/robosc_api.v1.SynthesisService/"
_IDLE_S = 5.0


def table(seconds: float = _SECONDS) -> str:
    """All tables, of one run."""
    with (
        echo_server() as echo,
        server_process("--worker-processes", "2", "--log-level", "warning") as (process, address),
    ):
        parts = [_calls(echo, address, seconds), _memory(address, process.pid), _watchers(address, process.pid)]
    return "\n\n".join(parts)


def _calls(echo: str, address: str, seconds: float) -> str:
    kinds = _kinds()
    rows = []
    for load in kinds.values():
        _measured(address, load(1), count=_WARM_UP)
    for clients in CLIENTS:
        asked = {"empty echo": (echo, _echo(clients))} | {
            name: (address, load(clients)) for name, load in kinds.items()
        }
        found: dict[str, list[Measured]] = {name: [] for name in asked}
        # By turns, since other guests of the same machine make it faster and slower all the time.
        for _ in range(_TURNS):
            for name, (where, chosen) in asked.items():
                found[name].append(_measured(where, chosen, duration_s=seconds / _TURNS))
        empty = together(found["empty echo"])
        rows += [_row(name, clients, together(parts), empty) for name, parts in found.items()]
    header = ["line follower", "clients", "calls/s", "p50 ms", "p99 ms", "of the echo", "errors"]
    return text_table("The synthesis service under load", header, rows)


def _kinds() -> dict[str, Callable[[int], Load]]:
    bundle = load_bundle(MODEL)
    options = SynthesisOptions()
    check, synthesize = (request_of(task).SerializeToString() for task in (Check(bundle), Synthesize(bundle, options)))
    numbers = iter(range(10**9))

    def other_check(number: int) -> bytes:
        return request_of(Check(varied(bundle, next(numbers)))).SerializeToString()

    def other_synthesis(number: int) -> bytes:
        return request_of(Synthesize(varied(bundle, next(numbers)), options)).SerializeToString()

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


def _echo(clients: int) -> Load:
    return Load(METHOD, False, lambda number: REQUEST, clients, channels=min(clients, 4))


def _measured(address: str, load: Load, **amount: Any) -> Measured:
    chosen = Load(load.method, load.is_stream, load.request, load.concurrency, channels=load.channels, **amount)
    return asyncio.run(measure(address, Credentials(), chosen))


def _row(name: str, clients: int, found: Measured, empty: Measured) -> list[str]:
    share = f"{found.calls_per_second / empty.calls_per_second:.0%}" if empty.calls_per_second else ""
    times = [found.percentile_s(percent) for percent in (50, 99)]
    told = ["" if time_s is None else f"{time_s * 1e3:.2f}" for time_s in times]
    return [name, str(clients), f"{found.calls_per_second:,.0f}", *told, share, str(sum(found.errors.values()))]


def _memory(address: str, pid: int) -> str:
    """Memory of the server's process, beginning when all has been used once."""
    load = _kinds()["Synthesize, cached"](8)
    rows = [["before", _megabytes(_resident_bytes(pid))]]
    for number in range(1, 5):
        found = _measured(address, load, count=CALLS // 4)
        assert len(found.times_s) == CALLS // 4, found.errors
        rows.append([f"after {number * CALLS // 4:,} calls", _megabytes(_resident_bytes(pid))])
    # What is kept of each request is bounded, too.
    found = _measured(address, _kinds()["Check"](8), count=_DISTINCT)
    assert len(found.times_s) == _DISTINCT, found.errors
    rows.append([f"after {_DISTINCT:,} different ones (Check)", _megabytes(_resident_bytes(pid))])
    return text_table("Memory of the server", ["Synthesize, cached", "MB"], rows)


def _watchers(address: str, pid: int) -> str:
    """Many who watch a job that goes on."""
    with Client(address) as client:
        job = client.submit(Synthesize(bundle_of(long_work(9)))).job
        before = _resident_bytes(pid)
        rows = asyncio.run(_watched(address, pid, job.id))
        client.cancel_job(job.id)
    rows.insert(1, ["memory for each, kB", f"{(int(rows.pop()[1]) - before) / WATCHERS / 1e3:.1f}"])
    return text_table(f"{WATCHERS:,} who watch a job", ["", ""], rows)


async def _watched(address: str, pid: int, job_id: str) -> list[list[str]]:
    ended: list[float] = []
    told: list[int] = [0] * WATCHERS
    channels = [grpc.aio.insecure_channel(address, (("robosc.bench", number),)) for number in range(_CONNECTIONS)]
    request = jobs_pb2.WatchJobRequest(id=job_id)

    async def watch(place: int) -> None:
        stub = jobs_pb2_grpc.JobServiceStub(channels[place % _CONNECTIONS])  # type: ignore[no-untyped-call]
        async for response in stub.WatchJob(request):
            told[place] = response.job.revision
        ended.append(time.perf_counter())

    begun_s = time.perf_counter()
    tasks = [asyncio.create_task(watch(place)) for place in range(WATCHERS)]
    while not all(told):
        await asyncio.sleep(0.01)
    opened_s = time.perf_counter() - begun_s
    resident = _resident_bytes(pid)
    used_s = _processor_s(pid)
    await asyncio.sleep(_IDLE_S)
    used_s = _processor_s(pid) - used_s
    async with grpc.aio.insecure_channel(address) as channel:
        stub = jobs_pb2_grpc.JobServiceStub(channel)  # type: ignore[no-untyped-call]
        cancelled_s = time.perf_counter()
        await stub.CancelJob(jobs_pb2.CancelJobRequest(id=job_id))
        await asyncio.gather(*tasks)
    for channel in channels:
        await channel.close()
    return [
        ["seconds until all were told the state", f"{opened_s:.2f}"],
        ["server's processor while nothing is told", f"{used_s / _IDLE_S:.1%}"],
        ["seconds until all were told the end", f"{max(ended) - cancelled_s:.2f}"],
        ["", str(resident)],
    ]


def _resident_bytes(pid: int) -> int:
    (line,) = [line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("VmRSS:")]
    return int(line.split()[1]) * 1024


def _processor_s(pid: int) -> float:
    """Time of a processor that a process has used, without its children's."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f}"
