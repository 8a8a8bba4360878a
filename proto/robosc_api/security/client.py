"""Credentials of a client, and channels that use them."""

import logging
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import grpc
import grpc.aio

from robosc_api.security.addresses import is_loopback_host, split_address
from robosc_api.security.errors import SecurityError
from robosc_api.security.listening import check_certificates, read, read_secret
from robosc_api.security.tokens import MAXIMUM_TOKEN, stamp_of

_log = logging.getLogger(__name__)

_CLOSE_S = 0.5
"""Time for a program that an error ends to close a channel, in seconds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Credentials:
    """Credentials for a service.

    Attributes:
        is_secure: True to use TLS with the system's certificate authorities; a CA or certificate implies TLS.
        ca: Certificate authorities (PEM) to trust instead; None: those of the system.
        certificate: Client certificate chain (PEM); None: none.
        key: Its private key.
        token_file: File that contains only the caller's token, and is read again when it has changed; None: no token is
            sent.
    """

    is_secure: bool = False
    ca: Path | None = None
    certificate: Path | None = None
    key: Path | None = None
    token_file: Path | None = None


def open_channel(
    address: str,
    credentials: Credentials = Credentials(),
    options: tuple[tuple[str, Any], ...] = (),
) -> grpc.Channel:
    """Open a channel to a service; it connects with the first call.

    Raises:
        SecurityError: A file cannot be used, or a token would be sent without TLS to another machine.
    """
    token = _usable_token(address, credentials)
    if _is_secure(credentials):
        channel = grpc.secure_channel(address, _channel_credentials(credentials), options=options)
    else:
        channel = grpc.insecure_channel(address, options=options)
    return channel if token is None else grpc.intercept_channel(channel, _Bearer(token))


def open_async_channel(
    address: str,
    credentials: Credentials = Credentials(),
    options: tuple[tuple[str, Any], ...] = (),
) -> grpc.aio.Channel:
    """Open a channel for asyncio, for calls with a single request.

    Raises:
        SecurityError: As `open_channel`.
    """
    token = _usable_token(address, credentials)
    interceptors = [] if token is None else [_AsyncBearer(token), _AsyncStreamBearer(token)]
    if _is_secure(credentials):
        secrets = _channel_credentials(credentials)
        return grpc.aio.secure_channel(address, secrets, options=options, interceptors=interceptors)
    return grpc.aio.insecure_channel(address, options=options, interceptors=interceptors)


def close_channel(channel: grpc.Channel, error: BaseException | None = None) -> None:
    """Close a channel; open calls are cancelled.

    Args:
        channel: Channel to close.
        error: Error that ends its use, if one does. An interrupt during the start of a call, which may come out as
            another error, would make gRPC wait for ever for the call's end, so the wait is bounded then.
    """
    if error is None:
        channel.close()
        return
    # Closing cancels all calls before it waits.
    ending = threading.Thread(target=channel.close, daemon=True)
    ending.start()
    ending.join(_CLOSE_S)


def _is_secure(credentials: Credentials) -> bool:
    return credentials.is_secure or credentials.ca is not None or credentials.certificate is not None


class _TokenSource:
    """Token of a file, which may be replaced by another one while the channel is open.

    Args:
        path: Path of the file.

    Raises:
        SecurityError: The file cannot be used.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        # The order matters: a token that is replaced meanwhile is read with the next call.
        self._stamp = _stamp(path)
        self._token = _token(path)
        self._is_failing = False

    def authorization(self) -> tuple[str, str]:
        """Return the metadata of a call; the previous token stays if the changed file cannot be used."""
        try:
            stamp = _stamp(self._path)
            if stamp != self._stamp:
                self._token, self._stamp = _token(self._path), stamp
            self._is_failing = False
        except SecurityError as error:
            if not self._is_failing:
                _log.warning("the changed token is not used: %s", error)
            self._is_failing = True
        return "authorization", f"Bearer {self._token}"


def _stamp(path: Path) -> tuple[int, int, int]:
    try:
        return stamp_of(path.stat())
    except OSError as error:
        raise SecurityError(f"{path}: {error.strerror}") from error


