"""The thread in which a worker takes its steps."""

from robosc_bridge.daemon.threads.workers import Worker
from robosc_bridge.host import Host


class DeviceThread:
    """Thread that takes a worker's steps when they are due, or at once after `hurry`.

    Args:
        worker: Worker whose steps are taken.
        host: Host that the thread belongs to.
    """

    def __init__(self, worker: Worker, host: Host) -> None:
        self._worker = worker
        self._clock = host.monotonic
        self._condition = host.condition()
        self._is_hurried = False
        self._is_over = False
        # A daemon thread: a driver that hangs for ever must not keep the process from ending.
        self._thread = host.thread(self._run, worker.name)

    @property
    def is_alive(self) -> bool:
        """True if the thread still takes steps."""
        return self._thread.is_alive()

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def hurry(self) -> None:
        """Take the next step now, and wake the step under way, after a change that must not wait."""
        with self._condition:
            self._is_hurried = True
            self._condition.notify()
        self._worker.wake()

    def stop(self, limit_s: float) -> bool:
        """End the thread after the step under way, and close the worker; return True if that was done in time."""
        with self._condition:
            self._is_over = True
            self._condition.notify()
        self._worker.wake()
        if self._thread.ident is not None:
            self._thread.join(limit_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            due_s = self._clock()
            while self._waited(due_s):
                due_s = self._worker.step(self._clock())
        finally:
            self._worker.close()

    def _waited(self, due_s: float) -> bool:
        """Wait for the next step; False: there is none."""
        with self._condition:
            while not self._is_over and not self._is_hurried and (left_s := due_s - self._clock()) > 0.0:
                self._condition.wait(left_s)
            self._is_hurried = False
            return not self._is_over
