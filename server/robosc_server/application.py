"""Assembly of a server from its parts: storage, workers, services, operations and graceful shutdown."""

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from functools import partial
from typing import Any

import grpc.aio
from grpc_health.v1 import health as health_names
from grpc_health.v1 import health_pb2_grpc
from grpc_reflection.v1alpha import reflection, reflection_pb2_grpc

from robosc import __version__
from robosc_api.connection_ledger import ConnectionLimits
from robosc_api.connection_watch import Arrivals, ConnectionWatch
from robosc_api.layers import LayeredServices
from robosc_api.malformed import PLAIN_REQUESTS, MalformedRequests
from robosc_api.request_timeouts import REFLECTION_METHODS, RequestTimeouts
from robosc_api.security import Guard, Rule, Scope, SecurityError, TokenFile, add_port, caller_of, token_or_host_of
from robosc_api.security.addresses import is_loopback_host, split_address
from robosc_server.clock import wall_clock_s
from robosc_server.jobs import (
    JOB_METHODS,
    JOB_SERVICE_NAME,
    JobLimits,
    JobManager,
    JobService,
    QueueLimits,
    ResultCache,
    Scheduler,
    add_job_service,
)
from robosc_server.operations.descriptors import usable_connections
from robosc_server.operations.drain import drain, stop
from robosc_server.operations.exposure import exposures
from robosc_server.operations.health import Health
from robosc_server.operations.instrumented_workers import InstrumentedWorkers
from robosc_server.operations.interceptor import CallInterceptor
from robosc_server.operations.metrics import Metrics, MetricsEndpoint, check_metrics_address
from robosc_server.operations.open_calls import HEALTH_CALLS, CallLimits, OpenCalls
from robosc_server.operations.quotas import Quotas
from robosc_server.operations.settings import Confinement, Settings
from robosc_server.operations.thread_scheduling import batched_threads
from robosc_server.operations.tracing import TracingError, open_tracing
from robosc_server.result_sender import ResultSender
from robosc_server.signing import SigningError, read_signing_key, signed
from robosc_server.store import StoreError, StoreUnavailableError, open_store
from robosc_server.synthesis_service import METHODS, SERVICE_NAME, SynthesisService
from robosc_server.task_dispatcher import TaskDispatcher
from robosc_server.tasks.describe import server_limits, targets_response, version_response
from robosc_server.tasks.requests import QUICK_BYTES, RequestLimits, accept_request
from robosc_server.tasks.task import Result, TaskKind, own_key
from robosc_server.workers import Workers, WorkersError
from robosc_server.workers.cluster_check import check_cluster
from robosc_server.workers.factory import open_workers

_log = logging.getLogger(__name__)

_RULE = Rule(frozenset({Scope.SYNTHESIZE}))

_IDLE_METHODS = frozenset({f"/{JOB_SERVICE_NAME}/WatchJob", "/grpc.health.v1.Health/Watch"})
"""Methods whose open calls do not delay a shutdown."""

KEEPALIVE = (
    ("grpc.keepalive_time_ms", 30_000),
    ("grpc.keepalive_timeout_ms", 10_000),
    # The timeout of a ping; a minute by default.
    ("grpc.http2.ping_timeout_ms", 10_000),
)
"""gRPC keepalive options, which detect peers that have disappeared, so that their tasks end."""

_RESERVED_TASKS = 1
"""Tasks that may run beyond the number of workers, for callers without a running task."""

_UNREAD_RESULTS = 8
"""Unread results of maximum size that the server holds in memory."""

_REFUSED_CALLS = 1000
"""Calls that can be refused and logged at the same time; those beyond them are refused without a log line."""

_IDLE_S = 120.0
"""Time after which a connection without calls is closed; clients reconnect by themselves."""

_REFLECTION_IDLE_S = 60.0
"""Maximum time between two requests of a reflection stream."""

_PENDING_CALLS = 20_000
"""Calls that may wait to be taken by the server's loop: a second of calls that are begun as fast as possible."""

_HANDSHAKE_LIMIT_S = 10.0
"""Maximum time of the TLS and HTTP/2 handshakes."""

_METADATA_BYTES = 8 * 1024
"""Maximum size of the metadata of a call, all names and values together, in bytes."""


class StartError(Exception):
    """The server cannot start with its settings; one sentence for the operator."""


@asynccontextmanager
async def running_server(settings: Settings, workers: Workers | None = None) -> AsyncIterator[str]:
    """Run a server that answers inside the context; yield its address.

    Args:
        settings: Settings of the server.
        workers: Workers that run the tasks, not started yet; None: as configured.

    Raises:
        StartError: The server cannot start with these settings.
    """
    try:
        async with AsyncExitStack() as stack:
            yield await _start(settings, workers, stack)
    except (SecurityError, SigningError, StoreError, StoreUnavailableError, TracingError, WorkersError) as error:
        raise StartError(str(error)) from error


