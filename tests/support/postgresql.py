"""A real PostgreSQL server from Debian's packages, in a folder of its own, which tests start, stop and kill."""

import contextlib
import itertools
import os
import pwd
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest

from support.background import children_of, has_ended
from support.ports import lasting_port, port_of
from support.waiting import wait_until

PATIENCE_S = 60.0
_USER = "postgres"


@cache
def _programs() -> Path | None:
    """Return the folder of the newest server's programs."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/postgres"), key=lambda path: int(path.parts[-3]))
    return found[-1].parent if found else None


def missing_for_postgresql() -> str | None:
    """Return what PostgreSQL lacks here; None: it can run."""
    if _programs() is None:
        return "PostgreSQL is not installed (Debian's package: postgresql)"
    if os.getuid() == 0:
        try:
            pwd.getpwnam(_USER)
        except KeyError:
            return f"there is no user {_USER}, and PostgreSQL does not run as root"
        if shutil.which("setpriv") is None:
            return f"there is no setpriv to become the user {_USER} (Debian's package: util-linux)"
    return None


def skip_without_postgresql() -> None:
    """Skip the test where there is no PostgreSQL, or no user to run it as."""
    if missing := missing_for_postgresql():
        pytest.skip(missing)


class Postgresql:
    """One server, on a port of the loopback interface.

    Args:
        folder: Empty; for its data.
        connections: Most connections that it takes.
    """

    def __init__(self, folder: Path, connections: int = 40) -> None:
        self._folder = folder
        self._connections = connections
        self._process: subprocess.Popen[bytes] | None = None
        self._numbers = itertools.count()
        self._keeper = lasting_port()
        self._port = port_of(self._keeper)
        self._as: list[str] = []
        if os.getuid() == 0:
            user = pwd.getpwnam(_USER)
            os.chown(folder, user.pw_uid, user.pw_gid)
            # `user=` would fork, and of ten forks while gRPC has a call under way one child ends of it (SIGSEGV).
            self._as = ["setpriv", f"--reuid={user.pw_uid}", f"--regid={user.pw_gid}", "--clear-groups"]

    @property
    def url(self) -> str:
        """URL of its first database."""
        return f"postgresql://{_USER}@127.0.0.1:{self._port}/postgres"

    def new_database(self) -> str:
        """The URL of a database with nothing in it."""
        name = f"test{next(self._numbers)}"
        self._run("createdb", "-h", "127.0.0.1", "-p", str(self._port), "-U", _USER, name)
        return self.url.removesuffix("postgres") + name

    def make(self) -> None:
        """Make its data."""
        self._run("initdb", "--auth", "trust", "--username", _USER, "--no-sync", "--pgdata", str(self._data))

    def start(self) -> None:
        """Start it, and wait until it answers."""
        programs = _programs()
        assert programs is not None and self._process is None
        options = {
            "listen_addresses": "127.0.0.1",
            "port": str(self._port),
            "unix_socket_directories": "",
            "shared_buffers": "16MB",
            "max_connections": str(self._connections),
            # Committed rows survive a kill of its processes without it, and the machine's disk is busy.
            "fsync": "off",
        }
        settings = [word for name, value in options.items() for word in ("-c", f"{name}={value}")]
        with (self._folder / "log").open("ab") as log:
            self._process = subprocess.Popen(
                [*self._as, programs / "postgres", "-D", self._data, *settings],
                stdout=log,
                stderr=log,
                cwd=self._folder,
                start_new_session=True,
            )
        end = time.monotonic() + PATIENCE_S
        while self._try("pg_isready", "-q", "-h", "127.0.0.1", "-p", str(self._port)):
            assert self._process.poll() is None, f"{self._process.poll()}: {(self._folder / 'log').read_text()}"
            assert time.monotonic() < end, (self._folder / "log").read_text()
            time.sleep(0.02)

    def stop(self) -> None:
        """Stop it at once, as an operator would; its clients lose their connections."""
        self._end(signal.SIGINT)

    def kill(self) -> None:
        """End all its processes at once, as a machine that loses its power; what was committed is on its disk."""
        assert self._process is not None
        # Read first: those of a parent that is gone belong to another one.
        children = children_of(self._process.pid)
        self._process.kill()
        self._process.wait(PATIENCE_S)
        self._process = None
        for pid in children:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        # A new server refuses to begin beside the processes of the old one.
        wait_until(lambda: all(map(has_ended, children)), "the end of the processes of PostgreSQL")

    @property
    def pid(self) -> int | None:
        """The first of its processes; None: it does not run."""
        return None if self._process is None else self._process.pid

    def freeze(self) -> None:
        """Stop all its processes where they are: it takes connections, and does not answer."""
        self._signal_all(signal.SIGSTOP)

    def thaw(self) -> None:
        """Have them go on."""
        self._signal_all(signal.SIGCONT)

    def end(self) -> None:
        """End it, whatever it does, and give up its port."""
        self._keeper.close()
        if self._process is not None:
            self.thaw()
            self._end(signal.SIGQUIT)

    @property
    def _data(self) -> Path:
        return self._folder / "data"

    def _signal_all(self, number: int) -> None:
        assert self._process is not None
        # Its processes are all children of the first; each has a session of its own.
        for pid in (self._process.pid, *children_of(self._process.pid)):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, number)

    def _end(self, number: int) -> None:
        assert self._process is not None
        self._process.send_signal(number)
        self._process.wait(PATIENCE_S)
        self._process = None

    def _run(self, program: str, *arguments: str) -> None:
        programs = _programs()
        assert programs is not None
        subprocess.run(
            [*self._as, programs / program, *arguments],
            check=True,
            capture_output=True,
            cwd=self._folder,
        )

    def _try(self, program: str, *arguments: str) -> int:
        programs = _programs()
        assert programs is not None
        return subprocess.run([programs / program, *arguments], check=False, capture_output=True).returncode


@contextmanager
def postgresql(connections: int = 40) -> Iterator[Postgresql]:
    """A server that runs and takes so many connections; ended at the end."""
    skip_without_postgresql()
    # Not where only root comes: the server runs as another user.
    folder = Path(tempfile.mkdtemp(prefix="postgresql-", dir="/tmp"))
    server = Postgresql(folder, connections)
    try:
        server.make()
        server.start()
        yield server
    finally:
        server.end()
        shutil.rmtree(folder, ignore_errors=True)
