"""Listening address and TLS configuration of a service."""

import logging
import os
import ssl
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import grpc

from robosc_api.security.addresses import UNIX, is_loopback_host, joined, split_address
from robosc_api.security.errors import SecurityError
from robosc_api.security.tokens import TokenFile

_log = logging.getLogger(__name__)

_MAXIMUM_BYTES = 1024 * 1024


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerSecurity:
    """Security of a service.

    Attributes:
        certificate: Chain of certificates (PEM), the service's own first; None: no TLS.
        key: Its private key (PEM, not encrypted).
        client_ca: Authorities (PEM) of client certificates; None: no client certificates are required.
        tokens: Token file; None: no tokens are required.
        insecure_beyond_loopback: True to allow connections from other machines without TLS.
        forwarded_identity: True if a proxy in front of the service sends the identity of callers.
    """

    certificate: Path | None = None
    key: Path | None = None
    client_ca: Path | None = None
    tokens: Path | None = None
    insecure_beyond_loopback: bool = False
    forwarded_identity: bool = False


def add_port(server: Any, address: str, security: ServerSecurity) -> str:
    """Let a gRPC server listen; returns `HOST:PORT` with the port that it got, or the address of the Unix socket.

    A replaced certificate is used for the next connections: the files are checked for each of them.

    Args:
        server: A `grpc.Server` or `grpc.aio.Server`.
        address: `HOST:PORT`; port 0 picks a free one. Or `unix:` and the path of a socket.
        security: Security of the server.

    Raises:
        SecurityError: The address needs TLS, a file is invalid, or the address is in use or belongs to another machine.
    """
    check_listening(address, security)
    if address.startswith(UNIX):
        return _add_socket(server, address)
    host, port = split_address(address)
    # gRPC's parser of addresses wants IPv6 in brackets, and takes a name that is a number for something else.
    name = joined(host, port)
    try:
        is_secure = security.certificate is not None
        got = server.add_secure_port(name, _credentials(security)) if is_secure else server.add_insecure_port(name)
    except RuntimeError:
        got = 0
    if got == 0:
        raise SecurityError(f"cannot listen on {name}: the address is in use or does not belong to this machine")
    return joined(host, got)


def _add_socket(server: Any, address: str) -> str:
    """Let a gRPC server listen on a Unix socket, to which this user and its group may connect."""
    path = Path(address.removeprefix(UNIX))
    # The socket exists before its mode can be set: until then no other user may connect.
    before = os.umask(0o177)
    try:
        got = server.add_insecure_port(address)
    except RuntimeError:
        got = 0
    finally:
        os.umask(before)
    if got == 0:
        raise SecurityError(f"cannot listen on {path}: it is in use, or its folder cannot be written")
    path.chmod(0o660)
    return address


def check_listening(address: str, security: ServerSecurity) -> None:
    """Check the configuration without reading the files.

    Raises:
        SecurityError: The configuration is not allowed for this address.
        ValueError: The address is none.
    """
    is_secure = security.certificate is not None
    if security.forwarded_identity and security.tokens is not None:
        raise SecurityError("callers are known by tokens or by a proxy's word, and not by both: set only one of them")
    if address.startswith(UNIX):
        if is_secure:
            raise SecurityError("a Unix socket has no TLS: leave out certificate, key and client certificates")
        return
    if security.forwarded_identity and security.client_ca is None:
        raise SecurityError(
            "a forwarded identity is trusted only over a Unix socket, or from a proxy with a client certificate: "
            "otherwise every caller could name anybody"
        )
    host, _ = split_address(address)
    if is_secure != (security.key is not None):
        raise SecurityError("a certificate and its key must be given together: one of them is missing")
    if security.client_ca is not None and not is_secure:
        raise SecurityError("client certificates need TLS: set certificate and key, too")
    if not is_secure and not security.insecure_beyond_loopback and not is_loopback_host(host):
        raise SecurityError(
            f"{address} is reachable from other machines, and a connection without TLS can be read and changed: set a "
            "certificate and key, or insecure_beyond_loopback on a trusted network"
        )