async def _start(settings: Settings, given_workers: Workers | None, stack: AsyncExitStack) -> str:
    """Start the parts; the stack stops them in reverse order."""
    # Wrong settings are reported before anything is started.
    if settings.metrics_address:
        check_metrics_address(settings.metrics_address, beyond_loopback=settings.metrics_beyond_loopback)
    check_cluster(settings.workers, is_insecure_allowed=settings.insecure_workers_beyond_loopback)
    for warning in exposures(settings.database_url, settings.tracing_endpoint):
        _log.warning("%s", warning)
    finish = _finish(settings)
    tokens = (
        None
        if settings.tokens is None
        else TokenFile(settings.tokens, needed=Scope.SYNTHESIZE, wall_clock=wall_clock_s)
    )
    request_limits = RequestLimits(
        bundle_bytes=settings.bundle_bytes, bundle_files=settings.bundle_files, nodes=settings.task_nodes
    )
    metrics = Metrics(__version__)
    tracing = open_tracing(settings.tracing_endpoint, __version__)
    stack.push_async_callback(asyncio.to_thread, tracing.close)
    calls = CallInterceptor(metrics, tracing)
    services = {SERVICE_NAME: METHODS, JOB_SERVICE_NAME: JOB_METHODS}
    for service, names in services.items():
        for name in names:
            metrics.method(f"/{service}/{name}")
    guard = Guard(
        {f"/{service}/{name}": _RULE for service, names in services.items() for name in names},
        tokens,
        has_client_certificates=settings.client_ca is not None,
        is_forwarded=settings.forwarded_identity,
    )
    arrivals = Arrivals()
    # Looking for a client certificate that cannot exist takes longer than the rest of the layer.
    identify = caller_of if settings.client_ca is not None else token_or_host_of
    keys = _every_callers_key if settings.share_results else own_key
    # Outside of the request timeouts: a call without a request counts as open, too.
    open_calls = OpenCalls(
        CallLimits(settings.open_calls, settings.open_calls_per_caller),
        identify,
        arrivals=arrivals,
    )
    prompt = RequestTimeouts(settings.request_seconds, dict.fromkeys(REFLECTION_METHODS, _REFLECTION_IDLE_S))
    # Services with larger requests check them themselves.
    malformed = MalformedRequests(
        JOB_SERVICE_NAME, health_names.SERVICE_NAME, reflection.SERVICE_NAME, limit=QUICK_BYTES
    )
    connections = usable_connections(settings.connections, settings.worker_processes)
    layered = LayeredServices(
        calls,
        guard,
        open_calls,
        prompt,
        arrivals,
        malformed,
        most_calls=settings.open_calls + 2 * HEALTH_CALLS + _REFUSED_CALLS,
    )
    options = _options(settings, request_limits.submission_bytes, connections)
    with batched_threads():
        server = grpc.aio.server(None, (layered,), options=options)
    address = add_port(server, settings.address, settings.security)
    stack.push_async_callback(stop, server)
    store = await asyncio.to_thread(open_store, settings.state_dir, settings.database_url)
    stack.push_async_callback(asyncio.to_thread, store.close)
    workers: Any = given_workers or open_workers(
        settings.workers,
        settings.worker_processes,
        must_be_confined=settings.confinement is Confinement.REQUIRED,
    )
    await stack.enter_async_context(workers)
    observed = InstrumentedWorkers(workers, metrics, tracing)
    quotas = Quotas(tokens)
    scheduler = Scheduler(
        observed,
        QueueLimits(settings.waiting_tasks, settings.waiting_tasks_per_caller, _RESERVED_TASKS),
        accounts=quotas,
    )
    results = await stack.enter_async_context(ResultCache(store, settings.memory_cache_bytes, finish))
    manager = await stack.enter_async_context(
        JobManager(
            store,
            scheduler,
            results,
            settings.task_limits,
            JobLimits(
                retention_s=settings.retention_seconds,
                results_bytes=settings.results_bytes,
                jobs_per_owner=settings.jobs_per_caller,
            ),
            tracing=tracing,
        )
    )
    sender = ResultSender(2 * settings.result_bytes, _UNREAD_RESULTS * settings.result_bytes)
    targets, version = await asyncio.to_thread(_descriptions, settings, request_limits)
    synthesis = SynthesisService(
        TaskDispatcher(results, scheduler, quotas, settings.task_limits, metrics),
        sender,
        request_limits,
        targets,
        version,
        keys,
        identify,
    )
    jobs = JobService(
        manager,
        lambda kind, request: accept_request(kind, request, request_limits),
        admit=quotas.admit,
        send=sender.send_stream,
        limits=request_limits,
        keys=keys,
    )

    layered.add_generic_rpc_handlers((synthesis.handler(),))
    add_job_service(jobs, layered)
    health = Health({SERVICE_NAME: ("workers",), JOB_SERVICE_NAME: ("store", "workers")})
    health_pb2_grpc.add_HealthServicer_to_server(health, layered)
    reflected = reflection.aio.ReflectionServicer((*services, health_names.SERVICE_NAME, reflection.SERVICE_NAME))
    reflection_pb2_grpc.add_ServerReflectionServicer_to_server(reflected, layered)
    metrics.set_sources(
        waiting=lambda: scheduler.waiting,
        running=lambda: scheduler.running,
        jobs=lambda: {str(state): count for state, count in manager.counts.items()},
        conditions=health.conditions,
        expiries=dict if tokens is None else tokens.seconds_to_expiry,
        restarts=lambda: getattr(workers, "restarts", 0),  # A cluster restarts its own workers.
    )
    await stack.enter_async_context(
        health.probing(
            {
                "store": partial(_is_true, lambda: store.is_available),
                "workers": partial(_is_true, lambda: workers.capacity > 0),
            }
        )
    )
    if settings.metrics_address:
        await stack.enter_async_context(
            MetricsEndpoint(metrics, settings.metrics_address, beyond_loopback=settings.metrics_beyond_loopback)
        )

    async def end() -> None:
        scheduler.close()
        await asyncio.gather(
            manager.drain(settings.drain_seconds),
            drain(
                server,
                health,
                calls,
                settings.drain_seconds,
                _IDLE_METHODS,
                lambda: sender.unread_bytes,
                scheduler.end_calls,
            ),
        )

    await server.start()
    if settings.socket is None:
        limits = ConnectionLimits(connections=connections, request_bytes=request_limits.submission_bytes)
        watch = stack.enter_context(ConnectionWatch(split_address(address)[1], limits, arrivals, bars=_is_elsewhere))
        metrics.set_sources(
            closed=lambda: watch.closed, barred=lambda: watch.barred, times_barred=lambda: watch.times_barred
        )
    stack.push_async_callback(end)
    return address


