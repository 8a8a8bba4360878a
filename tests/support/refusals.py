"""Details that a server reports of a call that it refuses."""

from typing import Any

from google.rpc import error_details_pb2, status_pb2

_DETAILS = "grpc-status-details-bin"


def reason_of(error: Any) -> str:
    """The reason in the details of a call's error, of grpc or of grpc.aio."""
    trailing = dict(error.trailing_metadata() or ())
    assert _DETAILS in trailing, error
    info = error_details_pb2.ErrorInfo()
    for detail in status_pb2.Status.FromString(trailing[_DETAILS]).details:
        if detail.Unpack(info):
            return str(info.reason)
    raise AssertionError(f"no reason is given: {error}")
