"""Real servers for tests: one in this process on a port of its own choice, one as a program."""

import asyncio
import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import grpc

from robosc.source import Bundle, SourceFile
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_api.v1 import synthesis_pb2_grpc
from robosc_server.main import running_server
from robosc_server.pool import WORKER_COMMAND
from robosc_server.settings import Settings

FAKE_WORKER = (sys.executable, str(Path(__file__).with_name("fake_worker.py")))
"""A worker that does what a model's text says: `stuck`, `die`, `refuse`, ..."""

PATIENCE_S = 60.0
"""How long a test waits for what must happen; only a failing test waits so long."""


@contextmanager
def served(settings: Settings | None = None, worker_command: Sequence[str] = WORKER_COMMAND) -> Iterator[str]:
    """A server in a thread of this process; yields its address."""
    chosen = settings or Settings(port=0, workers=1)
    address: list[str] = []
    failure: list[BaseException] = []
    ready = threading.Event()
    loop = asyncio.new_event_loop()
    stop = asyncio.Event()

    async def run() -> None:
        async with running_server(chosen, worker_command) as name:
            address.append(name)
            ready.set()
            await stop.wait()

    def target() -> None:
        try:
            with asyncio.Runner(loop_factory=lambda: loop) as runner:
                runner.run(run())
        except BaseException as error:
            failure.append(error)
        finally:
            ready.set()

    thread = threading.Thread(target=target)
    thread.start()
    try:
        assert ready.wait(PATIENCE_S)
        if failure:
            raise failure[0]
        yield address[0]
    finally:
        with contextlib.suppress(RuntimeError):  # The loop is closed where the server failed.
            loop.call_soon_threadsafe(stop.set)
        thread.join(PATIENCE_S)
        assert not thread.is_alive()
    if failure:
        raise failure[0]


@contextmanager
def server_process(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """`robosc-server` as a program; yields the process and its address."""
    command = [sys.executable, "-m", "robosc_server.main", "--port", "0", "--workers", "1", *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line.startswith("robosc-server listening on "), line + (process.stderr.read() if process.stderr else "")
        yield process, line.split()[-1]
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
        try:
            process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()


def eventually(condition: Callable[[], bool]) -> bool:
    """Whether a condition becomes true; asks often, and long enough for a slow machine."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.005)
    return False


def is_running(pid: int) -> bool:
    """Whether there is a process of that number."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def bundle_of(text: str, name: str = "robot.rscd", **libraries: str) -> Bundle:
    """A bundle with a main file and libraries by name."""
    return Bundle(SourceFile(name, text), tuple(SourceFile(f"{key}.rscd", libraries[key]) for key in sorted(libraries)))


class Scripted(synthesis_pb2_grpc.SynthesisServiceServicer):
    """A server that answers what a test wants, right or wrong."""

    def __init__(
        self,
        check: pb.CheckResponse | None = None,
        synthesize: Sequence[pb.SynthesizeResponse] = (),
        generate: pb.GenerateResponse | None = None,
    ) -> None:
        self.answers = check, synthesize, generate

    def Check(self, request: pb.CheckRequest, context: grpc.ServicerContext) -> pb.CheckResponse | None:
        return self.answers[0]

    def Synthesize(
        self, request: pb.SynthesizeRequest, context: grpc.ServicerContext
    ) -> Iterator[pb.SynthesizeResponse]:
        yield from self.answers[1]

    def Generate(self, request: pb.GenerateRequest, context: grpc.ServicerContext) -> pb.GenerateResponse | None:
        return self.answers[2]


@contextmanager
def scripted(servicer: Scripted) -> Iterator[str]:
    """A server that answers as written; yields its address."""
    with ThreadPoolExecutor(2) as threads:
        server = grpc.server(threads)
        synthesis_pb2_grpc.add_SynthesisServiceServicer_to_server(servicer, server)  # type: ignore[no-untyped-call]
        port = server.add_insecure_port("127.0.0.1:0")
        server.start()
        try:
            yield f"127.0.0.1:{port}"
        finally:
            server.stop(None).wait()
