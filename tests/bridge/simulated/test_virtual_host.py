"""Virtual time: threads that take turns, waits that are exact, and serial ports of memory."""

import math
import queue
import time
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc_bridge.errors import LineBusyError, LineLostError, LineMissingError
from robosc_simulated import VirtualHost, VirtualTimeError
from support.effort import examples


@settings(max_examples=examples(40))
@given(st.lists(st.lists(st.integers(0, 5), min_size=1, max_size=6), min_size=1, max_size=5))
def test_whoever_sleeps_wakes_in_the_order_of_time(naps: list[list[int]]) -> None:
    """Compare with a twin that sorts: each thread's wake-ups, and of equal ones, the first to begin to sleep."""
    woken: list[tuple[float, int]] = []
    with VirtualHost(0.0) as host:

        def sleeper(number: int) -> None:
            for nap in naps[number]:
                host.sleep(nap)
                woken.append((host.monotonic(), number))

        threads = [host.thread(partial(sleeper, number), f"{number}") for number in range(len(naps))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert [time_s for time_s, _ in woken] == sorted(time_s for time_s, _ in woken)
    for number, own in enumerate(naps):
        assert [time_s for time_s, other in woken if other == number] == [sum(own[: n + 1]) for n in range(len(own))]


def test_a_day_passes_at_once_and_exactly() -> None:
    begin_s = time.monotonic()
    with VirtualHost(5.0, epoch_s=100.0) as host:
        host.sleep(86_400.0)
        assert (host.monotonic(), host.wall()) == (86_405.0, 86_505.0)
    assert time.monotonic() - begin_s < 3600.0


def test_a_condition_wakes_whoever_waits_or_lets_the_time_pass() -> None:
    with VirtualHost(0.0) as host:
        condition = host.condition()
        found: list[tuple[bool, float]] = []

        def wait(limit_s: float | None) -> None:
            with condition:
                found.append((condition.wait(limit_s), host.monotonic()))

        threads = [host.thread(partial(wait, limit_s), "waits") for limit_s in (1.0, None, None)]
        for thread in threads:
            thread.start()
        host.sleep(2.0)
        with condition:
            condition.notify()
        host.sleep(1.0)
        assert found == [(False, 1.0), (True, 2.0)]
        with condition:
            condition.notify_all()
            assert not condition.wait_for(lambda: False, 0.5)
        assert found[2] == (True, 3.0)
        assert not any(thread.is_alive() for thread in threads)


def test_a_queue_is_waited_at() -> None:
    with VirtualHost(0.0) as host:
        items = host.queue()

        def put() -> None:
            host.sleep(0.5)
            items.put("late")

        host.thread(put, "puts").start()
        assert items.get(timeout=2.0) == "late"
        assert host.monotonic() == 0.5
        with pytest.raises(queue.Empty):
            items.get(timeout=2.0)
        assert host.monotonic() == 2.5


def test_what_will_never_happen_is_reported() -> None:
    with VirtualHost() as host, pytest.raises(VirtualTimeError, match="everybody waits for ever"):
        host.wait(lambda: False, math.inf)


@pytest.mark.parametrize("rest_s", [math.inf, 1.0], ids=["waits", "ends"])
def test_it_is_reported_to_whoever_made_the_host_though_another_thread_comes_to_it(rest_s: float) -> None:
    with VirtualHost() as host:
        host.thread(partial(host.sleep, rest_s), "other").start()
        with pytest.raises(VirtualTimeError, match="everybody waits for ever"):
            host.wait(lambda: False, math.inf)
        # And again, if it goes on to wait.
        with pytest.raises(VirtualTimeError):
            host.condition().wait()
        host.sleep(1.0)


def test_waiting_in_vain_while_others_live_on_is_reported() -> None:
    with VirtualHost(0.0) as host:

        def live() -> None:
            while True:
                host.sleep(60.0)

        host.thread(live, "lives").start()
        host.sleep(86_400.0)
        with pytest.raises(VirtualTimeError, match="in vain"):
            host.wait(lambda: False, math.inf)
        assert host.monotonic() == pytest.approx(86_400.0 + 3600.0, abs=60.0)


def test_it_is_reported_to_whoever_made_the_host_whoever_was_the_last_to_wait() -> None:
    with VirtualHost(0.0) as host:

        def wait() -> None:
            host.sleep(1.0)
            host.sleep(math.inf)

        host.thread(wait, "waits").start()
        with pytest.raises(VirtualTimeError, match="everybody waits for ever"):
            host.sleep(math.inf)
        # The host lives on.
        host.sleep(1.0)
        assert host.monotonic() == 2.0


def test_whoever_has_waited_its_time_goes_before_those_who_wait_anew() -> None:
    turns: list[tuple[str, int]] = []
    with VirtualHost(0.0) as host:

        def impatient(name: str) -> None:
            for number in range(3):
                host.sleep(0.0)
                turns.append((name, number))

        for name in ("one", "other"):
            host.thread(partial(impatient, name), name).start()
        host.sleep(0.0)
        turns.append(("maker", 0))
        host.sleep(1.0)
    assert turns[:3] == [("maker", 0), ("one", 0), ("other", 0)]
    assert turns[3:] == [("one", 1), ("other", 1), ("one", 2), ("other", 2)]


def test_threads_that_are_suspended_stand_still_and_go_on_late() -> None:
    with VirtualHost(0.0) as host:
        woken: list[tuple[str, float]] = []

        def works(name: str) -> None:
            for _ in range(4):
                host.sleep(1.0)
                woken.append((name, host.monotonic()))

        for name in ("first", "second", "other"):
            host.thread(partial(works, name), name).start()
        host.sleep(1.5)
        host.suspend(2.0, "first", "second")
        host.sleep(1.25)
        assert woken[3:] == [
            ("other", 2.0), ("other", 3.0), ("first", 3.5), ("second", 3.5), ("other", 4.0), ("first", 4.5),
            ("second", 4.5),
        ]  # fmt: skip


def test_threads_that_still_wait_end_with_the_host() -> None:
    ended: list[str] = []
    with VirtualHost() as host:

        def wait() -> None:
            try:
                host.sleep(math.inf)
            finally:
                ended.append("waited")

        thread = host.thread(wait, "waits")
        thread.start()
        host.thread(wait, "never began")
        host.sleep(1.0)
        assert thread.is_alive()
    assert ended == ["waited"]


def test_bytes_go_both_ways_and_wait_for_their_reader() -> None:
    with VirtualHost(0.0) as host:
        end = host.new_end(None)
        with pytest.raises(FileExistsError):
            host.new_end(Path(end.path))
        port = host.open_port(end.path, 9600)
        with pytest.raises(LineBusyError):
            host.open_port(end.path, 9600)
        port.write(b"ask")
        assert (end.wait(1.0), end.read(), end.host_baud()) == (True, b"ask", 9600)
        assert port.read(0.2) == b"" and host.monotonic() == 0.2

        def answer() -> None:
            host.sleep(0.1)
            end.write(b"answer")

        host.thread(answer, "device").start()
        assert (port.read(1.0), round(host.monotonic(), 6)) == (b"answer", 0.3)
        end.write(b"more")
        assert end.unread() == 4
        port.discard_input()
        assert end.unread() == 0
        port.wake()
        assert port.read(math.inf) == b""
        assert host.monotonic() == pytest.approx(0.3)
        port.close()
        assert host.open_port(end.path, 1).baud == 1


def test_a_port_that_is_pulled_is_reported_to_whoever_reads() -> None:
    with VirtualHost(0.0) as host:
        end = host.new_end(None)
        port = host.open_port(end.path, 9600)

        def pull() -> None:
            host.sleep(0.1)
            end.disconnect()

        host.thread(pull, "hand").start()
        with pytest.raises(LineLostError):
            port.read(1.0)
        assert host.monotonic() == 0.1
        with pytest.raises(LineLostError):
            port.write(b"x")
        with pytest.raises(LineMissingError):
            host.open_port(end.path, 9600)
        end.connect()
        host.open_port(end.path, 9600)
