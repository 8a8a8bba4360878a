"""Both clients against a server that answers what a test has written, over real gRPC."""

import asyncio
import inspect
import threading
from collections.abc import AsyncGenerator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import grpc
import pytest

import robosc_client
from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.source import Bundle, Location, SourceFile
from robosc_api.security import Credentials
from robosc_api.v1 import jobs_pb2
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client import (
    NO_RETRIES,
    AsyncClient,
    Check,
    Client,
    ClientError,
    CredentialsError,
    DeadlineError,
    Job,
    JobError,
    RequestRefusedError,
    ServerBusyError,
    ServerUnavailableError,
    ServiceError,
    SynthesisOptions,
    SynthesisStatus,
    Verify,
)
from support.answers import (
    enveloped,
    explanation,
    exploration,
    generation,
    job,
    load,
    progress,
    supervisor,
    synthesis,
    verification,
    watched,
)
from support.both_clients import AWAY, KINDS, QUICK, Talk, client_of
from support.certificates import Authority
from support.models import bundle_of
from support.scripted_service import Refusal, scripted
from support.waiting import PATIENCE_S, eventually

NOWHERE = "127.0.0.1:1"
BUNDLE = bundle_of("robot R { }")
BUSY = Refusal(grpc.StatusCode.RESOURCE_EXHAUSTED, "too much to do", "SERVER_BUSY", 2.0)


def test_public_names() -> None:
    assert sorted(robosc_client.__all__) == [
        "AsyncClient", "CallerLoad", "Check", "Client", "ClientError", "CredentialsError", "DeadlineError", "Explain",
        "Explained", "Exploration", "Explore", "Format", "Formatted", "Generate", "Generation", "GoalSummary", "Job",
        "JobError", "JobFailure", "JobState", "NO_RETRIES", "NotThereError", "Progress", "RequestRefusedError",
        "RetryPolicy", "ServerBusyError", "ServerInfo", "ServerLimits", "ServerUnavailableError",
        "ServiceError", "ServiceLoad", "StateGraph", "StateValues", "Statistics", "Strategy", "Submission",
        "Summary", "Synthesis", "SynthesisOptions", "SynthesisStatus", "Synthesize", "Task", "TaskKind", "TaskResult",
        "Verification", "VerificationStatus", "Verify",
    ]  # fmt: skip
    assert all(hasattr(robosc_client, name) for name in robosc_client.__all__)


def test_servers_behind_one_name_take_turns(connect: Any) -> None:
    answers = {"Check": [[pb.CheckResponse()]]}
    # The first calls may come before there are both connections.
    with (
        scripted(**answers) as (one, first),
        scripted(**answers) as (two, second),
        connect(f"ipv4:{one},{two}") as client,
    ):

        def have_both() -> bool:
            client.check(BUNDLE)
            return bool(first.of("Check") and second.of("Check"))

        assert eventually(have_both)
        before = len(first.of("Check")), len(second.of("Check"))
        for _ in range(10):
            client.check(BUNDLE)
        assert (len(first.of("Check")), len(second.of("Check"))) == (before[0] + 5, before[1] + 5)


def test_both_clients_have_the_same_methods() -> None:
    names = [{name for name in vars(kind) if not name.startswith("_")} for kind in (Client, AsyncClient)]
    assert names[0] == names[1]


_LOCAL = ("close", "simulate")
"""Methods that call no server."""


def test_methods_say_what_they_take_and_give() -> None:
    """Methods document themselves, although they are described elsewhere."""
    for kind in (Client, AsyncClient):
        for name in (name for name in vars(kind) if not name.startswith("_") and name not in _LOCAL):
            method = getattr(kind, name)
            assert (method.__name__, method.__qualname__) == (name, f"{kind.__name__}.{name}")
            assert method.__doc__[0].isupper()
            signature = inspect.signature(method)
            assert next(iter(signature.parameters)) == "self"
            assert "deadline_s" in signature.parameters
            assert signature.return_annotation is not inspect.Signature.empty
    assert str(inspect.signature(Client.get_job)) == (
        "(self, /, job_id: str, *, deadline_s: float | None = None) -> robosc_client.jobs.Job"
    )
    assert inspect.signature(Client.wait) == inspect.signature(AsyncClient.wait)
    assert inspect.iscoroutinefunction(AsyncClient.get_job)
    assert inspect.signature(AsyncClient.watch).return_annotation == AsyncGenerator[Job]


