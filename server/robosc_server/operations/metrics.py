"""Metrics of the server for Prometheus, in a registry of their own, over HTTP at /metrics."""

import asyncio
from bisect import bisect_left
from collections.abc import Callable, Iterable, Mapping
from itertools import accumulate
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
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, Metric
from prometheus_client.registry import Collector
from prometheus_client.utils import floatToGoString

from robosc_api.connection_ledger import CloseReason
from robosc_api.metrics_server import MetricsServer
from robosc_api.security import SecurityError, is_loopback_host, joined
from robosc_api.security.addresses import split_address
from robosc_server.tasks.task import Failure, Outcome, Reason, TaskKind

_CALL_SECONDS = (0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30, 60, 300, 600)
_TASK_SECONDS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30, 60, 120, 300, 600)

_RESULT, _CANCELLED = "RESULT", "CANCELLED"
"""Outcomes of tasks, beside the reasons of failures."""

_COLLECT_S = 4.0
"""Time limit for the event loop to collect the metrics, in seconds: less than that of a connection."""


class MethodMetrics:
    """Metrics of one method, looked up once and not for each call.

    The calls of the event loop count in plain numbers: a counter with a lock takes several times as long.

    Attributes:
        under_way: Calls that have begun and not ended.
        codes: Number of completed calls, by status code.
        seconds: Duration of all completed calls together, in seconds.
    """

    __slots__ = ("_numbers", "_refusals", "codes", "seconds", "under_way")

    def __init__(self, refusals: Counter) -> None:
        self._refusals = refusals
        self._numbers = [0] * (len(_CALL_SECONDS) + 1)
        self.codes: dict[str, int] = {"OK": 0}
        self.seconds = 0.0
        self.under_way = 0

    def ended(self, code: grpc.StatusCode, reason: str, seconds: float) -> None:
        """Count a call.

        Args:
            code: Status code with which the call ended.
            reason: Reason of its failure, as in google.rpc.ErrorInfo; empty: unknown.
            seconds: Duration of the call, in seconds.
        """
        if code is grpc.StatusCode.OK:
            self.codes["OK"] += 1
        else:
            self.codes[code.name] = self.codes.get(code.name, 0) + 1
            if reason:
                self._refusals.labels(reason).inc()
        self._numbers[bisect_left(_CALL_SECONDS, seconds)] += 1
        self.seconds += seconds

    def buckets(self) -> list[tuple[str, float]]:
        """Return the number of calls that took no longer than each limit of the histogram."""
        limits = [*map(floatToGoString, _CALL_SECONDS), "+Inf"]
        return list(zip(limits, accumulate(map(float, self._numbers)), strict=True))