def _usable_token(address: str, credentials: Credentials) -> _TokenSource | None:
    """Return the token, if it may be sent to the address."""
    token = None if credentials.token_file is None else _TokenSource(credentials.token_file)
    if token is not None and not _is_secure(credentials) and not is_loopback_host(_host(address)):
        raise SecurityError(
            f"a token may be sent to another machine only with TLS, and {address} is on another machine"
        )
    return token


def check_credentials(credentials: Credentials) -> None:
    """Read the files that a service would be reached with.

    Raises:
        SecurityError: One of them cannot be used.
    """
    _channel_credentials(credentials)
    if credentials.token_file is not None:
        _token(credentials.token_file)


def _host(address: str) -> str:
    try:
        return split_address(address)[0]
    except ValueError:
        return ""


def _channel_credentials(credentials: Credentials) -> grpc.ChannelCredentials:
    if (credentials.certificate is None) != (credentials.key is None):
        raise SecurityError("a certificate and its key must be given together: one of them is missing")
    return grpc.ssl_channel_credentials(
        None if credentials.ca is None else check_certificates(credentials.ca),
        None if credentials.key is None else read_secret(credentials.key),
        None if credentials.certificate is None else read(credentials.certificate),
    )


def _token(path: Path) -> str:
    try:
        token = read_secret(path).decode("ascii").strip()
    except UnicodeDecodeError:
        token = ""
    if not token.isprintable() or not 0 < len(token) <= MAXIMUM_TOKEN or any(map(str.isspace, token)):
        raise SecurityError(f"{path}: must contain exactly one token")
    return token


class _Bearer(grpc.UnaryUnaryClientInterceptor, grpc.UnaryStreamClientInterceptor, grpc.StreamStreamClientInterceptor):
    """Interceptor that adds a token to each call."""

    def __init__(self, token: _TokenSource) -> None:
        self._token = token

    def intercept_unary_unary(self, continuation: Any, client_call_details: Any, request: Any) -> Any:
        """Add the token."""
        return continuation(self._with_token(client_call_details), request)

    def intercept_unary_stream(self, continuation: Any, client_call_details: Any, request: Any) -> Any:
        """Add the token."""
        return continuation(self._with_token(client_call_details), request)

    def intercept_stream_stream(self, continuation: Any, client_call_details: Any, request_iterator: Any) -> Any:
        """Add the token."""
        return continuation(self._with_token(client_call_details), request_iterator)

    def _with_token(self, meant: Any) -> "_Details":
        return _Details(meant, (*(meant.metadata or ()), self._token.authorization()))


class _Details(grpc.ClientCallDetails):
    """Details of a call with other metadata."""

    def __init__(self, meant: Any, metadata: Any) -> None:
        self.method = meant.method
        self.timeout = meant.timeout
        self.metadata = metadata
        self.credentials = meant.credentials
        self.wait_for_ready = meant.wait_for_ready
        self.compression = meant.compression


class _AsyncBearer(grpc.aio.UnaryUnaryClientInterceptor):
    """Interceptor that adds a token to each unary call of asyncio."""

    def __init__(self, token: _TokenSource) -> None:
        self._token = token

    async def intercept_unary_unary(self, continuation: Any, client_call_details: Any, request: Any) -> Any:
        """Add the token."""
        return await continuation(_with_entry(client_call_details, self._token.authorization()), request)


class _AsyncStreamBearer(grpc.aio.UnaryStreamClientInterceptor):
    """Interceptor that adds a token to each call of asyncio with a stream of responses."""

    def __init__(self, token: _TokenSource) -> None:
        self._token = token

    async def intercept_unary_stream(self, continuation: Any, client_call_details: Any, request: Any) -> Any:
        """Add the token."""
        return await continuation(_with_entry(client_call_details, self._token.authorization()), request)


def _with_entry(meant: Any, entry: tuple[str, str]) -> Any:
    return meant._replace(metadata=grpc.aio.Metadata(*(meant.metadata or ()), entry))