def _options(settings: Settings, request_bytes: int, connections: int) -> list[tuple[str, int]]:
    """Channel arguments of the gRPC server."""
    return [
        *KEEPALIVE,
        # Otherwise two servers could share a port and each get a part of the requests.
        ("grpc.so_reuseport", 0),
        ("grpc.http2.min_ping_interval_without_data_ms", 10_000),
        ("grpc.server_handshake_timeout_ms", int(_HANDSHAKE_LIMIT_S * 1000)),
        ("grpc.max_connection_idle_ms", int(_IDLE_S * 1000)),
        # The watch over connections keeps their number below this one.
        ("grpc.max_allowed_incoming_connections", connections),
        # Calls that are begun faster than they are taken wait. Beyond these numbers gRPC cancels some at random, also
        # those of other callers.
        ("grpc.server.max_pending_requests", _PENDING_CALLS),
        ("grpc.server.max_pending_requests_hard_limit", 2 * _PENDING_CALLS),
        # Beyond this number a client queues calls silently; calls that are refused with a reason must fit.
        ("grpc.max_concurrent_streams", settings.open_calls_per_caller + _REFUSED_CALLS),
        ("grpc.max_metadata_size", _METADATA_BYTES),
        ("grpc.absolute_max_metadata_size", _METADATA_BYTES),
        # The server refuses large messages with a reason; beyond this size gRPC refuses without one.
        ("grpc.max_receive_message_length", 2 * request_bytes),
        PLAIN_REQUESTS,
        # A probed window grows to megabytes, and so much of a message that gRPC refuses would still be received. The
        # window of a message that is read grows to its size all the same.
        ("grpc.http2.bdp_probe", 0),
    ]


def _is_elsewhere(host: str) -> bool:
    """Return True for the host of another machine: the programs of this one share its address."""
    return not is_loopback_host(host)


def _every_callers_key(key: str, caller: str) -> str:
    """Return the key of a task whose result callers share."""
    return key


async def _is_true(condition: Any) -> bool:
    return bool(condition())


def _finish(settings: Settings) -> Callable[[TaskKind, Result], Result]:
    """Return the function that is applied to a result before it is sent.

    Raises:
        SigningError: The key cannot be used.
    """
    if settings.signing_key is None:
        return lambda kind, result: result
    key = read_signing_key(settings.signing_key)
    return lambda kind, result: signed(kind, result, key)


def _descriptions(settings: Settings, request_limits: RequestLimits) -> tuple[bytes, bytes]:
    """Return the serialized responses of ListTargets and GetVersion; this is slow."""
    limits = server_limits(
        request_limits,
        settings.task_limits,
        waiting_tasks=settings.waiting_tasks,
        waiting_tasks_per_caller=settings.waiting_tasks_per_caller,
        retention_seconds=settings.retention_seconds,
    )
    return targets_response().SerializeToString(), version_response(limits).SerializeToString()
