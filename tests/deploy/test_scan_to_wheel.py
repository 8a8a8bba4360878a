"""The figure of the way of a scan to a wheel is the way that a scan takes."""

import itertools
import pkgutil
import runpy
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest

from robosc.execution.runtime.event_log import NullLog
from robosc_bridge.assembly import EXCHANGE_S, assemble
from robosc_bridge.configuration import map_channels, parse
from robosc_bridge.configuration.structure import Execution
from robosc_bridge.daemon.threads.workers import DriveWorker
from robosc_bridge.daemon.timing import MEANINGS
from robosc_simulated import SimulatedTurtleBot3, VirtualHost
from support.daemons import supervisor_of

TOP = Path(__file__).parents[2]
DRAWING = runpy.run_path(str(TOP / "deploy" / "draw_scan_to_wheel.py"))
HOPS = DRAWING["HOPS"]
MODEL = TOP / "tests" / "benchmarks" / "bridge" / "stop_at_obstacle.rscd"
LIMIT_S = 60.0


def called(function: str) -> Callable[..., Any]:
    found = pkgutil.resolve_name(function)
    assert callable(found)
    made: Callable[..., Any] = found
    return made


@pytest.mark.parametrize("hop", HOPS, ids=lambda hop: hop.function)
def test_there_is_such_a_function(hop: Any) -> None:
    module, _, name = hop.function.partition(":")
    assert called(hop.function).__qualname__ == name
    assert hop.is_safety is module.startswith("robosc_bridge.safety.")


def test_the_picture_is_up_to_date() -> None:
    assert DRAWING["PICTURE"].read_text(encoding="utf-8") == DRAWING["drawn"]()


def test_the_page_shows_it() -> None:
    page = (TOP / "docs" / "bridge-daemon.md").read_text(encoding="utf-8")
    assert "](pictures/scan-to-wheel.svg)" in page


def test_times_are_those_of_the_code() -> None:
    text = " ".join(hop.note + hop.time for hop in HOPS)
    assert f"up to {Execution().period_s * 1000:g} ms" in text
    assert f"each {EXCHANGE_S * 1000:g} ms" in text


def test_it_ends_where_the_measured_time_ends() -> None:
    assert HOPS[-1].function == f"{DriveWorker.__module__}:{DriveWorker.written.__qualname__}"
    assert "`scan_to_wheel`" in HOPS[-1].note
    assert "bytes" in MEANINGS["scan_to_wheel"]
    assert HOPS[-2].function.endswith(":SerialLine.write")


@contextmanager
def watched(functions: list[str], clock: Callable[[], float]) -> Iterator[list[tuple[float, str, str]]]:
    """Note the calls of functions in threads that begin within the block: time, thread, function."""
    codes: dict[CodeType, str] = {called(name).__code__: name for name in functions}
    found: list[tuple[float, str, str]] = []

    def note(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and (name := codes.get(frame.f_code)):
            found.append((clock(), threading.current_thread().name, name))

    threading.setprofile(note)
    try:
        yield found
    finally:
        threading.setprofile(None)


def is_way(hops: list[Any], calls: list[tuple[float, str, str]]) -> bool:
    """Return True if hops are a way to the last command: back from it, each the last call before the next one.

    Nothing else on the way may be called in between in the same thread, but for a hop that waits. What is read in
    pieces is called several times.
    """
    at, times = len(calls), []
    for number in reversed(range(len(hops))):
        between = set()
        while True:
            at -= 1
            if at < 0:
                return False
            if calls[at][1:] == (hops[number].thread, hops[number].function):
                break
            if number + 1 < len(hops) and calls[at][1] == hops[number + 1].thread:
                between.add(calls[at][2])
        if not any(hop.time for hop in hops[number + 1 : number + 2]):
            allowed = {hop.function for hop in hops[number : number + (3 if hops[number].time else 2)]}
            if number + 1 < len(hops) and between - allowed:
                return False
        times.append(calls[at][0])
    # So it is one way, of one scan: from its end in the inbox on, it takes a decision and an exchange at most.
    posted = next(place for place, hop in enumerate(reversed(hops)) if hop.thread == "scanner")
    return times[0] - times[posted] < Execution().period_s + EXCHANGE_S


def test_a_bridge_calls_them_in_this_order_and_in_these_threads() -> None:
    # Ports of a virtual host are others.
    hops = [hop for hop in HOPS if not hop.function.startswith("robosc_bridge.transport.")]
    supervisor = supervisor_of(MODEL.read_text())
    with (
        VirtualHost() as host,
        # The wall is 0.63 m before the laser; the supervisor stops at 0.5 m.
        SimulatedTurtleBot3("burger", "opencr", "lds01", clock=host, pose=(1.4, 0.0, 0.0)) as robot,
    ):
        text = (
            f"robot: burger\ndrive: {{driver: opencr, port: {robot.base_path}, options: {{answer_limit_s: 0.3}}}}\n"
            f"scanner: {{driver: lds01, port: {robot.scanner_path}}}\n"
            "channels:\n  /scan: {channel: scanner}\n  /cmd_vel: {channel: drive}\n"
        )
        configuration = parse(text.encode(), "test.yaml").configuration
        mapping = map_channels(supervisor.model, configuration)
        machine = assemble(configuration, mapping, supervisor, NullLog(), starts_itself=True, host=host)
        with watched([hop.function for hop in hops], host.monotonic) as calls:

            def run() -> None:
                machine.run()

            thread = host.thread(run, "loop")
            thread.start()

            def wait_for(condition: Callable[[], bool]) -> None:
                end_s = time.monotonic() + LIMIT_S
                while not condition():
                    assert time.monotonic() < end_s
                    host.sleep(0.001)

            wait_for(lambda: robot.world.left.goal_rad_s > 0.0)
            wait_for(lambda: robot.world.left.goal_rad_s == 0.0)
            until = len(calls)
        machine.quit()
        thread.join(LIMIT_S)
        assert not thread.is_alive()
    assert sys.getprofile() is None
    assert is_way(hops, calls[:until])
    # It would be seen if the figure had two of them the other way round, or one that is not called there.
    for place, (first, second) in enumerate(itertools.pairwise(hops)):
        if first.thread == second.thread:
            swapped = [*hops[:place], second, first, *hops[place + 2 :]]
            assert not is_way(swapped, calls[:until]), f"{first.function}, {second.function}"
    assert not is_way([replace(hops[0], thread="drive"), *hops[1:]], calls[:until])
