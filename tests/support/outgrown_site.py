"""A service that has outgrown one machine, all of it on this one: servers, a database and a Dask cluster, one proxy.

Every part but the proxy is a process that may be killed at any time; a keeper starts it again a moment later, on the
same port, as systemd and Kubernetes do (`Restart=always`).
"""

import asyncio
import contextlib
import os
import random
import shutil
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import AsyncIterator, Iterable, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from support.background import children_of
from support.ports import lasting_port, port_of
from support.postgresql import Postgresql, postgresql

RESTART_S = 1.0
"""Time between the end of a part and its next start, in seconds, as `RestartSec` of systemd."""

_LOOK_S = 0.1
_END_S = 20.0
_CONNECTIONS = 200
_JOBS_PER_CALLER = 1_000_000


class Kind(StrEnum):
    """Kind of a part that is killed."""

    WORKER = "worker"
    SERVER = "server"
    SCHEDULER = "scheduler"
    DATABASE = "database"


class Part:
    """One process of the site, which is started again when it has ended.

    Args:
        kind: Kind of the part.
        command: Command that starts it.
        log: File that it writes to.
        environment: Variables of its environment.

    Attributes:
        kind: Kind of the part.
        starts: Number of times that it was started.
        lock: Held while it is started or killed.
    """

    def __init__(self, kind: Kind, command: list[str], log: Path, environment: dict[str, str]) -> None:
        self.kind = kind
        self.starts = 0
        self._command, self._log, self._environment = command, log, environment
        self._process: subprocess.Popen[bytes] | None = None
        self.lock = asyncio.Lock()

    @property
    def pid(self) -> int | None:
        """Its process; None: it does not run."""
        return None if self._process is None or self._process.poll() is not None else self._process.pid

    def start(self) -> None:
        """Start it."""
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(
                self._command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=self._environment
            )
        self.starts += 1

    def kill(self) -> None:
        """End it at once."""
        assert self._process is not None
        self._process.kill()
        self._process.wait()

    def end(self) -> None:
        """End it, if need be by force."""
        if self._process is None:
            return
        with contextlib.suppress(ProcessLookupError):
            self._process.send_signal(signal.SIGTERM)
        try:
            self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self.kill()


class DatabasePart(Part):
    """The database as a part.

    Args:
        server: Server of the database, which runs.
    """

    def __init__(self, server: Postgresql) -> None:
        super().__init__(Kind.DATABASE, [], Path(), {})
        self.starts = 1
        self._server = server

    @property
    def pid(self) -> int | None:
        """Its first process; None: it does not run."""
        return self._server.pid

    def start(self) -> None:
        """Start it, and wait until it answers."""
        self._server.start()
        self.starts += 1

    def kill(self) -> None:
        """End all its processes at once."""
        self._server.kill()

    def end(self) -> None:
        """Leave it to who has started it."""


@dataclass
class Site:
    """The parts of a service under one proxy.

    Attributes:
        address: Address of the proxy.
        database: URL of the database.
        parts: Parts that may be killed.
        proxy: Process of the proxy.
        folder: Folder of the logs.
        keeper: Task that starts each part again a moment after its end; it ends only if one cannot be started.
        kills: Number of kills of each kind.
    """

    address: str
    database: str
    parts: list[Part]
    proxy: subprocess.Popen[bytes]
    folder: Path
    keeper: asyncio.Task[None]
    kills: Counter[str] = field(default_factory=Counter)

    def of(self, kind: Kind) -> list[Part]:
        """The parts of a kind."""
        return [part for part in self.parts if part.kind is kind]

    async def kill_at_random(self, every_s: float, dice: random.Random) -> None:
        """Kill parts at random until cancelled.

        Args:
            every_s: Mean time between two kills, in seconds; the times are exponentially distributed.
            dice: Source of chance.
        """
        while True:
            await asyncio.sleep(dice.expovariate(1 / every_s))
            kind = dice.choice(list(Kind))
            part = dice.choice(self.of(kind))
            async with part.lock:
                if part.pid is None:
                    continue
                await asyncio.to_thread(part.kill)
            self.kills[kind] += 1


async def _keep_all(parts: Iterable[Part]) -> None:
    async with asyncio.TaskGroup() as group:
        for part in parts:
            group.create_task(_keep(part))


async def _keep(part: Part) -> None:
    while True:
        await asyncio.sleep(_LOOK_S)
        if part.pid is None:
            await asyncio.sleep(RESTART_S)
            async with part.lock:
                await asyncio.to_thread(part.start)


def proxy_program() -> str | None:
    """The proxy, haproxy; None: it is not installed."""
    return shutil.which("haproxy", path=f"{os.environ.get('PATH', '')}:/usr/sbin:/usr/local/sbin")


