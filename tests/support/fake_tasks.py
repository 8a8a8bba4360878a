"""Tasks that do what the main file's text says, one thing a line, for tests of everything around the work.

Behaviour (`A` stands for the rest of the line):

    pid             reports its process's number, as stage `pid`
    reports A       reports A times
    long reports A  reports A times, as long as a report may be
    echo A          answers A: in a finding, a reason or a text, wherever the kind of answer has room
    size A          answers with a text of A bytes in all
    sleep A         waits for A seconds
    work A          works for A seconds of a processor's time
    spin            works for ever
    stuck           works for ever in one call in C, which keeps the interpreter to itself
    stop            stops its process, as Ctrl-Z would
    allocate        takes memory without end, in Python
    allocate in C   takes memory without end, and dies as libraries in C do
    die A           ends its process by the signal of number A
    exit A          ends its process with status A
    raise           has a fault
    refuse A        fails with reason MALFORMED_REQUEST and message A
    noise           prints much to standard output and error
    try A           does what a hostile program would (see `hostile_code`), and answers how that went
    flood           reports without end
    claim A         sends the beginning of a message of A bytes, and nothing more
    garbage         sends what is no frame to whoever started it
    modules         answers which of the modules that no worker may hold are loaded
    limits          answers the limits of its process on processor time, files and memory
    environment     answers the names of its environment
"""

import collections
import contextlib
import ctypes
import itertools
import os
import resource
import signal
import stat
import sys
import time
from collections.abc import Callable
from typing import Any

from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.task import Failure, Outcome, Reason, Report, Result, Task, TaskKind, TaskLimits
from robosc_server.workers.frames import HEADER, Tag
from support.hostile_code import tried, warm_up

__all__ = ["TASK_FUNCTION", "fake_task", "run_task", "said", "warm_up"]

TASK_FUNCTION = "support.fake_tasks:run_task"

# A worker may read its programs; all that is in them is for tasks that do something.
PRELOADED, NOT_PRELOADED = ("robosc",), ("robosc.",)

_REQUESTS: dict[TaskKind, Any] = {
    TaskKind.CHECK: pb.CheckRequest,
    TaskKind.SYNTHESIZE: pb.SynthesizeRequest,
    TaskKind.GENERATE: pb.GenerateRequest,
    TaskKind.EXPLORE: pb.ExploreRequest,
    TaskKind.VERIFY: pb.VerifyRequest,
    TaskKind.EXPLAIN: pb.ExplainRequest,
    TaskKind.FORMAT: pb.FormatRequest,
}


def fake_task(text: str, kind: TaskKind = TaskKind.CHECK, key: str = "0" * 64) -> Task:
    """A task that behaves as a text says."""
    file = pb.SourceFile(name="robot.rscd", text=text)
    content: dict[str, Any] = {"file": file} if kind is TaskKind.FORMAT else {"bundle": pb.Bundle(main=file)}
    request = _REQUESTS[kind](**content)
    return Task(kind, request.SerializeToString(), key, file.name)


def said(outcome: Outcome) -> str:
    """Return the message in the answer to a check with `echo` and the like."""
    assert isinstance(outcome, Result), outcome
    (message,) = outcome.messages
    return pb.CheckResponse.FromString(message).diagnostics[0].message


def run_task(kind: TaskKind, request: bytes, limits: TaskLimits, on_report: Callable[[Report], None]) -> Outcome:
    """Behave well or badly."""
    message = _REQUESTS[kind].FromString(request)
    text = message.file.text if kind is TaskKind.FORMAT else message.bundle.main.text
    answer = "done"
    for line in text.splitlines():
        done = _do(line.strip(), on_report)
        if isinstance(done, Failure):
            return done
        answer = done if done is not None else answer
    return Result((_response(kind, answer).SerializeToString(),))


