"""Worker processes that are killed, not asked, when nobody waits for their result any more."""

import asyncio
import contextlib
import logging
import os
import sys
from collections.abc import Awaitable, Callable, Sequence
from types import TracebackType
from typing import Self

from robosc_server.work import Failed, Job, Outcome, Report
from robosc_server.worker import LENGTH, pack, unpack

_LOG = logging.getLogger(__name__)

WORKER_COMMAND = (sys.executable, "-P", "-m", "robosc_server.worker")
"""Starts a worker; `-P` keeps the folder that the server was started in out of its imports."""

WAITING_LIMIT = 64
"""Requests that may wait for a worker; more are refused at once."""

_RESTART_PAUSE_S = 1.0


class StartError(Exception):
    """No worker can be started; one sentence for the operator."""


class PoolBusyError(Exception):
    """Too many requests wait already."""


class _Worker:
    """One worker process."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        assert process.stdin is not None and process.stdout is not None  # noqa: S101  # both are pipes
        self._process, self._stdin, self._stdout = process, process.stdin, process.stdout

    @classmethod
    async def start(cls, command: Sequence[str]) -> Self:
        """Start a process in its own session, so that a terminal's signals reach the server alone."""
        pipe = asyncio.subprocess.PIPE
        # A copy: the environment itself may be changed by another thread in the middle of the start.
        environment = dict(os.environ)
        return cls(
            await asyncio.create_subprocess_exec(
                *command, stdin=pipe, stdout=pipe, start_new_session=True, env=environment
            )
        )

    @property
    def pid(self) -> int:
        """The process's number."""
        return self._process.pid

    async def run(self, job: Job, on_report: Callable[[Report], Awaitable[None]]) -> Outcome:
        """Send a job and pass on what comes back; a process that dies on it has failed."""
        try:
            self._stdin.write(pack(job))
            await self._stdin.drain()
            while True:
                (size,) = LENGTH.unpack(await self._stdout.readexactly(LENGTH.size))
                message = unpack(await self._stdout.readexactly(size))
                if not isinstance(message, Report):
                    return message  # type: ignore[return-value]  # a worker sends reports and one outcome
                await on_report(message)
        except (asyncio.IncompleteReadError, ConnectionError):
            return Failed(f"the worker process {self.pid} ended with status {await self._process.wait()}")

    @property
    def is_alive(self) -> bool:
        """Whether the process has not been seen to end."""
        return self._process.returncode is None

    async def kill(self) -> None:
        """End the process at once and wait until it is gone."""
        with contextlib.suppress(ProcessLookupError):
            self._process.kill()
        self._stdin.close()
        await self._process.wait()


class WorkerPool:
    """A fixed number of workers; use it with `async with`."""

    def __init__(self, size: int, command: Sequence[str] = WORKER_COMMAND) -> None:
        """Plan `size` workers, each started with `command`."""
        self._size = size
        self._command = command
        self._idle: asyncio.Queue[_Worker] = asyncio.Queue()
        self._workers: set[_Worker] = set()
        self._replacements: set[asyncio.Task[None]] = set()
        self._waiting = 0
        self._is_closing = False

    async def __aenter__(self) -> Self:
        try:
            for _ in range(self._size):
                await self._add()
        except OSError as error:
            await self._close()
            raise StartError(f"cannot start a worker process: {error}") from error
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self._close()

    async def _close(self) -> None:
        """End every process."""
        self._is_closing = True
        tasks = list(self._replacements)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await asyncio.gather(*(worker.kill() for worker in self._workers))

    @property
    def pids(self) -> frozenset[int]:
        """Numbers of the worker processes."""
        return frozenset(worker.pid for worker in self._workers)

    async def run(self, job: Job, on_report: Callable[[Report], Awaitable[None]]) -> Outcome:
        """The outcome of a job, as soon as a worker is free for it.

        Cancelling this ends the work: its worker is killed and another one started in its place.

        Raises:
            PoolBusyError: Too many jobs wait already.
        """
        worker = await self._take()
        finished = False
        try:
            outcome = await worker.run(job, on_report)
            finished = worker.is_alive
            return outcome
        finally:
            if finished:
                self._idle.put_nowait(worker)
            elif not self._is_closing:
                task = asyncio.create_task(self._replace(worker))
                self._replacements.add(task)
                task.add_done_callback(self._replacements.discard)

    async def _take(self) -> _Worker:
        """A free worker."""
        if self._idle.empty() and self._waiting >= WAITING_LIMIT:
            raise PoolBusyError
        self._waiting += 1
        try:
            return await self._idle.get()
        finally:
            self._waiting -= 1

    async def _add(self) -> None:
        worker = await _Worker.start(self._command)
        self._workers.add(worker)
        self._idle.put_nowait(worker)

    async def _replace(self, worker: _Worker) -> None:
        """Kill a worker and start another, as often as it takes."""
        await worker.kill()
        self._workers.discard(worker)
        while True:
            try:
                await self._add()
                return
            except OSError as error:
                _LOG.error("cannot start a worker: %s", error)
                await asyncio.sleep(_RESTART_PAUSE_S)
