"""Asking a service for its health by its own configuration: with and without TLS, well and not well."""

import socket
import tempfile
from pathlib import Path

import pytest
from grpc_health.v1 import health_pb2

from robosc_api.health import ask_alive, ask_health, local_address
from robosc_api.security import SecurityError, ServerSecurity
from robosc_api.security.addresses import joined
from robosc_bridge.health_check import main as bridge_health
from robosc_server.operations.health_check import main as server_health
from support.certificates import Authority
from support.health_servers import answering
from support.scripted_service import kept_port

Status = health_pb2.HealthCheckResponse
IN_THE_CLEAR = ServerSecurity()


@pytest.fixture
def secure(tmp_path: Path) -> ServerSecurity:
    certificate, key = Authority(tmp_path).sign("server")
    return ServerSecurity(certificate=certificate, key=key)


@pytest.mark.parametrize(
    ("listening", "asked"),
    [("0.0.0.0:1", "127.0.0.1:1"), ("[::]:2", "[::1]:2"), ("10.0.0.1:3", "10.0.0.1:3"), ("robot:4", "robot:4")],
)
def test_what_listens_everywhere_is_asked_here(listening: str, asked: str) -> None:
    assert local_address(listening) == asked


def test_answers_are_told_apart() -> None:
    with answering(Status.SERVING) as address:
        well = ask_health(address, timeout_s=10)
        other = ask_health(address, "robosc_api.v1.None", timeout_s=10)
    assert (well.is_alive, well.is_serving, well.message) == (True, True, "SERVING")
    assert (other.is_alive, other.is_serving) == (True, False)
    with answering(Status.NOT_SERVING) as address:
        ill = ask_health(address, timeout_s=10)
    assert (ill.is_alive, ill.is_serving, ill.message) == (True, False, "NOT_SERVING")
    with kept_port() as port:
        nobody = ask_health(f"127.0.0.1:{port}", timeout_s=10)
    assert (nobody.is_alive, nobody.is_serving) == (False, False) and nobody.message.startswith("UNAVAILABLE")


def test_the_programs_own_certificate_is_believed_and_no_other(secure: ServerSecurity, tmp_path: Path) -> None:
    other, _ = Authority(tmp_path, "other").sign("other")
    with answering(Status.SERVING, secure) as address:
        assert ask_health(address, timeout_s=10, certificate=secure.certificate).is_serving
        for certificate in (other, None):
            condition = ask_health(address, timeout_s=10, certificate=certificate)
            assert (condition.is_alive, condition.is_serving) == (True, False), condition


def test_an_expired_certificate_is_not_well_but_ends_no_program(tmp_path: Path) -> None:
    certificate, key = Authority(tmp_path).sign("server", days=-1.0)
    with answering(Status.SERVING, ServerSecurity(certificate=certificate, key=key)) as address:
        condition = ask_health(address, timeout_s=10, certificate=certificate)
    assert (condition.is_alive, condition.is_serving) == (True, False) and "expired" in condition.message.lower()
    with kept_port() as port:
        assert not ask_health(f"127.0.0.1:{port}", timeout_s=10, certificate=certificate).is_alive


def test_whoever_wants_a_certificate_is_shown_its_own(tmp_path: Path) -> None:
    authority = Authority(tmp_path)
    certificate, key = authority.sign("server")
    security = ServerSecurity(certificate=certificate, key=key, client_ca=authority.file)
    with answering(Status.SERVING, security) as address:
        assert ask_health(
            address, timeout_s=10, certificate=certificate, client_certificate=(certificate, key)
        ).is_serving
        without = ask_health(address, timeout_s=10, certificate=certificate)
        assert (without.is_alive, without.is_serving) == (True, False)


def test_whoever_has_too_many_calls_is_there() -> None:
    with answering(Status.SERVING, most_calls=0) as address:
        condition = ask_health(address, timeout_s=10)
    assert (condition.is_alive, condition.is_serving) == (True, False)
    assert condition.message.startswith("RESOURCE_EXHAUSTED")


