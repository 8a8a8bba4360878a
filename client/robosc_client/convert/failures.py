"""Failure of a call, as gRPC reports it and as google.rpc adds to it (AIP-193)."""

import math
from dataclasses import dataclass
from typing import Any

import grpc

from robosc.source import visible

_DETAILS = "grpc-status-details-bin"
_DOMAIN = "robosc"
_MAXIMUM_MESSAGE = 2000
_MAXIMUM_REASON = 400


@dataclass(frozen=True, slots=True)
class Failure:
    """Failure of a call.

    Attributes:
        code: gRPC's status code.
        message: One sentence; harmless on a terminal.
        reason: Server's word for the reason; empty: it has given none.
        retry_after_s: Seconds after which the server wants to be asked again; None: it has not said.
    """

    code: grpc.StatusCode
    message: str = ""
    reason: str = ""
    retry_after_s: float | None = None


def first_line(text: str) -> str:
    """Return the words of gRPC or a server about a connection, as a sentence may end with them.

    They are bounded, and harmless on a terminal.
    """
    return visible(text[:_MAXIMUM_REASON].strip().partition("\n")[0].rstrip())


def failure_of(error: grpc.RpcError) -> Failure:
    """Return the failure of a call; malformed details count as not given."""
    # Every error of a call is also a grpc.Call; the stubs do not say so.
    call: Any = error
    details = call.details() or ""
    message = visible(details[:_MAXIMUM_MESSAGE])
    for key, value in call.trailing_metadata() or ():
        if key == _DETAILS and isinstance(value, bytes):
            reason, retry_after_s = _details(value)
            return Failure(call.code(), message, reason, retry_after_s)
    # Without a word of a server, this is gRPC's own.
    return Failure(call.code(), first_line(details) if call.code() is grpc.StatusCode.UNAVAILABLE else message)


def _details(content: bytes) -> tuple[str, float | None]:
    """Reason, and seconds to wait. What they are written in is imported when it is needed."""
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
