"""`robosc-client health` against a server that is as it is said to be."""

import json
from functools import partial
from pathlib import Path

import pytest
from grpc_health.v1 import health_pb2

from robosc_api.security import ServerSecurity
from robosc_client.main import main
from support.certificates import Authority
from support.client_commands import Run
from support.health_servers import answering

Status = health_pb2.HealthCheckResponse


@pytest.fixture
def asked(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Run:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))
    return partial(run, "health")


def test_well_and_not_well(asked: Run) -> None:
    with answering(Status.SERVING, Jobs=Status.NOT_SERVING, Odd=Status.UNKNOWN) as address:
        assert asked("--server", address) == (0, "SERVING\n", "")
        assert asked("--server", address, "--service", "Jobs") == (1, "NOT_SERVING\n", "")
        assert asked("--server", address, "--service", "Odd") == (1, "UNKNOWN\n", "")
        status, out, err = asked("--server", address, "--service", "None")
        assert (status, out, err) == (1, "", f"robosc-client: the server at {address} has no service 'None'\n")
        assert json.loads(asked("--server", address, "--service", "None", "--json")[1])["error"]["status"] == 1
        status, out, _ = asked("--server", address, "--service", "Jobs", "--json")
        assert (status, json.loads(out)) == (1, {"server": address, "service": "Jobs", "status": "NOT_SERVING"})


def test_nobody_there(asked: Run) -> None:
    status, out, err = asked("--server", "127.0.0.1:1")
    assert (status, out) == (3, "")
    assert err.startswith("robosc-client: no server answers at 127.0.0.1:1: UNAVAILABLE: ")
    assert err.count("\n") == 1
    assert json.loads(asked("--server", "127.0.0.1:1", "--json")[1])["error"]["status"] == 3


def test_with_tls_as_a_profile_says(asked: Run, tmp_path: Path) -> None:
    authority = Authority(tmp_path)
    certificate, key = authority.sign("server")
    with answering(Status.SERVING, ServerSecurity(certificate=certificate, key=key)) as address:
        assert main(["profile", "add", "lab", "--server", address, "--ca", str(authority.file)]) == 0
        status, out, _ = asked()
        assert (status, out.splitlines()[-1]) == (0, "SERVING")
        # Questions in the clear, and with trust in other certificates.
        for wrong in ([], ["--tls"]):
            assert asked("--server", address, *wrong)[0] == 3
        assert asked("--server", address, "--ca", tmp_path / "none.pem")[0] == 2