class Metrics:
    """Metrics of the server.

    Args:
        version: Version of RoboSC.
    """

    def __init__(self, version: str) -> None:
        registry = self._registry = CollectorRegistry()
        ProcessCollector(registry=registry)
        PlatformCollector(registry=registry)
        GCCollector(registry=registry)
        Info("robosc_server", "Version of the server.", registry=registry).info({"version": version})
        self._refusals = Counter(
            "robosc_server_failures", "Failed calls, by reason (ErrorInfo).", ("reason",), registry=registry
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
        self._methods: dict[str, MethodMetrics] = {}
        self._unknown = 0
        self._lookups = {"memory": 0, "store": 0, "none": 0}
        # Each begins at 0: the first event of a series that comes into being with it is no increase for Prometheus, and
        # would raise no alert.
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
        self._expiries: Callable[[], Mapping[str, float]] = dict
        self._closed: Callable[[], Mapping[CloseReason, int]] = lambda: dict.fromkeys(CloseReason, 0)
        self._barred: Callable[[], int] = _zero
        self._times_barred: Callable[[], int] = _zero
        Gauge("robosc_server_tasks_waiting", "Tasks waiting for a worker.", registry=registry).set_function(
            lambda: self._waiting()
        )
        Gauge("robosc_server_tasks_running", "Tasks that workers are running.", registry=registry).set_function(
            lambda: self._running()
        )
        Gauge(
            "robosc_server_hosts_barred", "Hosts whose new connections are kept away after floods.", registry=registry
        ).set_function(lambda: self._barred())
        registry.register(_LabelledCollector(self))

    def method(self, name: str) -> MethodMetrics:
        """Return the metrics of one method, which must exist, since its metrics are never removed."""
        found = self._methods.get(name)
        if found is None:
            found = self._methods[name] = MethodMetrics(self._refusals)
        return found

    def unknown_method(self) -> None:
        """Count a call of a method that does not exist; its name comes from the caller and is not stored."""
        self._unknown += 1

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
        """Count a request whose result was cached.

        Args:
            where: `memory` or `store`.
        """
        self._lookups[where] += 1

    def cache_miss(self) -> None:
        """Count a request whose result was not cached."""
        self._lookups["none"] += 1

    def set_sources(
        self,
        *,
        waiting: Callable[[], int] | None = None,
        running: Callable[[], int] | None = None,
        jobs: Callable[[], Mapping[str, int]] | None = None,
        conditions: Callable[[], Mapping[str, bool]] | None = None,
        restarts: Callable[[], int] | None = None,
        expiries: Callable[[], Mapping[str, float]] | None = None,
        closed: Callable[[], Mapping[CloseReason, int]] | None = None,
        barred: Callable[[], int] | None = None,
        times_barred: Callable[[], int] | None = None,
    ) -> None:
        """Set the functions that are called for each request for metrics, on the event loop: they must be quick.

        Args:
            waiting: Number of tasks that wait.
            running: Number of tasks that workers are busy with.
            jobs: Number of jobs, by state.
            conditions: Conditions that the service needs, and whether they hold.
            restarts: Number of times that the process that starts workers had to be started again.
            expiries: Seconds until tokens expire, by id of the token.
            closed: Number of connections that the server has closed, by reason.
            barred: Number of hosts whose new connections are kept away now.
            times_barred: Number of times that those of a host began to be kept away.
        """
        self._waiting = waiting or self._waiting
        self._running = running or self._running
        self._jobs = jobs or self._jobs
        self._conditions = conditions or self._conditions
        self._restarts = restarts or self._restarts
        self._expiries = expiries or self._expiries
        self._closed = closed or self._closed
        self._barred = barred or self._barred
        self._times_barred = times_barred or self._times_barred

    def labelled_metrics(self) -> Iterable[Metric]:
        """Return the metrics that have labels and values that are computed on request."""
        calls = CounterMetricFamily("robosc_server_calls", "Completed calls.", labels=("method", "code"))
        seconds = HistogramMetricFamily("robosc_server_call_seconds", "Duration of calls.", labels=("method",))
        for method, found in self._methods.items():
            for code, number in found.codes.items():
                calls.add_metric((method, code), number)
            seconds.add_metric((method,), found.buckets(), found.seconds)
        if self._unknown:
            calls.add_metric(("unknown", grpc.StatusCode.UNIMPLEMENTED.name), self._unknown)
        lookups = CounterMetricFamily(
            "robosc_server_result_lookups",
            "Result lookups by location: memory, store, or none (a worker runs the task).",
            labels=("found",),
        )
        for where, number in self._lookups.items():
            lookups.add_metric((where,), number)
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
        expiries = GaugeMetricFamily(
            "robosc_server_token_seconds_to_expiry",
            "Time until a token expires that no other token replaces; negative if it has expired.",
            labels=("token",),
        )
        for token, remaining_s in sorted(self._expiries().items()):
            expiries.add_metric((token,), remaining_s)
        closed = CounterMetricFamily(
            "robosc_server_connections_closed",
            "Connections that the server has closed because they cost more than their calls explain, by reason.",
            labels=("reason",),
        )
        for reason, number in self._closed().items():
            closed.add_metric((reason.name.lower(),), number)
        bars = CounterMetricFamily(
            "robosc_server_host_bars", "Times that new connections of a host began to be kept away after floods."
        )
        bars.add_metric((), self._times_barred())
        return calls, seconds, lookups, jobs, conditions, restarts, expiries, closed, bars

    def collector(self, loop: asyncio.AbstractEventLoop) -> Collector:
        """Return a collector of all metrics for other threads, which collects them on the event loop."""
        return _OnLoop(self._registry, loop)

    def text(self) -> bytes:
        """Return all metrics, in the text format of Prometheus."""
        return generate_latest(self._registry)


def _zero() -> int:
    return 0


class _LabelledCollector:
    def __init__(self, metrics: Metrics) -> None:
        self._metrics = metrics

    def collect(self) -> Iterable[Metric]:
        return self._metrics.labelled_metrics()

    # The names that this returns let a scraper ask for a part of the metrics.
    describe = collect


class _OnLoop(Collector):
    """Collector that reads a registry on the event loop, for the threads of the endpoint.

    Args:
        registry: Registry of the metrics, or a part of one.
        loop: Event loop of the server.
    """

    def __init__(self, registry: Any, loop: asyncio.AbstractEventLoop) -> None:
        self._registry, self._loop = registry, loop

    def collect(self) -> Iterable[Metric]:
        """Return the metrics.

        Raises:
            TimeoutError: The loop does not answer in time.
        """
        return asyncio.run_coroutine_threadsafe(self._collected(), self._loop).result(_COLLECT_S)

    async def _collected(self) -> list[Metric]:
        return list(self._registry.collect())

    def restricted_registry(self, names: Iterable[str]) -> Self:
        """Return a collector of the metrics with some names."""
        return type(self)(self._registry.restricted_registry(names), self._loop)


class MetricsEndpoint:
    """HTTP endpoint for Prometheus at /metrics; an asynchronous context.

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
        self._server: MetricsServer | None = None
        self.address = address

    async def __aenter__(self) -> Self:
        """Listen.

        Raises:
            SecurityError: It may not listen there, or cannot.
        """
        check_metrics_address(self.address, beyond_loopback=self._beyond_loopback)
        host, port = split_address(self.address)
        server = MetricsServer(self._metrics.collector(asyncio.get_running_loop()), host, port)
        try:
            await asyncio.to_thread(server.start)
        except OSError as error:
            raise SecurityError(
                f"the metrics endpoint cannot listen on {self.address}: {error.strerror or error}"
            ) from error
        self._server = server
        self.address = joined(host, server.port)
        structlog.get_logger().info("metrics endpoint is listening", address=self.address)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._server is not None:
            # A thread may be asking the loop for metrics, so it must not wait for the threads.
            await asyncio.to_thread(self._server.stop)


def check_metrics_address(address: str, *, beyond_loopback: bool) -> None:
    """Check the address of the endpoint before it listens.

    Raises:
        SecurityError: The endpoint may not listen there.
    """
    if not beyond_loopback and not is_loopback_host(split_address(address)[0]):
        raise SecurityError(
            f"{address} is reachable from other machines, and metrics need no token: set metrics_beyond_loopback to "
            "allow this, or use a loopback address"
        )
