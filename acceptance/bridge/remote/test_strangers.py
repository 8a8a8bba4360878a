"""Callers without a token who hold connections and calls, over real sockets."""

import logging
import threading
import time
from collections.abc import Iterator
from typing import Any

import grpc
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc

from robosc_bridge.remote import RemoteEndpoint
from support.remote import FakeDaemon, served
from support.waiting import PATIENCE_S


@pytest.fixture
def daemon() -> Any:
    with FakeDaemon() as made:
        yield made


@pytest.fixture
def endpoint(daemon: FakeDaemon) -> Any:
    with served(daemon) as made:
        yield made


@pytest.mark.real_time
def test_streams_without_an_end_do_not_keep_it_from_ending(
    daemon: FakeDaemon, endpoint: RemoteEndpoint, caplog: pytest.LogCaptureFixture
) -> None:
    forever = threading.Event()

    def nothing() -> Iterator[bytes]:
        forever.wait(PATIENCE_S)
        yield from ()

    channel: Any
    with grpc.insecure_channel(endpoint.address) as channel:
        reflect = channel.stream_stream("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo")
        attach = channel.stream_stream("/robosc_api.v1.BridgeService/Attach")
        calls = [reflect(nothing()) for _ in range(20)] + [attach(nothing()) for _ in range(5)]
        # Calls that follow on the same connection are answered after them.
        health_pb2_grpc.HealthStub(channel).Check(health_pb2.HealthCheckRequest(), timeout=PATIENCE_S)
        begin_s = time.monotonic()
        endpoint.stop()
        assert time.monotonic() - begin_s < 4.0
        forever.set()
        # The last ones on a busy machine are ended by gRPC itself.
        assert "the bridge ends" in {call.details() for call in calls} <= {"the bridge ends", "CANCELLED"}
    assert not [record for record in caplog.records if record.levelno >= logging.ERROR or record.exc_info]
