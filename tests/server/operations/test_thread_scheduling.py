import os
import threading
from pathlib import Path

import pytest

from robosc_server.operations.thread_scheduling import batched_threads
from support.service import server_process


def policy_of_new_thread() -> int:
    policies: list[int] = []
    thread = threading.Thread(target=lambda: policies.append(os.sched_getscheduler(0)))
    thread.start()
    thread.join()
    return policies[0]


def test_only_threads_that_begin_inside_wait_for_their_turn() -> None:
    with batched_threads():
        inside = policy_of_new_thread()
    assert (inside, policy_of_new_thread()) == (os.SCHED_BATCH, os.SCHED_OTHER)


def test_a_policy_that_was_chosen_for_the_server_remains() -> None:
    chosen: list[int] = []

    def serve() -> None:
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
        with batched_threads():
            pass
        chosen.append(os.sched_getscheduler(0))

    thread = threading.Thread(target=serve)
    thread.start()
    thread.join()
    assert chosen == [os.SCHED_BATCH]


def test_a_sandbox_without_the_system_call_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*arguments: object) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    with batched_threads():
        assert policy_of_new_thread() == os.SCHED_OTHER


def test_a_server_runs_its_handlers_with_the_usual_policy() -> None:
    with server_process() as (process, _):
        threads = [int(folder.name) for folder in Path(f"/proc/{process.pid}/task").iterdir()]
        assert os.SCHED_BATCH in map(os.sched_getscheduler, threads)
        assert os.sched_getscheduler(process.pid) == os.SCHED_OTHER
