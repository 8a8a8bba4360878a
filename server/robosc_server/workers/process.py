"""Handle of one worker process in the server: its connection, its process descriptor and its exit."""

import asyncio
import contextlib
import os
import select
import signal
import socket

from robosc_server.tasks.task import Failure, Outcome, Reason, Report, Task, TaskLimits
from robosc_server.workers import OnReport
from robosc_server.workers.exit_reasons import ProcessExit, RecentOomKills, failure_of, oom_kills
from robosc_server.workers.frames import HEADER, AnswerReader, FrameError, task_frames

_BUFFER_BYTES = 2**16
_EXIT_S = 5.0
_CRASH_OUTPUT_BYTES = 2**14

_kills_before = RecentOomKills()


class ForkServerLostError(Exception):
    """The fork server of a worker has ended, and the worker with it."""


class WorkerProcess:
    """A worker process for one task.

    Attributes:
        pid: Process id.
        task: Task that it runs; None before the task, and once its outcome is known.
        exit: Exit of the process, as soon as that is known; None: the fork server that would report it is gone.
    """

    def __init__(self, pid: int, connection: socket.socket, descriptor: int, crash_output: int) -> None:
        self.pid = pid
        self.task: Task | None = None
        self.exit: asyncio.Future[ProcessExit | None] = asyncio.get_running_loop().create_future()
        self._connection = connection
        self._descriptor = descriptor
        self._crash_output = crash_output
        self._is_gone = asyncio.get_running_loop().create_future()
        self._writer: asyncio.StreamWriter | None = None
        asyncio.get_running_loop().add_reader(descriptor, self._note_exit)

    def _note_exit(self) -> None:
        asyncio.get_running_loop().remove_reader(self._descriptor)
        self._is_gone.set_result(None)

    def kill(self) -> None:
        """Kill the process, even if it is stopped or busy in a C library."""
        with contextlib.suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._descriptor, signal.SIGKILL)

    def has_ended(self) -> bool:
        """Return True if the process has ended."""
        poll = select.poll()
        poll.register(self._descriptor, select.POLLIN)
        return bool(poll.poll(0))

    async def wait_for_exit(self) -> None:
        """Wait until the process has ended."""
        await asyncio.shield(self._is_gone)

    def close(self) -> None:
        """Close the descriptors of an ended process."""
        if not self._is_gone.done():
            asyncio.get_running_loop().remove_reader(self._descriptor)
        if self._writer is not None:
            self._writer.transport.abort()
        self._connection.close()
        os.close(self._descriptor)
        os.close(self._crash_output)

    async def run(self, task: Task, limits: TaskLimits, on_report: OnReport) -> Outcome:
        """Run a task and return its outcome; the process cannot be used afterwards.

        Raises:
            ForkServerLostError: The process ended together with its fork server, which the task has not caused.
        """
        kills = _kills_before()
        self.task = task
        try:
            self._connection.setblocking(False)
            reader, self._writer = await asyncio.open_connection(sock=self._connection, limit=_BUFFER_BYTES)
            self._writer.write(task_frames(task, limits))
            return await self._answer(reader, limits, on_report)
        except (asyncio.IncompleteReadError, ConnectionError):
            return await self._failure(limits, kills)
        except FrameError as error:
            return Failure(Reason.WORKER_DIED, "the worker process sent an invalid answer", str(error))

    async def _answer(self, reader: asyncio.StreamReader, limits: TaskLimits, on_report: OnReport) -> Outcome:
        answer = AnswerReader(limits)
        while True:
            announced = answer.read_header(await reader.readexactly(HEADER.size))
            if isinstance(announced, Failure):
                return announced
            tag, length = announced
            message = answer.read(tag, await reader.readexactly(length))
            if isinstance(message, Report):
                # Reading pauses meanwhile, so that a worker with too many reports has to wait.
                await on_report(message)
            elif message is not None:
                return message

    async def _failure(self, limits: TaskLimits, kills: int) -> Failure:
        """Return the reason why the connection ended before an answer was whole."""
        self.kill()  # The process has closed the connection, but may still be running.
        try:
            async with asyncio.timeout(_EXIT_S):
                end = await asyncio.shield(self.exit)
        except TimeoutError:
            return Failure(Reason.WORKER_DIED, "the worker process ended for an unknown reason")
        if end is None:
            raise ForkServerLostError
        return failure_of(end, limits, self._read_crash_output(), oom_kills() > kills)

    def _read_crash_output(self) -> str:
        try:
            return os.read(self._crash_output, _CRASH_OUTPUT_BYTES).decode("utf-8", "replace")
        except OSError:  # None were written.
            return ""
