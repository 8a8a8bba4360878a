"""Keys that make a submission that is sent again one job, through a whole server."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import grpc
import pytest

from robosc_api.security import Scope, make_token
from robosc_api.v1 import jobs_pb2, jobs_pb2_grpc
from robosc_server.tasks.task import TaskKind
from support.job_workers import StartedWorkers
from support.refusals import reason_of
from support.requests import small_request
from support.service import served
from support.waiting import PATIENCE_S


def test_a_key_that_is_sent_again_is_one_job_and_not_for_another_task(tmp_path: Path) -> None:
    made = [make_token(name, (Scope.SYNTHESIZE,)) for name in ("one", "other")]
    tokens = tmp_path / "tokens"
    tokens.write_text("".join(line + "\n" for _, line in made))
    tokens.chmod(0o600)
    one, other = ((("authorization", f"Bearer {token}"),) for token, _ in made)

    with served(given_workers=StartedWorkers(), tokens=tokens) as address, grpc.insecure_channel(address) as channel:
        jobs: Any = jobs_pb2_grpc.JobServiceStub(channel)  # type: ignore[no-untyped-call]

        def submit(number: int, metadata: Any = one) -> Any:
            task = jobs_pb2.Task(check=small_request(TaskKind.CHECK, f"robot R{number} {{ }}"))
            request = jobs_pb2.SubmitJobRequest(task=task, idempotency_key="key")
            return jobs.SubmitJob(request, timeout=PATIENCE_S, metadata=metadata)

        with ThreadPoolExecutor(8) as threads:
            answers = list(threads.map(lambda _: submit(1), range(16)))
        assert len({answer.job.id for answer in answers}) == 1
        assert [answer.existed for answer in answers].count(False) == 1
        with pytest.raises(grpc.RpcError) as refused:
            submit(2)
        assert (refused.value.code(), reason_of(refused.value)) == (
            grpc.StatusCode.ALREADY_EXISTS,
            "IDEMPOTENCY_KEY_REUSED",
        )
        # Keys are each caller's own.
        assert not submit(2, other).existed
