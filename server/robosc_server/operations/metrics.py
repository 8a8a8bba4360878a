"""Metrics of the server, for Prometheus: in a registry of its own, asked for over HTTP at /metrics."""

import asyncio
import contextlib
from collections.abc import Callable, Iterable, Mapping
from types import TracebackType
from typing import Any, Self

import grpc
import structlog
from prometheus_client import (
    CollectorRegistry,
    Counter,
    Gauge,
    GCCollector,
    Histogram,
    Info,
    PlatformCollector,
    ProcessCollector,
    generate_latest,
)
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.exposition import CONTENT_TYPE_LATEST

from robosc_api.security import SecurityError, is_loopback_host, joined
from robosc_api.security.addresses import split_address
from robosc_server.tasks.task import Failure, Outcome, Reason, TaskKind

_CALL_SECONDS = (0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30, 60, 300, 600)
_TASK_SECONDS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30, 60, 120, 300, 600)

_RESULT, _CANCELLED = "RESULT", "CANCELLED"
"""Outcomes of tasks, beside the reasons of failures."""

_HEAD_BYTES = 8192
_HEAD_SECONDS = 5.0
_CONNECTIONS = 16


class MethodMetrics:
    """Metrics of one method, looked up once and not for each call.

    Attributes:
        under_way: Calls that have begun and not ended.
    """

    __slots__ = ("_calls", "_method", "_ok", "_refusals", "_seconds", "under_way")

    def __init__(self, method: str, calls: Counter, refusals: Counter, seconds: Histogram) -> None:
        self._method, self._calls, self._refusals = method, calls, refusals
        self._ok = calls.labels(method, "OK")
        self._seconds = seconds.labels(method)
        self.under_way = 0

    def ended(self, code: grpc.StatusCode, reason: str, seconds: float) -> None:
        """Count a call.

        Args:
            code: Status code with which the call ended.
            reason: Reason of its failure, as in google.rpc.ErrorInfo; empty: nothing is known.
            seconds: Duration of the call, in seconds.
        """
        if code is grpc.StatusCode.OK:
            self._ok.inc()
        else:
            self._calls.labels(self._method, code.name).inc()
            if reason:
                self._refusals.labels(reason).inc()
        self._seconds.observe(seconds)


