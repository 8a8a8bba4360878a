"""Bytes that are no message of the service."""

from typing import Any

import grpc
import pytest

from support.service import served


@pytest.mark.parametrize("method", ["Check", "Synthesize", "Generate"])
def test_bytes_that_are_no_message_are_the_callers_fault(method: str, capfd: pytest.CaptureFixture[str]) -> None:
    channel: Any  # the stubs know the types of generated methods only
    with served() as address, grpc.insecure_channel(address) as channel:
        path = f"/robosc_api.v1.SynthesisService/{method}"
        with pytest.raises(grpc.RpcError) as raised:
            if method == "Synthesize":
                list(channel.unary_stream(path)(b"\xff\xff\xff\xff", timeout=20))
            else:
                channel.unary_unary(path)(b"\xff", timeout=20)
        assert raised.value.code() is grpc.StatusCode.INVALID_ARGUMENT
        assert raised.value.details() == "the request is no message of this service"
    assert "Traceback" not in capfd.readouterr().err
