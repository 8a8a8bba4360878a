import subprocess
import threading
import time
from functools import partial
from typing import Any, cast

import grpc
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection_pb2, reflection_pb2_grpc

from robosc_api.v1 import synthesis_pb2 as pb
from robosc_api.v1 import synthesis_pb2_grpc
from robosc_server import pool as pool_module
from robosc_server.main import AddressError, main
from robosc_server.pool import StartError
from robosc_server.settings import Settings
from support.service import FAKE_WORKER, PATIENCE_S, eventually, is_running, served

STUB: Any = synthesis_pb2_grpc.SynthesisServiceStub


def bundle(text: str = "", name: str = "robot.rscd", libraries: Any = ()) -> Any:
    files = [pb.SourceFile(name=other, text="") for other in libraries]
    return pb.Bundle(main=pb.SourceFile(name=name, text=text), libraries=files)


@pytest.fixture(scope="module")
def fake() -> Any:
    """A server with two workers that do what the model's text says."""
    with (
        served(Settings(port=0, workers=2, max_bundle_bytes=1000), FAKE_WORKER) as address,
        grpc.insecure_channel(address) as channel,
    ):
        yield channel


def has_ended(pid: int) -> bool:
    return not is_running(pid)


def refusal(call: Any, streams: Any = False) -> Any:
    """Code and details of a call that must fail."""
    with pytest.raises(grpc.RpcError) as caught:
        for _ in call() if streams else [call()]:
            pass
    assert "Traceback" not in str(caught.value.details())
    return caught.value.code(), caught.value.details()


def health(channel: Any, service: Any = "") -> Any:
    request = health_pb2.HealthCheckRequest(service=service)
    return health_pb2_grpc.HealthStub(channel).Check(request, timeout=PATIENCE_S).status


class TestStandardServices:
    @pytest.mark.parametrize("name", ["", "robosc_api.v1.SynthesisService"])
    def test_health(self, fake: Any, name: str) -> None:
        assert health(fake, name) == health_pb2.HealthCheckResponse.SERVING

    def test_reflection_lists_the_services_and_their_file(self, fake: Any) -> None:
        stub = reflection_pb2_grpc.ServerReflectionStub(fake)
        requests = [
            reflection_pb2.ServerReflectionRequest(list_services=""),
            reflection_pb2.ServerReflectionRequest(file_containing_symbol="robosc_api.v1.SynthesisService"),
        ]
        listing, file = stub.ServerReflectionInfo(iter(requests), timeout=PATIENCE_S)
        names = {service.name for service in listing.list_services_response.service}
        assert names == {
            "robosc_api.v1.SynthesisService",
            "grpc.health.v1.Health",
            "grpc.reflection.v1alpha.ServerReflection",
        }
        assert b"robosc_api/v1/synthesis.proto" in file.file_descriptor_response.file_descriptor_proto[0]


