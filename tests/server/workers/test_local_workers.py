"""Processes of this machine: they do what they are asked to, die of what they may not, and are killed in time."""

import asyncio
import contextlib
import os
import signal
import socket
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from robosc_server.tasks.exceeded import cpu_time_exceeded, memory_exceeded, time_exceeded
from robosc_server.tasks.task import Failure, Reason, Report, Result, TaskKind
from robosc_server.workers import WorkerLostError, WorkersError
from robosc_server.workers.local import LocalWorkers
from robosc_server.workers.pool import WorkerPool
from support.background import BackgroundLoop, has_ended, is_stopped, parent_of
from support.descriptors import open_descriptors
from support.fake_tasks import TASK_FUNCTION, said
from support.held_time import HeldLoop
from support.waiting import PATIENCE_S, eventually
from support.worker_runs import LIMITS, Running


class TestAnswers:
    def test_a_task_is_answered_after_its_reports(self, running: Running) -> None:
        future, reports = running.start("reports 3\necho hello")
        assert said(future.result(60)) == "hello"
        assert reports == [Report("synthesis", f"step {number}") for number in range(3)]

    @pytest.mark.parametrize("kind", TaskKind)
    def test_each_kind_reaches_the_function(self, running: Running, kind: TaskKind) -> None:
        outcome = running.start("echo here", kind=kind)[0].result(60)
        assert isinstance(outcome, Result)
        assert b"here" in outcome.messages[0]

    def test_each_task_has_a_process_of_its_own(self, running: Running) -> None:
        pids = {running.begun("echo")[1] for _ in range(3)}
        assert len(pids) == 3
        assert os.getpid() not in pids

    def test_as_many_as_the_capacity_are_under_way_at_once(self, running: Running) -> None:
        assert running.workers.capacity == 2
        tasks = [running.begun("stop") for _ in range(2)]
        assert eventually(lambda: all(is_stopped(pid) for _, pid in tasks))
        for future, pid in tasks:
            os.kill(pid, signal.SIGCONT)
            assert said(future.result(60)) == "done"

    def test_noise_and_secrets_stay_out(self, running: Running) -> None:
        assert said(running.run("noise\necho quiet")) == "quiet"
        found = set(said(running.run("environment")).split())
        assert {"PATH", "PYTHONPATH"} <= found
        assert "A_PASSWORD_OF_SOMETHING" not in found
        assert said(running.run("modules")) == ""


class TestLimits:
    def test_the_kernel_gets_the_limits(self, running: Running) -> None:
        assert said(running.run("limits")) == f"{20} 0 0 {LIMITS.memory_bytes}"

    def test_what_the_process_has_already_is_left_to_it(self, running: Running) -> None:
        limits = replace(LIMITS, memory_bytes=1)
        assert said(running.run("echo small", limits)) == "small"
        assert running.failure("allocate", limits).reason is Reason.MEMORY_LIMIT

    @pytest.mark.parametrize("text", ["allocate", "allocate in C", "exit 1"])
    def test_memory(self, running: Running, text: str) -> None:
        limits = replace(LIMITS, memory_bytes=2**28)
        expected = memory_exceeded(limits)
        failure = running.failure(text, limits)
        assert (failure.reason, failure.message) == (expected.reason, expected.message)

    def test_processor_time(self, running: Running) -> None:
        # Side by side: the kernel counts in whole seconds.
        tasks = [running.start(text, replace(LIMITS, cpu_seconds=0.1))[0] for text in ("spin", "stuck")]
        for failure in (task.result(PATIENCE_S) for task in tasks):
            assert isinstance(failure, Failure)
            assert failure.reason is Reason.CPU_LIMIT
            assert failure.message == cpu_time_exceeded(replace(LIMITS, cpu_seconds=0.1)).message

    def test_time_by_the_clock(self) -> None:
        clock = HeldLoop()
        with BackgroundLoop(clock) as loop:
            workers = LocalWorkers(2, TASK_FUNCTION)
            loop.run(workers.__aenter__())
            running = Running(loop, workers)
            for text in ("sleep 600", "stop", "stuck"):
                limits = replace(LIMITS, seconds=50.0)
                future, _ = running.begun(text, limits)
                clock.advance(49.0)
                assert not future.done()
                clock.advance(1.0)
                assert future.result(PATIENCE_S) == time_exceeded(limits)
            loop.run(workers.__aexit__())

    def test_the_size_of_a_result(self, running: Running) -> None:
        assert len(said(running.run("size 900000"))) == 900_000
        assert running.failure("size 1000000").reason is Reason.RESULT_TOO_LARGE

    def test_a_size_that_is_only_claimed_is_not_waited_for(self, running: Running) -> None:
        assert running.failure("claim 1000001").reason is Reason.RESULT_TOO_LARGE
        assert running.failure("claim 18446744073709551615").reason is Reason.RESULT_TOO_LARGE


