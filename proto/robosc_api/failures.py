"""Details of failed gRPC calls in the form of google.rpc (AIP-193)."""

from typing import Any

import grpc
from google.protobuf import any_pb2, duration_pb2
from google.rpc import error_details_pb2, status_pb2
from grpc_status import rpc_status

from robosc_api.calls import REQUEST_ID_HEADER, request_id

DOMAIN = "robosc"
"""Domain of google.rpc.ErrorInfo."""

type Metadata = tuple[tuple[str, str | bytes], ...]


def failure_metadata(code: grpc.StatusCode, message: str, reason: str, retry_after_s: float | None = None) -> Metadata:
    """Return the trailing metadata of a failed call, with its identifier if it is under way and has one.

    Args:
        code: Its status code.
        message: One sentence for the caller.
        reason: Identifier of the cause in capital letters.
        retry_after_s: Seconds after which the call may be retried; None: no retry, or unknown.
    """
    details = [_packed(error_details_pb2.ErrorInfo(reason=reason, domain=DOMAIN))]
    identifier = request_id()
    trailing: Metadata = ((REQUEST_ID_HEADER, identifier),) if identifier else ()
    if retry_after_s is not None:
        delay = duration_pb2.Duration()
        delay.FromNanoseconds(round(retry_after_s * 1e9))
        details.append(_packed(error_details_pb2.RetryInfo(retry_delay=delay)))
        trailing = (*trailing, ("retry-after", f"{retry_after_s:.3f}"))
    status = rpc_status.to_status(status_pb2.Status(code=code.value[0], message=message, details=details))
    return (*trailing, *status.trailing_metadata)


def reason_of(metadata: Any) -> str:
    """The reason in the trailing metadata of a call that has failed; empty: there is none."""
    for key, value in metadata or ():
        if key == "grpc-status-details-bin":
            for detail in status_pb2.Status.FromString(value).details:
                info = error_details_pb2.ErrorInfo()
                if detail.Unpack(info):
                    return str(info.reason)
    return ""


def _packed(message: Any) -> any_pb2.Any:
    packed = any_pb2.Any()
    packed.Pack(message)
    return packed