def test_whoever_listens_and_says_nothing_hangs() -> None:
    """The kernel takes connections for a program that stands still."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        condition = ask_health(joined(*listening.getsockname()), timeout_s=0.5)
    assert (condition.is_alive, condition.is_serving) == (False, False)
    assert condition.message.startswith("DEADLINE_EXCEEDED")


def test_a_file_that_is_no_certificate_is_one_clear_error(secure: ServerSecurity, tmp_path: Path) -> None:
    file = tmp_path / "server.pem"
    file.write_text("no certificate\n")
    with pytest.raises(SecurityError, match=r"server\.pem"):
        ask_health("127.0.0.1:1", timeout_s=1, certificate=file)
    # The listening server has read another file, and goes on with it.
    with answering(Status.SERVING, secure) as address:
        condition = ask_alive(address, timeout_s=10, certificate=file)
    assert (condition.is_alive, condition.is_serving) == (True, False) and "server.pem" in condition.message
    with kept_port() as port:
        assert not ask_alive(f"127.0.0.1:{port}", timeout_s=10, certificate=file).is_alive


@pytest.mark.parametrize(("status", "code", "alive"), [(Status.SERVING, 0, 0), (Status.NOT_SERVING, 1, 0)])
def test_the_commands_say_it_by_their_status(
    status: int, code: int, alive: int, secure: ServerSecurity, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with answering(status, secure) as address:
        port = address.rpartition(":")[2]
        server = tmp_path / "server.toml"
        server.write_text(f'port = {port}\ntls_certificate = "{secure.certificate}"\ntls_key = "{secure.key}"\n')
        assert server_health(["--config", str(server)]) == code
        assert server_health(["--config", str(server), "--alive"]) == alive
        bridge = tmp_path / "robot.yaml"
        bridge.write_text(
            "robot: burger\ndrive: {driver: opencr, port: /dev/none}\nchannels: {}\n"
            f"remote: {{grpc_address: '127.0.0.1:{port}', tls_certificate: {secure.certificate}, "
            f"tls_key: {secure.key}}}\n"
        )
        assert bridge_health(["health", "--config", str(bridge)]) == code
        assert bridge_health(["health", "--config", str(bridge), "--alive"]) == alive
        spoiled = tmp_path / "spoiled.pem"
        spoiled.write_text("no certificate\n")
        for file, health in ((server, server_health), (bridge, lambda given: bridge_health(["health", *given]))):
            file.write_text(file.read_text().replace(str(secure.certificate), str(spoiled)))
            assert health(["--config", str(file)]) == 2
            assert health(["--config", str(file), "--alive"]) == 0
    with kept_port() as nobodys:
        server.write_text(server.read_text().replace(f"port = {port}", f"port = {nobodys}"))
        assert server_health(["--config", str(server), "--alive"]) == 1
    capsys.readouterr()


def test_wrong_use_is_one_clear_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text("robot: burger\ndrive: {driver: opencr, port: /dev/none}\nchannels: {}\n")
    assert bridge_health(["health", "--config", str(file)]) == 2
    assert "remote.grpc_address is not set" in capsys.readouterr().err
    assert server_health(["--port", "many"]) == 2
    assert capsys.readouterr().err == "robosc-server: --port: must be a whole number\n"


def test_a_unix_socket_is_told_apart_too(capsys: pytest.CaptureFixture[str]) -> None:
    # Paths of sockets are short.
    with tempfile.TemporaryDirectory(prefix="robosc-") as folder:
        place = f"{folder}/socket"
        nobody = ask_health(f"unix:{place}", timeout_s=10)
        assert (nobody.is_alive, nobody.is_serving) == (False, False) and nobody.message.startswith("UNAVAILABLE")
        for words in ([], ["--alive"]):
            assert server_health([*words, "--socket", place]) == 1
            assert "UNAVAILABLE" in capsys.readouterr().err
        # A program has ended, and its socket is there still; another one accepts connections and never answers.
        for name, hangs in (("left", False), ("hanging", True)):
            with socket.socket(socket.AF_UNIX) as listener:
                listener.bind(f"{folder}/{name}")
                if hangs:
                    listener.listen()
                condition = ask_health(f"unix:{folder}/{name}", timeout_s=0.5)
            assert not condition.is_alive
            assert condition.message.startswith("DEADLINE_EXCEEDED" if hangs else "UNAVAILABLE")