TASKS: dict[str, Any] = {
    "Check": (lambda client: client.check(BUNDLE), [pb.CheckResponse()]),
    "Synthesize": (lambda client: client.synthesize(BUNDLE), [progress(), synthesis()]),
    "Generate": (lambda client: client.generate(BUNDLE, "ros2"), generation()),
    "Explore": (lambda client: client.explore(BUNDLE), exploration()),
    "Verify": (lambda client: client.verify(Verify(model=BUNDLE, properties=("AG a",))), [verification()]),
    "Explain": (lambda client: client.explain(BUNDLE), [progress(), explanation()]),
    "Format": (lambda client: client.format(BUNDLE.main), [pb.FormatResponse(text="robot R {\n}\n")]),
    "ListTargets": (lambda client: client.list_targets(), [pb.ListTargetsResponse()]),
    "GetVersion": (lambda client: client.get_version(), [pb.GetVersionResponse(version="1")]),
    "SubmitJob": (lambda client: client.submit(Check(BUNDLE)), [jobs_pb2.SubmitJobResponse(job=job())]),
    "GetJob": (lambda client: client.get_job("job-1"), [jobs_pb2.GetJobResponse(job=job())]),
    "CancelJob": (lambda client: client.cancel_job("job-1"), [jobs_pb2.CancelJobResponse(job=job())]),
    "ListJobs": (lambda client: list(client.list_jobs()), [jobs_pb2.ListJobsResponse()]),
    "GetLoad": (lambda client: client.get_load(), [load()]),
    "GetJobResult": (lambda client: client.job_result("job-1"), enveloped("synthesize", [synthesis()])),
    "WatchJob": (lambda client: list(client.watch("job-1")), watched(job(1, jobs_pb2.JOB_STATE_SUCCEEDED))),
}
"""For each method of the services a call of it, and an answer."""


def test_every_method_is_tested() -> None:
    methods = [
        method.name
        for service in (
            pb.DESCRIPTOR.services_by_name["SynthesisService"],
            jobs_pb2.DESCRIPTOR.services_by_name["JobService"],
        )
        for method in service.methods
    ]
    assert sorted(TASKS) == sorted(methods)


@pytest.mark.parametrize("method", TASKS)
class TestEveryMethod:
    def test_answer(self, talk: Talk, method: str) -> None:
        call, answer = TASKS[method]
        with talk(**{method: [answer]}) as (client, script):
            call(client)
            assert len(script.of(method)) == 1

    def test_bytes_that_are_no_message(self, talk: Talk, method: str) -> None:
        call, _ = TASKS[method]
        answers = {method: [[b"\xff\xff\xff"]]}
        with talk(**answers) as (client, _), pytest.raises(ServiceError):
            call(client)

    def test_nobody_there(self, connect: Any, method: str) -> None:
        with connect(NOWHERE) as client, pytest.raises(ServerUnavailableError, match=f"no server answers at {NOWHERE}"):
            TASKS[method][0](client)

    @pytest.mark.parametrize("refusal", [AWAY, BUSY])
    def test_tried_again(self, connect: Any, method: str, refusal: Refusal) -> None:
        call, answer = TASKS[method]
        slept: list[float] = []
        with (
            scripted(**{method: [[refusal], [refusal], answer]}) as (address, script),
            connect(address, sleep=slept.append) as client,
        ):
            call(client)
            assert len(script.of(method)) == 3
            # The very same request: also the key of a job that was submitted.
            assert all(request == script.of(method)[0] for request in script.of(method))
        assert len(slept) == 2
        assert min(slept) >= (refusal.retry_after_s or 0)

    def test_not_tried_for_ever(self, connect: Any, method: str) -> None:
        with (
            scripted(**{method: [[AWAY]]}) as (address, script),
            connect(address, sleep=lambda seconds: None) as client,
            pytest.raises(ServerUnavailableError, match="the server is ending") as caught,
        ):
            TASKS[method][0](client)
        assert caught.value.reason == "SHUTTING_DOWN"
        assert len(script.of(method)) == (QUICK.watch_attempts if method == "WatchJob" else QUICK.attempts)

    @pytest.mark.parametrize(
        ("code", "reason", "error"),
        [
            ("INVALID_ARGUMENT", "MALFORMED_REQUEST", RequestRefusedError),
            ("RESOURCE_EXHAUSTED", "CPU_LIMIT", RequestRefusedError),
            ("RESOURCE_EXHAUSTED", "SERVER_BUSY", ServerBusyError),
            ("RESOURCE_EXHAUSTED", "", RequestRefusedError),
            ("UNAUTHENTICATED", "UNAUTHENTICATED", RequestRefusedError),
            ("PERMISSION_DENIED", "PERMISSION_DENIED", RequestRefusedError),
            ("DEADLINE_EXCEEDED", "TIME_LIMIT", DeadlineError),
            ("INTERNAL", "WORKER_DIED", ServiceError),
            ("NOT_FOUND", "NO_SUCH_JOB", JobError),
            ("FAILED_PRECONDITION", "JOB_NOT_ENDED", JobError),
            ("ALREADY_EXISTS", "IDEMPOTENCY_KEY_REUSED", JobError),
            ("UNIMPLEMENTED", "", ServiceError),
        ],
    )
    def test_refused(self, talk: Talk, method: str, code: str, reason: str, error: Any) -> None:
        refusal = Refusal(grpc.StatusCode[code], "that is why\x1b[31m", reason)
        with talk(**{method: [[refusal]]}) as (client, script), pytest.raises(error) as caught:
            TASKS[method][0](client)
        assert type(caught.value) is error
        assert str(caught.value).isprintable()
        assert caught.value.reason == (reason if code != "UNIMPLEMENTED" else "")
        assert len(script.of(method)) == 1

    def test_an_empty_answer(self, talk: Talk, method: str) -> None:
        """None at all, or a message without anything in it; a watch asks again, but not for ever."""
        if method in ("Check", "Format", "ListTargets", "GetVersion", "ListJobs"):
            return  # An empty message is an answer.
        empty = type(TASKS[method][1][0])()
        with talk(**{method: [[empty]]}) as (client, _), pytest.raises(ServiceError):
            TASKS[method][0](client)


