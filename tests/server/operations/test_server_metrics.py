"""Metrics over HTTP as Prometheus asks for them."""

import asyncio
import socket
import threading
import urllib.request
from collections.abc import Awaitable, Callable

import grpc
import pytest
from prometheus_client.parser import text_string_to_metric_families

from robosc_api.connection_ledger import CloseReason
from robosc_api.security import SecurityError
from robosc_server.jobs import JOB_METHODS, JOB_SERVICE_NAME
from robosc_server.operations import metrics as metrics_module
from robosc_server.operations.instrumented_workers import InstrumentedWorkers
from robosc_server.operations.metrics import Metrics, MetricsEndpoint
from robosc_server.synthesis_service import METHODS, SERVICE_NAME
from robosc_server.tasks.task import Failure, Outcome, Reason, Result, Task, TaskKind, TaskLimits
from support.ports import lasting_port, port_of
from support.service import served
from support.waiting import PATIENCE_S, limited


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
        expiries=lambda: {"0f5c1d2e": -1.5},
        closed=lambda: {CloseReason.BYTES_TOGETHER: 4},
        barred=lambda: 6,
        times_barred=lambda: 8,
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
            ("robosc_server_connections_closed_total", {"reason": "bytes_together"}, 4),
            ("robosc_server_hosts_barred", {}, 6),
            ("robosc_server_host_bars_total", {}, 8),
            ("robosc_server_token_seconds_to_expiry", {"token": "0f5c1d2e"}, -1.5),
            ("robosc_server_result_lookups_total", {"found": "memory"}, 1),
            ("robosc_server_result_lookups_total", {"found": "store"}, 0),
        ]:
            assert found[name, frozenset(labels.items())] == expected
        assert ("process_resident_memory_bytes", frozenset()) in found

    asked(metrics, test)


def test_calls_are_counted_by_code_and_duration() -> None:
    metrics = Metrics("1")
    check = metrics.method("/s/Check")
    metrics.method("/s/Idle")
    # Limits of the histogram are included.
    for seconds in (0.0001, 0.0005, 0.002, 700.0):
        check.ended(grpc.StatusCode.OK, "", seconds)
    check.ended(grpc.StatusCode.INTERNAL, "WORKER_DIED", 0.25)
    metrics.unknown_method()
    found = samples(metrics.text().decode())

    def of(name: str, **labels: str) -> float | None:
        return found.get((f"robosc_server_{name}", frozenset(labels.items())))

    assert of("calls_total", method="/s/Check", code="OK") == 4
    assert of("calls_total", method="/s/Check", code="INTERNAL") == 1
    assert of("calls_total", method="/s/Idle", code="OK") == 0
    assert of("calls_total", method="unknown", code="UNIMPLEMENTED") == 1
    assert of("failures_total", reason="WORKER_DIED") == 1
    buckets = {"0.0005": 2, "0.001": 2, "0.0025": 3, "0.1": 3, "0.25": 4, "600.0": 4, "+Inf": 5}
    assert {limit: of("call_seconds_bucket", method="/s/Check", le=limit) for limit in buckets} == buckets
    assert of("call_seconds_count", method="/s/Check") == 5
    assert of("call_seconds_sum", method="/s/Check") == pytest.approx(700.2526)


def test_sources_are_asked_on_the_loop() -> None:
    metrics = Metrics("1")
    threads: list[int] = []

    def jobs() -> dict[str, int]:
        threads.append(threading.get_ident())
        return {"queued": len(threads)}

    metrics.set_sources(jobs=jobs)

    async def test(address: str) -> None:
        for query in ("", "?name[]=robosc_server_jobs"):
            answer = await sent(address, f"GET /metrics{query} HTTP/1.1\r\n\r\n".encode())
            assert b" 200 OK" in answer
            assert f'robosc_server_jobs{{state="queued"}} {len(threads)}.0'.encode() in answer
            assert (b"robosc_server_calls_under_way" in answer) is (query == "")
        assert set(threads) == {threading.get_ident()}

    asked(metrics, test)


def test_a_loop_that_does_not_answer_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(metrics_module, "_COLLECT_S", 0.01)

    async def test(address: str) -> None:
        host, _, port = address.rpartition(":")
        # The loop stands still until the answer is there.
        with socket.create_connection((host, int(port)), timeout=PATIENCE_S) as connection:
            connection.sendall(b"GET /metrics HTTP/1.1\r\n\r\n")
            assert b" 500 " in connection.recv(100)

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


def test_other_machines_reach_it_only_if_it_is_asked_for() -> None:
    async def opened(*, beyond_loopback: bool) -> None:
        async with MetricsEndpoint(Metrics("1"), "0.0.0.0:0", beyond_loopback=beyond_loopback) as endpoint:
            assert not endpoint.address.endswith(":0")

    with pytest.raises(SecurityError, match="metrics_beyond_loopback"):
        asyncio.run(opened(beyond_loopback=False))
    asyncio.run(opened(beyond_loopback=True))


def test_an_address_in_use_is_reported() -> None:
    async def test(address: str) -> None:
        with pytest.raises(SecurityError, match="cannot listen"):
            async with MetricsEndpoint(Metrics("1"), address):
                pass

    asked(Metrics("1"), test)


async def test_tasks_are_counted_by_how_they_ended() -> None:
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

    for request in (b"result", b"failure", b"stuck"):
        task = Task(TaskKind.CHECK, request, "0" * 64, "name")
        running = asyncio.create_task(observed.run(task, TaskLimits(), drop))
        if request == b"stuck":
            await asyncio.sleep(0)
            running.cancel()
        await asyncio.wait([running])
    assert observed.running == 0
    for outcome in ("RESULT", "MEMORY_LIMIT", "CANCELLED"):
        assert value(metrics, "robosc_server_tasks_total", kind="check", outcome=outcome) == 1
    assert value(metrics, "robosc_server_task_seconds_count", kind="check") == 3


def test_every_name_begins_as_it_should() -> None:
    names = {metric.name for metric in Metrics("")._registry.collect()}
    ours = {name for name in names if not name.startswith(("process_", "python_"))}
    assert all(name.startswith("robosc_server") for name in ours)
    assert {"robosc_server_calls", "robosc_server_jobs", "robosc_server_task_seconds"} <= ours
