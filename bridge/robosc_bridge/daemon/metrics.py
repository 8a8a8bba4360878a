"""Metrics of the bridge for Prometheus: its latest snapshot, over HTTP at /metrics."""

import logging
from collections.abc import Iterator
from itertools import accumulate, chain

from prometheus_client import CollectorRegistry, GCCollector, PlatformCollector, ProcessCollector
from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    InfoMetricFamily,
    Metric,
    StateSetMetricFamily,
)
from prometheus_client.registry import Collector

from robosc._version import __version__
from robosc.execution.runtime.progress import Progress
from robosc_api.metrics_server import MetricsServer
from robosc_api.security import SecurityError, ServerSecurity, check_listening
from robosc_api.security.addresses import split_address
from robosc_bridge.daemon.feed import Feed, Snapshot
from robosc_bridge.daemon.states import State
from robosc_bridge.daemon.timing import BOUNDS_S, Latency
from robosc_bridge.errors import BridgeError

_log = logging.getLogger(__name__)


class MetricsError(BridgeError):
    """The metrics cannot be served as configured; the message says why."""


class MetricsEndpoint:
    """Server of the metrics: an `Endpoint`. It only reads, and its end does not stop the robot.

    Args:
        feed: Feed that shows the daemon.
        address: Address that it listens at, HOST:PORT.
        is_open: True if other machines may read them.

    Raises:
        MetricsError: The server may not listen at this address.
    """

    name = "metrics endpoint"

    def __init__(self, feed: Feed, address: str, *, is_open: bool = False) -> None:
        try:
            check_listening(address, ServerSecurity(insecure_beyond_loopback=is_open))
            self._host, self._port = split_address(address)
        except (SecurityError, ValueError) as error:
            raise MetricsError(f"remote.metrics_address: {error}") from error
        self._registry = CollectorRegistry()
        ProcessCollector(registry=self._registry)
        PlatformCollector(registry=self._registry)
        GCCollector(registry=self._registry)
        self._registry.register(_SnapshotCollector(feed))
        self._server: MetricsServer | None = None

    @property
    def address(self) -> str:
        """Address at which it listens."""
        return f"{self._host}:{self._port}"

    @property
    def is_alive(self) -> bool:
        """True: a robot does not stop because its metrics are unavailable."""
        return True

    def start(self) -> None:
        """Begin to serve.

        Raises:
            MetricsError: The address cannot be used.
        """
        try:
            server = MetricsServer(self._registry, self._host, self._port)
            server.start()
        except OSError as error:
            raise MetricsError(f"remote.metrics_address: {self.address} cannot be used: {error.strerror}") from error
        self._server = server
        self._port = server.port
        _log.info("metrics at http://%s/metrics", self.address)

    def stop(self) -> None:
        """End serving."""
        server, self._server = self._server, None
        if server is not None:
            server.stop()


class _SnapshotCollector(Collector):
    """Collector of metrics from the latest snapshot.

    Args:
        feed: Feed that shows the daemon.
    """

    def __init__(self, feed: Feed) -> None:
        self._feed = feed

    def collect(self) -> Iterator[Metric]:
        """Yield the metrics."""
        yield InfoMetricFamily("robosc_bridge", "Version of the bridge.", {"version": __version__})
        subscription = self._feed.subscribe(lambda: None, 1)
        try:
            snapshot = subscription.take().snapshot
        finally:
            subscription.close()
        if snapshot is not None:
            yield from _metrics(snapshot)


def _metrics(snapshot: Snapshot) -> Iterator[Metric]:
    states = StateSetMetricFamily("robosc_bridge_state", "State of the bridge.", labels=[])
    states.add_metric([], {str(state): snapshot.state is state for state in State})
    yield states
    # An age would need the clock of who asks: a time that stands still is that of a loop that hangs.
    yield GaugeMetricFamily(
        "robosc_bridge_snapshot_time_seconds", "Time of the latest snapshot since 1970.", snapshot.time_s
    )
    yield CounterMetricFamily(
        "robosc_bridge_overruns",
        "Decisions that were left out because the one before took too long.",
        snapshot.overruns,
    )
    reasons = GaugeMetricFamily("robosc_bridge_stopped", "Reasons why nothing moves.", labels=["reason"])
    for reason in snapshot.reasons:
        reasons.add_metric([reason.name], 1.0)
    yield reasons
    devices = GaugeMetricFamily("robosc_bridge_device_up", "Devices: 1 works, 0 is not there.", labels=["device"])
    for device, works in snapshot.devices.items():
        devices.add_metric([str(device)], float(works))
    yield devices
    reading = snapshot.reading
    if reading is not None and reading.battery_v is not None:
        yield GaugeMetricFamily("robosc_bridge_battery_volts", "Voltage of the battery.", reading.battery_v)
    cancelling = GaugeMetricFamily(
        "robosc_bridge_cancelling",
        "Actions whose goal was to be cancelled and has not ended: 1 in time, 2 overdue.",
        labels=["action"],
    )
    for action in snapshot.cancelling:
        cancelling.add_metric([action], 2.0 if action in snapshot.overdue_cancels else 1.0)
    yield cancelling
    if snapshot.progress is not None:
        yield from _progress(snapshot.progress)
    latencies = HistogramMetricFamily(
        "robosc_bridge_latency_seconds", "Times that the bridge measures of itself.", labels=["what"]
    )
    for latency in snapshot.timing.latencies:
        latencies.add_metric([latency.name], list(_buckets(latency)), latency.sum_s)
    yield latencies
    lines = CounterMetricFamily(
        "robosc_bridge_line", "Counts of a device's line since it was opened.", labels=["device", "what"]
    )
    for line, counts in snapshot.timing.lines.items():
        for name, count in counts.items():
            lines.add_metric([line, name], count)
    yield lines


def _progress(progress: Progress) -> Iterator[Metric]:
    reached = CounterMetricFamily(
        "robosc_bridge_goal_reached",
        "Times that a goal has become true, or a visit was made, since the run began.",
        labels=["goal"],
    )
    for aim in progress.aims:
        reached.add_metric([aim.name], aim.times)
    yield reached
    if progress.missions:
        visit = GaugeMetricFamily(
            "robosc_bridge_mission_visit",
            "Number of the visit that a mission is at, from 1 on; 0 if it is not asked for.",
            labels=["mission"],
        )
        rounds = CounterMetricFamily(
            "robosc_bridge_mission_rounds", "Rounds that a mission has made since the run began.", labels=["mission"]
        )
        for mission in progress.missions:
            visit.add_metric([mission.name], float(mission.visit))
            rounds.add_metric([mission.name], mission.rounds)
        yield visit
        yield rounds
    owed = GaugeMetricFamily(
        "robosc_bridge_assumption_owed_seconds",
        "Time since when an assumption is owed; 0 if it is met.",
        labels=["assumption"],
    )
    for assumption in progress.assumptions:
        owed.add_metric([assumption.name], assumption.unmet_s or 0.0)
    yield owed


def _buckets(latency: Latency) -> Iterator[tuple[str, float]]:
    """Return every second bound, which is enough for a graph, with the number of times up to it."""
    *counts, total = map(float, accumulate(latency.counts))
    bounds = (f"{bound_s:g}" for bound_s in BOUNDS_S[::2])
    return chain(zip(bounds, counts[::2], strict=True), [("+Inf", total)])
