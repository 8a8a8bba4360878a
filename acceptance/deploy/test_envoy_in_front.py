"""Envoy with the configurations of `deploy/envoy` in front of a real server: who is let through, and as whom.

Only paths of files, the address and the issuer's keys are others.
"""

import base64
import json
import os
import socket
import ssl
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import grpc
import pytest
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import padding, rsa
from grpc_health.v1 import health_pb2, health_pb2_grpc

from support.certificates import Authority
from support.checkers import found
from support.containers import TOP
from support.job_workers import StartedWorkers
from support.service import served, status_of_list
from support.strangers import END_OF_HEADERS, END_OF_STREAM, HEADERS, PREFACE, SETTINGS, frame, headers
from support.waiting import PATIENCE_S, wait_until

ENVOY = TOP / "deploy" / "envoy"
KEY = rsa.generate_private_key(public_exponent=65537, key_size=2048)
_CALLS = 5
CALLS_OF_SERVER = "cluster.server.upstream_rq_total"
FOUR_CALLS = (
    "{max_tokens: 1000, tokens_per_fill: 200, fill_interval: 1s}",
    "{max_tokens: 4, tokens_per_fill: 1, fill_interval: 3600s}",
)
TWO_PROBES = (
    "{max_tokens: 100, tokens_per_fill: 20, fill_interval: 1s}",
    "{max_tokens: 2, tokens_per_fill: 1, fill_interval: 3600s}",
)
SPOOFED = (("x-robosc-caller", "root"), ("x-robosc-scopes", "synthesize admin"))


@pytest.fixture
def folder() -> Iterator[Path]:
    """A folder whose path is short enough for sockets."""
    with tempfile.TemporaryDirectory(prefix="robosc-") as name:
        yield Path(name)


@contextmanager
def behind_envoy(name: str, folder: Path, authority: Authority, *smaller: tuple[str, str]) -> Iterator[str]:
    """Run a server behind Envoy, with some smaller limits; yield the address for callers."""
    certificate, key = authority.sign("localhost")
    (folder / "jwks.json").write_text(json.dumps({"keys": [_public()]}))
    with socket.create_server(("127.0.0.1", 0)) as place:
        port = place.getsockname()[1]
    text = (ENVOY / name).read_text(encoding="utf-8")
    for old, new in {
        "/etc/robosc/tls/tls.crt": certificate,
        "/etc/robosc/tls/tls.key": key,
        "/etc/robosc/callers/ca.crt": authority.file,
        "/etc/robosc/oidc/jwks.json": folder / "jwks.json",
        "/run/robosc/server.socket": folder / "server.socket",
        "/tmp/envoy-admin.socket": folder / "admin.socket",
        "address: 0.0.0.0, port_value: 50051": f"address: 127.0.0.1, port_value: {port}",
    }.items():
        text = text.replace(str(old), str(new))
    for usual, other in smaller:
        assert usual in text
        text = text.replace(usual, other)
    file = folder / name
    file.write_text(text, encoding="utf-8")
    words = [found("envoy"), "-c", str(file), "--log-level", "error", "--concurrency", "1"]
    words += ["--base-id", str(os.getpid())]
    with (
        served(given_workers=StartedWorkers(), socket=folder / "server.socket", forwarded_identity=True),
        subprocess.Popen(words) as envoy,
    ):
        try:
            wait_until(lambda: _listens(port))
            yield f"localhost:{port}"
        finally:
            envoy.terminate()


def _listens(port: int) -> bool:
    with suppress(OSError), socket.create_connection(("127.0.0.1", port)):
        return True
    return False


def list_jobs(
    address: str,
    authority: Authority,
    *metadata: tuple[str, str],
    certificate: tuple[Path, Path] | None = None,
    all_owners: bool = False,
) -> str:
    """Return the status of a call over TLS."""
    own = (None, None) if certificate is None else (certificate[1].read_bytes(), certificate[0].read_bytes())
    credentials = grpc.ssl_channel_credentials(authority.file.read_bytes(), *own)
    return status_of_list(address, *metadata, all_owners=all_owners, credentials=credentials)