class TestMalformedRequests:
    @pytest.mark.parametrize(
        ("request_bundle", "words"),
        [
            (None, "no main file"),
            (pb.Bundle(libraries=[pb.SourceFile(name="a.rscd")]), "no main file"),
            (bundle(name=""), "no name"),
            (bundle(name="/etc/passwd"), "relative"),
            (bundle(name="C:\\robot.rscd"), "relative"),
            (bundle(name="C:robot.rscd"), "relative"),
            (bundle(name="\\\\host\\robot.rscd"), "relative"),
            (bundle(name="a\0b"), "NUL"),
            (bundle(name="a\x1b[31mb"), "printed"),
            (bundle(libraries=["/x.rscd"]), "relative"),
            (bundle(libraries=["robot.rscd"]), "two files"),
            (bundle(libraries=["a.rscd", "b.rscd", "a.rscd"]), "two files"),
        ],
    )
    def test_bundle(self, fake: Any, request_bundle: Any, words: str) -> None:
        stub = STUB(fake)
        for call, streams in (
            (lambda: stub.Check(pb.CheckRequest(bundle=request_bundle)), False),
            (lambda: stub.Synthesize(pb.SynthesizeRequest(bundle=request_bundle)), True),
            (lambda: stub.Generate(pb.GenerateRequest(bundle=request_bundle, target="python")), False),
        ):
            code, details = refusal(call, streams)
            assert code is grpc.StatusCode.INVALID_ARGUMENT
            assert words in details

    def test_unknown_deployment(self, fake: Any) -> None:
        request = pb.SynthesizeRequest(bundle=bundle(), options=pb.SynthesisOptions(deployment=cast("Any", 9)))
        code, details = refusal(lambda: STUB(fake).Synthesize(request), streams=True)
        assert code is grpc.StatusCode.INVALID_ARGUMENT
        assert "deployment" in details

    def test_no_target(self, fake: Any) -> None:
        code, details = refusal(lambda: STUB(fake).Generate(pb.GenerateRequest(bundle=bundle())))
        assert code is grpc.StatusCode.INVALID_ARGUMENT
        assert "target" in details

    def test_what_the_work_refuses(self, fake: Any) -> None:
        code, details = refusal(lambda: STUB(fake).Check(pb.CheckRequest(bundle=bundle("refuse"))))
        assert (code, details) == (grpc.StatusCode.INVALID_ARGUMENT, "there is no such thing")

    @pytest.mark.parametrize("size", [991, 2**22])
    def test_bundle_too_large(self, fake: Any, size: Any) -> None:
        code, _ = refusal(lambda: STUB(fake).Check(pb.CheckRequest(bundle=bundle("x" * size))))
        assert code is grpc.StatusCode.RESOURCE_EXHAUSTED

    def test_bundle_just_small_enough(self, fake: Any) -> None:
        assert not STUB(fake).Check(pb.CheckRequest(bundle=bundle("x" * 990)), timeout=PATIENCE_S).diagnostics


class TestWork:
    def test_reports_come_in_order_and_one_result_ends_them(self, fake: Any) -> None:
        request = pb.SynthesizeRequest(bundle=bundle("reports"))
        responses = list(STUB(fake).Synthesize(request, timeout=PATIENCE_S))
        assert [response.progress.message for response in responses[:-1]] == [f"step {number}" for number in range(100)]
        result = responses[-1].result
        assert (result.status, result.reason) == (pb.SYNTHESIS_STATUS_EMPTY, "because")

    def test_what_a_library_prints_does_not_disturb(self, fake: Any) -> None:
        assert not STUB(fake).Check(pb.CheckRequest(bundle=bundle("noise")), timeout=PATIENCE_S).diagnostics

    @pytest.mark.parametrize("text", ["fault", "die", "mismatch"])
    def test_a_fault_is_told_by_an_id_alone_and_the_server_lives_on(
        self, fake: Any, text: str, caplog: pytest.LogCaptureFixture
    ) -> None:
        code, details = refusal(lambda: STUB(fake).Check(pb.CheckRequest(bundle=bundle(text))))
        assert code is grpc.StatusCode.INTERNAL
        identity = details.split()[2].rstrip(",")
        assert len(identity) == 8
        assert any(identity in record.getMessage() for record in caplog.records)
        assert "work" not in details
        assert not STUB(fake).Check(pb.CheckRequest(bundle=bundle()), timeout=PATIENCE_S).diagnostics

    def test_health_answers_while_every_worker_is_busy(self, fake: Any) -> None:
        calls, _ = zip(*(start_stuck(fake) for _ in range(2)), strict=True)
        assert health(fake) == health_pb2.HealthCheckResponse.SERVING
        for call in calls:
            call.cancel()

    def test_two_requests_at_once(self, fake: Any) -> None:
        call, pid = start_stuck(fake)
        # The second worker answers while the first is stuck.
        assert not STUB(fake).Check(pb.CheckRequest(bundle=bundle()), timeout=PATIENCE_S).diagnostics
        assert is_running(pid)
        call.cancel()


def start_stuck(channel: Any, timeout: Any = None) -> Any:
    """A synthesis that has begun and never ends, and its worker's process."""
    call = STUB(channel).Synthesize(pb.SynthesizeRequest(bundle=bundle("stuck")), timeout=timeout)
    return call, int(next(call).progress.message)


