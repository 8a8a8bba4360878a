"""A worker's thread: steps when they are due, at once when it is hurried, and ends with the worker closed."""

import threading

from robosc_bridge.daemon.threads.device_thread import DeviceThread
from robosc_bridge.transport.system_host import SYSTEM_HOST

LIMIT_S = 10.0
LATER_S = 3600.0


class Worker:
    """Steps once an hour, and remembers."""

    name = "hourly"

    def __init__(self) -> None:
        self.stepped = threading.Semaphore(0)
        self.is_closed = threading.Event()
        self.blocks: threading.Event | None = None
        self.is_woken = False

    def step(self, now_s: float) -> float:
        self.stepped.release()
        if self.blocks:
            self.blocks.wait()
        return now_s + LATER_S

    def wake(self) -> None:
        self.is_woken = True
        if self.blocks:
            self.blocks.set()

    def close(self) -> None:
        self.is_closed.set()


def test_it_steps_at_the_start_and_whenever_it_is_hurried() -> None:
    worker = Worker()
    thread = DeviceThread(worker, SYSTEM_HOST)
    thread.start()
    assert worker.stepped.acquire(timeout=LIMIT_S)
    assert not worker.stepped.acquire(blocking=False)
    assert not worker.is_woken
    for _ in range(3):
        thread.hurry()
        assert worker.stepped.acquire(timeout=LIMIT_S)
    # A step under way may have something to do with it.
    assert worker.is_woken
    assert thread.stop(LIMIT_S)
    assert worker.is_closed.is_set()
    assert not thread.is_alive


def test_stopping_wakes_a_step_that_waits() -> None:
    worker = Worker()
    worker.blocks = threading.Event()
    thread = DeviceThread(worker, SYSTEM_HOST)
    thread.start()
    assert worker.stepped.acquire(timeout=LIMIT_S)
    assert thread.stop(LIMIT_S)
    assert worker.is_woken
    assert worker.is_closed.is_set()


def test_a_thread_that_never_began_is_stopped_at_once() -> None:
    worker = Worker()
    assert DeviceThread(worker, SYSTEM_HOST).stop(LIMIT_S)


def test_a_step_that_hangs_is_reported() -> None:
    worker = Worker()
    worker.blocks = threading.Event()
    worker.wake = lambda: None  # type: ignore[method-assign]
    thread = DeviceThread(worker, SYSTEM_HOST)
    thread.start()
    assert worker.stepped.acquire(timeout=LIMIT_S)
    assert not thread.stop(0.01)
    assert not worker.is_closed.is_set()
    worker.blocks.set()
    assert worker.is_closed.wait(LIMIT_S)
