"""Tests of the configuration of Envoy: its limits, whom it believes, and what Envoy's own validator says."""

import base64
import json
import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from cryptography.hazmat.primitives.asymmetric import rsa

from robosc_api.security.forwarded import CALLER_HEADER, SCOPES_HEADER
from robosc_server.operations.config_check import check_settings
from robosc_server.operations.settings_sources import settings_from
from support.certificates import Authority
from support.checkers import TOP, checked

ENVOY = TOP / "deploy" / "envoy"
FILES = ("jwt.yaml", "mtls.yaml")


def read(name: str) -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load((ENVOY / name).read_text(encoding="utf-8"))
    return found


def manager_of(settings: dict[str, Any]) -> dict[str, Any]:
    """The settings of the connections of callers."""
    (listener,) = settings["static_resources"]["listeners"]
    (chain,) = listener["filter_chains"]
    (manager,) = chain["filters"]
    found: dict[str, Any] = manager["typed_config"]
    return found


@pytest.mark.parametrize("name", FILES)
def test_what_arrives_is_bounded(name: str) -> None:
    settings = read(name)
    manager = manager_of(settings)
    assert manager["codec_type"] == "HTTP2"
    assert manager["max_request_headers_kb"] <= 8
    assert manager["common_http_protocol_options"]["max_headers_count"] <= 100
    assert manager["request_headers_timeout"] == "10s"
    http2 = manager["http2_protocol_options"]
    assert http2["max_concurrent_streams"] <= 100
    assert http2["max_consecutive_inbound_frames_with_empty_payload"] == 1
    assert settings["layered_runtime"]["layers"][0]["static_layer"]["http"]["max_requests_per_io_cycle"] == 1
    (listener,) = settings["static_resources"]["listeners"]
    assert listener["max_connections_to_accept_per_socket_event"] == 1
    monitors = {monitor["name"] for monitor in settings["overload_manager"]["resource_monitors"]}
    assert {
        "envoy.resource_monitors.fixed_heap",
        "envoy.resource_monitors.global_downstream_max_connections",
    } == monitors


@pytest.mark.parametrize("name", FILES)
def test_answers_that_are_not_read_delay_no_others(name: str) -> None:
    """Callers share the connections to the server, whose windows unread answers take up (RFC 9113, 5.2)."""
    (cluster,) = read(name)["static_resources"]["clusters"]
    (options,) = cluster["typed_extension_protocol_options"].values()
    http2 = options["explicit_http_config"]["http2_protocol_options"]
    calls, window = http2["max_concurrent_streams"], http2["initial_stream_window_size"]
    assert window == 64 * 1024
    assert calls * window <= http2["initial_connection_window_size"] <= 2 * calls * window


@pytest.mark.parametrize("name", FILES)
def test_calls_are_bounded_by_connection_and_by_caller(name: str) -> None:
    """No client that behaves uses up the calls of others, and none needs several connections for a burst of watches."""
    filters = manager_of(read(name))["http_filters"]
    by_connection, by_caller = (
        found["typed_config"] for found in filters if found["name"] == "envoy.filters.http.local_ratelimit"
    )
    assert filters[0]["typed_config"] is by_connection and filters[-2]["typed_config"] is by_caller
    assert by_connection["local_rate_limit_per_downstream_connection"] is True
    assert "local_rate_limit_per_downstream_connection" not in by_caller
    assert by_caller["rate_limits"][0]["actions"] == [
        {"request_headers": {"header_name": CALLER_HEADER, "descriptor_key": "caller"}}
    ]
    of_caller = by_caller["descriptors"][0]
    assert of_caller["entries"] == [{"key": "caller"}]
    connection, caller, together = (limits["token_bucket"] for limits in (by_connection, of_caller, by_caller))
    for size in ("max_tokens", "tokens_per_fill"):
        assert connection[size] < caller[size] < together[size]
    for limits in (by_connection, by_caller):
        assert limits["filter_enforced"] == limits["filter_enabled"] == {"default_value": {"numerator": 100}}
        assert limits["rate_limited_as_resource_exhausted"] is True


@pytest.mark.parametrize("name", FILES)
def test_callers_cannot_send_the_word_of_the_proxy(name: str) -> None:
    manager = manager_of(read(name))
    (early,) = manager["early_header_mutation_extensions"]
    removed = {mutation.get("remove") for mutation in early["typed_config"]["mutations"]}
    assert {CALLER_HEADER, SCOPES_HEADER} <= removed


@pytest.mark.parametrize("name", FILES)
def test_wrong_deadlines_reach_no_server(name: str) -> None:
    """Deadlines have the form of gRPC's protocol (PROTOCOL-HTTP2.md, Timeout)."""
    manager = manager_of(read(name))
    (host,) = manager["route_config"]["virtual_hosts"]
    first = host["routes"][0]
    assert first["direct_response"]["status"] == 400
    (header,) = first["match"]["headers"]
    assert (header["name"], header["invert_match"]) == ("grpc-timeout", True)
    allowed = re.compile(header["string_match"]["safe_regex"]["regex"])
    assert all(allowed.fullmatch(text) for text in ("0n", "1H", "20S", "20000000u", "5m", "99999999M"))
    assert not any(allowed.fullmatch(text) for text in ("", "abc", "1", "S", "-1S", "999999999S", "20 S", "20S ", "1h"))


