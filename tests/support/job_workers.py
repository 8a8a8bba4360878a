"""Workers that do what the text of a task's main file says, in this process: one command a line.

`log FILE` writes a line into a file; `until FILE` waits until there is one; `report N` reports N things; `fail REASON`;
`big N` has a result of N bytes; `fault` raises; `spend S` takes S
seconds of a processor's time; `lose` takes what starts workers with it. Without any of it, the result holds the text.
"""

import asyncio
import hashlib
from pathlib import Path
from types import TracebackType
from typing import Self

from robosc_api.v1 import jobs_pb2 as jobs
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.task import Failure, Outcome, Reason, Report, Result, Task, TaskKind, TaskLimits
from robosc_server.workers import OnCpuTime, OnReport, WorkerLostError, WorkersError, ignore_cpu_time

_LOOK_S = 0.005


class ScriptedWorkers:
    """Workers that do what the text of a task's main file says.

    Args:
        capacity: Number of workers; may be changed.
    """

    def __init__(self, capacity: int = 2) -> None:
        self.capacity = capacity
        self.is_away = False
        self.begun: list[str] = []
        self.running = 0
        self.most_running = 0
        self.killed = 0

    async def run(
        self, task: Task, limits: TaskLimits, on_report: OnReport, on_cpu_time: OnCpuTime = ignore_cpu_time
    ) -> Outcome:
        if self.is_away:
            raise WorkersError("the workers are away")
        assert self.running < self.capacity
        text = main_text(task.request)
        self.begun.append(text)
        self.running += 1
        self.most_running = max(self.running, self.most_running)
        try:
            return await self._do(text, task.kind, on_report)
        except asyncio.CancelledError:
            self.killed += 1
            raise
        finally:
            self.running -= 1
            on_cpu_time(sum(float(line.split()[1]) for line in text.splitlines() if line.startswith("spend ")))

    async def _do(self, text: str, kind: TaskKind, on_report: OnReport) -> Outcome:
        size = 0
        for line in text.splitlines():
            match line.split(maxsplit=1):
                case ["log", name]:
                    with Path(name).open("a", encoding="utf-8") as log:
                        log.write(hashlib.sha256(text.encode()).hexdigest() + "\n")
                case ["until", name]:
                    while not Path(name).exists():
                        if self.is_away:
                            raise WorkersError("the workers are away")
                        await asyncio.sleep(_LOOK_S)
                case ["report", number]:
                    for place in range(int(number)):
                        await on_report(Report("synthesis", f"round {place}"))
                case ["fail", reason]:
                    return Failure(Reason(reason), "it failed")
                case ["big", number]:
                    size = int(number)
                case ["lose"]:
                    raise WorkerLostError("the worker was lost")
                case ["fault"]:
                    raise ZeroDivisionError
        return Result(messages_for(kind, text, size))


class StartedWorkers(ScriptedWorkers):
    """Scripted workers that a server starts."""

    restarts = 0

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        pass


def main_text(request: bytes) -> str:
    """The text of the main file of any request: its bundle is the first field of each."""
    return pb.CheckRequest.FromString(request).bundle.main.text


def messages_for(kind: TaskKind, text: str, size: int) -> tuple[bytes, ...]:
    """Return the messages that the workers make of a text."""
    if kind is TaskKind.CHECK:
        return (pb.CheckResponse(diagnostics=[pb.Diagnostic(message=text)]).SerializeToString(),)
    if kind is TaskKind.SYNTHESIZE:
        result = pb.SynthesisResult(reason=text, supervisor=b"x" * size)
        return (pb.SynthesizeResponse(result=result).SerializeToString(),)
    chunks = [b"x" * min(65536, size - place) for place in range(0, size, 65536)]
    return (
        pb.GenerateResponse(result=pb.GenerationResult(reason=text)).SerializeToString(),
        *(pb.GenerateResponse(chunk=pb.FileChunk(data=chunk)).SerializeToString() for chunk in chunks),
    )


def request_of(text: str) -> bytes:
    """A request with a main file; the same bytes for each kind."""
    return pb.CheckRequest(bundle=pb.Bundle(main=pb.SourceFile(name="robot.rscd", text=text))).SerializeToString()


def task_of(text: str, kind: TaskKind = TaskKind.CHECK) -> Task:
    """A task with a main file."""
    return accepted(kind, request_of(text))


def accepted(kind: TaskKind, request: bytes) -> Task:
    """Any request as a task."""
    return Task(kind, request, hashlib.sha256(kind.encode() + request).hexdigest(), "robot.rscd")


def task_message(text: str, kind: TaskKind = TaskKind.CHECK) -> jobs.Task:
    """A task as a message."""
    message = jobs.Task()
    getattr(message, kind.value).ParseFromString(request_of(text))
    getattr(message, kind.value).SetInParent()
    return message