def _do(line: str, on_report: Callable[[Report], None]) -> str | Failure | None:
    command, _, rest = line.partition(" ")
    match command:
        case "pid":
            on_report(Report("pid", str(os.getpid())))
        case "reports":
            for number in range(int(rest)):
                on_report(Report("synthesis", f"step {number}"))
        case "long":
            for number in range(int(rest.removeprefix("reports "))):
                on_report(Report("synthesis", f"step {number} ".ljust(4000, "x")))
        case "echo":
            return rest
        case "size":
            return "x" * int(rest)
        case "sleep":
            time.sleep(float(rest))
        case "modules":
            return " ".join(sorted(sys.modules.keys() & {"grpc", "sqlalchemy", "distributed", "numpy"}))
        case "limits":
            kinds = (resource.RLIMIT_CPU, resource.RLIMIT_CORE, resource.RLIMIT_FSIZE, resource.RLIMIT_AS)
            return " ".join(str(resource.getrlimit(kind)[0]) for kind in kinds)
        case "environment":
            return " ".join(sorted(os.environ))
        case "refuse":
            return Failure(Reason.MALFORMED_REQUEST, rest)
        case "raise":
            raise ValueError("a fault, on purpose")
        case "try":
            return tried(rest)
        case "flood":
            while True:
                on_report(Report("synthesis", "x" * 1000))
        case "noise":
            for stream in (sys.stdout, sys.stderr):
                print("a library that prints\n" * 10_000, file=stream, flush=True)
            os.write(1, b"a library that prints\n")
        case _:
            _misbehave(line)
    return None


def _misbehave(line: str) -> None:
    match line.split():
        case ["work", seconds]:
            end_s = time.process_time() + float(seconds)
            while time.process_time() < end_s:
                pass
        case ["spin"]:
            while True:
                pass
        case ["stuck"]:
            collections.deque(itertools.repeat(0), maxlen=0)
        case ["stop"]:
            os.kill(os.getpid(), signal.SIGSTOP)
        case ["allocate"]:
            kept = []
            while True:
                kept.append(bytearray(2**20))
        case ["allocate", "in", "C"]:
            library = ctypes.CDLL(None)
            library.malloc.restype = ctypes.c_void_p
            while memory := library.malloc(ctypes.c_size_t(2**20)):
                ctypes.memset(memory, 1, 2**20)
            os.abort()
        case ["die", number]:
            os.kill(os.getpid(), int(number))
        case ["exit", status]:
            os._exit(int(status))
        case ["garbage"]:
            _send(b"HTTP/1.1 200 OK\r\n\r\n")
        case ["claim", size]:
            _send(HEADER.pack(Tag.MESSAGE.value, int(size)))


def _send(content: bytes) -> None:
    """Send bytes on every socket that is open, and wait."""
    for descriptor in range(3, 64):
        with contextlib.suppress(OSError):
            if stat.S_ISSOCK(os.fstat(descriptor).st_mode):
                os.write(descriptor, content)
    time.sleep(600)


def _response(kind: TaskKind, text: str) -> Any:
    match kind:
        case TaskKind.CHECK:
            return pb.CheckResponse(diagnostics=[pb.Diagnostic(severity=pb.SEVERITY_NOTE, code="said", message=text)])
        case TaskKind.SYNTHESIZE:
            return pb.SynthesizeResponse(result=pb.SynthesisResult(status=pb.SYNTHESIS_STATUS_EMPTY, reason=text))
        case TaskKind.GENERATE:
            return pb.GenerateResponse(result=pb.GenerationResult(status=pb.SYNTHESIS_STATUS_EMPTY, reason=text))
        case TaskKind.EXPLORE:
            return pb.ExploreResponse(result=pb.ExplorationResult(status=pb.SYNTHESIS_STATUS_EMPTY, reason=text))
        case TaskKind.VERIFY:
            return pb.VerifyResponse(
                result=pb.VerificationResult(status=pb.VERIFICATION_STATUS_NO_SUPERVISOR, reason=text)
            )
        case TaskKind.EXPLAIN:
            return pb.ExplainResponse(
                result=pb.ExplanationResult(status=pb.EXPLANATION_STATUS_MODEL_ERRORS, reason=text)
            )
        case TaskKind.FORMAT:
            return pb.FormatResponse(text=text)
