"""What can go wrong between client and server; callers never see a raw gRPC error.

ClientError
|-- ServerUnavailableError   nobody answers at the address     (also a ConnectionError)
|-- CredentialsError         a certificate, key or token cannot be used
|-- DeadlineError            no result in time                 (also a TimeoutError)
|-- RequestRefusedError      the server refuses the request: malformed, too large, too busy, not allowed
`-- ServiceError             the server failed, or answered what no RoboSC server answers
"""


class ClientError(Exception):
    """Root of every error of the client; its text is one sentence for people."""


class ServerUnavailableError(ClientError, ConnectionError):
    """Nobody answers at the address, or the connection was lost."""


class CredentialsError(ClientError):
    """A certificate, key or token cannot be used."""


class DeadlineError(ClientError, TimeoutError):
    """The caller's deadline or the server's own limit passed before there was a result."""


class RequestRefusedError(ClientError):
    """The server refuses the request."""


class ServiceError(ClientError):
    """The server failed, or answered what no RoboSC server answers."""
