"""Reporting of failures over gRPC: a status code, and details in the form of google.rpc (AIP-193)."""

from typing import Any, NoReturn

import grpc

from robosc_api.failures import failure_metadata
from robosc_server.operations.logs import log_fault, log_limit
from robosc_server.tasks.task import Failure, Reason, RefusedError

MAXIMUM_MESSAGE_BYTES = 1000
"""Maximum size of a sentence for a caller, in bytes of UTF-8; percent-encoded it is up to three times as long."""

_CODES = {
    Reason.MALFORMED_REQUEST: grpc.StatusCode.INVALID_ARGUMENT,
    Reason.REQUEST_TOO_LARGE: grpc.StatusCode.RESOURCE_EXHAUSTED,
    Reason.SERVER_BUSY: grpc.StatusCode.RESOURCE_EXHAUSTED,
    Reason.QUOTA_EXCEEDED: grpc.StatusCode.RESOURCE_EXHAUSTED,
    Reason.CPU_LIMIT: grpc.StatusCode.RESOURCE_EXHAUSTED,
    Reason.MEMORY_LIMIT: grpc.StatusCode.RESOURCE_EXHAUSTED,
    Reason.NODE_LIMIT: grpc.StatusCode.RESOURCE_EXHAUSTED,
    Reason.RESULT_TOO_LARGE: grpc.StatusCode.RESOURCE_EXHAUSTED,
    Reason.TIME_LIMIT: grpc.StatusCode.DEADLINE_EXCEEDED,
    Reason.WORKER_DIED: grpc.StatusCode.INTERNAL,
    Reason.INTERNAL_FAULT: grpc.StatusCode.INTERNAL,
    Reason.SERVER_DIED: grpc.StatusCode.ABORTED,
    Reason.SHUTTING_DOWN: grpc.StatusCode.UNAVAILABLE,
    Reason.STORE_UNAVAILABLE: grpc.StatusCode.UNAVAILABLE,
    Reason.WORKERS_UNAVAILABLE: grpc.StatusCode.UNAVAILABLE,
    Reason.NO_SUCH_JOB: grpc.StatusCode.NOT_FOUND,
    Reason.JOB_NOT_ENDED: grpc.StatusCode.FAILED_PRECONDITION,
    Reason.JOB_HAS_FAILED: grpc.StatusCode.FAILED_PRECONDITION,
    Reason.JOB_CANCELLED: grpc.StatusCode.FAILED_PRECONDITION,
    Reason.IDEMPOTENCY_KEY_REUSED: grpc.StatusCode.ALREADY_EXISTS,
    Reason.UNAUTHENTICATED: grpc.StatusCode.UNAUTHENTICATED,
    Reason.TOKEN_EXPIRED: grpc.StatusCode.UNAUTHENTICATED,
    Reason.PERMISSION_DENIED: grpc.StatusCode.PERMISSION_DENIED,
}

_FAULTS = frozenset({Reason.WORKER_DIED, Reason.INTERNAL_FAULT})
"""Reasons that are to be reported; the others are refusals by a limit."""


def code_of(reason: Reason) -> grpc.StatusCode:
    """Return the status code of a reason."""
    return _CODES[reason]


async def abort(context: Any, error: RefusedError) -> NoReturn:
    """Abort a call of grpc.aio with the status, message and details of an error."""
    code = code_of(error.reason)
    # The metadata has the message twice, and clients accept 8 KiB: longer metadata would lose the reason as well.
    message = error.message.encode("utf-8", "replace")[:MAXIMUM_MESSAGE_BYTES].decode("utf-8", "ignore")
    metadata = failure_metadata(code, message, error.reason, error.retry_after_s)
    await context.abort(code, message, metadata)
    raise AssertionError("unreachable: abort raises")


def public_failure(failure: Failure) -> Failure:
    """Return a failure without its details, which are logged: those of a fault under an id that the caller gets."""
    if not failure.details:
        return failure
    if failure.reason not in _FAULTS:
        log_limit(failure.details, failure.reason)
        return Failure(failure.reason, failure.message)
    fault = log_fault(failure.details, failure.reason)
    return Failure(failure.reason, f"{failure.message}; {fault_message(fault)}")


def fault_message(identity: str) -> str:
    """Return the message for a caller about an internal error that the log has under an id."""
    return f"internal error {identity}, please report it with the server's log"
