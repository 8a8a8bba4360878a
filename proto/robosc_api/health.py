"""Asking a service of this machine how it is, by gRPC's health checks: for containers, units and probes."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import grpc
from grpc_health.v1 import health_pb2, health_pb2_grpc

from robosc_api.security.addresses import joined, split
from robosc_api.security.client import Credentials, open_channel
from robosc_api.security.errors import SecurityError
from robosc_api.security.listening import read

_ANYWHERE = {"0.0.0.0": "127.0.0.1", "": "127.0.0.1", "::": "::1"}  # noqa: S104  # Not listening: asked there.


@dataclass(frozen=True, slots=True)
class Condition:
    """How a service is.

    Attributes:
        is_there: Whether anything answered.
        is_serving: Whether it said that it is well.
        words: Its answer, or why there is none.
    """

    is_there: bool
    is_serving: bool
    words: str


def local_address(address: str) -> str:
    """Where somebody on this machine reaches what listens on `HOST:PORT`, also where HOST is every interface.

    Raises:
        ValueError: It is no address.
    """
    host, port = split(address)
    return joined(_ANYWHERE.get(host, host), port)


def ask_health(
    address: str,
    service: str = "",
    *,
    timeout_s: float,
    certificate: Path | None = None,
    shown: tuple[Path, Path] | None = None,
) -> Condition:
    """Ask a service how it is.

    Args:
        address: `HOST:PORT`.
        service: Full name of one; empty: the program as a whole.
        timeout_s: Longest time for connection and answer, in seconds.
        certificate: The one (PEM) that the program itself listens with: none other is believed; None: without TLS.
        shown: Certificate and key (PEM) that are shown to it; None: none.

    Raises:
        SecurityError: A file cannot be used.
    """
    credentials = Credentials()
    options: tuple[tuple[str, str | int], ...] = (("grpc.enable_http_proxy", 0),)
    if certificate is not None:
        credentials = Credentials(ca=certificate, certificate=shown and shown[0], key=shown and shown[1])
        # The certificate is for the name that others call the machine by.
        options = (*options, ("grpc.ssl_target_name_override", _name_in(certificate)))
    with open_channel(address, credentials, options) as channel:
        stub = health_pb2_grpc.HealthStub(channel)
        try:
            answer = stub.Check(health_pb2.HealthCheckRequest(service=service), timeout=timeout_s)
        except grpc.RpcError as error:
            # What the service itself has answered, if with no: it is there.
            is_there = error.code() in (grpc.StatusCode.NOT_FOUND, grpc.StatusCode.UNIMPLEMENTED)
            return Condition(is_there, False, f"{error.code().name}: {error.details()}")
    status = health_pb2.HealthCheckResponse.ServingStatus
    return Condition(True, answer.status == status.SERVING, status.Name(answer.status))


def _name_in(certificate: Path) -> str:
    """A name that a certificate is for."""
    try:
        from cryptography import x509
    except ImportError as error:
        raise SecurityError(
            "reading the certificate needs the package cryptography: pip install 'robosc[signing]'"
        ) from error
    try:
        first = x509.load_pem_x509_certificate(read(certificate))
        names = first.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except (ValueError, x509.ExtensionNotFound) as error:
        raise SecurityError(f"{certificate}: no certificate for the name of a machine") from error
    found: Sequence[str] = [
        *names.get_values_for_type(x509.DNSName),
        *map(str, names.get_values_for_type(x509.IPAddress)),
    ]
    if not found:
        raise SecurityError(f"{certificate}: no certificate for the name of a machine")
    # A certificate for all machines of a domain is one for any of them.
    return found[0].replace("*", "health", 1)
