"""Times that the bridge measures of itself: histograms, the way of a scan to the wheels, and who shows them."""

import math
import urllib.request
from bisect import bisect_left
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from prometheus_client.parser import text_string_to_metric_families

from robosc_bridge.daemon.metrics import MetricsEndpoint, MetricsError
from robosc_bridge.daemon.timing import BOUNDS_S, Histogram, Latency, Timing, shown
from robosc_simulated import SimulatedTurtleBot3
from robosc_simulated.virtual_host import VirtualHost
from support.containers import TOP as ROOT
from support.daemons import supervisor_of
from support.driven import driven
from support.machines import machine
from support.remote import FakeDaemon

TIMES = st.lists(st.floats(0.0, 5.0), min_size=1, max_size=50)


def latency(*times_s: float) -> Latency:
    histogram = Histogram("exchange")
    for time_s in times_s:
        histogram.observe(time_s)
    return histogram.latency


@given(TIMES, st.sampled_from([0.01, 0.5, 0.9, 0.99, 1.0]))
def test_a_share_is_the_bound_of_the_bucket_that_sorting_finds(times_s: list[float], share: float) -> None:
    found = latency(*times_s)
    exact_s = sorted(times_s)[math.ceil(share * len(times_s)) - 1]
    place = bisect_left(BOUNDS_S, exact_s)
    expected_s = max(times_s) if place == len(BOUNDS_S) else min(BOUNDS_S[place], max(times_s))
    assert found.share_s(share) == expected_s >= exact_s
    assert (found.count, found.max_s) == (len(times_s), max(times_s))
    assert found.sum_s == pytest.approx(math.fsum(times_s))


def test_the_buckets_are_a_tenth_wide_from_a_quarter_of_a_millisecond_to_two_seconds() -> None:
    assert BOUNDS_S[0] == 0.00025
    assert 1.5 < BOUNDS_S[-1] < 2.0
    assert all(later / one == pytest.approx(1.1, rel=0.01) for one, later in pairwise(BOUNDS_S))


@given(st.lists(st.floats(BOUNDS_S[0], BOUNDS_S[-1]), min_size=1, max_size=50), st.sampled_from([0.5, 0.99]))
def test_a_share_is_a_tenth_too_long_at_most(times_s: list[float], share: float) -> None:
    exact_s = sorted(times_s)[math.ceil(share * len(times_s)) - 1]
    assert exact_s <= latency(*times_s).share_s(share) <= 1.1 * exact_s + 1e-6


def test_of_nothing_there_is_nothing_to_show() -> None:
    assert latency().share_s(0.99) == 0.0
    assert shown([latency(), latency(0.001)]) == [("exchange", 1.0, 1.0, 1.0)]


class Clock:
    def __init__(self) -> None:
        self.now_s = 10.0

    def __call__(self) -> float:
        return self.now_s


def measured(timing: Timing, clock: Clock) -> dict[str, Latency]:
    clock.now_s += 2.0
    return {one.name: one for one in timing.figures().latencies if one.count}


def test_a_scan_is_followed_to_the_bytes_of_what_was_decided_on_it() -> None:
    clock = Clock()
    timing = Timing(clock)
    timing.scan_taken(9.9)
    timing.deciding()
    timing.commanding()
    clock.now_s = 10.004
    timing.decided()
    scan_s = timing.take_command()
    assert (scan_s, timing.take_command()) == (9.9, None)
    assert scan_s is not None
    clock.now_s = 10.006
    timing.written(scan_s)
    clock.now_s = 10.010
    timing.exchanged(10.005)
    found = measured(timing, clock)
    assert found["scan_to_wheel"].max_s == pytest.approx(0.106)
    assert found["scan_to_decision"].max_s == pytest.approx(0.104)
    assert found["exchange"].max_s == pytest.approx(0.005)
    assert "decision_period" not in found