def test_callers_are_known_by_a_certificate_or_a_token() -> None:
    (listener,) = read("mtls.yaml")["static_resources"]["listeners"]
    assert listener["filter_chains"][0]["transport_socket"]["typed_config"]["require_client_certificate"] is True
    filters = manager_of(read("jwt.yaml"))["http_filters"]
    (provider,) = filters[1]["typed_config"]["providers"].values()
    headers = {claim["header_name"] for claim in provider["claim_to_headers"]}
    assert headers == {CALLER_HEADER, SCOPES_HEADER}
    assert provider["audiences"] and provider["require_expiration"] is True
    *open_rules, last = filters[1]["typed_config"]["rules"]
    assert last == {"match": {"prefix": "/"}, "requires": {"provider_name": "site"}}
    assert [rule["match"]["prefix"] for rule in open_rules] == ["/grpc.health.v1.Health/"]


def test_callers_with_tokens_have_the_same_limits() -> None:
    """The configurations differ in whom they know, and in nothing else."""
    certificates, tokens = (read(name) for name in ("mtls.yaml", "jwt.yaml"))
    for settings in (certificates, tokens):
        (listener,) = settings["static_resources"]["listeners"]
        del listener["filter_chains"][0]["transport_socket"]["typed_config"]
        manager = manager_of(settings)
        (early,) = manager["early_header_mutation_extensions"]
        early["typed_config"]["mutations"] = [
            mutation for mutation in early["typed_config"]["mutations"] if "remove" in mutation
        ]
        manager["http_filters"] = [
            found for found in manager["http_filters"] if found["name"] != "envoy.filters.http.jwt_authn"
        ]
        by_caller = manager["http_filters"][1]["typed_config"]
        # Those without a name, whom only the identity provider's configuration lets through.
        del by_caller["rate_limits"][1:], by_caller["descriptors"][1:]
    assert certificates == tokens


def test_kubernetes_has_the_same_configuration() -> None:
    component = TOP / "deploy" / "kubernetes" / "components" / "envoy" / "envoy.yaml"
    assert component.read_text(encoding="utf-8") == (ENVOY / "mtls.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize("file", ["compose/server-behind-envoy.toml", "kubernetes/components/envoy/server.toml"])
def test_servers_behind_it_trust_it_over_a_socket_alone(
    file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROBOSC_SERVER_SOCKET", str(tmp_path / "server.socket"))
    monkeypatch.setenv("ROBOSC_SERVER_FORWARDED_IDENTITY", "true")
    settings = settings_from({"database_url": f"sqlite:///{tmp_path}/jobs"}, TOP / "deploy" / file)
    assert settings.tokens is None and settings.tls_certificate is None
    findings = [finding for finding in check_settings(settings) if finding.part in ("listening", "tokens")]
    assert [finding.grade for finding in findings] == ["ok", "ok"]


@pytest.mark.parametrize("name", FILES)
def test_envoy_accepts_it(name: str, tmp_path: Path) -> None:
    checked("envoy", "--mode", "validate", "-c", _with_files(name, tmp_path))


def test_a_wrong_configuration_would_be_found(tmp_path: Path) -> None:
    file = _with_files("mtls.yaml", tmp_path)
    file.write_text(file.read_text().replace("max_request_headers_kb", "max_request_header_kb"))
    with pytest.raises(AssertionError, match="max_request_header_kb"):
        checked("envoy", "--mode", "validate", "-c", file)


def _with_files(name: str, folder: Path) -> Path:
    """Return a copy of a configuration whose certificates and keys are there."""
    authority = Authority(folder)
    certificate, key = authority.sign("localhost")
    public = rsa.generate_private_key(public_exponent=65537, key_size=2048).public_key().public_numbers()
    jwks = folder / "jwks.json"
    entry = {"kty": "RSA", "alg": "RS256", "kid": "1", "use": "sig", "n": _number(public.n), "e": _number(public.e)}
    jwks.write_text(json.dumps({"keys": [entry]}))
    text = (ENVOY / name).read_text(encoding="utf-8")
    places = {"tls/tls.crt": certificate, "tls/tls.key": key, "callers/ca.crt": authority.file, "oidc/jwks.json": jwks}
    for place, file in places.items():
        text = text.replace(f"/etc/robosc/{place}", str(file))
    made = folder / name
    made.write_text(text, encoding="utf-8")
    return made


def _number(value: int) -> str:
    """Return a number in the form of a JSON Web Key (RFC 7518, 6.3.1)."""
    return base64.urlsafe_b64encode(value.to_bytes((value.bit_length() + 7) // 8)).decode().rstrip("=")