class TestDeaths:
    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("exit 3", "the worker process ended with status 3 and no answer"),
            ("exit 0", "the worker process ended with status 0 and no answer"),
            ("die 9", "the worker process was ended by SIGKILL"),
            ("die 11", "the worker process was ended by SIGSEGV"),
            ("garbage", "the worker process sent an invalid answer"),
        ],
    )
    def test_a_process_that_dies_ends_its_task_alone(
        self, running: Running, monkeypatch: pytest.MonkeyPatch, text: str, message: str
    ) -> None:
        # The machine may lack memory for something else.
        for name in ("oom_kills", "_kills_before"):
            monkeypatch.setattr(f"robosc_server.workers.process.{name}", lambda: 0)
        other, pid = running.begun("stop\necho unharmed")
        assert eventually(lambda: is_stopped(pid))
        failure = running.failure(text)
        assert (failure.reason, failure.message) == (Reason.WORKER_DIED, message)
        os.kill(pid, signal.SIGCONT)
        assert said(other.result(60)) == "unharmed"

    def test_where_it_crashed_stands_in_the_details(self, running: Running) -> None:
        assert "in _misbehave" in running.failure("die 11").details

    def test_a_fault_is_reported_with_its_traceback(self, running: Running) -> None:
        failure = running.failure("raise")
        assert failure.reason is Reason.INTERNAL_FAULT
        assert failure.details.rstrip().endswith("ValueError: a fault, on purpose")
        assert running.failure("refuse this") == Failure(Reason.MALFORMED_REQUEST, "this")

    def test_a_waiting_process_that_dies_is_replaced(self, running: Running) -> None:
        pids = running.local.pids
        for pid in pids:
            with contextlib.suppress(ProcessLookupError):  # It was that of the task before.
                os.kill(pid, signal.SIGKILL)
        assert eventually(lambda: all(map(has_ended, pids)))
        assert said(running.run("echo again")) == "again"

    def test_where_no_more_files_may_be_open_there_are_workers_again_when_they_may(
        self, running: Running, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        receive = socket.recv_fds
        lost: list[int] = []

        def without_files(*arguments: Any) -> Any:
            packet, descriptors, flags, address = receive(*arguments)
            if descriptors and len(lost) < 3:
                lost.append(len(descriptors))
                for number in descriptors:
                    os.close(number)
                return packet, [], flags, address
            return packet, descriptors, flags, address

        monkeypatch.setattr(socket, "recv_fds", without_files)
        assert [said(running.run(f"echo {number}")) for number in range(8)] == [str(number) for number in range(8)]
        assert lost == [3, 3, 3]

    def test_a_task_that_is_over_is_not_under_way(self, running: Running, caplog: pytest.LogCaptureFixture) -> None:
        restarts = running.local.restarts
        future, pid = running.begun("stop\necho over")
        assert eventually(lambda: is_stopped(pid))
        # A fork server that is stopped does not report that the worker has ended.
        server = parent_of(pid)
        os.kill(server, signal.SIGSTOP)
        assert eventually(lambda: is_stopped(server))
        os.kill(pid, signal.SIGCONT)
        assert said(future.result(60)) == "over"
        os.kill(server, signal.SIGKILL)
        assert eventually(lambda: running.local.restarts == restarts + 1)
        assert said(running.run("echo again")) == "again"
        assert "restarting it" in caplog.text
        assert "under way" not in caplog.text

    def test_a_task_whose_fork_server_dies_is_begun_again_once(
        self, running: Running, caplog: pytest.LogCaptureFixture
    ) -> None:
        restarts = running.local.restarts
        future, reports = running.start("pid\nstop\necho twice")
        assert eventually(lambda: len(reports) == 1)
        pid = int(reports[0].message)
        os.kill(parent_of(pid), signal.SIGKILL)
        assert eventually(lambda: len(reports) == 2)
        again = int(reports[1].message)
        assert eventually(lambda: is_stopped(again))
        os.kill(again, signal.SIGCONT)
        assert said(future.result(60)) == "twice"
        assert running.local.restarts == restarts + 1
        ended = "ended with status -9; restarting it; tasks under way: check 0000000000000000"
        assert f"the fork server of the workers {ended}" in caplog.text
        assert eventually(lambda: has_ended(pid))

        future, reports = running.start("pid\nsleep 600")
        for count in (1, 2):
            assert eventually(lambda count=count: len(reports) == count)  # type: ignore[misc]
            os.kill(parent_of(int(reports[-1].message)), signal.SIGKILL)
        with pytest.raises(WorkerLostError, match="ended twice during one task"):
            future.result(60)
        assert said(running.run("echo again")) == "again"

    def test_a_fork_server_that_cannot_load_is_reported_in_one_sentence(self) -> None:
        problem = r"^cannot load no\.such:thing: ModuleNotFoundError: No module named"
        workers = LocalWorkers(1, "no.such:thing")
        with BackgroundLoop() as loop, pytest.raises(WorkersError, match=problem):
            loop.run(workers.__aenter__())
        assert workers.fault.startswith("cannot load no.such:thing")

    def test_while_no_process_can_be_had_there_is_room_for_nothing(self) -> None:
        clock = HeldLoop()

        def becomes(capacity: int) -> bool:
            # A fork server that fails is started again after pauses.
            clock.advance(0.2)
            return workers.capacity == capacity

        with BackgroundLoop(clock) as loop:
            workers = LocalWorkers(1, TASK_FUNCTION)
            loop.run(workers.__aenter__())
            running = Running(loop, workers)
            try:
                assert workers.capacity == 1
                workers._pool._task_function = "no.such:thing"
                os.kill(parent_of(next(iter(workers.pids))), signal.SIGKILL)
                assert eventually(lambda: becomes(0))
                with pytest.raises(WorkersError, match="cannot load"):
                    running.run("echo")
                workers._pool._task_function = TASK_FUNCTION
                assert eventually(lambda: becomes(1))
                assert said(running.run("echo again")) == "again"
            finally:
                loop.run(workers.__aexit__())

    def test_ended_workers_take_no_task(self) -> None:
        with BackgroundLoop() as loop:
            workers = LocalWorkers(1, TASK_FUNCTION)
            loop.run(workers.__aenter__())
            running = Running(loop, workers)
            future, pid = running.begun("stuck")
            fork_server = parent_of(pid)
            loop.run(workers.__aexit__())
            assert eventually(lambda: has_ended(pid) and has_ended(fork_server))
            with pytest.raises(WorkersError, match="workers are shut down"):
                future.result(60)
            with pytest.raises(WorkersError, match="workers are shut down"):
                running.run("echo")


class TestNothingIsLeft:
    def test_nothing_outlives_a_server_that_is_killed(self, tmp_path: Path) -> None:
        program = tmp_path / "program.py"
        program.write_text(
            "import asyncio\n"
            "from robosc_server.tasks.task import TaskLimits\n"
            "from robosc_server.workers.local import LocalWorkers\n"
            "from support.fake_tasks import TASK_FUNCTION, fake_task\n"
            "async def note(report):\n"
            "    print(report.message, flush=True)\n"
            "async def main():\n"
            "    async with LocalWorkers(2, TASK_FUNCTION) as workers:\n"
            "        tasks = map(fake_task, ('pid\\nstuck', 'pid\\nstop'))\n"
            "        await asyncio.gather(*(workers.run(task, TaskLimits(), note) for task in tasks))\n"
            "asyncio.run(main())\n"
        )
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
        with subprocess.Popen([sys.executable, program], stdout=subprocess.PIPE, text=True, env=environment) as server:
            assert server.stdout is not None
            pids = [int(server.stdout.readline()) for _ in range(2)]
            fork_server = parent_of(pids[0])
            children = Path(f"/proc/{fork_server}/task/{fork_server}/children")
            pids += [fork_server, *map(int, children.read_text().split())]
            server.kill()
        assert len(set(pids)) >= 3
        assert eventually(lambda: all(map(has_ended, pids)))

    def test_nothing_is_left_after_many_tasks(self, running: Running) -> None:
        def is_at_rest() -> bool:
            # Also of the last one, whose descriptors are closed when it is gone: only then those that wait are counted.
            return not running.local._pool._terminations and len(running.local.pids) == 2

        running.run("echo")
        assert eventually(is_at_rest)
        before = open_descriptors()
        for text in ("echo", "exit 1", "die 11", "garbage", "raise") * 4:
            running.run(text)
        assert eventually(is_at_rest)
        # Leftovers of earlier tests may have been closed meanwhile.
        assert eventually(lambda: open_descriptors() <= before)

    async def test_workers_end_also_where_a_burial_ends_that_very_moment(self) -> None:
        pool = WorkerPool(TASK_FUNCTION, 1, must_be_confined=False)
        termination = pool._begin(asyncio.sleep(0))
        while not termination.done():
            await asyncio.sleep(0)
        # It is done, and what follows from that is at its turn only when this here waits.
        assert pool._terminations == {termination}
        await pool.__aexit__()
        assert not pool._terminations
