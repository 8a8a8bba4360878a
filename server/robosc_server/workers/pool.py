"""Pool of idle worker processes: a fork server process creates them, and is restarted whenever it exits."""

import asyncio
import contextlib
import json
import logging
import os
import socket
import sys
from collections import deque
from collections.abc import Coroutine
from typing import Any, Self

from robosc_server.clock import monotonic
from robosc_server.tasks.task import Task
from robosc_server.workers import WorkersError
from robosc_server.workers.exit_reasons import ProcessExit
from robosc_server.workers.fork_server import MUST_BE_CONFINED, PACKET_BYTES
from robosc_server.workers.process import WorkerProcess
from robosc_server.workers.shared_memory import ENVIRONMENT

_LOG = logging.getLogger(__name__)

START_S = 60.0
"""Time limit for the first idle worker after the start, in seconds; long enough for an overloaded machine."""

_PAUSES_S = (0.0, 0.0, 0.2, 1.0, 5.0)
_FAILING = 3
_DESCRIPTORS = 3
_REPLACEMENT_PAUSE_S = 0.2
_KEY_DIGITS = 16
_INHERITED = frozenset({"PATH", "HOME", "LANG", "LANGUAGE", "TZ", "TMPDIR", "LD_LIBRARY_PATH"})
_INHERITED_PREFIXES = ("LC_", "PYTHON")
"""Environment variables that workers inherit."""


