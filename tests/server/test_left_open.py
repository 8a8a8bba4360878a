"""Tests of things callers leave open: connections without a word, calls without a request, streams gone silent."""

import socket
import struct
from collections.abc import Iterator
from typing import Any

import grpc
import pytest
from grpc_reflection.v1alpha import reflection_pb2

from robosc_api.failures import reason_of
from robosc_api.request_timeouts import REFLECTION_METHODS
from robosc_api.v1 import jobs_pb2, synthesis_pb2, synthesis_pb2_grpc
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server import application
from robosc_server.tasks.requests import RequestLimits
from support.job_workers import StartedWorkers
from support.service import served
from support.strangers import END_OF_HEADERS, END_OF_STREAM, SETTINGS, strangers
from support.waiting import PATIENCE_S, eventually

STUB: Any = synthesis_pb2_grpc.SynthesisServiceStub
MAXIMUM_CONCURRENT_STREAMS = 3
SERVICES = (synthesis_pb2.DESCRIPTOR, jobs_pb2.DESCRIPTOR)
METHODS = [
    f"/{service.full_name}/{method.name}"
    for file in SERVICES
    for service in file.services_by_name.values()
    for method in service.methods
] + ["/grpc.health.v1.Health/Check", "/grpc.health.v1.Health/Watch", REFLECTION_METHODS[-1]]
UNKNOWN_FIELD = b"\x98\x06\x01"


@pytest.fixture(scope="module")
def quick() -> Iterator[str]:
    with served(given_workers=StartedWorkers()) as address:
        yield address


def test_whatever_is_called_the_request_comes_in_time() -> None:
    with served(given_workers=StartedWorkers(), request_seconds=0.3) as address, strangers(address, 1) as (stranger,):
        for place, method in enumerate(METHODS):
            stranger.call(2 * place + 1, method)
        assert eventually(lambda: stranger.ended == len(METHODS))
        assert stranger.has_received(b"request did not arrive within 0.3 seconds")
        # The first has its request at once: its end.
        stranger.call(2 * len(METHODS) + 1, METHODS[0], flags=END_OF_HEADERS | END_OF_STREAM)
        assert eventually(lambda: stranger.ended == len(METHODS) + 1)


def test_reflection_is_not_left_open(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(application, "_REFLECTION_IDLE_S", 0.3)
    with served(given_workers=StartedWorkers()) as address, strangers(address, 1) as (stranger,):
        stranger.call(1, REFLECTION_METHODS[-1])
        stranger.message(1, reflection_pb2.ServerReflectionRequest(list_services="").SerializeToString())
        assert eventually(lambda: stranger.has_received(b"each further one within 0.3"))


def test_connections_without_a_word_are_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(application, "_HANDSHAKE_LIMIT_S", 0.3)
    with served(given_workers=StartedWorkers()) as address:
        host, _, port = address.rpartition(":")
        with socket.create_connection((host, int(port)), PATIENCE_S) as line:
            while line.recv(1024):
                pass


def test_connections_without_a_call_are_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(application, "_IDLE_S", 0.3)
    with served(given_workers=StartedWorkers()) as address, strangers(address, 1) as (stranger,):
        assert eventually(lambda: not stranger.is_open)


def test_calls_of_one_connection_and_their_metadata_are_bounded() -> None:
    with (
        served(given_workers=StartedWorkers(), open_calls_per_caller=7) as address,
        strangers(address, 1) as (stranger,),
    ):
        assert eventually(lambda: any(kind == SETTINGS and not flags for kind, flags, _ in stranger.frames))
        payload = next(content for kind, flags, content in stranger.frames if kind == SETTINGS and not flags)
        settings = {struct.unpack_from(">HI", payload, at) for at in range(0, len(payload), 6)}
        assert (MAXIMUM_CONCURRENT_STREAMS, 1007) in settings
        with grpc.insecure_channel(address) as channel:
            stub = STUB(channel)
            stub.GetVersion(pb.GetVersionRequest(), timeout=PATIENCE_S, metadata=(("x-much", "x" * 7000),))
            with pytest.raises(grpc.RpcError, match="RESOURCE_EXHAUSTED"):
                stub.GetVersion(pb.GetVersionRequest(), timeout=PATIENCE_S, metadata=(("x-much", "x" * 9000),))


def test_a_request_that_is_too_large_is_refused_with_a_reason() -> None:
    limits = RequestLimits(bundle_bytes=1000)
    with (
        served(given_workers=StartedWorkers(), bundle_bytes=1000) as address,
        grpc.insecure_channel(address) as channel,
    ):

        def refusal(size: int, submits: bool) -> tuple[Any, str]:
            check = pb.CheckRequest(bundle=pb.Bundle(main=pb.SourceFile(name="robot.rscd", text="x" * size)))
            name = "/robosc_api.v1.SynthesisService/Check"
            request = check.SerializeToString()
            if submits:
                name = "/robosc_api.v1.JobService/SubmitJob"
                request = jobs_pb2.SubmitJobRequest(task=jobs_pb2.Task(check=check)).SerializeToString()
            call: Any = channel.unary_unary(name)
            with pytest.raises(grpc.RpcError) as caught:
                call(request, timeout=PATIENCE_S)
            error: Any = caught.value
            return error.code(), reason_of(error.trailing_metadata())

        expected = grpc.StatusCode.RESOURCE_EXHAUSTED, "REQUEST_TOO_LARGE"
        for submits in (False, True):
            for size in (991, limits.request_bytes, 2 * limits.request_bytes):
                assert refusal(size, submits) == expected
            # gRPC's own answer, and the server goes on.
            assert refusal(3 * limits.request_bytes, submits) == (grpc.StatusCode.RESOURCE_EXHAUSTED, "")
            assert refusal(991, submits) == expected


def test_a_packed_request_is_not_unpacked(quick: str) -> None:
    """A request of a few hundred bytes would be megabytes before any limit is asked."""
    with grpc.insecure_channel(quick) as channel:
        stub = STUB(channel)
        with pytest.raises(grpc.RpcError) as caught:
            stub.GetVersion(pb.GetVersionRequest(), timeout=PATIENCE_S, compression=grpc.Compression.Gzip)
        error: Any = caught.value
        assert error.code() is grpc.StatusCode.UNIMPLEMENTED
        stub.GetVersion(pb.GetVersionRequest(), timeout=PATIENCE_S)


SHORT = [method for method in METHODS if "SynthesisService" not in method and not method.endswith("SubmitJob")]


@pytest.mark.parametrize("method", [*SHORT, "/robosc_api.v1.SynthesisService/GetVersion"])
def test_a_request_without_a_model_is_short(method: str, quick: str) -> None:
    with grpc.insecure_channel(quick) as channel:
        call: Any = channel.stream_stream(method)
        with pytest.raises(grpc.RpcError) as caught:
            list(call(iter([UNKNOWN_FIELD * 20_000]), timeout=PATIENCE_S))
        error: Any = caught.value
        assert reason_of(error.trailing_metadata()) in ("MALFORMED_REQUEST", "REQUEST_TOO_LARGE")
