"""Workers on a Dask cluster, without one: how they are opened, what is reported of them, and answers on their way."""

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import hypothesis.strategies as st
import pytest
from hypothesis import given

from robosc import __version__
from robosc_server.tasks.exceeded import result_too_large
from robosc_server.tasks.task import Failure, Outcome, Reason, Result, TaskLimits
from robosc_server.workers import WorkersError, dask_task
from robosc_server.workers.dask_cluster import DaskWorkers
from robosc_server.workers.dask_cpu_time import CpuTimeAccount
from robosc_server.workers.dask_task import answer, outcome_of
from robosc_server.workers.factory import open_workers
from robosc_server.workers.frames import FrameError
from robosc_server.workers.local import LocalWorkers
from support.fake_tasks import TASK_FUNCTION

LIMITS = TaskLimits(seconds=60, cpu_seconds=20, memory_bytes=512 * 2**20, result_bytes=10**6)


def test_a_missing_package_is_reported_in_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(WorkersError, match=r"^workers on a Dask cluster need .*: pip install 'robosc\[dask\]'$"):
        open_workers("dask://localhost:8786", 1)


def test_a_package_that_cannot_be_loaded_is_reported_in_one_sentence(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The module cannot be loaded, like where /proc has processes alone."""
    (tmp_path / "distributed.py").write_text("open('/proc/none/meminfo')\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "distributed")
    with pytest.raises(WorkersError, match=r"^workers on a Dask .* cannot be loaded here: .*/proc/none/meminfo'$"):
        open_workers("dask://localhost:8786", 1)


def test_nobody_loads_dask_who_does_not_ask_for_it() -> None:
    program = "import sys, robosc_server.workers.factory; print({'distributed', 'dask', 'grpc'} & sys.modules.keys())"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "set()"


def test_workers_are_opened_by_what_the_operator_writes() -> None:
    assert isinstance(open_workers("local", 3), LocalWorkers)
    assert open_workers("local", 3).capacity == 3
    for spec in ("dask://cluster.example:8786", "dask://[::1]:8786"):
        assert isinstance(open_workers(spec, 1), DaskWorkers)
    with pytest.raises(WorkersError, match="workers on dask\\+tls:// need Dask's settings"):
        open_workers("dask+tls://10.0.0.1:1/", 1)
    for spec in ("", "Local", "dask://", "dask://host", "tcp://host:1", "dask://host:1/x", "dask://user@host:1"):
        with pytest.raises(ValueError, match="workers are 'local'"):
            open_workers(spec, 1)


def test_what_lost_workers_took_counts_by_the_clock() -> None:
    def begun(worker: str) -> dict[str, object]:
        return {"is": "begun", "task": "t", "worker": worker}

    def report(worker: str, cpu_s: object) -> dict[str, object]:
        return {"is": "spent", "task": "t", "worker": worker, "cpu_s": cpu_s}

    spent: list[float] = []
    now_s = 10.0
    account = CpuTimeAccount(spent.append, lambda: now_s)
    account.record_event({"is": "reports", "task": "t", "reports": []})
    account.record_event(begun("a"))
    # Another one begins: the first one was lost, and is not believed any more.
    now_s = 13.0
    account.record_event(begun("b"))
    account.record_event(report("a", 1.0))
    assert spent == [3.0]
    for nonsense in (-1.0, float("nan"), float("inf"), "7", None):
        account.record_event(report("b", nonsense))
    account.record_event(report("b", 0.25))
    account.record_event(report("b", 0.25))
    assert spent == [3.0, 0.25]
    # It is given up, and what the last worker has to report never comes.
    now_s = 20.0
    account.record_event(begun("c"))
    now_s = 21.5
    account.stop()
    now_s = 30.0
    account.close()
    account.close()
    assert spent == [3.0, 0.25, 1.5]


@given(st.lists(st.binary(max_size=50), min_size=1, max_size=5) | st.text())
def test_answers_travel_as_bytes(said: list[bytes] | str) -> None:
    outcome: Outcome = Failure(Reason.NODE_LIMIT, said, "") if isinstance(said, str) else Result(tuple(said))
    content = answer(outcome)
    assert isinstance(content, bytes)
    assert outcome_of(content, LIMITS) == outcome
    with pytest.raises(FrameError):
        outcome_of(content[:-1], LIMITS)


@given(st.binary(max_size=100))
def test_bytes_that_are_no_answer_are_one_kind_of_error(content: bytes) -> None:
    with suppress(FrameError):
        outcome = outcome_of(content, LIMITS)
        # A frame may announce more than a result may have, whatever comes then; or the bytes are an answer after all.
        assert outcome == result_too_large(LIMITS) or content.startswith(answer(outcome))


def test_a_fault_of_ours_on_the_cluster_is_an_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    class Worker:
        address = "tcp://192.0.2.1:1"

        def get_current_task(self) -> str:
            return "name"

        def log_event(self, topic: str, event: object) -> None:
            """Drop an event."""

    def broken(*arguments: object, **options: object) -> None:
        raise ValueError("on purpose")

    monkeypatch.setattr(dask_task, "get_worker", Worker)
    monkeypatch.setattr(dask_task, "run_isolated", broken)
    values = (1.0, 1.0, 2**30, 1000, 1000)
    content = dask_task.run_on_cluster(
        __version__, TASK_FUNCTION, False, "topic", "check", b"", ("0" * 64, "main"), values
    )
    assert content.startswith(dask_task.ANSWER)
    outcome = dask_task.outcome_of(content.removeprefix(dask_task.ANSWER), TaskLimits())
    assert isinstance(outcome, Failure)
    assert outcome.reason is Reason.INTERNAL_FAULT
    assert "ValueError: on purpose" in outcome.details
