"""The synthesis server and its client over real sockets with TLS, client certificates and tokens."""

import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

import grpc
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection_pb2, reflection_pb2_grpc

from robosc_api.security import Credentials, Quota, Scope, ServerSecurity, make_token
from robosc_api.v1 import jobs_pb2, jobs_pb2_grpc
from robosc_client import (
    Check,
    Client,
    CredentialsError,
    RequestRefusedError,
    RetryPolicy,
    ServerBusyError,
    ServerUnavailableError,
)
from robosc_client.main import main as robosc_client
from robosc_server.application import StartError
from robosc_server.main import main
from robosc_server.tasks.task import Outcome, Result, Task, TaskLimits
from robosc_server.workers import OnCpuTime, OnReport, ignore_cpu_time
from support.certificates import Authority
from support.held_time import HeldLoop
from support.job_workers import task_message
from support.service import bundle_of, secured, served, server_process
from support.waiting import PATIENCE_S


class Quick:
    """Workers that find nothing wrong with anything, at once."""

    capacity = 4

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        pass

    async def run(
        self, task: Task, limits: TaskLimits, on_report: OnReport, on_cpu_time: OnCpuTime = ignore_cpu_time
    ) -> Outcome:
        return Result((b"",))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("certificates")


@pytest.fixture(scope="module")
def authority(folder: Path) -> Authority:
    return Authority(folder)


@pytest.fixture(scope="module")
def secure(authority: Authority) -> ServerSecurity:
    certificate, key = authority.sign("server")
    return ServerSecurity(certificate=certificate, key=key)


@contextmanager
def serving(security: ServerSecurity, **settings: Any) -> Iterator[str]:
    with served(given_workers=Quick(), **secured(security), **settings) as address:
        yield address


ONCE = RetryPolicy(attempts=1)


def check(address: str, **credentials: Any) -> None:
    with Client(address, Credentials(**credentials), retries=ONCE) as client:
        assert client.check(bundle_of(""), deadline_s=PATIENCE_S) == ()


def token_in(folder: Path, *scopes: Scope, quota: Quota | None = None, name: str = "caller") -> tuple[Path, Path]:
    """A file with a token, and one that lets it in."""
    token, line = make_token(name, scopes, quota or Quota())
    files = folder / f"token-of-{name}", folder / f"tokens-with-{name}"
    files[0].write_text(token + "\n")
    files[1].write_text(line + "\n")
    for file in files:
        file.chmod(0o600)
    return files