def test_callers_with_certificates(folder: Path) -> None:
    authority = Authority(folder)
    anna = authority.sign("anna")
    with behind_envoy("mtls.yaml", folder, authority) as address:
        assert list_jobs(address, authority, certificate=anna) == "OK"
        assert list_jobs(address, authority) == "UNAVAILABLE"
        stranger = Authority(folder, "others").sign("stranger")
        assert list_jobs(address, authority, certificate=stranger) == "UNAVAILABLE"
        # Headers that callers send in the name of the proxy count for nothing.
        assert list_jobs(address, authority, *SPOOFED, certificate=anna) == "OK"
        assert list_jobs(address, authority, *SPOOFED, certificate=anna, all_owners=True) == "PERMISSION_DENIED"


def test_callers_with_tokens_of_an_identity_provider(folder: Path) -> None:
    authority = Authority(folder)
    with behind_envoy("jwt.yaml", folder, authority) as address:
        assert list_jobs(address, authority, _bearer(scope="openid synthesize")) == "OK"
        assert list_jobs(address, authority, _bearer(scope="synthesize"), all_owners=True) == "PERMISSION_DENIED"
        assert list_jobs(address, authority, _bearer(scope="synthesize admin"), all_owners=True) == "OK"
        assert list_jobs(address, authority, _bearer(scope="openid")) == "PERMISSION_DENIED"
        assert list_jobs(address, authority) == "UNAUTHENTICATED"
        assert list_jobs(address, authority, *SPOOFED) == "UNAUTHENTICATED"
        assert list_jobs(address, authority, _bearer(scope="synthesize", aud="others")) != "OK"
        assert list_jobs(address, authority, _bearer(scope="synthesize", exp=1)) == "UNAUTHENTICATED"
        # A token without scopes is no place for those of a caller.
        assert list_jobs(address, authority, _bearer(), *SPOOFED) == "UNAUTHENTICATED"


def test_a_caller_has_its_calls_on_all_its_connections(folder: Path) -> None:
    authority = Authority(folder)
    anna, berta = authority.sign("anna"), authority.sign("berta")
    with behind_envoy("mtls.yaml", folder, authority, FOUR_CALLS) as address:
        statuses = [list_jobs(address, authority, *SPOOFED, certificate=anna) for _ in range(5)]
        assert statuses == ["OK"] * 4 + ["RESOURCE_EXHAUSTED"]
        assert list_jobs(address, authority, certificate=berta) == "OK"


def test_a_holder_of_tokens_has_its_calls_on_all_its_connections(folder: Path) -> None:
    authority = Authority(folder)
    with behind_envoy("jwt.yaml", folder, authority, FOUR_CALLS, TWO_PROBES) as address:
        tokens = [_bearer(scope="synthesize", exp=int(time.time()) + 3600 + number) for number in range(5)]
        statuses = [list_jobs(address, authority, token) for token in tokens]
        assert statuses == ["OK"] * 4 + ["RESOURCE_EXHAUSTED"]
        assert [_health(address, authority) for _ in range(3)] == ["OK"] * 2 + ["RESOURCE_EXHAUSTED"]
        # Those whose token is refused, and those without one, use up nobody's calls.
        assert list_jobs(address, authority, *SPOOFED) == "UNAUTHENTICATED"
        assert list_jobs(address, authority, _bearer(scope="synthesize", sub="berta")) == "OK"


def test_calls_of_a_connection_that_ends_reach_no_server(folder: Path) -> None:
    """One of the calls that arrive together with the end of their connection is begun."""
    authority = Authority(folder)
    anna = authority.sign("anna")
    with behind_envoy("mtls.yaml", folder, authority) as address:
        with _line(address, authority, anna) as line:
            calls = [
                frame(
                    HEADERS, END_OF_HEADERS | END_OF_STREAM, stream, headers("/robosc_api.v1.JobService/ListJobs", {})
                )
                for stream in range(1, 2 * _CALLS, 2)
            ]
            line.sendall(b"".join(calls))
            assert _ended(line) == _CALLS
        assert _statistic(folder, CALLS_OF_SERVER) == _CALLS
        with _line(address, authority, anna) as line:
            # The end leaves in one packet with what was sent before.
            line.setsockopt(socket.IPPROTO_TCP, socket.TCP_CORK, 1)
            line.sendall(b"".join(calls))
            line.shutdown(socket.SHUT_RDWR)
        wait_until(lambda: _statistic(folder, "http.callers.downstream_rq_total") == 2 * _CALLS)
        wait_until(lambda: _statistic(folder, "http.callers.downstream_cx_active") == 0)
        assert _statistic(folder, CALLS_OF_SERVER) <= _CALLS + 1


