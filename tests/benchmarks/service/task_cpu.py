"""Benchmark of the processor time of an uncached task, of all processes that take part in it.

Processor time says the same on a machine with other work, where the time on a clock says little. Page faults of
workers are most of what a process of its own costs: each page that a fork writes is copied.
"""

import os
import statistics
from dataclasses import dataclass
from pathlib import Path

from figures import text_table
from service.load import call_kinds, processor_s, run_load
from support.service import server_process

TASKS = 200
ROUNDS = 5
WARM_UP = 20

HEADER = ("line follower", "server ms", "fork server ms", "workers ms", "all ms", "least", "page faults of a worker")

_TICKS = os.sysconf("SC_CLK_TCK")
# Fields of /proc/PID/stat behind the name, see proc_pid_stat(5).
_PARENT, _FAULTS_OF_CHILDREN, _USER_OF_CHILDREN, _SYSTEM_OF_CHILDREN = 1, 8, 13, 14


@dataclass(frozen=True, slots=True)
class _Used:
    """Use of the machine by the processes of a service.

    Attributes:
        server_s: Processor time of the server.
        fork_server_s: Processor time of the process that forks workers.
        workers_s: Processor time of all workers that have ended.
        faults: Page faults of these workers.
    """

    server_s: float
    fork_server_s: float
    workers_s: float
    faults: float

    def per_task(self, before: "_Used") -> "_Used":
        """Return the use of one task, of all that came after another measurement."""
        return _Used(
            (self.server_s - before.server_s) / TASKS,
            (self.fork_server_s - before.fork_server_s) / TASKS,
            (self.workers_s - before.workers_s) / TASKS,
            (self.faults - before.faults) / TASKS,
        )

    @property
    def all_s(self) -> float:
        """Processor time of all."""
        return self.server_s + self.fork_server_s + self.workers_s


def table() -> str:
    """Medians of several rounds, and the least time of all processes."""
    with server_process("--worker-processes", "2", "--log-level", "warning") as (process, address):
        (fork_server,) = _children(process.pid)
        rows = []
        for name, load in call_kinds().items():
            if name.endswith("cached"):
                continue
            run_load(address, load(1), count=WARM_UP)
            found = []
            for _ in range(ROUNDS):
                before = _used(process.pid, fork_server)
                assert len(run_load(address, load(1), count=TASKS).times_s) == TASKS
                found.append(_used(process.pid, fork_server).per_task(before))
            rows.append(_row(name, found))
    return text_table("Processor time of a task, milliseconds", HEADER, rows)


def _row(name: str, found: list[_Used]) -> list[str]:
    return [
        name,
        *(
            f"{statistics.median(values) * 1e3:.1f}"
            for values in zip(
                *((one.server_s, one.fork_server_s, one.workers_s, one.all_s) for one in found), strict=True
            )
        ),
        f"{min(one.all_s for one in found) * 1e3:.1f}",
        f"{statistics.median(one.faults for one in found):.0f}",
    ]


def _used(server: int, fork_server: int) -> _Used:
    fields = _fields(fork_server)
    workers_s = (int(fields[_USER_OF_CHILDREN]) + int(fields[_SYSTEM_OF_CHILDREN])) / _TICKS
    return _Used(processor_s(server), processor_s(fork_server), workers_s, int(fields[_FAULTS_OF_CHILDREN]))


def _children(pid: int) -> list[int]:
    numbers = [int(path.name) for path in Path("/proc").iterdir() if path.name.isdigit()]
    return [number for number in numbers if int(_fields(number)[_PARENT]) == pid]


def _fields(pid: int) -> list[str]:
    """Fields of a process's state behind its name, which may hold anything."""
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