def proxy_configuration(port: int, servers: list[int]) -> str:
    """Configuration of a proxy that spreads calls over servers.

    One connection of a client carries all its calls, watches included; so the proxy admits as many of them on it as
    the servers do, and ends no idle one.
    """
    lines = [f"  server server{number} 127.0.0.1:{one} check" for number, one in enumerate(servers)]
    return "\n".join(
        [
            "global",
            "  maxconn 4000",
            "  nbthread 1",
            "  tune.h2.max-concurrent-streams 2000",
            "defaults",
            "  mode http",
            "  timeout connect 2s",
            "  timeout client 1h",
            "  timeout server 1h",
            "  option redispatch",
            "  retry-on conn-failure",
            "frontend grpc",
            f"  bind 127.0.0.1:{port} proto h2",
            "  default_backend servers",
            "backend servers",
            "  balance roundrobin",
            "  default-server proto h2 inter 500ms fall 1 rise 1",
            *lines,
            "",
        ]
    )


@asynccontextmanager
async def site(folder: Path, servers: int, workers: int) -> AsyncIterator[Site]:
    """Run such a service; it is kept running inside the context.

    Args:
        folder: Folder of its files and logs.
        servers: Number of servers.
        workers: Number of Dask workers, of one thread each.
    """
    with postgresql(_CONNECTIONS) as database, _ports(servers + 2) as (proxy_port, scheduler_port, *server_ports):
        url = database.new_database()
        parts = [
            DatabasePart(database),
            *_cluster(folder, scheduler_port, workers),
            *_servers(folder, server_ports, f"dask://127.0.0.1:{scheduler_port}", url),
        ]
        configuration = folder / "haproxy.cfg"
        configuration.write_text(proxy_configuration(proxy_port, server_ports))
        proxy = _proxy(configuration, folder / "proxy.log")
        keeper = asyncio.create_task(_keep_all(parts))
        try:
            for part in parts[1:]:
                part.start()
            yield Site(f"127.0.0.1:{proxy_port}", url, parts, proxy, folder, keeper)
        finally:
            keeper.cancel()
            await asyncio.gather(keeper, return_exceptions=True)
            # Servers first, so that they leave while there are a database and a cluster.
            for part in reversed(parts):
                part.end()
            proxy.kill()
            proxy.wait()


def tree_of(pid: int) -> list[int]:
    """A process and all that it has started, directly or not."""
    return [pid, *(below for child in children_of(pid) for below in tree_of(child))]


@contextmanager
def _ports(count: int) -> Iterator[list[int]]:
    with contextlib.ExitStack() as stack:
        yield [port_of(stack.enter_context(lasting_port())) for _ in range(count)]


def _environment() -> dict[str, str]:
    variables = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    # Each start would compile all imports without bytecode on disk.
    variables.pop("PYTHONDONTWRITEBYTECODE", None)
    return variables


def cluster_commands(folder: Path, port: int) -> tuple[list[str], list[str]]:
    """Commands of a scheduler of Dask and of a worker, which nobody on another machine can reach.

    Whoever reaches them can run programs here. Without an address they would listen on all, and so would the pages of
    HTTP that each has even without a dashboard.

    Args:
        folder: Folder of the files of workers.
        port: Port of the scheduler.
    """
    here = ["--host", "127.0.0.1", "--no-dashboard", "--dashboard-address", "127.0.0.1:0"]
    scheduler = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", str(port), *here]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", f"tcp://127.0.0.1:{port}", "--nthreads", "1"]
    worker += ["--no-nanny", "--death-timeout", "60", "--local-directory", str(folder / "workers"), *here]
    return scheduler, worker


def _cluster(folder: Path, port: int, workers: int) -> list[Part]:
    scheduler, worker = cluster_commands(folder, port)
    variables = _environment()
    return [
        Part(Kind.SCHEDULER, scheduler, folder / "scheduler.log", variables),
        *(Part(Kind.WORKER, worker, folder / f"worker{number}.log", variables) for number in range(workers)),
    ]


def _servers(folder: Path, ports: list[int], workers: str, database: str) -> list[Part]:
    parts = []
    for number, port in enumerate(ports):
        command = [sys.executable, "-m", "robosc_server.main", "--port", str(port), "--workers", workers]
        command += ["--database-url", database, "--state-dir", str(folder), "--drain-seconds", "1"]
        command += ["--jobs-per-caller", str(_JOBS_PER_CALLER)]
        parts.append(Part(Kind.SERVER, command, folder / f"server{number}.log", _environment()))
    return parts


def _proxy(configuration: Path, log: Path) -> subprocess.Popen[bytes]:
    program = proxy_program()
    if program is None:
        raise RuntimeError("haproxy is not installed (Debian's package: haproxy)")
    with log.open("ab") as stream:
        return subprocess.Popen([program, "-db", "-f", configuration], stdout=stream, stderr=stream)