class TestErrors:
    def test_kin(self) -> None:
        assert issubclass(ServerUnavailableError, ConnectionError)
        assert issubclass(DeadlineError, TimeoutError)
        assert issubclass(ServerBusyError, RequestRefusedError)
        for error in (ServerUnavailableError, DeadlineError, RequestRefusedError, ServiceError, JobError):
            assert issubclass(error, ClientError)

    def test_deadline(self, talk: Talk) -> None:
        begun, ended = threading.Event(), threading.Event()

        def stuck(context: Any) -> Any:
            if context.add_callback(ended.set):
                begun.set()
                yield progress()
                ended.wait(PATIENCE_S)

        with talk(Synthesize=[[stuck]]) as (client, _):
            reports: list[Any] = []
            with pytest.raises(DeadlineError, match=r"within 0\.5 seconds"):
                client.synthesize(BUNDLE, deadline_s=0.5, on_progress=reports.append)
            # On a slow machine the call may not even have begun by then.
            assert len(reports) <= 1
            assert not begun.is_set() or ended.wait(PATIENCE_S)

    def test_what_a_caller_raises_ends_the_work(self, talk: Talk) -> None:
        ended = threading.Event()

        def stuck(context: Any) -> Any:
            context.add_callback(ended.set)
            yield progress()
            ended.wait(PATIENCE_S)

        class StopNowError(Exception):
            pass

        def stop(report: Any) -> None:
            raise StopNowError

        with talk(Synthesize=[[stuck]]) as (client, _):
            with pytest.raises(StopNowError) as caught:
                client.synthesize(BUNDLE, on_progress=stop)
            # The call itself is still referred to by the exception, so it is not its destruction that ends it.
            assert ended.wait(PATIENCE_S)
            assert caught.tb

    def test_cancelling_a_task_ends_the_work(self) -> None:
        begun, ended = threading.Event(), threading.Event()

        def stuck(context: Any) -> None:
            context.add_callback(ended.set)
            begun.set()
            ended.wait(PATIENCE_S)

        async def run(address: str) -> None:
            async with AsyncClient(address) as client:
                task = asyncio.create_task(client.synthesize(BUNDLE))
                await asyncio.to_thread(begun.wait, PATIENCE_S)
                task.cancel()
                with pytest.raises(asyncio.CancelledError):
                    await task
                assert await asyncio.to_thread(ended.wait, PATIENCE_S)

        with scripted(Synthesize=[[stuck]]) as (address, _):
            asyncio.run(run(address))

    def test_not_tried_again_once_there_was_an_answer(self, talk: Talk) -> None:
        with talk(Synthesize=[[progress(), AWAY]]) as (client, script):
            with pytest.raises(ServerUnavailableError):
                client.synthesize(BUNDLE)
            assert len(script.of("Synthesize")) == 1

    def test_details_of_another_domain_or_that_are_none(self, talk: Talk) -> None:
        strange = Refusal(grpc.StatusCode.RESOURCE_EXHAUSTED, "no", "SERVER_BUSY", 0.0, domain="elsewhere.example")

        def broken(context: grpc.ServicerContext) -> Any:
            context.set_trailing_metadata((("grpc-status-details-bin", b"\xff\xff\xff"),))
            context.abort(grpc.StatusCode.INTERNAL, "oh")

        with talk(Check=[[strange], [broken]]) as (client, script):
            with pytest.raises(RequestRefusedError) as caught:
                client.check(BUNDLE)
            assert (type(caught.value), caught.value.reason) == (RequestRefusedError, "")
            with pytest.raises(ServiceError, match="oh"):
                client.check(BUNDLE)
            assert len(script.of("Check")) == 2

    def test_what_cannot_be_sent(self, connect: Any) -> None:
        with connect(NOWHERE) as client:
            for bundle in (bundle_of("\udcff"), Bundle(SourceFile("robot\udcff.rscd", ""))):
                with pytest.raises(RequestRefusedError, match="Unicode"):
                    client.check(bundle)
            for states in (-1, 0):
                with pytest.raises(RequestRefusedError, match=r"maximum_states is .* at least 1"):
                    client.explore(BUNDLE, maximum_states=states)
                with pytest.raises(RequestRefusedError, match=r"maximum_states is .* at least 1"):
                    client.verify(Verify(model=BUNDLE, supervisor=b"x", maximum_states=states))
                with pytest.raises(RequestRefusedError, match=r"maximum_nodes is .* at least 1"):
                    client.synthesize(BUNDLE, SynthesisOptions(maximum_nodes=states))
            with pytest.raises(RequestRefusedError):
                client.synthesize(BUNDLE, SynthesisOptions(verified_states=-1))
            with pytest.raises(RequestRefusedError, match="condition_seconds is for synthesis on this machine"):
                client.synthesize(BUNDLE, SynthesisOptions(condition_seconds=5.0))
            with pytest.raises(RequestRefusedError):
                client.submit(Check(BUNDLE), retention_s=1e300)

    def test_a_stranger_answers(self, connect: Any) -> None:
        with ThreadPoolExecutor(1) as threads:
            server = grpc.server(threads)
            port = server.add_insecure_port("127.0.0.1:0")
            server.start()
            with connect(f"127.0.0.1:{port}") as client, pytest.raises(ServiceError, match="not a RoboSC server"):
                client.check(BUNDLE)
            server.stop(None).wait()

    def test_a_message_that_is_too_large(self, talk: Talk) -> None:
        large = supervisor(b"x" * 2**26)
        large.result.reason = "y" * 2**22
        with talk(Synthesize=[[large]]) as (client, _), pytest.raises(ClientError):
            client.synthesize(BUNDLE)

    def test_endless_progress_ends_with_the_deadline(self, talk: Talk) -> None:
        def endless(context: grpc.ServicerContext) -> Any:
            while context.is_active():
                yield progress()

        with talk(Synthesize=[[endless]]) as (client, _), pytest.raises(DeadlineError):
            client.synthesize(BUNDLE, deadline_s=0.3)

    def test_two_threads_share_a_client(self) -> None:
        answers = [progress(number) for number in range(100)]
        with (
            scripted(Synthesize=[[*answers, synthesis()]]) as (address, _),
            Client(address) as client,
            ThreadPoolExecutor(4) as threads,
        ):
            found = list(threads.map(lambda _: client.synthesize(BUNDLE).status, range(8)))
        assert found == [SynthesisStatus.EMPTY] * 8


