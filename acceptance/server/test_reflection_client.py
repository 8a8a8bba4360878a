"""Calls by a user who was given an address and nothing else, as with grpcurl."""

import base64
import hashlib
import json
import time
from collections.abc import Iterator

import grpc
import pytest

from robosc.cli.main import main as robosc
from support.models import EXAMPLES
from support.reflection import PATIENCE_S, ReflectionClient
from support.service import server_process

MODEL = EXAMPLES / "line_follower" / "line_follower.rscd"
SYNTHESIS, JOBS = "robosc_api.v1.SynthesisService", "robosc_api.v1.JobService"


@pytest.fixture(scope="module")
def client() -> Iterator[ReflectionClient]:
    with server_process() as (_, address), grpc.insecure_channel(address) as channel:
        yield ReflectionClient(channel)


def of_model(**fields: object) -> str:
    """A request with the model as its bundle."""
    return json.dumps({"bundle": {"main": {"name": MODEL.name, "text": MODEL.read_text()}}, **fields})


def test_the_services_are_listed_with_their_methods(client: ReflectionClient) -> None:
    services = client.services()
    assert {SYNTHESIS, JOBS, "grpc.health.v1.Health"} <= services.keys()
    assert "Synthesize" in services[SYNTHESIS]
    assert "WatchJob" in services[JOBS]


def test_whether_the_server_is_well(client: ReflectionClient) -> None:
    for service in ("", SYNTHESIS, JOBS):
        (answer,) = client.call("grpc.health.v1.Health", "Check", json.dumps({"service": service}))
        assert answer == {"status": "SERVING"}


def test_a_supervisor_as_on_the_command_line(
    client: ReflectionClient, tmp_path_factory: pytest.TempPathFactory, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path_factory.mktemp("out") / "out.rsup"
    assert robosc(["synth", str(MODEL), "-o", str(file)]) == 0
    *reports, last = client.call(SYNTHESIS, "Synthesize", of_model(options={"deployment": "DEPLOYMENT_CONTROLLER"}))
    # Their number depends on the time of the synthesis.
    assert all(report["progress"]["stage"] for report in reports)
    result = last["result"]
    assert result["status"] == "SYNTHESIS_STATUS_SUPERVISOR"
    supervisor = base64.b64decode(result["supervisor"])
    assert supervisor == file.read_bytes()
    assert base64.b64decode(result["supervisor_digest"]) == hashlib.sha256(supervisor).digest()


def test_findings(client: ReflectionClient) -> None:
    request = {"bundle": {"main": {"name": "robot.rscd", "text": "robot R {"}}}
    (answer,) = client.call(SYNTHESIS, "Check", json.dumps(request))
    (finding,) = answer["diagnostics"]
    assert (finding["severity"], finding["code"]) == ("SEVERITY_ERROR", "syntax-error")
    assert finding["location"] == {"file": "robot.rscd", "line": 1, "column": 10, "length": 1}


def test_a_job_that_goes_on_without_its_caller(client: ReflectionClient) -> None:
    task = {"verify": json.loads(of_model(properties=["reachable true"]))}
    (submitted,) = client.call(JOBS, "SubmitJob", json.dumps({"task": task, "label": "mine"}))
    job = submitted["job"]
    assert (job["kind"], job["label"]) == ("TASK_KIND_VERIFY", "mine")
    end_s = time.monotonic() + PATIENCE_S
    while job["state"] in ("JOB_STATE_QUEUED", "JOB_STATE_RUNNING") and time.monotonic() < end_s:
        watched = {"id": job["id"], "after_revision": job["revision"]}
        job = list(client.call(JOBS, "WatchJob", json.dumps(watched)))[-1]["job"]
    assert job["state"] == "JOB_STATE_SUCCEEDED"
    (answer,) = client.call(JOBS, "GetJobResult", json.dumps({"id": job["id"]}))
    assert answer["verify"]["result"]["status"] == "VERIFICATION_STATUS_PASSED"


def test_a_refusal(client: ReflectionClient) -> None:
    with pytest.raises(grpc.RpcError) as caught:
        list(client.call(SYNTHESIS, "Check", "{}"))
    call: grpc.Call = caught.value  # type: ignore[assignment]
    assert (call.code(), call.details()) == (grpc.StatusCode.INVALID_ARGUMENT, "the bundle has no main file")
