"""Real models in processes of their own: small ones, and those that would take all the time or memory that there is."""

import time
from concurrent.futures import CancelledError

import pytest

from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.task import Reason, Result, TaskKind, TaskLimits
from support.background import cpu_ticks, is_running
from support.hostile_models import buttons, products
from support.real_tasks import RealRunning, reason_of, synthesis, task_of
from support.real_tasks import real as real
from support.requests import small_request
from support.waiting import eventually

KILLED_WITHIN_S = 0.2


def test_an_endless_model_reaches_its_limits_and_harms_no_other(real: RealRunning) -> None:
    endless = synthesis(products())
    by_clock = real.start(endless, TaskLimits(seconds=1.0, nodes=10**9))
    by_processor = real.start(endless, TaskLimits(cpu_seconds=1, nodes=10**9))
    check = task_of(small_request(TaskKind.CHECK, products()), TaskKind.CHECK)
    for _ in range(3):
        outcome = real.run(check)
        assert isinstance(outcome, Result)
        found = pb.CheckResponse.FromString(outcome.messages[0]).diagnostics
        assert [finding.code for finding in found] == ["may-leave-range"] * 2
    assert reason_of(by_clock.result(60)) is Reason.TIME_LIMIT
    assert reason_of(by_processor.result(60)) is Reason.CPU_LIMIT


def test_a_model_with_too_many_states_reaches_the_limit_of_memory(real: RealRunning) -> None:
    request = small_request(TaskKind.EXPLORE, buttons(20))
    request.maximum_states = 10**9
    # The least that a task can be given.
    failure = real.run(task_of(request, TaskKind.EXPLORE), TaskLimits(memory_bytes=1))
    assert reason_of(failure) is Reason.MEMORY_LIMIT


@pytest.mark.real_time
def test_an_endless_model_is_gone_in_time_when_it_is_cancelled(real: RealRunning) -> None:
    future = real.start(synthesis(products()))
    busy: list[int] = []

    def is_busy() -> bool:
        busy[:] = [pid for pid in real.local.pids if cpu_ticks(pid) > 30]
        return len(busy) == 1

    assert eventually(is_busy)
    begin = time.monotonic()
    future.cancel()
    assert eventually(lambda: not is_running(busy[0]))
    assert time.monotonic() - begin < KILLED_WITHIN_S
    with pytest.raises(CancelledError):
        future.result(60)
