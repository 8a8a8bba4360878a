"""One worker's process, as the server sees it: a connection, a descriptor to kill it by, and how it ended."""

import asyncio
import contextlib
import os
import select
import signal
import socket

from robosc_server.tasks.task import Failure, Outcome, Reason, Report, Task, TaskLimits
from robosc_server.workers import OnReport
from robosc_server.workers.endings import Ending, KillsBefore, failure_of, kills_for_memory
from robosc_server.workers.frames import HEADER, AnswerReader, FrameError, task_frames

_BUFFER_BYTES = 2**16
_ENDING_S = 5.0
_LAST_WORDS_BYTES = 2**14

_kills_before = KillsBefore()


class TemplateLostError(Exception):
    """The process that a worker was forked from has ended, and the worker with it."""


class WorkerProcess:
    """A worker that stands ready for one task.

    Attributes:
        pid: Its number.
        task: Task that it is busy with, or was.
        ending: End of the process, as soon as that is known; None: the template that could have reported it is gone.
    """

    def __init__(self, pid: int, connection: socket.socket, descriptor: int, last_words: int) -> None:
        self.pid = pid
        self.task: Task | None = None
        self.ending: asyncio.Future[Ending | None] = asyncio.get_running_loop().create_future()
        self._connection = connection
        self._descriptor = descriptor
        self._last_words = last_words
        self._is_gone = asyncio.get_running_loop().create_future()
        self._writer: asyncio.StreamWriter | None = None
        asyncio.get_running_loop().add_reader(descriptor, self._note_gone)

    def _note_gone(self) -> None:
        asyncio.get_running_loop().remove_reader(self._descriptor)
        self._is_gone.set_result(None)

    def kill(self) -> None:
        """Have the kernel end it, stopped or deep in a library as it may be."""
        with contextlib.suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._descriptor, signal.SIGKILL)

    def has_ended(self) -> bool:
        """Return True if the process is no more, asked of the kernel."""
        poll = select.poll()
        poll.register(self._descriptor, select.POLLIN)
        return bool(poll.poll(0))

    async def gone(self) -> None:
        """Return when the process is no more."""
        await asyncio.shield(self._is_gone)

    def close(self) -> None:
        """Let go of a process that is gone."""
        if not self._is_gone.done():
            asyncio.get_running_loop().remove_reader(self._descriptor)
        if self._writer is not None:
            self._writer.transport.abort()
        self._connection.close()
        os.close(self._descriptor)
        os.close(self._last_words)

    async def run(self, task: Task, limits: TaskLimits, on_report: OnReport) -> Outcome:
        """The outcome of a task; the process is of no use afterwards.

        Raises:
            TemplateLostError: It ended with its template, which is not the task's fault.
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
            return Failure(Reason.WORKER_DIED, "the worker process sent what is no answer", str(error))

    async def _answer(self, reader: asyncio.StreamReader, limits: TaskLimits, on_report: OnReport) -> Outcome:
        answer = AnswerReader(limits)
        while True:
            announced = answer.announced(await reader.readexactly(HEADER.size))
            if isinstance(announced, Failure):
                return announced
            tag, length = announced
            told = answer.read(tag, await reader.readexactly(length))
            if isinstance(told, Report):
                # Nothing more is read meanwhile, so that a worker that reports too much has to wait.
                await on_report(told)
            elif told is not None:
                return told

    async def _failure(self, limits: TaskLimits, kills: int) -> Failure:
        """Return the reason why the connection ended before an answer was whole."""
        self.kill()  # It closed its end, but may live: then it was told nothing of a limit by the kernel.
        try:
            async with asyncio.timeout(_ENDING_S):
                ending = await asyncio.shield(self.ending)
        except TimeoutError:
            return Failure(Reason.WORKER_DIED, "the worker process ended, and nothing is known of how")
        if ending is None:
            raise TemplateLostError
        return failure_of(ending, limits, self._read_last_words(), kills_for_memory() > kills)

    def _read_last_words(self) -> str:
        try:
            return os.read(self._last_words, _LAST_WORDS_BYTES).decode("utf-8", "replace")
        except OSError:  # None were written.
            return ""