@pytest.mark.parametrize("wrong", ["abc", "", "999999999999S"])
def test_a_wrong_deadline_harms_no_calls_of_others(wrong: str, folder: Path) -> None:
    """Calls of all callers share connections from Envoy to a server, in which gRPC keeps fields of earlier calls."""
    authority = Authority(folder)
    anna, berta = authority.sign("anna"), authority.sign("berta")
    with behind_envoy("mtls.yaml", folder, authority) as address:
        with _line(address, authority, berta) as line:
            method = "/robosc_api.v1.JobService/ListJobs"
            metadata = {"grpc-timeout": wrong, "grpc-previous-rpc-attempts": wrong}
            for stream in range(1, 2 * _CALLS, 2):
                line.sendall(frame(HEADERS, END_OF_HEADERS | END_OF_STREAM, stream, headers(method, metadata)))
            assert _ended(line) == _CALLS
        statuses = [list_jobs(address, authority, certificate=anna) for _ in range(5)]
        assert statuses == ["OK"] * 5


def _statistic(folder: Path, name: str) -> int:
    """Return a counter of Envoy; 0 if it has not counted yet."""
    with socket.socket(socket.AF_UNIX) as line:
        line.settimeout(PATIENCE_S)
        line.connect(str(folder / "admin.socket"))
        line.sendall(f"GET /stats?filter=^{name}$ HTTP/1.1\r\nHost: envoy\r\nConnection: close\r\n\r\n".encode())
        text = b"".join(iter(lambda: line.recv(65536), b"")).decode()
    return sum(int(row.rpartition(": ")[2]) for row in text.splitlines() if row.startswith(f"{name}: "))


def _health(address: str, authority: Authority) -> str:
    """Return the status of a health check without a token."""
    with grpc.secure_channel(address, grpc.ssl_channel_credentials(authority.file.read_bytes())) as channel:
        try:
            health_pb2_grpc.HealthStub(channel).Check(health_pb2.HealthCheckRequest(), timeout=PATIENCE_S)
        except grpc.RpcError as error:
            return str(error.code().name)
    return "OK"


def _ended(line: ssl.SSLSocket) -> int:
    """Read until the calls of a line have ended, or the line has; return how many calls have."""
    ended, data = 0, b""
    while ended < _CALLS and (more := line.recv(65536)):
        data += more
        while len(data) >= 9 + (size := int.from_bytes(data[:3])) and len(data) >= 9:
            ended += data[3] == HEADERS and bool(data[4] & END_OF_STREAM)
            data = data[9 + size :]
    return ended


@contextmanager
def _line(address: str, authority: Authority, certificate: tuple[Path, Path]) -> Iterator[ssl.SSLSocket]:
    """A connection of a caller that has begun HTTP/2, for frames that no client of gRPC would send."""
    context = ssl.create_default_context(cafile=str(authority.file))
    context.load_cert_chain(*certificate)
    context.set_alpn_protocols(["h2"])
    port = int(address.rpartition(":")[2])
    with (
        socket.create_connection(("127.0.0.1", port), PATIENCE_S) as plain,
        context.wrap_socket(plain, server_hostname="localhost") as line,
    ):
        line.sendall(PREFACE + frame(SETTINGS, 0, 0, b""))
        yield line


def _bearer(**claims: Any) -> tuple[str, str]:
    """Return the header with a JWT of the identity provider (RFC 7519)."""
    usual = {"iss": "https://login.example.org", "aud": "robosc", "sub": "anna", "exp": int(time.time()) + 3600}
    parts = ({"alg": "RS256", "kid": "1", "typ": "JWT"}, usual | claims)
    text = ".".join(_encoded(json.dumps(part).encode()) for part in parts)
    signature = KEY.sign(text.encode(), padding.PKCS1v15(), hashes.SHA256())
    return "authorization", f"Bearer {text}.{_encoded(signature)}"


def _public() -> dict[str, str]:
    """Return the key of the identity provider as a JSON Web Key (RFC 7517)."""
    numbers = KEY.public_key().public_numbers()
    n, e = (_encoded(value.to_bytes((value.bit_length() + 7) // 8)) for value in (numbers.n, numbers.e))
    return {"kty": "RSA", "alg": "RS256", "kid": "1", "use": "sig", "n": n, "e": e}


def _encoded(data: bytes) -> str:
    return base64.urlsafe_b64encode(data).decode().rstrip("=")
