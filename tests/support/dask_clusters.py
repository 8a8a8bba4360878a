"""A Dask cluster of real processes: a scheduler and workers that can be stopped, killed and started again."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path

from support.waiting import eventually

_END_S = 20.0


class Cluster:
    """A scheduler and its workers.

    Args:
        folder: For what they write.
        protocol: `tcp` or `tls`.
        environment: Of all of them, beside this process's own.
    """

    def __init__(self, folder: Path, protocol: str = "tcp", environment: Mapping[str, str] | None = None) -> None:
        self.folder = folder
        self._environment = dict(environment or {})
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.address = f"{protocol}://127.0.0.1:{self.port}"
        self.scheduler: subprocess.Popen[bytes] | None = None
        self.workers: list[subprocess.Popen[bytes]] = []
        self._stack = ExitStack()

    def start_scheduler(self) -> None:
        """Start it, on the same port as before."""
        where = ("--host", self.address.rpartition(":")[0], "--port", str(self.port))
        self.scheduler = self._start("scheduler", *where, "--no-dashboard")
        assert eventually(self._is_listening)

    def _is_listening(self) -> bool:
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", self.port)) == 0

    def start_worker(self, threads: int = 1, environment: Mapping[str, str] | None = None) -> subprocess.Popen[bytes]:
        """Start a worker."""
        options = ("--nthreads", str(threads), "--no-nanny", "--no-dashboard", "--death-timeout", "60")
        folder = ("--local-directory", str(self.folder / "workers"))
        worker = self._start("worker", self.address, *options, *folder, environment=environment)
        self.workers.append(worker)
        return worker

    def _start(
        self, program: str, *arguments: str, environment: Mapping[str, str] | None = None
    ) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{program}", *arguments]
        variables = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(path for path in sys.path if path),
            **self._environment,
            **(environment or {}),
        }
        with (self.folder / f"{program}.log").open("ab") as log:
            process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=variables, cwd=self.folder
            )
        self._stack.callback(end, process)
        return process

    def close(self) -> None:
        """End every process."""
        self._stack.close()


def end(process: subprocess.Popen[bytes]) -> None:
    """End a process, if need be by force."""
    with contextlib.suppress(ProcessLookupError):
        process.send_signal(signal.SIGCONT)
        process.terminate()
    try:
        process.wait(_END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def kill(process: subprocess.Popen[bytes]) -> None:
    """End a process at once."""
    process.kill()
    process.wait()


@contextmanager
def dask_cluster(
    folder: Path, workers: int, protocol: str = "tcp", environment: Mapping[str, str] | None = None
) -> Iterator[Cluster]:
    """A cluster with some workers of one thread each; see `Cluster`."""
    cluster = Cluster(folder, protocol, environment)
    try:
        cluster.start_scheduler()
        for _ in range(workers):
            cluster.start_worker()
        yield cluster
    finally:
        cluster.close()
