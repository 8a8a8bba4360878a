"""Tests of callers that a proxy names, over a Unix socket and with a client certificate; not all may name them."""

import socket
from collections.abc import Sequence
from pathlib import Path

import pytest

from robosc_api.security import Scope, SecurityError, ServerSecurity, check_listening
from robosc_api.security.forwarded import forwarded_entry
from robosc_server.operations.health_check import main as health
from robosc_server.workers import WorkersError
from robosc_server.workers.cluster_check import check_cluster
from support.job_workers import StartedWorkers
from support.service import served, status_of_list


@pytest.mark.parametrize(
    ("metadata", "name", "scopes"),
    [
        ((("x-robosc-caller", "anna"), ("x-robosc-scopes", "synthesize")), "anna", {Scope.SYNTHESIZE}),
        (
            (("x-robosc-caller", "anna"), ("x-robosc-scopes", "openid synthesize,admin")),
            "anna",
            {"synthesize", "admin"},
        ),
        ((("x-robosc-caller", "anna"), ("x-robosc-scopes", "")), "anna", set()),
        ((("x-robosc-caller", "anna"),), None, set()),
        ((("x-robosc-scopes", "synthesize"),), None, set()),
        ((("x-robosc-caller", ""), ("x-robosc-scopes", "synthesize")), None, set()),
        ((("x-robosc-caller", "two words"), ("x-robosc-scopes", "synthesize")), None, set()),
        ((("x-robosc-caller", "a"), ("x-robosc-caller", "b"), ("x-robosc-scopes", "synthesize")), None, set()),
        ((("x-robosc-caller", "a"), ("x-robosc-scopes", "watch"), ("x-robosc-scopes", "admin")), None, set()),
        ((), None, set()),
    ],
)
def test_the_word_of_a_proxy(metadata: Sequence[tuple[str, str]], name: str | None, scopes: set[str]) -> None:
    entry = forwarded_entry(metadata)
    assert (None if entry is None else entry.name) == name
    assert entry is None or entry.scopes == scopes


FILE = Path("somewhere")


@pytest.mark.parametrize(
    ("address", "security", "words"),
    [
        ("127.0.0.1:1", ServerSecurity(forwarded_identity=True), "trusted only over a Unix socket"),
        ("10.0.0.1:1", ServerSecurity(certificate=FILE, key=FILE, forwarded_identity=True), "trusted only over"),
        ("unix:/run/s", ServerSecurity(tokens=FILE, forwarded_identity=True), "not by both"),
        ("unix:/run/s", ServerSecurity(certificate=FILE, key=FILE), "no TLS"),
    ],
)
def test_a_forwarded_identity_is_refused_where_anybody_could_send_one(
    address: str, security: ServerSecurity, words: str
) -> None:
    with pytest.raises(SecurityError, match=words):
        check_listening(address, security)


def test_a_forwarded_identity_is_taken_over_a_socket_and_from_a_proxy_with_a_certificate() -> None:
    check_listening("unix:/run/s", ServerSecurity(forwarded_identity=True))
    check_listening("10.0.0.1:1", ServerSecurity(certificate=FILE, key=FILE, client_ca=FILE, forwarded_identity=True))


def test_calls_over_a_socket_have_the_scopes_that_the_proxy_sends(tmp_path: Path) -> None:
    file = tmp_path / "server.socket"
    anna = ("x-robosc-caller", "anna")
    with served(given_workers=StartedWorkers(), socket=file, forwarded_identity=True) as address:
        assert address == f"unix:{file}"
        assert file.stat().st_mode & 0o777 == 0o660
        assert status_of_list(address, anna, ("x-robosc-scopes", "synthesize")) == "OK"
        assert status_of_list(address, anna, ("x-robosc-scopes", "watch")) == "PERMISSION_DENIED"
        assert status_of_list(address) == "UNAUTHENTICATED"
        assert status_of_list(address, anna, ("x-robosc-scopes", "synthesize"), all_owners=True) == "PERMISSION_DENIED"
        assert status_of_list(address, anna, ("x-robosc-scopes", "synthesize admin"), all_owners=True) == "OK"
        assert health(["--socket", str(file), "--alive"]) == 0


def test_a_socket_that_a_killed_server_has_left_is_replaced(tmp_path: Path) -> None:
    file = tmp_path / "server.socket"
    with socket.socket(socket.AF_UNIX) as left:
        left.bind(str(file))
    with served(given_workers=StartedWorkers(), socket=file) as address:
        assert status_of_list(address) == "OK"


def test_the_headers_mean_nothing_to_a_server_that_trusts_no_proxy() -> None:
    with served(given_workers=StartedWorkers()) as address:
        words = (("x-robosc-caller", "anna"), ("x-robosc-scopes", "synthesize admin"))
        assert status_of_list(address, *words, all_owners=True) == "PERMISSION_DENIED"


def test_a_cluster_on_other_machines_needs_tls_or_the_word() -> None:
    for spec in ("local", "dask://127.0.0.1:8786", "dask+tls://10.0.0.1:8786"):
        check_cluster(spec, is_insecure_allowed=False)
    with pytest.raises(WorkersError, match=r"dask\+tls"):
        check_cluster("dask://10.0.0.1:8786", is_insecure_allowed=False)
    check_cluster("dask://10.0.0.1:8786", is_insecure_allowed=True)
