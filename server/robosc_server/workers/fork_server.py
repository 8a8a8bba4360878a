"""Fork server: a process that imports everything once and forks workers; it has one thread and runs no task.

Its arguments are the descriptor of its channel to the server, the name of the function that runs tasks, the process id
of the server, and whether workers must be fully confined. On the channel it receives packets with the number of
requested workers. It sends packets about the missing parts of the sandbox, about a new worker (with its connection, its
process descriptor and the pipe of its crash output), about the exit of a worker, and about errors.
"""

import contextlib
import gc
import importlib
import json
import os
import pkgutil
import select
import signal
import socket
import sys
import traceback
from pathlib import Path
from typing import NoReturn

from robosc_server.workers import child, confinement, kernel, shared_memory
from robosc_server.workers.child import TaskFunction
from robosc_server.workers.sandbox import Sandbox

PACKET_BYTES = 4096
"""Maximum size of one packet on the line, in bytes."""

MUST_BE_CONFINED = "required"
"""Argument that requires complete confinement."""

_FORK_PAUSE_MS = 200


class _ForkServer:
    """Process that forks workers on request and reaps them."""

    def __init__(self, line: socket.socket, function: TaskFunction, sandbox: Sandbox) -> None:
        self._line = line
        self._function = function
        self._sandbox = sandbox
        # Forks have the same size and need not read it.
        self._used_bytes = confinement.address_space_bytes()
        self._poll = select.poll()
        self._poll.register(line, select.POLLIN)
        self._pids: dict[int, int] = {}  # by process descriptor
        self._wanted = 0

    def run(self) -> None:
        """Serve until the server has ended: then this process exits, and the kernel kills its workers."""
        while True:
            for descriptor, _ in self._poll.poll(_FORK_PAUSE_MS if self._wanted else None):
                if descriptor in self._pids:
                    self._reap(descriptor)
                elif packet := self._line.recv(PACKET_BYTES):
                    self._wanted += int(packet)
                else:
                    return
            try:
                while self._wanted:
                    self._fork()
                    self._wanted -= 1
            except OSError as error:
                self._send({"is": "fault", "message": f"cannot start a worker process: {error.strerror}"})

    def _fork(self) -> None:
        with contextlib.ExitStack() as stack:
            ours, theirs = socket.socketpair()
            stack.enter_context(ours)
            stack.enter_context(theirs)
            words, crash_output = os.pipe2(os.O_CLOEXEC | os.O_NONBLOCK)
            stack.callback(os.close, words)
            stack.callback(os.close, crash_output)
            fork_server = os.getpid()
            pid = os.fork()
            if pid == 0:
                self._become_worker(fork_server, theirs, crash_output)
            try:
                descriptor = os.pidfd_open(pid)
            except OSError:
                os.kill(pid, signal.SIGKILL)
                os.waitpid(pid, 0)
                raise
            self._pids[descriptor] = pid
            self._poll.register(descriptor, select.POLLIN)
            self._send({"is": "worker", "pid": pid}, [ours.fileno(), descriptor, words])

    def _become_worker(self, fork_server: int, connection: socket.socket, crash_output: int) -> None:
        """Run one task in the child, and exit in any case."""
        try:
            confinement.exit_with_parent(fork_server)
            child.run_worker(connection, crash_output, self._function, self._sandbox, self._used_bytes)
        except BaseException:
            with contextlib.suppress(BaseException):
                os.write(crash_output, traceback.format_exc().encode())
            os._exit(1)
        finally:
            os._exit(0)

    def _reap(self, descriptor: int) -> None:
        pid = self._pids.pop(descriptor)
        self._poll.unregister(descriptor)
        os.close(descriptor)
        _, status, usage = os.wait4(pid, 0)
        self._send(
            {
                "is": "ended",
                "pid": pid,
                "exit_code": os.waitstatus_to_exitcode(status),
                "cpu_s": usage.ru_utime + usage.ru_stime,
                "peak_bytes": usage.ru_maxrss * 1024,
            }
        )

    def _send(self, values: dict[str, object], descriptors: list[int] | None = None) -> None:
        socket.send_fds(self._line, [json.dumps(values).encode()], descriptors or [])


def _load(name: str) -> TaskFunction:
    """Import the function that runs tasks, with everything that it needs, and return it.

    The tuples `PRELOADED` and `NOT_PRELOADED` of its module name packages to import and prefixes of modules to skip;
    the function `warm_up` builds what is built on first use. The function `make_ready` makes what each task uses up;
    what there is before is kept for ever. Each of them is optional.
    """
    module_name, _, attribute = name.partition(":")
    tasks = importlib.import_module(module_name)
    function: TaskFunction = getattr(tasks, attribute)
    for name in getattr(tasks, "PRELOADED", ()):
        package = importlib.import_module(name)
        for module in pkgutil.walk_packages(package.__path__, f"{name}."):
            if not module.name.startswith(tasks.NOT_PRELOADED) and not module.name.endswith("__main__"):
                # Modules for generated packages need their middleware.
                with contextlib.suppress(ImportError):
                    importlib.import_module(module.name)
    if warm_up := getattr(tasks, "warm_up", None):
        warm_up()
    shared_memory.keep_objects()
    if make_ready := getattr(tasks, "make_ready", None):
        make_ready()
    return function


def main() -> None:
    """Import, freeze, serve."""
    shared_memory.reserve_arenas()
    line = socket.socket(fileno=int(sys.argv[1]))
    line.set_inheritable(False)
    confinement.exit_with_parent(int(sys.argv[3]))
    # Forks inherit these settings.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    confinement.disable_core_dumps()
    kernel.keep_memory_private()
    sys.dont_write_bytecode = True
    try:
        function = _load(sys.argv[2])
        threads = len(list(Path("/proc/self/task").iterdir()))
        if threads > 1:
            raise RuntimeError(f"the fork server has {threads} threads and cannot fork safely")
    except Exception as error:  # The server reports any error in one sentence.
        _give_up(line, f"cannot load {sys.argv[2]}: {type(error).__name__}: {error}")
    sandbox = Sandbox()
    if sandbox.missing and sys.argv[4] == MUST_BE_CONFINED:
        _give_up(
            line, f"confinement is required, but this machine cannot confine workers: {'; '.join(sandbox.missing)}"
        )
    line.send(json.dumps({"is": "confined", "missing": sandbox.missing}).encode())
    # Workers copy each page that they write, and a garbage collection would write to all pages.
    gc.collect()
    gc.freeze()
    gc.disable()
    shared_memory.join_pages()
    sys.stdout.flush()
    sys.stderr.flush()
    child.redirect_to_devnull()
    with contextlib.suppress(ConnectionError):
        _ForkServer(line, function, sandbox).run()
    # The end of an interpreter would free each object for itself.
    os._exit(0)


def _give_up(line: socket.socket, message: str) -> NoReturn:
    """Report to the server why there are no workers, and exit."""
    line.send(json.dumps({"is": "fault", "message": message[:1000]}).encode())
    sys.exit(1)


if __name__ == "__main__":
    main()
