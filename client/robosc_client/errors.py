"""Errors of the client; callers never see a raw gRPC error.

ClientError
|-- ServerUnavailableError   no server answers at the address  (also a ConnectionError)
|-- CredentialsError         a certificate, key or token cannot be used
|-- DeadlineError            no result in time                 (also a TimeoutError)
|-- RequestRefusedError      the server refuses the request: malformed, too large, not allowed, beyond its limits
|   |-- ServerBusyError      the server may accept it later
|   `-- NotThereError        an event, a state or a run that is asked about is not there  (also a LookupError)
|-- JobError                 a job does not exist, has no result, or cannot be submitted
`-- ServiceError             the server failed, or sent an invalid answer
"""


class ClientError(Exception):
    """Root of every error of the client; its text is one sentence for people.

    Attributes:
        reason: Reason of the server, such as `SERVER_BUSY`, as documented in the API; empty: not given.
    """

    def __init__(self, message: str, reason: str = "") -> None:
        super().__init__(message)
        self.reason = reason


class ServerUnavailableError(ClientError, ConnectionError):
    """No server answers at the address, the connection was lost, or the server is shutting down."""


class CredentialsError(ClientError):
    """A certificate, key or token cannot be used."""


class DeadlineError(ClientError, TimeoutError):
    """The caller's deadline or the server's own limit passed before there was a result."""


class RequestRefusedError(ClientError):
    """The server refuses the request, or the task exceeded a limit."""


class ServerBusyError(RequestRefusedError):
    """The server is overloaded, or the caller is over its quota; the call may succeed later.

    Attributes:
        retry_after_s: Seconds after which the call may be retried; None: not given.
    """

    def __init__(self, message: str, reason: str = "", retry_after_s: float | None = None) -> None:
        super().__init__(message, reason)
        self.retry_after_s = retry_after_s


class NotThereError(RequestRefusedError, LookupError):
    """An event, a part of the model, a state or a run that an explanation is asked about is not there."""


class JobError(ClientError):
    """A job does not exist or has no result, or its idempotency key belongs to another task, see `reason`."""


class ServiceError(ClientError):
    """The server failed, or sent an invalid answer."""


def malformed(what: str) -> ServiceError:
    """Return the error for an invalid answer."""
    return ServiceError(f"the server's answer is malformed: {what}")
