"""Tests of the permissions of a bridge's callers, over real TLS sockets."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import grpc
import pytest

from robosc_api.security import Credentials, Scope, ServerSecurity, make_token
from robosc_api.v1 import bridge_pb2 as pb
from robosc_bridge.daemon.states import OperatorCommand
from robosc_bridge.remote import RemoteSettings
from robosc_bridge.remote.service import RULES
from support.certificates import Authority
from support.remote import Attachment, FakeDaemon, connected, served
from support.waiting import PATIENCE_S, wait_until

ADMITTED = "admitted"
CALLS = ("GetStatus", "GetDefinition", "Watch", "Stop", "Command", "Attach")


@pytest.fixture(scope="module")
def authority(tmp_path_factory: pytest.TempPathFactory) -> Authority:
    return Authority(tmp_path_factory.mktemp("certificates"))


@contextmanager
def bridge(security: ServerSecurity, host: str = "127.0.0.1") -> Iterator[tuple[FakeDaemon, str]]:
    with FakeDaemon() as daemon, served(daemon, RemoteSettings(f"{host}:0", security)) as endpoint:
        yield daemon, endpoint.address.replace("0.0.0.0", "127.0.0.1")


def outcome(stub: Any, call: str) -> str:
    """Make a call, and return its outcome: that it was admitted, or its status."""
    try:
        match call:
            case "Watch":
                stream = stub.Watch(pb.WatchRequest(), timeout=PATIENCE_S)
                next(stream)
                stream.cancel()
            case "Attach":
                program = Attachment(stub, name="program")
                try:
                    program.receive()
                finally:
                    program.end()
            case "Command":
                stub.Command(pb.CommandRequest(command=pb.COMMAND_KIND_START), timeout=PATIENCE_S)
            case _:
                getattr(stub, call)(getattr(pb, f"{call}Request")(), timeout=PATIENCE_S)
    except grpc.RpcError as error:
        return str(error.code().name)
    return ADMITTED


def outcomes(address: str, **credentials: Any) -> dict[str, str]:
    with connected(address, Credentials(**credentials)) as stub:
        return {call: outcome(stub, call) for call in CALLS}


def tokens_of(folder: Path, *scopes: tuple[Scope, ...]) -> tuple[Path, list[Path]]:
    """A file of tokens, and a file with each token."""
    made = [make_token(f"caller-{number}", which) for number, which in enumerate(scopes)]
    file = folder / "tokens"
    file.write_text("".join(f"{line}\n" for _, line in made))
    file.chmod(0o600)
    files = [folder / f"token-{number}" for number in range(len(made))]
    for path, (token, _) in zip(files, made, strict=True):
        path.write_text(token)
    return file, files


ALL = dict.fromkeys(CALLS, ADMITTED)


def test_every_call_has_a_rule() -> None:
    assert {name.rpartition("/")[2] for name in RULES} == set(CALLS)


def test_on_the_same_machine_nothing_is_needed_by_default() -> None:
    with bridge(ServerSecurity()) as (_, address):
        assert outcomes(address) == ALL


def test_scopes_over_tls(tmp_path: Path, authority: Authority) -> None:
    certificate, key = authority.sign("bridge")
    tokens, (watch, operate, other) = tokens_of(tmp_path, (Scope.WATCH,), (Scope.OPERATE,), (Scope.SYNTHESIZE,))
    wrong = tmp_path / "wrong"
    wrong.write_text("robosc_wrong")
    with bridge(ServerSecurity(certificate=certificate, key=key, tokens=tokens), "0.0.0.0") as (daemon, address):
        ca = authority.file
        assert outcomes(address, ca=ca, token_file=operate) == ALL
        denied = "PERMISSION_DENIED"
        assert outcomes(address, ca=ca, token_file=watch) == {**ALL, "Command": denied, "Attach": denied}
        assert outcomes(address, ca=ca, token_file=other) == {**dict.fromkeys(CALLS, denied), "Stop": ADMITTED}
        unknown = dict.fromkeys(CALLS, "UNAUTHENTICATED")
        before = len(daemon.orders)
        assert outcomes(address, ca=ca) == unknown
        assert outcomes(address, ca=ca, token_file=wrong) == unknown
        assert len(daemon.orders) == before
        # Not even a stop is heard without TLS.
        assert outcomes(address) == dict.fromkeys(CALLS, "UNAVAILABLE")


def test_an_expired_token_can_only_stop(tmp_path: Path) -> None:
    token, line = make_token("caller", (Scope.OPERATE,), expires_s=1_000_000_000)
    tokens, file = tmp_path / "tokens", tmp_path / "token"
    tokens.write_text(line)
    tokens.chmod(0o600)
    file.write_text(token)
    with bridge(ServerSecurity(tokens=tokens)) as (daemon, address):
        assert outcomes(address, token_file=file) == {**dict.fromkeys(CALLS, "UNAUTHENTICATED"), "Stop": ADMITTED}
        assert [order.command for order in daemon.orders] == [OperatorCommand.STOP]


def test_who_ordered_stands_in_the_log_by_name(tmp_path: Path) -> None:
    tokens, (operate,) = tokens_of(tmp_path, (Scope.OPERATE,))
    with bridge(ServerSecurity(tokens=tokens)) as (daemon, address):
        with connected(address, Credentials(token_file=operate)) as stub:
            stub.Stop(pb.StopRequest(), timeout=PATIENCE_S)
        assert daemon.orders[0].command is OperatorCommand.STOP
        assert daemon.orders[0].by.startswith("'caller-0' at ipv4:127.0.0.1:")


def test_client_certificates_are_enough(authority: Authority, monkeypatch: pytest.MonkeyPatch) -> None:
    # The guard sees every caller on another machine: tests have only this one.
    monkeypatch.setattr("robosc_api.security.guard.peer_of", lambda context: "ipv4:192.0.2.1:4711")
    certificate, key = authority.sign("bridge")
    own, own_key = authority.sign("operator")
    security = ServerSecurity(certificate=certificate, key=key, client_ca=authority.file)
    with bridge(security, "0.0.0.0") as (_, address):
        assert outcomes(address, ca=authority.file, certificate=own, key=own_key) == ALL
        assert outcomes(address, ca=authority.file) == dict.fromkeys(CALLS, "UNAVAILABLE")


def test_without_tokens_other_machines_may_watch_and_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    # The guard sees every caller on another machine: tests have only this one.
    monkeypatch.setattr("robosc_api.security.guard.peer_of", lambda context: "ipv4:192.0.2.1:4711")
    with bridge(ServerSecurity()) as (daemon, address):
        denied = "PERMISSION_DENIED"
        assert outcomes(address) == {**ALL, "Command": denied, "Attach": denied}
        assert wait_until(lambda: daemon.commands()) == [OperatorCommand.STOP]
