"""Failure of a call: status and message of gRPC, and details of google.rpc (AIP-193)."""

import math
from dataclasses import dataclass
from typing import Any

import grpc

from robosc.source import visible

_LOST = ("Stream removed", "Received RST_STREAM", "RST_STREAM")
"""Beginnings of gRPC's own messages about a stream that ended without a status.

A proxy ends the streams of a server that it has lost so: by the last frame of its data, or by a reset. Without a proxy,
gRPC sees the lost connection itself, and says UNAVAILABLE.
"""

_LOST_CODES = frozenset({grpc.StatusCode.UNKNOWN, grpc.StatusCode.INTERNAL, grpc.StatusCode.CANCELLED})

_DETAILS = "grpc-status-details-bin"
_DOMAIN = "robosc"
_MAXIMUM_MESSAGE = 2000
_MAXIMUM_REASON = 400


@dataclass(frozen=True, slots=True)
class Failure:
    """Failure of a call.

    Attributes:
        code: gRPC's status code.
        message: One sentence without control characters.
        reason: Reason of the server, such as `SERVER_BUSY`; empty: not given.
        retry_after_s: Seconds after which the call may be retried; None: not given.
    """

    code: grpc.StatusCode
    message: str = ""
    reason: str = ""
    retry_after_s: float | None = None


def first_line(text: str) -> str:
    """Return the first line of an error message of gRPC or a server, bounded and without control characters."""
    return visible(text[:_MAXIMUM_REASON].strip().partition("\n")[0].rstrip())


def failure_of(error: grpc.RpcError) -> Failure:
    """Return the failure of a call; malformed details count as not given."""
    # Every error of a call is also a grpc.Call, which the type stubs omit.
    call: Any = error
    details = call.details() or ""
    message = visible(details[:_MAXIMUM_MESSAGE])
    for key, value in call.trailing_metadata() or ():
        if key == _DETAILS and isinstance(value, bytes):
            reason, retry_after_s = _details(value)
            return Failure(call.code(), message, reason, retry_after_s)
    # A message without details of a server is from gRPC itself.
    is_lost = call.code() in _LOST_CODES and details.startswith(_LOST)
    code = grpc.StatusCode.UNAVAILABLE if is_lost else call.code()
    return Failure(code, first_line(details) if code is grpc.StatusCode.UNAVAILABLE else message)


def _details(content: bytes) -> tuple[str, float | None]:
    """Return the reason and the delay of a retry; the modules for them are imported on use."""
    from google.protobuf.message import DecodeError
    from google.rpc import error_details_pb2, status_pb2

    reason, retry_after_s = "", None
    try:
        for item in status_pb2.Status.FromString(content).details:
            info, retry = error_details_pb2.ErrorInfo(), error_details_pb2.RetryInfo()
            if item.Unpack(info) and info.domain == _DOMAIN:
                reason = visible(info.reason[:100])
            elif item.Unpack(retry):
                seconds = retry.retry_delay.seconds + retry.retry_delay.nanos / 1e9
                retry_after_s = seconds if math.isfinite(seconds) and seconds >= 0 else None
    except DecodeError:
        return "", None
    return reason, retry_after_s
