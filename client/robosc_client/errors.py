"""Errors between client and server; callers never see a raw gRPC error.

ClientError
|-- ServerUnavailableError   nobody answers at the address     (also a ConnectionError)
|-- CredentialsError         a certificate, key or token cannot be used
|-- DeadlineError            no result in time                 (also a TimeoutError)
|-- RequestRefusedError      the server refuses the request: malformed, too large, not allowed, beyond its limits
|   `-- ServerBusyError      it may take it later
|-- JobError                 a job is not there, has no result, or cannot be made
`-- ServiceError             the server failed, or answered what no RoboSC server answers
"""


class ClientError(Exception):
    """Root of every error of the client; its text is one sentence for people.

    Attributes:
        reason: Reason in the server's words: a word such as `SERVER_BUSY`, documented in the API; empty where the
            server has given none.
    """

    def __init__(self, message: str, reason: str = "") -> None:
        super().__init__(message)
        self.reason = reason


class ServerUnavailableError(ClientError, ConnectionError):
    """Nobody answers at the address, the connection was lost, or the server is about to end."""


class CredentialsError(ClientError):
    """A certificate, key or token cannot be used."""


class DeadlineError(ClientError, TimeoutError):
    """The caller's deadline or the server's own limit passed before there was a result."""


class RequestRefusedError(ClientError):
    """The server refuses the request, or gave it up for what it takes."""


class ServerBusyError(RequestRefusedError):
    """The server has too much to do, or this caller asks for too much; later may be better.

    Attributes:
        retry_after_s: Seconds after which the server would be asked again; None: it has not said.
    """

    def __init__(self, message: str, reason: str = "", retry_after_s: float | None = None) -> None:
        super().__init__(message, reason)
        self.retry_after_s = retry_after_s


class JobError(ClientError):
    """A job is not there, has no result, or its idempotency key was used for another task; `reason` says which."""


class ServiceError(ClientError):
    """The server failed, or answered what no RoboSC server answers."""


def malformed(what: str) -> ServiceError:
    """The error for an answer that no RoboSC server gives."""
    return ServiceError(f"the server's answer is malformed: {what}")