class Metrics:
    """Metrics of the server.

    Args:
        version: Of RoboSC.
    """

    def __init__(self, version: str) -> None:
        registry = self._registry = CollectorRegistry()
        ProcessCollector(registry=registry)
        PlatformCollector(registry=registry)
        GCCollector(registry=registry)
        Info("robosc_server", "Version of the server.", registry=registry).info({"version": version})
        self._calls = Counter("robosc_server_calls", "Completed calls.", ("method", "code"), registry=registry)
        self._refusals = Counter(
            "robosc_server_failures", "Failed calls, by reason (ErrorInfo).", ("reason",), registry=registry
        )
        self._seconds = Histogram(
            "robosc_server_call_seconds",
            "Duration of calls.",
            ("method",),
            buckets=_CALL_SECONDS,
            registry=registry,
        )
        self._outcomes = Counter(
            "robosc_server_tasks", "Completed tasks, by outcome.", ("kind", "outcome"), registry=registry
        )
        self._task_seconds = Histogram(
            "robosc_server_task_seconds",
            "Duration of tasks at workers.",
            ("kind",),
            buckets=_TASK_SECONDS,
            registry=registry,
        )
        self._lookups = Counter(
            "robosc_server_result_lookups",
            "Result lookups by location: memory, store, or none (a worker runs the task).",
            ("found",),
            registry=registry,
        )
        # Each begins at 0: the first event of a series that comes into being with it is no increase for Prometheus, and
        # would raise no alert.
        for where in ("memory", "store", "none"):
            self._lookups.labels(where)
        for reason in Reason:
            self._refusals.labels(reason.value)
        for kind in TaskKind:
            self._task_seconds.labels(kind.value)
            for word in (_RESULT, _CANCELLED, *Reason):
                self._outcomes.labels(kind.value, str(word))
        Gauge("robosc_server_calls_under_way", "Calls in progress.", registry=registry).set_function(
            lambda: self.calls_under_way
        )
        self._waiting: Callable[[], int] = _zero
        self._running: Callable[[], int] = _zero
        self._jobs: Callable[[], Mapping[str, int]] = dict
        self._conditions: Callable[[], Mapping[str, bool]] = dict
        self._restarts: Callable[[], int] = _zero
        Gauge("robosc_server_tasks_waiting", "Tasks waiting for a worker.", registry=registry).set_function(
            lambda: self._waiting()
        )
        Gauge("robosc_server_tasks_running", "Tasks that workers are running.", registry=registry).set_function(
            lambda: self._running()
        )
        registry.register(_LabelledCollector(self))
        self._methods: dict[str, MethodMetrics] = {}

    def method(self, name: str) -> MethodMetrics:
        """Return the metrics of one method; only for methods that exist, since each stays."""
        found = self._methods.get(name)
        if found is None:
            found = self._methods[name] = MethodMetrics(name, self._calls, self._refusals, self._seconds)
        return found

    def unknown_method(self) -> None:
        """Count a call of a method that there is not; its name is the caller's, and kept nowhere."""
        self._calls.labels("unknown", grpc.StatusCode.UNIMPLEMENTED.name).inc()

    @property
    def calls_under_way(self) -> int:
        """Calls that have begun and not ended."""
        return sum(method.under_way for method in tuple(self._methods.values()))

    def task_ended(self, kind: TaskKind, outcome: Outcome | None, seconds: float) -> None:
        """Count a task that a worker was busy with.

        Args:
            kind: Kind of the task.
            outcome: Outcome of the task; None: it was cancelled.
            seconds: Wall-clock time during which a worker was busy with it, in seconds.
        """
        match outcome:
            case None:
                word = _CANCELLED
            case Failure(reason=reason):
                word = reason.value
            case _:
                word = _RESULT
        self._outcomes.labels(kind.value, word).inc()
        self._task_seconds.labels(kind.value).observe(seconds)

    def cache_hit(self, where: str) -> None:
        """Count a request whose result was there.

        Args:
            where: `memory` or `store`.
        """
        self._lookups.labels(where).inc()

    def cache_miss(self) -> None:
        """Count a request whose result was not there."""
        self._lookups.labels("none").inc()

    def set_sources(
        self,
        *,
        waiting: Callable[[], int] | None = None,
        running: Callable[[], int] | None = None,
        jobs: Callable[[], Mapping[str, int]] | None = None,
        conditions: Callable[[], Mapping[str, bool]] | None = None,
        restarts: Callable[[], int] | None = None,
    ) -> None:
        """Set the functions that are called for each request for metrics, on the event loop: they must be quick.

        Args:
            waiting: Number of tasks that wait.
            running: Number of tasks that workers are busy with.
            jobs: Number of jobs, by state.
            conditions: Conditions that the service needs, and whether they hold.
            restarts: Number of times that the process that starts workers had to be started again.
        """
        self._waiting = waiting or self._waiting
        self._running = running or self._running
        self._jobs = jobs or self._jobs
        self._conditions = conditions or self._conditions
        self._restarts = restarts or self._restarts

    def labelled_metrics(self) -> Iterable[Metric]:
        """Return the metrics whose values are asked for, and that have labels."""
        jobs = GaugeMetricFamily("robosc_server_jobs", "Stored jobs, by state.", labels=("state",))
        for state, number in sorted(self._jobs().items()):
            jobs.add_metric((state,), number)
        conditions = GaugeMetricFamily(
            "robosc_server_condition", "1 if a condition of the service is met, else 0.", labels=("name",)
        )
        for name, holds in sorted(self._conditions().items()):
            conditions.add_metric((name,), float(holds))
        restarts = CounterMetricFamily("robosc_server_worker_restarts", "Restarts of the fork server of the workers.")
        restarts.add_metric((), self._restarts())
        return jobs, conditions, restarts

    def text(self) -> bytes:
        """All of it, in the text format of Prometheus."""
        return generate_latest(self._registry)


