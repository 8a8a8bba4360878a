"""Client of gRPC health checks, for containers, units, probes and people."""

import socket
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import grpc
from google.protobuf.wrappers_pb2 import StringValue, UInt32Value

from robosc_api.security.addresses import UNIX, joined, split_address
from robosc_api.security.client import Credentials, open_channel
from robosc_api.security.errors import SecurityError
from robosc_api.security.listening import read

_ANYWHERE = {"0.0.0.0": "127.0.0.1", "": "127.0.0.1", "::": "::1"}  # noqa: S104  # Not listening: asked there.

# Status codes of gRPC itself, without an answer of the program; all others come from the program.
_UNANSWERED = (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED, grpc.StatusCode.CANCELLED)


_METHOD = "/grpc.health.v1.Health/Check"

_STATUSES = ("UNKNOWN", "SERVING", "NOT_SERVING", "SERVICE_UNKNOWN")


@dataclass(frozen=True, slots=True)
class Condition:
    """Condition of a service.

    Attributes:
        is_alive: True if the program is running: it answered, even with NOT_SERVING, or ended a connection that it had
            accepted, for example because of a certificate. A program that accepts connections and never answers hangs,
            and is not alive.
        is_serving: True if it answered SERVING.
        message: Its answer, or the reason why there is none.
        has_answered: True if there is an answer, whatever it says.
    """

    is_alive: bool
    is_serving: bool
    message: str
    has_answered: bool = False


def local_address(address: str) -> str:
    """Return the address on this machine of what listens on `HOST:PORT`, also where HOST is every interface.

    The address of a Unix socket stays as it is.

    Raises:
        ValueError: It is no address.
    """
    if address.startswith(UNIX):
        return address
    host, port = split_address(address)
    return joined(_ANYWHERE.get(host, host), port)


def ask_health(
    address: str,
    service: str = "",
    *,
    timeout_s: float,
    certificate: Path | None = None,
    client_certificate: tuple[Path, Path] | None = None,
) -> Condition:
    """Query the health of a service on this machine.

    Args:
        address: `HOST:PORT`.
        service: Full name of one; empty: the program as a whole.
        timeout_s: Longest time for connection and answer, in seconds.
        certificate: The one (PEM) that the program itself listens with: none other is believed; None: without TLS.
        client_certificate: Certificate and key (PEM) that are shown to it; None: none.

    Raises:
        SecurityError: A file cannot be used.
    """
    credentials = Credentials()
    options: tuple[tuple[str, str | int], ...] = (("grpc.enable_http_proxy", 0),)
    if certificate is not None:
        credentials = Credentials(
            ca=certificate,
            certificate=client_certificate and client_certificate[0],
            key=client_certificate and client_certificate[1],
        )
        # The certificate is for the external host name.
        options = (*options, ("grpc.ssl_target_name_override", _name_in(certificate)))
    return ask_service(address, service, credentials, timeout_s=timeout_s, options=options)


def ask_service(
    address: str,
    service: str,
    credentials: Credentials,
    *,
    timeout_s: float,
    options: tuple[tuple[str, str | int], ...] = (),
) -> Condition:
    """Query the health of a service.

    Args:
        address: `HOST:PORT`.
        service: Full name of one; empty: the program as a whole.
        credentials: Credentials for reaching it.
        timeout_s: Longest time for connection and answer, in seconds.
        options: Options of the channel.

    Raises:
        SecurityError: A file cannot be used.
    """
    with open_channel(address, credentials, options) as channel:
        # Request and response have the same bytes as these standard messages: one text, and one number.
        ask = channel.unary_unary(
            _METHOD, request_serializer=StringValue.SerializeToString, response_deserializer=UInt32Value.FromString
        )
        try:
            answer = ask(StringValue(value=service), timeout=timeout_s)
        except grpc.RpcError as error:
            is_alive = error.code() not in _UNANSWERED or (
                # The port is closed, or a handshake has failed.
                error.code() is grpc.StatusCode.UNAVAILABLE and _takes_connections(address, timeout_s)
            )
            return Condition(is_alive, False, f"{error.code().name}: {error.details()}")
    status = _STATUSES[answer.value] if answer.value < len(_STATUSES) else f"status {answer.value}"
    return Condition(True, status == "SERVING", status, has_answered=True)


def ask_alive(
    address: str,
    service: str = "",
    *,
    timeout_s: float,
    certificate: Path | None = None,
    client_certificate: tuple[Path, Path] | None = None,
) -> Condition:
    """Query whether a service is alive, for those who restart dead programs: unusable certificate files do not count.

    The program may still use the earlier content of the files.
    """
    try:
        return ask_health(
            address, service, timeout_s=timeout_s, certificate=certificate, client_certificate=client_certificate
        )
    except SecurityError as error:
        return Condition(_takes_connections(address, timeout_s), False, str(error))


def _takes_connections(address: str, timeout_s: float) -> bool:
    """Return True if the port or Unix socket accepts connections."""
    try:
        if address.startswith(UNIX):
            with socket.socket(socket.AF_UNIX) as line:
                line.settimeout(timeout_s)
                line.connect(address.removeprefix(UNIX))
            return True
        with socket.create_connection(split_address(address), timeout_s):
            return True
    except OSError:
        return False


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
        raise SecurityError(f"{certificate}: the certificate names no host") from error
    found: Sequence[str] = [
        *names.get_values_for_type(x509.DNSName),
        *map(str, names.get_values_for_type(x509.IPAddress)),
    ]
    if not found:
        raise SecurityError(f"{certificate}: the certificate names no host")
    # A wildcard certificate is valid for any host of the domain.
    return found[0].replace("*", "health", 1)