class TestStopping:
    def test_cancelling_kills_the_worker_and_frees_its_place(self) -> None:
        with (
            served(Settings(port=0, workers=1), FAKE_WORKER) as address,
            grpc.insecure_channel(address) as channel,
        ):
            for _ in range(3):
                call, pid = start_stuck(channel)
                assert is_running(pid)
                begun = time.monotonic()
                call.cancel()
                assert eventually(partial(has_ended, pid))
                print(f"worker gone {1000 * (time.monotonic() - begun):.1f} ms after the cancel")
            assert not STUB(channel).Check(pb.CheckRequest(bundle=bundle()), timeout=PATIENCE_S).diagnostics

    def test_the_callers_deadline_kills_the_worker(self, fake: Any) -> None:
        call, pid = start_stuck(fake, timeout=2.0)
        with pytest.raises(grpc.RpcError) as caught:
            next(call)
        assert caught.value.code() is grpc.StatusCode.DEADLINE_EXCEEDED
        assert eventually(lambda: not is_running(pid))

    def test_the_servers_own_limit(self) -> None:
        settings = Settings(port=0, workers=1, max_synthesis_seconds=1.5)
        with served(settings, FAKE_WORKER) as address, grpc.insecure_channel(address) as channel:
            code, details = refusal(lambda: STUB(channel).Check(pb.CheckRequest(bundle=bundle("stuck"))))
            assert code is grpc.StatusCode.DEADLINE_EXCEEDED
            assert "1.5 seconds" in details

    def test_a_caller_that_waits_for_a_worker_can_leave(self) -> None:
        with (
            served(Settings(port=0, workers=1), FAKE_WORKER) as address,
            grpc.insecure_channel(address) as channel,
        ):
            stuck, _ = start_stuck(channel)
            with pytest.raises(grpc.RpcError) as caught:
                STUB(channel).Check(pb.CheckRequest(bundle=bundle()), timeout=0.2)
            assert caught.value.code() is grpc.StatusCode.DEADLINE_EXCEEDED
            stuck.cancel()
            assert not STUB(channel).Check(pb.CheckRequest(bundle=bundle()), timeout=PATIENCE_S).diagnostics

    def test_too_many_that_wait_are_refused(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(pool_module, "WAITING_LIMIT", 0)
        with (
            served(Settings(port=0, workers=1), FAKE_WORKER) as address,
            grpc.insecure_channel(address) as channel,
        ):
            call, _ = start_stuck(channel)
            code, details = refusal(lambda: STUB(channel).Check(pb.CheckRequest(bundle=bundle())))
            assert code is grpc.StatusCode.RESOURCE_EXHAUSTED
            assert "later" in details
            call.cancel()

    def test_stopping_the_server_leaves_no_process(self) -> None:
        pids = []
        with (
            served(Settings(port=0, workers=2), FAKE_WORKER) as address,
            grpc.insecure_channel(address) as channel,
        ):
            call, pid = start_stuck(channel)
            pids.append(pid)
            call.cancel()
            pids.append(start_stuck(channel)[1])
        assert not any(is_running(pid) for pid in pids)


class TestAddress:
    def test_port_in_use(self) -> None:
        with served(Settings(port=0, workers=1), FAKE_WORKER) as address:
            port = int(address.rsplit(":", 1)[1])
            with pytest.raises(AddressError, match=str(port)), served(Settings(port=port), FAKE_WORKER):
                pass
            outcome = subprocess.run(
                [*FAKE_WORKER[:1], "-m", "robosc_server.main", "--port", str(port)],
                capture_output=True,
                text=True,
                timeout=PATIENCE_S,
                check=False,
            )
        assert outcome.returncode == 1
        assert outcome.stdout == ""
        assert outcome.stderr.count("\n") == 1
        assert "in use" in outcome.stderr

    @pytest.mark.parametrize(
        "arguments",
        [
            ["--port", "65536"],
            ["--port", "x"],
            ["--workers", "0"],
            ["--max-bundle-bytes", "-1"],
            ["--max-synthesis-seconds", "nan"],
            ["--nonsense"],
        ],
    )
    def test_wrong_use(self, arguments: Any, capsys: pytest.CaptureFixture[str]) -> None:
        with pytest.raises(SystemExit) as left:
            main(arguments)
        assert left.value.code == 2
        assert "usage:" in capsys.readouterr().err

    def test_no_workers(self) -> None:
        with (
            pytest.raises(StartError, match="no-such-program"),
            served(Settings(port=0, workers=1), ["/no-such-program"]),
        ):
            pass

    def test_no_thread_is_left(self) -> None:
        with served(Settings(port=0, workers=1), FAKE_WORKER):
            pass
        assert not [thread for thread in threading.enumerate() if thread.name.startswith("asyncio")]
