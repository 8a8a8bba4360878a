"""Metrics over HTTP as Prometheus asks for them."""

import asyncio
import urllib.error
import urllib.request
from collections.abc import Awaitable, Callable

import pytest
from prometheus_client.parser import text_string_to_metric_families

from robosc_api.security import SecurityError
from robosc_server.jobs import JOB_METHODS, JOB_SERVICE_NAME
from robosc_server.operations.instrumented_workers import InstrumentedWorkers
from robosc_server.operations.metrics import Metrics, MetricsEndpoint, metric_names
from robosc_server.synthesis_service import METHODS, SERVICE_NAME
from robosc_server.tasks.task import Failure, Outcome, Reason, Result, Task, TaskKind, TaskLimits
from support.held_time import HeldLoop, on_held_time
from support.ports import lasting_port, port_of
from support.service import served
from support.waiting import PATIENCE_S, limited, until


def samples(text: str) -> dict[tuple[str, frozenset[tuple[str, str]]], float]:
    return {
        (sample.name, frozenset(sample.labels.items())): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def value(metrics: Metrics, name: str, **labels: str) -> float:
    return samples(metrics.text().decode())[name, frozenset(labels.items())]


def asked(metrics: Metrics, test: Callable[[str], Awaitable[None]]) -> None:
    async def run() -> None:
        async with MetricsEndpoint(metrics, "127.0.0.1:0") as endpoint:
            await test(endpoint.address)

    limited(run())


async def sent(address: str, request: bytes) -> bytes:
    host, _, port = address.rpartition(":")
    reader, writer = await asyncio.open_connection(host, int(port))
    writer.write(request)
    answer = await reader.read()
    writer.close()
    return answer


def test_prometheus_can_read_them() -> None:
    metrics = Metrics("1.2")
    metrics.set_sources(
        waiting=lambda: 3,
        running=lambda: 2,
        jobs=lambda: {"queued": 5},
        conditions=lambda: {"store": False},
        restarts=lambda: 7,
    )
    metrics.cache_hit("memory")
    metrics.cache_miss()

    async def test(address: str) -> None:
        def get() -> tuple[str, str]:
            with urllib.request.urlopen(f"http://{address}/metrics", timeout=PATIENCE_S) as answer:
                return answer.headers["Content-Type"], answer.read().decode()

        kind, text = await asyncio.to_thread(get)
        assert kind.startswith("text/plain; version=")
        found = samples(text)
        for name, labels, expected in [
            ("robosc_server_info", {"version": "1.2"}, 1),
            ("robosc_server_tasks_waiting", {}, 3),
            ("robosc_server_tasks_running", {}, 2),
            ("robosc_server_jobs", {"state": "queued"}, 5),
            ("robosc_server_condition", {"name": "store"}, 0),
            ("robosc_server_worker_restarts_total", {}, 7),
            ("robosc_server_result_lookups_total", {"found": "memory"}, 1),
            ("robosc_server_result_lookups_total", {"found": "store"}, 0),
        ]:
            assert found[name, frozenset(labels.items())] == expected
        assert ("process_resident_memory_bytes", frozenset()) in found

    asked(metrics, test)


@pytest.mark.parametrize(
    ("request_line", "status"),
    [
        (b"GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n", b"200 OK"),
        (b"HEAD /metrics?x=1 HTTP/1.0\r\n\r\n", b"200 OK"),
        (b"GET / HTTP/1.1\r\n\r\n", b"404 Not Found"),
        (b"POST /metrics HTTP/1.1\r\nContent-Length: 5\r\n\r\nhello", b"405 Method Not Allowed"),
        (b"nonsense\r\n\r\n", b"400 Bad Request"),
        (b"\x16\x03\x01\r\n\r\n", b"400 Bad Request"),
    ],
)
def test_requests_of_all_kinds(request_line: bytes, status: bytes) -> None:
    async def test(address: str) -> None:
        answer = await sent(address, request_line)
        assert answer.startswith(b"HTTP/1.1 " + status)
        assert (b"robosc_server" in answer) is request_line.startswith(b"GET /metrics")

    asked(Metrics("1"), test)


def test_a_head_without_end_is_dropped() -> None:
    async def test(address: str) -> None:
        with pytest.raises(ConnectionError):
            assert await sent(address, b"GET /metrics HTTP/1.1\r\n" + b"X: y\r\n" * 20_000) == b""
            raise ConnectionError

    asked(Metrics("1"), test)


def test_what_alerts_count_is_0_before_it_first_happens() -> None:
    """Check that the first event is an increase: of a series that is new with it, Prometheus sees none."""
    metrics = Metrics("1")
    for kind in TaskKind:
        for outcome in ("RESULT", "CANCELLED", *Reason):
            assert value(metrics, "robosc_server_tasks_total", kind=kind, outcome=outcome) == 0
        assert value(metrics, "robosc_server_task_seconds_count", kind=kind) == 0
    for reason in Reason:
        assert value(metrics, "robosc_server_failures_total", reason=reason) == 0


def test_calls_of_each_method_are_counted_from_0() -> None:
    with lasting_port() as keeper:
        address = f"127.0.0.1:{port_of(keeper)}"
        with (
            served(metrics_address=address),
            urllib.request.urlopen(f"http://{address}/metrics", timeout=PATIENCE_S) as answer,
        ):
            found = samples(answer.read().decode())
    for service, names in ((SERVICE_NAME, METHODS), (JOB_SERVICE_NAME, JOB_METHODS)):
        for name in names:
            method = frozenset({("method", f"/{service}/{name}"), ("code", "OK")})
            assert found["robosc_server_calls_total", method] == 0


def test_who_keeps_connections_open_leaves_others_none_for_a_while_and_then_is_dropped() -> None:
    async def dropped(reader: asyncio.StreamReader) -> None:
        with pytest.raises(ConnectionError):
            assert await reader.read() == b""
            raise ConnectionError

    async def test(loop: HeldLoop) -> None:
        async with MetricsEndpoint(Metrics("1"), "127.0.0.1:0") as endpoint:
            host, _, port = endpoint.address.rpartition(":")
            silent = [await asyncio.open_connection(host, int(port)) for _ in range(40)]
            ends = [asyncio.create_task(dropped(reader)) for reader, _ in silent]
            # Those that there is no room for.
            await until(lambda: sum(end.done() for end in ends) == 24)
            await loop.passed(5.0)
            await asyncio.gather(*ends)
            for _, writer in silent:
                writer.close()
            assert b"200 OK" in await sent(endpoint.address, b"GET /metrics HTTP/1.1\r\n\r\n")

    on_held_time(test)


def test_where_other_machines_reach_it_only_if_it_is_told() -> None:
    async def opened(*, beyond_loopback: bool) -> None:
        async with MetricsEndpoint(Metrics("1"), "0.0.0.0:0", beyond_loopback=beyond_loopback) as endpoint:
            assert not endpoint.address.endswith(":0")

    with pytest.raises(SecurityError, match="metrics_beyond_loopback"):
        asyncio.run(opened(beyond_loopback=False))
    asyncio.run(opened(beyond_loopback=True))


def test_an_address_in_use_is_told() -> None:
    async def test(address: str) -> None:
        with pytest.raises(SecurityError, match="cannot listen"):
            async with MetricsEndpoint(Metrics("1"), address):
                pass

    asked(Metrics("1"), test)


def test_tasks_are_counted_by_how_they_ended() -> None:
    class Scripted:
        capacity = 1

        async def run(self, task: Task, limits: TaskLimits, on_report: object, on_cpu_time: object = None) -> Outcome:
            assert observed.running == 1
            match task.request:
                case b"result":
                    return Result(())
                case b"failure":
                    return Failure(Reason.MEMORY_LIMIT, "too much")
                case _:
                    await asyncio.Event().wait()
                    raise AssertionError

    metrics = Metrics("1")
    observed = InstrumentedWorkers(Scripted(), metrics)

    async def drop(report: object) -> None:
        pass

    async def run() -> None:
        for request in (b"result", b"failure", b"stuck"):
            task = Task(TaskKind.CHECK, request, "0" * 64, "name")
            running = asyncio.create_task(observed.run(task, TaskLimits(), drop))
            if request == b"stuck":
                await asyncio.sleep(0)
                running.cancel()
            await asyncio.wait([running])
        assert observed.running == 0

    asyncio.run(run())
    for outcome in ("RESULT", "MEMORY_LIMIT", "CANCELLED"):
        assert value(metrics, "robosc_server_tasks_total", kind="check", outcome=outcome) == 1
    assert value(metrics, "robosc_server_task_seconds_count", kind="check") == 3


def test_every_name_begins_as_it_should() -> None:
    ours = {name for name in metric_names() if not name.startswith(("process_", "python_"))}
    assert all(name.startswith("robosc_server") for name in ours)
    assert {"robosc_server_calls", "robosc_server_jobs", "robosc_server_task_seconds"} <= ours