class TestTls:
    def test_a_caller_that_believes_the_authority_is_answered(
        self, authority: Authority, secure: ServerSecurity
    ) -> None:
        with serving(secure) as address:
            check(address, ca=authority.file)
            # By its name as well.
            check(address.replace("127.0.0.1", "localhost"), ca=authority.file)

    def test_without_tls_and_with_another_authority_nobody_is_there(self, folder: Path, secure: ServerSecurity) -> None:
        other = Authority(folder, "other")
        with serving(secure) as address:
            for credentials in (Credentials(), Credentials(ca=other.file), Credentials(is_secure=True)):
                with Client(address, credentials, retries=ONCE) as client, pytest.raises(ServerUnavailableError):
                    client.check(bundle_of(""), deadline_s=PATIENCE_S)

    def test_a_client_with_tls_does_not_talk_to_a_server_without(self, authority: Authority) -> None:
        with serving(ServerSecurity()) as address, pytest.raises(ServerUnavailableError):
            check(address, ca=authority.file)

    def test_callers_show_certificates_where_they_are_asked_for(
        self, folder: Path, authority: Authority, secure: ServerSecurity
    ) -> None:
        assert secure.certificate is not None
        security = ServerSecurity(certificate=secure.certificate, key=secure.key, client_ca=authority.file)
        certificate, key = authority.sign("caller")
        strange, strange_key = Authority(folder, "stranger").sign("strange")
        with serving(security) as address:
            check(address, ca=authority.file, certificate=certificate, key=key)
            with pytest.raises(ServerUnavailableError):
                check(address, ca=authority.file)
            with pytest.raises(ServerUnavailableError):
                check(address, ca=authority.file, certificate=strange, key=strange_key)

    def test_a_new_certificate_is_taken_without_a_restart(self, tmp_path: Path) -> None:
        first, second = Authority(tmp_path, "first"), Authority(tmp_path, "second")
        certificate, key = first.sign("server")
        with serving(ServerSecurity(certificate=certificate, key=key)) as address:
            check(address, ca=first.file)
            # Half of it: what was read before stays.
            other, other_key = second.sign("new")
            shutil.copy(other, certificate)
            check(address, ca=first.file)
            shutil.copy(other_key, key)
            check(address, ca=second.file)

    def test_a_certificate_that_does_not_fit_is_reported_once_for_each_change(
        self, tmp_path: Path, caplog: pytest.LogCaptureFixture
    ) -> None:
        first = Authority(tmp_path, "first")
        certificate, key = first.sign("server")
        right = certificate.read_bytes()
        with serving(ServerSecurity(certificate=certificate, key=key)) as address:
            for number in (1, 2):
                shutil.copy(first.sign(f"other-{number}")[0], certificate)
                for _ in range(3):
                    check(address, ca=first.file)
                assert caplog.text.count("the changed certificate is not used") == number
            certificate.unlink()
            for _ in range(3):
                check(address, ca=first.file)
            assert caplog.text.count("No such file") == 1
            certificate.write_bytes(right)
            check(address, ca=first.file)
        assert caplog.text.count("the changed certificate is not used") == 3

    def test_a_certificate_that_has_expired_is_refused_until_a_new_one_is_there(self, tmp_path: Path) -> None:
        authority = Authority(tmp_path)
        old, old_key = authority.sign("server", days=-1)
        with serving(ServerSecurity(certificate=old, key=old_key)) as address:
            with pytest.raises(ServerUnavailableError):
                check(address, ca=authority.file)
            new, new_key = authority.sign("new")
            shutil.copy(new_key, old_key)
            shutil.copy(new, old)
            check(address, ca=authority.file)

    def test_a_caller_whose_certificate_has_expired_is_refused(
        self, tmp_path: Path, authority: Authority, secure: ServerSecurity
    ) -> None:
        callers = Authority(tmp_path, "callers")
        security = ServerSecurity(certificate=secure.certificate, key=secure.key, client_ca=callers.file)
        with serving(security) as address:
            for days, is_admitted in ((1, True), (-1, False)):
                certificate, key = callers.sign(f"caller{days}", days=days)
                if is_admitted:
                    check(address, ca=authority.file, certificate=certificate, key=key)
                else:
                    with pytest.raises(ServerUnavailableError):
                        check(address, ca=authority.file, certificate=certificate, key=key)

    def test_a_key_that_others_may_read_is_reported(self, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
        certificate, key = Authority(tmp_path).sign("server")
        key.chmod(0o640)
        with serving(ServerSecurity(certificate=certificate, key=key)):
            assert caplog.text.count(f"{key}: other users may read this file") == 1
        caplog.clear()
        key.chmod(0o600)
        with serving(ServerSecurity(certificate=certificate, key=key)):
            assert "may read this file" not in caplog.text


class TestTokens:
    def test_only_with_a_token_that_is_for_it(
        self, tmp_path: Path, authority: Authority, secure: ServerSecurity
    ) -> None:
        token, tokens = token_in(tmp_path, Scope.SYNTHESIZE)
        wrong = tmp_path / "wrong"
        wrong.write_text("robosc_guessed")
        security = ServerSecurity(certificate=secure.certificate, key=secure.key, tokens=tokens)
        with serving(security) as address:
            check(address, ca=authority.file, token_file=token)
            with pytest.raises(RequestRefusedError, match="a valid token is needed"):
                check(address, ca=authority.file)
            with pytest.raises(RequestRefusedError, match="a valid token is needed"):
                check(address, ca=authority.file, token_file=wrong)

    def test_a_token_for_something_else_is_not_enough(self, tmp_path: Path) -> None:
        token, tokens = token_in(tmp_path, Scope.WATCH, Scope.OPERATE)
        with (
            serving(ServerSecurity(tokens=tokens)) as address,
            pytest.raises(RequestRefusedError, match="scope does not include 'synthesize'"),
        ):
            check(address, token_file=token)

    def test_health_needs_no_token_and_reflection_does(self, tmp_path: Path) -> None:
        _, tokens = token_in(tmp_path, Scope.SYNTHESIZE)
        with serving(ServerSecurity(tokens=tokens)) as address, grpc.insecure_channel(address) as channel:
            answer = health_pb2_grpc.HealthStub(channel).Check(health_pb2.HealthCheckRequest(), timeout=PATIENCE_S)
            assert answer.status == health_pb2.HealthCheckResponse.SERVING
            stub = reflection_pb2_grpc.ServerReflectionStub(channel)
            request = reflection_pb2.ServerReflectionRequest(list_services="")
            with pytest.raises(grpc.RpcError) as caught:
                list(stub.ServerReflectionInfo(iter([request]), timeout=PATIENCE_S))
            assert caught.value.code() is grpc.StatusCode.UNAUTHENTICATED

    def test_who_has_none_is_refused_before_a_request_has_come(self, tmp_path: Path) -> None:
        _, tokens = token_in(tmp_path, Scope.SYNTHESIZE)
        with serving(ServerSecurity(tokens=tokens)) as address, grpc.insecure_channel(address) as channel:
            call: Any = channel.stream_stream("/robosc_api.v1.SynthesisService/Check")
            silence = threading.Event()

            def requests() -> Iterator[bytes]:
                silence.wait(PATIENCE_S)
                yield b""

            responses = call(requests(), timeout=PATIENCE_S)
            with pytest.raises(grpc.RpcError) as caught:
                next(responses)
            silence.set()
            assert caught.value.code() is grpc.StatusCode.UNAUTHENTICATED

    def test_two_tokens_are_none(self, tmp_path: Path) -> None:
        token, tokens = token_in(tmp_path, Scope.SYNTHESIZE)
        secret = token.read_text().strip()
        entry, other = [("authorization", f"{scheme} {secret}") for scheme in ("Bearer", "Digest")]
        with serving(ServerSecurity(tokens=tokens)) as address, grpc.insecure_channel(address) as channel:
            stub = reflection_pb2_grpc.ServerReflectionStub(channel)
            for metadata, is_admitted in (([entry], True), ([entry, entry], False), ([other], False)):
                request = reflection_pb2.ServerReflectionRequest(list_services="")
                call = stub.ServerReflectionInfo(iter([request]), timeout=PATIENCE_S, metadata=metadata)
                if is_admitted:
                    assert len(list(call)) == 1
                else:
                    with pytest.raises(grpc.RpcError):
                        list(call)

    def test_a_token_is_not_sent_in_the_clear_to_another_machine(self, tmp_path: Path) -> None:
        token, _ = token_in(tmp_path, Scope.SYNTHESIZE)
        with pytest.raises(CredentialsError, match="only with TLS"):
            Client("192.0.2.1:50051", Credentials(token_file=token))

    def test_a_token_is_never_logged(
        self, tmp_path: Path, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
    ) -> None:
        token, tokens = token_in(tmp_path, Scope.WATCH)
        with serving(ServerSecurity(tokens=tokens)) as address, pytest.raises(RequestRefusedError):
            check(address, token_file=token)
        secret = token.read_text().strip()
        assert "the token 'caller' is not for" in caplog.text
        assert secret not in caplog.text + "".join(capfd.readouterr())

    def test_a_token_that_has_expired_is_reported(self, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
        token, line = make_token("caller", (Scope.SYNTHESIZE,), expires_s=1_000_000_000)
        other, tokens = token_in(tmp_path, Scope.SYNTHESIZE, name="other")
        tokens.write_text(f"{line}\n{tokens.read_text()}")
        expired = tmp_path / "expired"
        expired.write_text(token)
        with serving(ServerSecurity(tokens=tokens)) as address:
            for _ in range(3):
                with pytest.raises(RequestRefusedError, match="has expired at 2001-09-09T01:46:40Z") as caught:
                    check(address, token_file=expired)
                assert caught.value.reason == "TOKEN_EXPIRED"
            check(address, token_file=other)
        assert caplog.text.count("of 'caller' has expired at 2001-09-09T01:46:40Z and is still used") == 1

    def test_two_tokens_of_an_owner_are_one_caller(self, tmp_path: Path) -> None:
        made = [make_token("caller", (Scope.SYNTHESIZE,)) for _ in range(2)]
        _, tokens = token_in(tmp_path, Scope.SYNTHESIZE)
        tokens.write_text("".join(f"{line}\n" for _, line in made))
        files = [tmp_path / "first", tmp_path / "second"]
        for file, (token, _) in zip(files, made, strict=True):
            file.write_text(token)
        with serving(ServerSecurity(tokens=tokens)) as address:
            with Client(address, Credentials(token_file=files[0]), retries=ONCE) as client:
                job = client.submit(Check(bundle_of("a"))).job
            with Client(address, Credentials(token_file=files[1]), retries=ONCE) as client:
                assert client.get_job(job.id).owner == "caller"


class TestQuotas:
    def test_beyond_its_quota_a_caller_learns_when_to_come_again_and_others_go_on(self, tmp_path: Path) -> None:
        token, tokens = token_in(tmp_path, Scope.SYNTHESIZE, quota=Quota(per_minute=2))
        other, other_tokens = token_in(tmp_path, Scope.SYNTHESIZE, name="other")
        tokens.write_text(tokens.read_text() + other_tokens.read_text())
        # Time stands still, so that nothing of the quota comes back.
        with serving(ServerSecurity(tokens=tokens), loop=HeldLoop()) as address:
            with Client(address, Credentials(token_file=token), retries=ONCE) as client:
                for text in ("a", "b"):
                    client.check(bundle_of(text))
                with pytest.raises(ServerBusyError) as caught:
                    client.check(bundle_of("c"))
                assert caught.value.reason == "QUOTA_EXCEEDED"
                assert caught.value.retry_after_s is not None
                assert 0 < caught.value.retry_after_s <= 30
                # A kept result counts, too: otherwise a caller could ask for it without end.
                with pytest.raises(ServerBusyError):
                    client.check(bundle_of("a"))
                with pytest.raises(ServerBusyError, match="2 tasks per minute"):
                    client.submit(Check(bundle_of("d")))
            with Client(address, Credentials(token_file=other), retries=ONCE) as client:
                client.check(bundle_of("c"))


class TestJobsOfOthers:
    def test_only_an_admin_sees_and_cancels_them(self, tmp_path: Path) -> None:
        files = [
            token_in(tmp_path, Scope.SYNTHESIZE, name="mine"),
            token_in(tmp_path, Scope.SYNTHESIZE, name="theirs"),
            token_in(tmp_path, Scope.SYNTHESIZE, Scope.ADMIN, name="admin"),
        ]
        tokens = tmp_path / "tokens"
        tokens.write_text("".join(lines.read_text() for _, lines in files))
        tokens.chmod(0o600)
        mine, theirs, admin = ((("authorization", f"Bearer {token.read_text().strip()}"),) for token, _ in files)
        stub: Any = jobs_pb2_grpc.JobServiceStub
        with serving(ServerSecurity(tokens=tokens)) as address, grpc.insecure_channel(address) as channel:
            jobs = stub(channel)

            def code(call: Any, request: Any, metadata: Any) -> str:
                try:
                    call(request, metadata=metadata, timeout=PATIENCE_S)
                except grpc.RpcError as error:
                    return str(error.code().name)
                return "OK"

            request = jobs_pb2.SubmitJobRequest(task=task_message("a model"))
            job = jobs.SubmitJob(request, metadata=mine, timeout=PATIENCE_S).job
            assert job.owner == "mine"
            get, cancel = jobs_pb2.GetJobRequest(id=job.id), jobs_pb2.CancelJobRequest(id=job.id)
            assert [code(jobs.GetJob, get, who) for who in (mine, theirs, admin)] == ["OK", "NOT_FOUND", "OK"]
            assert [code(jobs.CancelJob, cancel, who) for who in (theirs, admin)] == ["NOT_FOUND", "OK"]
            every = jobs_pb2.ListJobsRequest(all_owners=True)
            assert [code(jobs.ListJobs, every, who) for who in (theirs, admin)] == ["PERMISSION_DENIED", "OK"]
            loads = jobs_pb2.GetLoadRequest(all_callers=True)
            assert [code(jobs.GetLoad, loads, who) for who in (theirs, admin)] == ["PERMISSION_DENIED", "OK"]


class TestWhereItListens:
    @pytest.mark.parametrize("host", ["0.0.0.0", "::"])
    def test_beyond_this_machine_only_with_tls(self, host: str) -> None:
        refused = pytest.raises(StartError, match=r"is reachable from other machines.*insecure_beyond_loopback")
        with refused, served(given_workers=Quick(), host=host):
            pass

    def test_unless_it_is_set_otherwise(self, secure: ServerSecurity, authority: Authority) -> None:
        with serving(ServerSecurity(insecure_beyond_loopback=True), host="0.0.0.0") as address:
            check(address.replace("0.0.0.0", "127.0.0.1"))
        with serving(secure, host="0.0.0.0") as address:
            check(address.replace("0.0.0.0", "127.0.0.1"), ca=authority.file)

    def test_files_that_do_not_fit_are_reported_at_the_start(
        self, tmp_path: Path, authority: Authority, secure: ServerSecurity
    ) -> None:
        assert secure.certificate is not None
        assert secure.key is not None
        _, other_key = authority.sign("another")
        empty = tmp_path / "empty"
        empty.touch()
        cases = [
            (ServerSecurity(certificate=secure.certificate), "given together"),
            (ServerSecurity(client_ca=authority.file), "need TLS"),
            (ServerSecurity(certificate=secure.certificate, key=other_key), "cannot be used"),
            (ServerSecurity(certificate=tmp_path / "none", key=secure.key), "No such file"),
            (ServerSecurity(certificate=empty, key=secure.key), "cannot be used"),
            (
                ServerSecurity(certificate=secure.certificate, key=secure.key, client_ca=empty),
                "no PEM certificates",
            ),
            (ServerSecurity(tokens=tmp_path / "none"), "No such file"),
        ]
        for security, words in cases:
            with pytest.raises(StartError, match=words), serving(security):
                pass


class TestCommands:
    def test_as_programs(self, tmp_path: Path, authority: Authority, secure: ServerSecurity) -> None:
        command = [sys.executable, "-m", "robosc_server.main", "token", "laptop"]
        made = subprocess.run(command, capture_output=True, text=True, check=True)
        token, tokens = tmp_path / "token", tmp_path / "tokens"
        token.write_text(made.stdout)
        tokens.write_text(made.stderr.splitlines()[-1] + "\n")
        tokens.chmod(0o600)
        model = tmp_path / "robot.rscd"
        model.write_text("robot R { component C { incoming message go with type: none } }")
        options = ["--tls-certificate", str(secure.certificate), "--tls-key", str(secure.key), "--tokens", str(tokens)]
        with server_process(*options) as (_, address):
            given = ["check", str(model), "--server", address, "--ca", str(authority.file)]
            assert robosc_client([*given, "--token-file", str(token)]) == 0
            assert robosc_client(given) == 3

    def test_wrong_use(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        assert main(["token", "not a name"]) == 2
        assert main(["--port", "0", "--tls-key", str(tmp_path / "none")]) == 1
        assert "given together" in capsys.readouterr().err
        assert main(["--host", "0.0.0.0", "--port", "0"]) == 1
        model = tmp_path / "robot.rscd"
        model.write_text("robot R { }")
        given = ["check", str(model), "--server", "127.0.0.1:1", "--ca", str(tmp_path / "none")]
        assert robosc_client(given) == 2
        assert "No such file" in capsys.readouterr().err