def test_what_no_scan_has_caused_is_not_counted() -> None:
    clock = Clock()
    timing = Timing(clock)
    # A key, a rotation on its way: no scan was taken up, or nothing is being decided.
    timing.deciding()
    timing.commanding()
    timing.decided()
    timing.scan_taken(9.9)
    timing.scan_passed()
    timing.commanding()
    assert timing.take_command() is None
    timing.exchanged(10.0)
    assert "scan_to_wheel" not in measured(timing, clock)
    # Nor does a run go on from the one before.
    timing.rested()
    timing.deciding()
    timing.decided()
    assert "scan_to_decision" not in measured(timing, clock)


def test_a_scan_that_is_decided_on_at_once_is_followed_too() -> None:
    clock = Clock()
    timing = Timing(clock)
    timing.scan_taken(9.9)
    timing.commanding()
    timing.scan_passed()
    assert timing.take_command() == 9.9
    assert "scan_to_decision" not in measured(timing, clock)


def test_a_decision_at_once_is_measured_when_it_is_made() -> None:
    clock = Clock()
    timing = Timing(clock, decides_at_once=True)
    timing.scan_taken(9.9)
    clock.now_s = 10.002
    timing.scan_passed()
    clock.now_s = 10.02
    # The next period decides on no scan.
    timing.deciding()
    timing.decided()
    assert measured(timing, clock)["scan_to_decision"].max_s == pytest.approx(0.102)
    assert measured(timing, clock)["scan_to_decision"].count == 1


def test_figures_are_worked_out_once_a_second() -> None:
    clock = Clock()
    timing = Timing(clock, {"drive": lambda: {"requests": round(clock.now_s)}})
    first = timing.figures()
    assert first.lines == {"drive": {"requests": 10}}
    timing.reading_taken(9.0)
    clock.now_s = 10.99
    assert timing.figures() is first
    clock.now_s = 11.0
    assert timing.figures().lines == {"drive": {"requests": 11}}


@pytest.mark.parametrize("base", ["opencr", "dynamixel", "mavlink-rover"])
def test_a_robot_that_drives_measures_itself_and_counts_its_lines(base: str) -> None:
    with driven(base) as bridge:
        bridge.steady()
        began_s = bridge.host.monotonic()
        bridge.until(lambda: bridge.host.monotonic() > began_s + 3.0, "three seconds")
        snapshot = bridge.machine.operations.feed.subscribe(lambda: None, 1).take().snapshot
        assert snapshot is not None
        found = {one.name: one for one in snapshot.timing.latencies if one.count}
        assert found["decision_period"].share_s(0.5) == pytest.approx(0.02, rel=0.25)
        assert found["exchange"].count > 100
        # Its supervisor does not look at scans.
        assert "scan_to_wheel" not in found
        assert 0.0 <= found["queueing"].max_s < 0.05
        assert found["scan_to_decision"].max_s < 0.05
        assert sum(snapshot.timing.lines["scanner"].values()) > 0
        counted = snapshot.timing.lines["drive"]
        assert counted["frames" if base == "mavlink-rover" else "requests"] > 50


STOP_MODEL = (ROOT / "tests" / "benchmarks" / "bridge" / "stop_at_obstacle.rscd").read_text()