class WorkerPool:
    """Pool of idle workers; an asynchronous context.

    Attributes:
        restarts: Number of fork servers that ended unexpectedly.
        fault: Reason why no worker process is available, in one sentence; empty if there is one.
        missing: Parts of the workers' confinement that this machine does not have, one sentence for each; None: that
            is not known yet.
    """

    def __init__(self, task_function: str, spare: int, *, must_be_confined: bool) -> None:
        """Prepare a pool of `spare` idle workers that run tasks with a function (`package.module:name`).

        With `must_be_confined`, no worker starts on a machine that lacks a part of the confinement.
        """
        self.missing: tuple[str, ...] | None = None
        self._confinement = MUST_BE_CONFINED if must_be_confined else "best-effort"
        self.restarts = 0
        self._task_function = task_function
        self._spare = spare
        self._ready: deque[WorkerProcess] = deque()
        self._known: dict[int, WorkerProcess] = {}  # by pid, of the fork server that lives
        self._channel: socket.socket | None = None
        self.fault = ""
        self._failures = 0  # Fork servers that ended, one after the other, without a worker.
        self._lost: list[Task] = []  # Tasks that were under way when the last fork server ended.
        self._is_closed = False
        self._changed = asyncio.Event()
        self._restarter: asyncio.Task[None] | None = None
        self._terminations: set[asyncio.Task[None]] = set()

    async def __aenter__(self) -> Self:
        self._restarter = asyncio.create_task(self._keep_fork_server())
        try:
            async with asyncio.timeout(START_S):
                while not self._ready:
                    if self.fault:
                        raise WorkersError(self.fault)
                    await self._state_change()
        except TimeoutError:
            await self._close()
            raise WorkersError(f"no worker process was ready within {START_S:.0f} s") from None
        except BaseException:
            await self._close()
            raise
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._close()

    async def _close(self) -> None:
        self._is_closed = True
        if self._restarter is not None:
            self._restarter.cancel()
            await asyncio.gather(self._restarter, return_exceptions=True)
        self._changed.set()
        while self._terminations:
            # `gather` would return at once if all tasks are done, before their callbacks remove them from the set.
            await asyncio.wait(self._terminations)

    @property
    def is_failing(self) -> bool:
        """True if several fork servers in a row ended without a worker; restarts continue at intervals."""
        return self._failures >= _FAILING

    async def acquire(self) -> WorkerProcess:
        """Return a worker for one task; it must be ended by `terminate` afterwards.

        Raises:
            WorkersError: No process can be started.
        """
        end = monotonic() + START_S
        while (worker := self._next_live_worker()) is None:
            if self._is_closed:
                raise WorkersError("the workers are shut down")
            if self.is_failing:
                raise WorkersError(self.fault)
            try:
                async with asyncio.timeout(end - monotonic()):
                    await self._state_change()
            except TimeoutError:
                raise WorkersError(self.fault or f"no worker process was ready within {START_S:.0f} s") from None
        self._request_forks(1)
        return worker

    def _next_live_worker(self) -> WorkerProcess | None:
        """Return the next idle worker that is alive, if any."""
        while self._ready:
            worker = self._ready.popleft()
            if not worker.has_ended():
                return worker
            self._replace(worker)
        return None

    def _replace(self, worker: WorkerProcess) -> None:
        """Replace an idle worker that has died, at a limited rate."""
        _LOG.warning("an idle worker process ended")
        self.terminate(worker)
        asyncio.get_running_loop().call_later(_REPLACEMENT_PAUSE_S, self._request_forks, 1)

    def terminate(self, worker: WorkerProcess) -> asyncio.Task[None]:
        """Kill a worker; the returned task ends when its process has ended."""
        worker.task = None
        worker.kill()
        return self._begin(self._await_exit(worker))

    @property
    def pids(self) -> frozenset[int]:
        """Process ids of all workers, idle and busy."""
        return frozenset(self._known)

    async def _await_exit(self, worker: WorkerProcess) -> None:
        await worker.wait_for_exit()
        # The fork server reports the exit; after that, the process id may be reused.
        await asyncio.shield(worker.exit)
        worker.close()

    def _begin(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = asyncio.create_task(work)
        self._terminations.add(task)
        task.add_done_callback(self._terminations.discard)
        return task

    async def _state_change(self) -> None:
        self._changed.clear()
        await self._changed.wait()

    def _request_forks(self, count: int) -> None:
        """Request forks from the fork server; a missing one is replaced soon, and gets a new request."""
        if self._channel is not None:
            with contextlib.suppress(OSError):
                self._channel.send(str(count).encode())

    async def _keep_fork_server(self) -> None:
        """Keep a fork server running."""
        while True:
            status = await self._run_fork_server()
            self.restarts += 1
            self._failures += 1
            self.fault = self.fault or f"the fork server of the workers ended with status {status}"
            _LOG.error("%s; restarting it%s", self.fault, _tasks_under_way(self._lost))
            self._changed.set()
            await asyncio.sleep(_PAUSES_S[min(self._failures, len(_PAUSES_S) - 1)])

    async def _run_fork_server(self) -> int | None:
        """Run a fork server until it ends, and return its exit status."""
        loop = asyncio.get_running_loop()
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        ours.setblocking(False)
        process: asyncio.subprocess.Process | None = None
        try:
            with theirs:
                process = await asyncio.create_subprocess_exec(
                    *(sys.executable, "-P", "-m", "robosc_server.workers.fork_server"),
                    *(str(theirs.fileno()), self._task_function, str(os.getpid()), self._confinement),
                    stdin=asyncio.subprocess.DEVNULL,
                    stdout=asyncio.subprocess.DEVNULL,
                    pass_fds=[theirs.fileno()],
                    env=_environment(),
                    # Signals of a terminal must reach only the server.
                    start_new_session=True,
                )
            self._channel = ours
            loop.add_reader(ours, self._receive, ours)
            self._request_forks(self._spare)
            return await process.wait()
        except OSError as error:
            self.fault = f"cannot start the fork server of the workers: {error.strerror}"
            return None
        finally:
            if process is not None and process.returncode is None:
                process.kill()
            self._channel = None
            self._receive_all(ours)
            loop.remove_reader(ours)
            ours.close()
            # The kernel ends workers with their fork server; wait for their ends.
            for worker in self._ready:
                self.terminate(worker)
            self._ready.clear()
            self._lost = [worker.task for worker in self._known.values() if worker.task is not None]
            for worker in self._known.values():
                worker.kill()
                worker.exit.set_result(None)
            self._known.clear()
            if process is not None:
                await process.wait()

    def _receive_all(self, channel: socket.socket) -> None:
        """Process all packets that a fork server sent before it ended."""
        with contextlib.suppress(OSError):
            while self._receive(channel):
                pass

    def _receive(self, channel: socket.socket) -> bool:
        """Process one packet of the fork server; return False if there was none."""
        try:
            packet, descriptors, _, _ = socket.recv_fds(channel, PACKET_BYTES, _DESCRIPTORS, socket.MSG_CMSG_CLOEXEC)
        except BlockingIOError:
            return False
        except OSError:
            packet, descriptors = b"", []
        if not packet:
            asyncio.get_running_loop().remove_reader(
                channel
            )  # The fork server ends; its exit status is awaited elsewhere.
            return False
        packet_values = json.loads(packet)
        match packet_values["is"]:
            case "worker" if len(descriptors) < _DESCRIPTORS:
                # Descriptors were missing. A worker without its connection exits by itself, and another one is
                # requested later.
                for number in descriptors:
                    os.close(number)
                self.fault = "this process has reached its limit of open files"
                _LOG.error("%s: no worker can be started", self.fault)
                asyncio.get_running_loop().call_later(_REPLACEMENT_PAUSE_S, self._request_forks, 1)
            case "worker":
                connection, descriptor, crash_output = descriptors
                worker = WorkerProcess(packet_values["pid"], socket.socket(fileno=connection), descriptor, crash_output)
                self._known[worker.pid] = worker
                self._ready.append(worker)
                self.fault, self._failures = "", 0
            case "confined":
                self._note_confinement(tuple(packet_values["missing"]))
            case "ended":
                self._note_exit(
                    packet_values["pid"],
                    ProcessExit(packet_values["exit_code"], packet_values["cpu_s"], packet_values["peak_bytes"]),
                )
            case "fault":
                if packet_values["message"] != self.fault:
                    self.fault = packet_values["message"]
                    _LOG.error("%s", self.fault)
        self._changed.set()
        return True

    def _note_confinement(self, missing: tuple[str, ...]) -> None:
        if missing == self.missing:
            return
        self.missing = missing
        for part in missing:
            _LOG.warning("workers are not fully confined: %s", part)
        if not missing:
            _LOG.info("workers are confined")

    def _note_exit(self, pid: int, end: ProcessExit) -> None:
        worker = self._known.pop(pid, None)
        if worker is None:  # Its descriptors were lost: see `_receive`.
            return
        worker.exit.set_result(end)
        if worker in self._ready:
            self._ready.remove(worker)
            self._replace(worker)


def _tasks_under_way(tasks: list[Task]) -> str:
    """Describe the tasks that may have ended a fork server, by their keys, since names are parts of models."""
    if not tasks:
        return ""
    return "; tasks under way: " + ", ".join(f"{task.kind} {task.key[:_KEY_DIGITS]}" for task in tasks)


def _environment() -> dict[str, str]:
    """Return the environment of workers: variables that Python programs need, and the same module search path.

    Others say how the C library places memory. Workers get nothing else, such as database passwords, cloud keys or
    settings of the server.
    """
    # A copy, since another thread may change the environment.
    environment = {
        name: value
        for name, value in os.environ.copy().items()
        if name in _INHERITED or name.startswith(_INHERITED_PREFIXES)
    }
    environment |= ENVIRONMENT
    environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    return environment
