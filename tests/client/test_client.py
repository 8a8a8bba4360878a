import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import grpc
import pytest

import robosc_client
from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.language import load_bundle
from robosc.model import check
from robosc.model.structure import Deployment
from robosc.source import Bundle, Location, SourceFile
from robosc.synthesis import Statistics
from robosc.targets import GenerateOptions, SupervisedController
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client import (
    Client,
    ClientError,
    DeadlineError,
    RequestRefusedError,
    ServerUnavailableError,
    ServiceError,
    SynthesisStatus,
)
from robosc_client import convert as client_convert
from robosc_server import convert as server_convert
from robosc_server.settings import Settings
from robosc_server.work import CheckOutcome, Figures, GenerateOutcome, SynthesizeOutcome
from support.service import FAKE_WORKER, PATIENCE_S, Scripted, bundle_of, eventually, is_running, scripted, served

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*/*.rscd"))
NOWHERE = "127.0.0.1:1"


@pytest.fixture(scope="module")
def fake() -> Any:
    """A client of a server whose work does what the model's text says."""
    with served(Settings(port=0, workers=2, max_bundle_bytes=1000), FAKE_WORKER) as address, Client(address) as client:
        yield client


def result(**fields: Any) -> Any:
    return [pb.SynthesizeResponse(result=pb.SynthesisResult(**fields))]


def test_public_names() -> None:
    assert set(robosc_client.__all__) == {
        "Client",
        "ClientError",
        "CredentialsError",
        "DeadlineError",
        "Generation",
        "Progress",
        "RequestRefusedError",
        "ServerUnavailableError",
        "ServiceError",
        "Statistics",
        "Summary",
        "Synthesis",
        "SynthesisStatus",
    }
    assert all(hasattr(robosc_client, name) for name in robosc_client.__all__)


class TestErrors:
    def test_kin(self) -> None:
        assert issubclass(ServerUnavailableError, ConnectionError)
        assert issubclass(DeadlineError, TimeoutError)
        for error in (ServerUnavailableError, DeadlineError, RequestRefusedError, ServiceError):
            assert issubclass(error, ClientError)

    @pytest.mark.parametrize(
        "call",
        [
            lambda client: client.check(bundle_of("")),
            lambda client: client.synthesize(bundle_of("")),
            lambda client: client.generate(bundle_of(""), target="python"),
        ],
    )
    def test_nobody_there(self, call: Any) -> None:
        with Client(NOWHERE) as client, pytest.raises(ServerUnavailableError, match=NOWHERE):
            call(client)

    def test_deadline(self, fake: Any) -> None:
        pids = []
        with pytest.raises(DeadlineError, match=r"within 1\.5 seconds"):
            fake.synthesize(
                bundle_of("stuck"), deadline_s=1.5, on_progress=lambda progress: pids.append(int(progress.message))
            )
        assert len(pids) == 1
        assert eventually(lambda: not is_running(pids[0]))

    def test_the_servers_own_limit(self) -> None:
        settings = Settings(port=0, workers=1, max_synthesis_seconds=1.0)
        with (
            served(settings, FAKE_WORKER) as address,
            Client(address) as client,
            pytest.raises(DeadlineError, match="works at most 1 seconds"),
        ):
            client.check(bundle_of("stuck"), deadline_s=PATIENCE_S)

    def test_refused(self, fake: Any) -> None:
        with pytest.raises(RequestRefusedError, match="there is no such thing"):
            fake.check(bundle_of("refuse"))
        with pytest.raises(RequestRefusedError, match="1011 bytes"):
            fake.check(bundle_of("x" * 1001))
        with pytest.raises(RequestRefusedError, match="Unicode"):
            fake.check(bundle_of("", "robot\udcff.rscd"))

    def test_server_fault(self, fake: Any) -> None:
        with pytest.raises(ServiceError, match=r"internal error [0-9a-f]{8}") as caught:
            fake.check(bundle_of("fault"))
        assert "Traceback" not in str(caught.value)

    def test_a_stranger_answers(self) -> None:
        with ThreadPoolExecutor(1) as threads:
            server = grpc.server(threads)
            port = server.add_insecure_port("127.0.0.1:0")
            server.start()
            with Client(f"127.0.0.1:{port}") as client, pytest.raises(ServiceError, match="no RoboSC server"):
                client.check(bundle_of(""))
            server.stop(None).wait()


class TestProgress:
    def test_every_report_in_order(self, fake: Any) -> None:
        messages = []
        synthesis = fake.synthesize(bundle_of("reports"), on_progress=lambda item: messages.append(item.message))
        assert messages == [f"step {number}" for number in range(100)]
        assert (synthesis.status, synthesis.reason) == (SynthesisStatus.EMPTY, "because")

    def test_an_exception_of_the_caller_ends_the_work(self, fake: Any) -> None:
        pids = []

        class StopNowError(Exception):
            pass

        def stop(progress: Any) -> None:
            pids.append(int(progress.message))
            raise StopNowError

        begun = time.monotonic()
        with pytest.raises(StopNowError) as caught:
            fake.synthesize(bundle_of("stuck"), on_progress=stop)
        # The call itself is still referred to by the exception, so it is not its destruction that ends it.
        assert eventually(lambda: not is_running(pids[0]))
        assert caught.tb
        print(f"work ended after {time.monotonic() - begun:.3f} s")

    def test_two_threads_share_a_client(self, fake: Any) -> None:
        results = []
        threads = [
            threading.Thread(target=lambda: results.append(fake.synthesize(bundle_of("reports")).status))
            for _ in range(4)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(PATIENCE_S)
        assert results == [SynthesisStatus.EMPTY] * 4


class TestHostileServers:
    @pytest.mark.parametrize(
        "answers",
        [
            [],
            [pb.SynthesizeResponse()],
            result(),
            result(status=17),
            result(status=pb.SYNTHESIS_STATUS_SUPERVISOR),
            result(status=pb.SYNTHESIS_STATUS_EMPTY, supervisor=b"x"),
            result(status=pb.SYNTHESIS_STATUS_EMPTY, diagnostics=[pb.Diagnostic()]),
            result(status=pb.SYNTHESIS_STATUS_EMPTY, explanation="{"),
            result(status=pb.SYNTHESIS_STATUS_EMPTY, explanation='{"blamed": []}'),
            result(status=pb.SYNTHESIS_STATUS_EMPTY, explanation="[" * 100_000),
            result(status=pb.SYNTHESIS_STATUS_SUPERVISOR, supervisor=b"x", summary=pb.Summary(states="many")),
        ],
    )
    def test_synthesis(self, answers: Any) -> None:
        with scripted(Scripted(synthesize=answers)) as address, Client(address) as client, pytest.raises(ServiceError):
            client.synthesize(bundle_of(""))

    @pytest.mark.parametrize("path", ["/etc/passwd", "../x", "a/../../x", "", "a\0b", "a//b", "C:\\x"])
    def test_paths_of_generated_files(self, path: Any) -> None:
        response = pb.GenerateResponse(
            status=pb.SYNTHESIS_STATUS_SUPERVISOR, files=[pb.GeneratedFile(path=path, content="x")]
        )
        with (
            scripted(Scripted(generate=response)) as address,
            Client(address) as client,
            pytest.raises(ServiceError, match="malformed"),
        ):
            client.generate(bundle_of(""), target="python")

    def test_severity(self) -> None:
        response = pb.CheckResponse(diagnostics=[pb.Diagnostic()])
        with (
            scripted(Scripted(check=response)) as address,
            Client(address) as client,
            pytest.raises(ServiceError, match="severity"),
        ):
            client.check(bundle_of(""))


PLACE = Location("robot.rscd", 3, 7, 4)
FINDINGS = (
    Diagnostic(Severity.ERROR, "no-file", "there is no file", None, "Write it."),
    Diagnostic(
        Severity.WARNING, "odd", "this is odd: \u00e9\u4e16", PLACE, "Change it.", (RelatedPlace("first", PLACE),)
    ),
    Diagnostic(Severity.NOTE, "", "", Location("a", 1, 1), ""),
)


class TestConversion:
    """What one side packs the other unpacks to the same values."""

    def test_bundle(self) -> None:
        bundle = Bundle(
            SourceFile("robot.rscd", "robot \u00e9"), (SourceFile("../shared/a.rscd", ""),), ("here", "../shared")
        )
        request = client_convert.synthesize_request(bundle, Deployment.LAYER, "autoref")
        job = server_convert.synthesize_job(request, 1000)
        assert (job.bundle, job.deployment, job.engine) == (bundle, Deployment.LAYER, "autoref")
        assert not job.allow_livelock
        allowing = client_convert.synthesize_request(bundle, Deployment.LAYER, "autoref", allow_livelock=True)
        assert server_convert.synthesize_job(allowing, 1000).allow_livelock
        plain = (bundle, Deployment.CONTROLLER, "auto", "ros2", GenerateOptions())
        generate = client_convert.generate_request(*plain)
        assert server_convert.generate_job(generate, 1000).target == "ros2"
        assert server_convert.generate_job(generate, 1000).options == GenerateOptions()
        generate = client_convert.generate_request(*plain, allow_livelock=True)
        assert server_convert.generate_job(generate, 1000).synthesis.allow_livelock
        assert server_convert.check_job(client_convert.check_request(bundle), 1000).bundle == bundle

    @pytest.mark.parametrize(
        "options",
        [
            GenerateOptions("walker"),
            GenerateOptions(publish_state=True),
            GenerateOptions(log_events=True),
            GenerateOptions(supervised=SupervisedController("p", executable="x")),
            GenerateOptions(supervised=SupervisedController("p", launch_file="x.launch.py")),
        ],
    )
    def test_what_is_chosen_about_the_files(self, options: GenerateOptions) -> None:
        bundle = Bundle(SourceFile("robot.rscd", ""))
        request = client_convert.generate_request(bundle, Deployment.LAYER, "auto", "ros2", options)
        assert server_convert.generate_job(request, 1000).options == options

    def test_a_supervised_controller_with_a_path_is_refused(self) -> None:
        request = pb.GenerateRequest(target="ros2", bundle=pb.Bundle(main=pb.SourceFile(name="m")))
        request.options.deployment = pb.DEPLOYMENT_LAYER
        request.generation.supervised.package = "p"
        request.generation.supervised.executable = "/bin/sh"
        with pytest.raises(server_convert.RequestError, match="without a path"):
            server_convert.generate_job(request, 1000)

    def test_libraries_are_sorted_for_the_core(self) -> None:
        files = [pb.SourceFile(name=name) for name in ("b", "a")]
        request = pb.CheckRequest(bundle=pb.Bundle(main=pb.SourceFile(name="m"), libraries=files))
        assert [file.name for file in server_convert.check_job(request, 1000).bundle.libraries] == ["a", "b"]

    def test_no_options_are_the_defaults(self) -> None:
        request = pb.SynthesizeRequest(bundle=pb.Bundle(main=pb.SourceFile(name="m")))
        job = server_convert.synthesize_job(request, 1000)
        assert (job.deployment, job.engine) == (Deployment.CONTROLLER, "auto")

    def test_diagnostics(self) -> None:
        assert client_convert.check_diagnostics(server_convert.check_response(CheckOutcome(FINDINGS))) == FINDINGS

    def test_diagnostics_of_every_example(self) -> None:
        found = [check(load_bundle(model)).diagnostics for model in EXAMPLES]
        assert any(found)
        for diagnostics in found:
            assert (
                client_convert.check_diagnostics(server_convert.check_response(CheckOutcome(diagnostics)))
                == diagnostics
            )

    @pytest.mark.parametrize("status", list(SynthesisStatus))
    def test_synthesis(self, status: Any) -> None:
        is_made = status is SynthesisStatus.SUPERVISOR
        figures = Figures(2, 3, str(10**40), "", (("move.request", "true"),), "text\n") if is_made else None
        statistics = Statistics("autoref", 7, 3, 10**12, 5) if is_made else None
        outcome = SynthesizeOutcome(str(status), FINDINGS, "why", b"x" if is_made else b"", figures, statistics)
        there: Any = client_convert.progress_or_synthesis(server_convert.synthesize_response(outcome))
        assert (there.status, there.diagnostics, there.reason) == (status, FINDINGS, "why")
        assert there.supervisor == outcome.supervisor
        if figures:
            assert there.summary.states == 10**40
            assert there.summary.transitions is None
            assert there.summary.added == figures.added
            assert (there.summary.controllable_events, there.summary.uncontrollable_events) == (2, 3)
            assert there.summary.text == "text\n"
            assert there.statistics == robosc_client.Statistics("autoref", 7, 3, 10**12)
        else:
            assert there.summary is None
            assert there.statistics is None

    @pytest.mark.parametrize("status", list(SynthesisStatus))
    def test_generation(self, status: Any) -> None:
        files = (("a/b.py", "text", True), ("c", "", False)) if status is SynthesisStatus.SUPERVISOR else ()
        there: Any = client_convert.generation(
            server_convert.generate_response(GenerateOutcome(str(status), FINDINGS, "why", files))
        )
        assert (there.status, there.diagnostics, there.reason) == (status, FINDINGS, "why")
        if files:
            assert dict(there.files) == {"a/b.py": "text", "c": ""}
            assert there.files.executables == {"a/b.py"}
        else:
            assert there.files is None