class TestCredentials:
    @pytest.mark.parametrize("method", ["Check", "Synthesize"])
    def test_a_token_is_shown_with_every_call(self, connect: Any, tmp_path: Path, method: str) -> None:
        shown: list[Any] = []

        def note(context: grpc.ServicerContext) -> None:
            shown.extend(value for key, value in context.invocation_metadata() if key == "authorization")

        token = tmp_path / "token"
        token.touch(0o600)
        token.write_text("secret\n")
        call, answer = TASKS[method]
        with (
            scripted(**{method: [[note, *answer]]}) as (address, _),
            connect(address, credentials=Credentials(token_file=token)) as client,
        ):
            call(client)
            call(client)
        assert shown == ["Bearer secret"] * 2

    def test_never_in_the_clear_to_another_machine(self, connect: Any, tmp_path: Path) -> None:
        token = tmp_path / "token"
        token.touch(0o600)
        token.write_text("secret")
        chosen = Credentials(token_file=token)
        with pytest.raises(CredentialsError, match="only with TLS"), connect("192.0.2.1:1", credentials=chosen):
            pass
        with (
            pytest.raises(CredentialsError, match="No such file"),
            connect(NOWHERE, credentials=Credentials(ca=tmp_path / "none")),
        ):
            pass

    @pytest.mark.parametrize("kind", KINDS)
    def test_tls(self, kind: str, tmp_path: Path) -> None:
        authority = Authority(tmp_path)
        certificate, key = authority.sign("server")
        credentials = grpc.ssl_server_credentials([(key.read_bytes(), certificate.read_bytes())])
        with ThreadPoolExecutor(1) as threads:
            server = grpc.server(threads)
            port = server.add_secure_port("127.0.0.1:0", credentials)
            server.start()
            address = f"127.0.0.1:{port}"
            believing = Credentials(ca=authority.file)
            with (
                client_of(kind, address, credentials=believing, retries=NO_RETRIES) as client,
                pytest.raises(ServiceError, match="not a RoboSC server"),
            ):
                client.get_version()
            with client_of(kind, address, retries=NO_RETRIES) as client, pytest.raises(ServerUnavailableError):
                client.get_version()
            server.stop(None).wait()


