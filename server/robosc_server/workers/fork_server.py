"""The process that workers are forked from: it imports everything once, and holds no thread and no task.

Started as a program with the descriptor of its line to the server, the name of the function that does tasks, the
server's number, and whether workers must be confined whole. On the line (packets) it is told how many workers are
wanted, and tells: what cannot be kept from workers here; a worker that stands ready, with its connection, its process
descriptor and the pipe of its last words; a worker that has ended, and how; that no process can be had.
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

from robosc_server.workers import child, confinement, kernel
from robosc_server.workers.child import TaskFunction
from robosc_server.workers.sandbox import Sandbox

PACKET_BYTES = 4096
"""Maximum size of one packet on the line, in bytes."""

MUST_BE_CONFINED = "required"
"""Given to it where workers are not to be without a part of their confinement."""

_FORK_PAUSE_MS = 200


class _ForkServer:
    """Forks workers when it is told to, and reaps them."""

    def __init__(self, line: socket.socket, function: TaskFunction, sandbox: Sandbox) -> None:
        self._line = line
        self._function = function
        self._sandbox = sandbox
        # A fork's is the same, and need not be read in each of them.
        self._used_bytes = confinement.address_space_bytes()
        self._poll = select.poll()
        self._poll.register(line, select.POLLIN)
        self._pids: dict[int, int] = {}  # by process descriptor
        self._wanted = 0

    def run(self) -> None:
        """Serve until the server is gone: then this process ends, and the kernel kills every worker with it."""
        while True:
            for descriptor, _ in self._poll.poll(_FORK_PAUSE_MS if self._wanted else None):
                if descriptor in self._pids:
                    self._reap(descriptor)
                elif told := self._line.recv(PACKET_BYTES):
                    self._wanted += int(told)
                else:
                    return
            try:
                while self._wanted:
                    self._fork()
                    self._wanted -= 1
            except OSError as error:
                self._tell({"is": "fault", "message": f"cannot start a worker process: {error.strerror}"})

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
            self._tell({"is": "worker", "pid": pid}, [ours.fileno(), descriptor, words])

    def _become_worker(self, fork_server: int, connection: socket.socket, crash_output: int) -> None:
        """Do one task in the child, and end whatever happens."""
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
        self._tell(
            {
                "is": "ended",
                "pid": pid,
                "exit_code": os.waitstatus_to_exitcode(status),
                "cpu_s": usage.ru_utime + usage.ru_stime,
                "peak_bytes": usage.ru_maxrss * 1024,
            }
        )

    def _tell(self, values: dict[str, object], descriptors: list[int] | None = None) -> None:
        socket.send_fds(self._line, [json.dumps(values).encode()], descriptors or [])


def _load(name: str) -> TaskFunction:
    """The function that does tasks, after everything that it may need was imported, and made on first use.

    What the former is the tuples `PRELOADED` and `NOT_PRELOADED` beside it tell, names of packages and beginnings of
    names of modules; for the latter there is the function `rehearse`. Each may be missing.
    """
    module_name, _, attribute = name.partition(":")
    tasks = importlib.import_module(module_name)
    function: TaskFunction = getattr(tasks, attribute)
    for name in getattr(tasks, "PRELOADED", ()):
        package = importlib.import_module(name)
        for module in pkgutil.walk_packages(package.__path__, f"{name}."):
            if not module.name.startswith(tasks.NOT_PRELOADED) and not module.name.endswith("__main__"):
                # What is copied into generated packages needs the middleware that those run on.
                with contextlib.suppress(ImportError):
                    importlib.import_module(module.name)
    if rehearse := getattr(tasks, "rehearse", None):
        rehearse()
    return function


def main() -> None:
    """Import, freeze, serve."""
    line = socket.socket(fileno=int(sys.argv[1]))
    line.set_inheritable(False)
    confinement.exit_with_parent(int(sys.argv[3]))
    # What it forks has these from it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    confinement.disable_core_dumps()
    kernel.keep_memory_private()
    sys.dont_write_bytecode = True
    try:
        function = _load(sys.argv[2])
        threads = len(list(Path("/proc/self/task").iterdir()))
        if threads > 1:
            raise RuntimeError(f"the fork server has {threads} threads and cannot fork safely")
    except Exception as error:  # Whatever it was: the server tells it in one sentence.
        _give_up(line, f"cannot load {sys.argv[2]}: {type(error).__name__}: {error}")
    sandbox = Sandbox()
    if sandbox.missing and sys.argv[4] == MUST_BE_CONFINED:
        _give_up(
            line, f"confinement is required, but this machine cannot confine workers: {'; '.join(sandbox.missing)}"
        )
    line.send(json.dumps({"is": "confined", "missing": sandbox.missing}).encode())
    # Workers copy each page that they write to; a collection would write to all of them.
    gc.collect()
    gc.freeze()
    gc.disable()
    sys.stdout.flush()
    sys.stderr.flush()
    child.redirect_to_devnull()
    with contextlib.suppress(ConnectionError):
        _ForkServer(line, function, sandbox).run()


def _give_up(line: socket.socket, message: str) -> NoReturn:
    """Have the server tell why there are no workers."""
    line.send(json.dumps({"is": "fault", "message": message[:1000]}).encode())
    sys.exit(1)


if __name__ == "__main__":
    main()