def check_files(security: ServerSecurity) -> None:
    """Read the files of the configuration, to detect errors before the service listens.

    Raises:
        SecurityError: One of them cannot be used.
    """
    if security.certificate is not None:
        _checked(security)
    if security.tokens is not None:
        TokenFile(security.tokens)


@dataclass(frozen=True, slots=True)
class _Files:
    """Data that gRPC is given, as it stands in the files."""

    certificate: bytes
    key: bytes
    client_ca: bytes | None


def _credentials(security: ServerSecurity) -> grpc.ServerCredentials:
    latest = _checked(security)
    last_error: object = None

    def configuration(files: _Files) -> Any:
        return grpc.ssl_server_certificate_configuration([(files.key, files.certificate)], files.client_ca)

    def changed() -> Any:
        """Return a changed configuration; None: unchanged. Called for each connection."""
        nonlocal latest, last_error
        found: object = None
        try:
            found = _read(security)
            if found == latest:
                last_error = None
                return None
            latest = _checked(security)
        except SecurityError as error:
            # The file may be half written: keep the current one. Logged once for each change, not for each connection.
            if last_error != (found or str(error)):
                _log.error("the changed certificate is not used: %s", error)
            last_error = found or str(error)
            return None
        last_error = None
        _log.info("%s: reloaded", security.certificate)
        return configuration(latest)

    return grpc.dynamic_ssl_server_credentials(
        configuration(latest), changed, require_client_authentication=security.client_ca is not None
    )


def _checked(security: ServerSecurity) -> _Files:
    """Return the files, if OpenSSL accepts their combination: gRPC would fail only in each handshake.

    Raises:
        SecurityError: They do not.
    """
    files = _read(security)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(str(security.certificate), str(security.key), password=_no_password)
    except (ssl.SSLError, ValueError) as error:
        text = getattr(error, "reason", None) or error
        raise SecurityError(f"{security.certificate} and {security.key} cannot be used: {text}") from error
    if security.client_ca is not None:
        check_certificates(security.client_ca)
    if security.key is not None:
        warn_if_readable_by_others(security.key)
    return files


def _no_password() -> bytes:
    raise ValueError("the key is encrypted: use a key without a password")


def check_certificates(path: Path) -> bytes:
    """The bytes of a file of trusted certificates.

    Raises:
        SecurityError: It cannot be read, or holds no certificate.
    """
    data = read(path)
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT).load_verify_locations(cadata=data.decode("ascii"))
    except (ssl.SSLError, ValueError) as error:
        raise SecurityError(f"{path}: contains no PEM certificates") from error
    return data


def _read(security: ServerSecurity) -> _Files:
    if security.certificate is None or security.key is None:
        raise SecurityError("a certificate and its key must be given together: one of them is missing")
    client_ca = None if security.client_ca is None else read(security.client_ca)
    return _Files(read(security.certificate), read(security.key), client_ca)


def read_secret(path: Path) -> bytes:
    """The bytes of a file with a key or a token, as `read`; logs a warning if other users can read it."""
    data = read(path)
    warn_if_readable_by_others(path)
    return data


def warn_if_readable_by_others(path: Path) -> None:
    """Log a warning if other users can read a secret file."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return
    if os.name == "posix" and mode & (stat.S_IRGRP | stat.S_IROTH):
        _log.warning("%s: other users may read this file: run chmod go-r on it", path)


def read(path: Path) -> bytes:
    """The bytes of a file with certificates, a key or a token.

    Raises:
        SecurityError: It cannot be read, or is far too large for one.
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(_MAXIMUM_BYTES + 1)
    except OSError as error:
        raise SecurityError(f"{path}: {error.strerror}") from error
    if len(data) > _MAXIMUM_BYTES:
        raise SecurityError(f"{path}: larger than {_MAXIMUM_BYTES} bytes")
    return data
