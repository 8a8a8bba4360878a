"""Real servers for tests: one in this process on a port of its own choice, one as a program."""

import asyncio
import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path
from typing import Any

import grpc
import structlog

from robosc.source import Bundle, SourceFile
from robosc_api.security import ServerSecurity
from robosc_api.v1 import jobs_pb2, jobs_pb2_grpc
from robosc_server.application import running_server
from robosc_server.operations.settings import Settings
from robosc_server.workers.local import TASK_FUNCTION, LocalWorkers
from support.held_time import HeldLoop
from support.waiting import PATIENCE_S

_PAUSE_S = 0.005
_JOBS: Any = jobs_pb2_grpc.JobServiceStub


@contextmanager
def served(
    task_function: str = TASK_FUNCTION,
    /,
    *,
    given_workers: Any = None,
    loop: asyncio.AbstractEventLoop | None = None,
    **settings: Any,
) -> Iterator[str]:
    """Run a server in a thread of this process; yield its address.

    Args:
        task_function: Function that does the tasks, such as `fake_tasks.TASK_FUNCTION`.
        given_workers: Workers that do the tasks instead, not started yet; None: processes of this machine, which take
            most of the time until it serves.
        loop: Event loop that it runs on, such as a `HeldLoop`; None: a new one.
        **settings: Settings that are not as usual.
    """
    # Its log goes where pytest hears it, and not to whatever was standard output when the first line was written.
    structlog.configure(logger_factory=structlog.stdlib.LoggerFactory(), cache_logger_on_first_use=False)
    with tempfile.TemporaryDirectory() as folder:
        usual: dict[str, Any] = {"port": 0, "worker_processes": 1, "state_dir": Path(folder), "drain_seconds": 0.5}
        chosen = Settings(**(usual | settings))
        workers = given_workers or LocalWorkers(chosen.worker_processes, task_function)
        with _served(chosen, workers, loop or asyncio.new_event_loop()) as address:
            yield address


def secured(security: ServerSecurity) -> dict[str, Any]:
    """The settings of a server that is secured like this."""
    return {
        "tls_certificate": security.certificate,
        "tls_key": security.key,
        "client_ca": security.client_ca,
        "tokens": security.tokens,
        "insecure_beyond_loopback": security.insecure_beyond_loopback,
    }


@contextmanager
def _served(chosen: Settings, workers: Any, loop: asyncio.AbstractEventLoop) -> Iterator[str]:
    address: list[str] = []
    failure: list[BaseException] = []
    ready = threading.Event()
    stop = asyncio.Event()

    async def run() -> None:
        async with _time_at_the_end(loop, stop), running_server(chosen, workers) as name:
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


@asynccontextmanager
async def _time_at_the_end(loop: asyncio.AbstractEventLoop, stop: asyncio.Event) -> AsyncIterator[None]:
    """Have time pass on a loop that holds it, from the moment that its server is to stop.

    A server waits then for what its callers may have seen the end of already.
    """
    has_ended = False

    async def passes(held: HeldLoop) -> None:
        await stop.wait()
        while not has_ended:
            await held.passed(_PAUSE_S)
            await asyncio.to_thread(time.sleep, _PAUSE_S)

    passing = asyncio.create_task(passes(loop)) if isinstance(loop, HeldLoop) else None
    try:
        yield
    finally:
        has_ended = True
        stop.set()
        if passing is not None:
            await passing


@contextmanager
def server_process(*arguments: str, **environment: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """`robosc-server` as a program, with a folder of its own for its state; yields the process and its address."""
    with logged_server_process(*arguments, **environment) as (process, address, _):
        yield process, address


@contextmanager
def logged_server_process(
    *arguments: str, **environment: str
) -> Iterator[tuple[subprocess.Popen[str], str, list[str]]]:
    """The same; yields the lines of its log, too, which come as it writes them."""
    with tempfile.TemporaryDirectory() as folder:
        usual = ["--port", "0", "--worker-processes", "1", "--state-dir", folder, "--drain-seconds", "0.5"]
        command = [sys.executable, "-m", "robosc_server.main", *usual, *arguments]
        # The stacks of its threads are reported should it not end.
        variables = {**os.environ, "PYTHONFAULTHANDLER": "1", **environment}
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=variables)
        # Its log must not fill the pipe while it is not read.
        log: list[str] = []
        assert process.stdout is not None and process.stderr is not None
        reader = threading.Thread(target=lambda lines: log.extend(lines), args=(process.stderr,))
        reader.start()
        try:
            line = process.stdout.readline()
            if not line.startswith("robosc-server listening on "):
                process.kill()
                reader.join(PATIENCE_S)
                raise AssertionError(line + "".join(log))
            yield process, line.split()[-1], log
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
            try:
                process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGABRT)
                reader.join(PATIENCE_S)
                raise AssertionError("the server does not end:\n" + "".join(log)) from None
            finally:
                process.kill()
                reader.join(PATIENCE_S)
                process.stdout.close()
                process.stderr.close()


def status_of_list(address: str, *metadata: tuple[str, str], all_owners: bool = False, credentials: Any = None) -> str:
    """Return the status of a list of jobs that is asked for in clear text, or with credentials."""
    channel = grpc.insecure_channel(address) if credentials is None else grpc.secure_channel(address, credentials)
    with channel:
        try:
            _JOBS(channel).ListJobs(
                jobs_pb2.ListJobsRequest(all_owners=all_owners), metadata=metadata, timeout=PATIENCE_S
            )
        except grpc.RpcError as error:
            return str(error.code().name)
    return "OK"


def bundle_of(text: str, name: str = "robot.rscd", **libraries: str) -> Bundle:
    """A bundle with a main file and libraries by name."""
    return Bundle(SourceFile(name, text), tuple(SourceFile(f"{key}.rscd", libraries[key]) for key in sorted(libraries)))