PLACE = Location("robot.rscd", 3, 7, 4)
FINDINGS = (
    Diagnostic(Severity.ERROR, "no-file", "there is no file", None, "Write it."),
    Diagnostic(
        Severity.WARNING, "odd", "this is odd: \u00e9\u4e16", PLACE, "Change it.", (RelatedPlace("first", PLACE),)
    ),
    Diagnostic(Severity.NOTE, "", "", Location("a", 1, 1), ""),
)


def location(place: Location | None) -> Any:
    return place and pb.Location(file=place.file, line=place.line, column=place.column, length=place.length)


class TestConversion:
    def test_diagnostics(self, talk: Talk) -> None:
        numbers: Any = {Severity.ERROR: 1, Severity.WARNING: 2, Severity.NOTE: 3}
        messages = [
            pb.Diagnostic(
                severity=numbers[item.severity],
                code=item.code,
                message=item.message,
                location=location(item.location),
                mend=item.fix,
                related=[pb.RelatedPlace(message=at.message, location=location(at.location)) for at in item.related],
            )
            for item in FINDINGS
        ]
        with talk(Check=[[pb.CheckResponse(diagnostics=messages)]]) as (client, _):
            assert client.check(BUNDLE) == FINDINGS

    def test_synthesis(self, talk: Talk) -> None:
        summary = pb.Summary(
            controllable_events=2,
            uncontrollable_events=3,
            states=str(10**40),
            added=[pb.AddedCondition(event="move.request", condition="true")],
            text="text\n",
            goals=pb.Goals(aims=["once Base.here"], assumptions=["A leads to B"], has_strategy=True, modes=1),
        )
        race = [pb.Strategy(order="as declared", search="backwards", nodes=10**11, won=1)]
        statistics = pb.Statistics(engine="autoref", state_bits=7, iterations=3, peak_nodes=10**12, race=race)
        answer = supervisor(b"x", summary=summary, statistics=statistics, signature=b"s")
        with talk(Synthesize=[[answer]]) as (client, _):
            found = client.synthesize(BUNDLE)
        goals = robosc_client.GoalSummary(("once Base.here",), ("A leads to B",), True, 1)
        assert found.summary == robosc_client.Summary(2, 3, 10**40, None, (("move.request", "true"),), "text\n", goals)
        assert found.statistics == robosc_client.Statistics(
            "autoref", 7, 3, 10**12, (robosc_client.Strategy("as declared", "backwards", 10**11, 1, 0),)
        )
        assert (found.supervisor, found.signature, found.reason) == (b"x", b"s", "")

    def test_about_the_server(self, talk: Talk) -> None:
        limits = pb.ServerLimits(bundle_bytes=1, bundle_files=2, task_seconds=3.5, retention_seconds=10)
        version = pb.GetVersionResponse(version="9", engines=["cudd", "autoref"], limits=limits)
        targets = pb.ListTargetsResponse(targets=[pb.Target(name="ros2", description="a package")])
        with talk(GetVersion=[[version]], ListTargets=[[targets]]) as (client, _):
            found = client.get_version()
            assert (found.version, found.engines) == ("9", ("cudd", "autoref"))
            assert (found.limits.bundle_bytes, found.limits.task_seconds) == (1, 3.5)
            assert [(item.name, item.description) for item in client.list_targets()] == [("ros2", "a package")]