@pytest.mark.parametrize(("every", "limit_s"), [("event", 0.010), ("period", 0.030)])
@pytest.mark.parametrize("base", ["opencr", "dynamixel"])
def test_the_way_of_a_scan_to_the_wheels_is_measured(base: str, every: str, limit_s: float) -> None:
    supervisor = supervisor_of(STOP_MODEL)
    with VirtualHost() as host, SimulatedTurtleBot3("burger", base, "lds03", clock=host) as robot:
        made = machine(
            supervisor,
            f"robot: burger\ndrive: {{driver: {base}, port: {robot.base_path}}}\n"
            f"scanner: {{driver: lds03, port: {robot.scanner_path}}}\n"
            f"execution: {{every: {every}, period_s: 0.02}}\n"
            "channels: {/scan: {channel: scanner}, /cmd_vel: {channel: drive}}\n",
            host=host,
        )

        def run() -> None:
            made.run()

        thread = host.thread(run, "loop")
        thread.start()
        host.sleep(3.0)
        moved_m = robot.world.pose[0]
        for _ in range(5):
            # Its nose at a wall, and back.
            for x_m in (1.7, 0.0):
                robot.world.place(x_m, 0.0, 0.0)
                host.sleep(1.0)
        host.sleep(1.0)
        snapshot = made.operations.feed.subscribe(lambda: None, 1).take().snapshot
        made.quit()
        thread.join(10.0)
    assert moved_m > 0.05
    assert snapshot is not None
    (found,) = [one for one in snapshot.timing.latencies if one.name == "scan_to_wheel"]
    assert found.count >= 9
    # A board on a virtual host answers in no time.
    assert 0.0 <= found.share_s(0.5) <= found.max_s < limit_s


def test_prometheus_reads_what_the_bridge_measures() -> None:
    with FakeDaemon() as daemon:
        endpoint = MetricsEndpoint(daemon.feed, "127.0.0.1:0")
        endpoint.start()
        try:
            with urllib.request.urlopen(f"http://{endpoint.address}/metrics") as response:
                text = response.read().decode()
        finally:
            endpoint.stop()
        endpoint.stop()
    samples = {
        (sample.name, *(text for _, text in sorted(sample.labels.items(), reverse=True))): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }
    assert samples["robosc_bridge_state", "running"] == 1.0
    assert samples["robosc_bridge_state", "fault"] == 0.0
    assert samples["robosc_bridge_stopped", "SCAN_STALE"] == 1.0
    assert samples["robosc_bridge_device_up", "scanner"] == 0.0
    assert samples["robosc_bridge_overruns_total",] == 4.0
    # Every second bound is exported.
    buckets = {
        key[2]: value
        for key, value in samples.items()
        if key[:2] == ("robosc_bridge_latency_seconds_bucket", "exchange")
    }
    assert list(buckets) == [*(f"{bound_s:g}" for bound_s in BOUNDS_S[::2]), "+Inf"]
    for bound_s, count in ((BOUNDS_S[20], 0.0), (BOUNDS_S[22], 1.0), (BOUNDS_S[38], 1.0), (BOUNDS_S[40], 2.0)):
        assert buckets[f"{bound_s:g}"] == count
    assert samples["robosc_bridge_latency_seconds_bucket", "exchange", "+Inf"] == 2.0
    assert samples["robosc_bridge_latency_seconds_sum", "exchange"] == pytest.approx(0.012)
    assert samples["robosc_bridge_line_total", "unanswered", "drive"] == 3.0
    assert any(name[0] == "process_cpu_seconds_total" for name in samples)


@pytest.mark.parametrize("address", ["0.0.0.0:9100", "nowhere", "127.0.0.1"])
def test_metrics_are_refused_where_they_may_not_be(address: str) -> None:
    with FakeDaemon() as daemon, pytest.raises(MetricsError, match=r"remote\.metrics_address: "):
        MetricsEndpoint(daemon.feed, address)


def test_an_address_that_is_taken_is_reported() -> None:
    with FakeDaemon() as daemon:
        first = MetricsEndpoint(daemon.feed, "127.0.0.1:0")
        first.start()
        try:
            with pytest.raises(MetricsError, match=rf"{first.address} cannot be used"):
                MetricsEndpoint(daemon.feed, first.address).start()
        finally:
            first.stop()


def test_no_thread_measures_by_another_clock() -> None:
    with VirtualHost(now_s=500.0) as host:
        timing = Timing(host.monotonic)
        timing.reading_taken(499.5)
        host.sleep(1.0)
        (one,) = [item for item in timing.figures().latencies if item.count]
        assert (one.name, one.max_s) == ("queueing", 0.5)