def _zero() -> int:
    return 0


class _LabelledCollector:
    def __init__(self, metrics: Metrics) -> None:
        self._metrics = metrics

    def collect(self) -> Iterable[Metric]:
        return self._metrics.labelled_metrics()


class MetricsEndpoint:
    """HTTP/1.1 endpoint for Prometheus: one GET of /metrics for each connection; an asynchronous context.

    Args:
        metrics: Metrics that it shows.
        address: `HOST:PORT`; port 0 picks a free one.
        beyond_loopback: True if other machines may reach it.

    Attributes:
        address: `HOST:PORT` with the port that it got, once it is entered.
    """

    def __init__(self, metrics: Metrics, address: str, *, beyond_loopback: bool = False) -> None:
        self._metrics = metrics
        self._beyond_loopback = beyond_loopback
        self._server: asyncio.Server | None = None
        self._connections: set[asyncio.StreamWriter] = set()
        self.address = address

    async def __aenter__(self) -> Self:
        """Listen.

        Raises:
            SecurityError: It may not listen there, or cannot.
        """
        check_metrics_address(self.address, beyond_loopback=self._beyond_loopback)
        host, port = split_address(self.address)
        try:
            self._server = await asyncio.start_server(self._answer, host, port, limit=_HEAD_BYTES)
        except OSError as error:
            raise SecurityError(
                f"the metrics endpoint cannot listen on {self.address}: {error.strerror or error}"
            ) from error
        self.address = joined(host, self._server.sockets[0].getsockname()[1])
        structlog.get_logger().info("metrics endpoint is listening", address=self.address)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._server is not None:
            self._server.close()
            for writer in tuple(self._connections):
                writer.transport.abort()
            await self._server.wait_closed()

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(self._connections) >= _CONNECTIONS:
            writer.transport.abort()
            return
        self._connections.add(writer)
        try:
            async with asyncio.timeout(_HEAD_SECONDS):
                head = await reader.readuntil(b"\r\n\r\n")
                writer.write(self._response(head.split(b"\r\n", 1)[0].split(b" ")))
                await writer.drain()
        except (OSError, TimeoutError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            writer.transport.abort()
        finally:
            self._connections.discard(writer)
            writer.close()
            with contextlib.suppress(OSError):
                await writer.wait_closed()

    def _response(self, words: list[bytes]) -> bytes:
        if len(words) != 3 or not words[2].startswith(b"HTTP/1."):
            return _http("400 Bad Request", b"")
        if words[1].partition(b"?")[0] != b"/metrics":
            return _http("404 Not Found", b"metrics are at /metrics\n")
        if words[0] not in (b"GET", b"HEAD"):
            return _http("405 Method Not Allowed", b"")
        return _http("200 OK", self._metrics.text(), CONTENT_TYPE_LATEST, is_head=words[0] == b"HEAD")


def _http(status: str, body: bytes, content: str = "text/plain", *, is_head: bool = False) -> bytes:
    head = f"HTTP/1.1 {status}\r\nContent-Type: {content}\r\nContent-Length: {len(body)}\r\nConnection: close\r\n\r\n"
    return head.encode() + (b"" if is_head else body)


def check_metrics_address(address: str, *, beyond_loopback: bool) -> None:
    """Check what can be known before the endpoint listens.

    Raises:
        SecurityError: It may not listen there.
    """
    if not beyond_loopback and not is_loopback_host(split_address(address)[0]):
        raise SecurityError(
            f"{address} is reachable from other machines, and metrics need no token: set metrics_beyond_loopback to "
            "allow this, or use a loopback address"
        )


def metric_names() -> frozenset[str]:
    """Return the names of all metrics, for dashboards and alerts."""
    found: Any = Metrics("")._registry.collect()
    return frozenset(metric.name for metric in found)
