"""Callers without a token who hold connections and calls, over real sockets."""

import socket
import struct
import time
from typing import Any

import grpc
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection_pb2

from robosc_api.request_timeouts import REFLECTION_METHODS
from robosc_api.v1 import bridge_pb2 as pb
from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.remote import RemoteEndpoint
from robosc_bridge.remote import endpoint as endpoint_module
from robosc_bridge.remote.connection_slots import ConnectionSlots
from robosc_bridge.remote.endpoint import MAXIMUM_CALLS, MAXIMUM_CONNECTIONS
from support.remote import FakeDaemon, connected, served
from support.strangers import SETTINGS, strangers
from support.waiting import PATIENCE_S, wait_until


def test_connections_that_take_all_places_are_reported(
    daemon: FakeDaemon, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(endpoint_module, "IDLE_S", 3600.0)
    monkeypatch.setattr(endpoint_module, "_LOOK_S", 0.01)
    monkeypatch.setattr(endpoint_module, "MAXIMUM_CONNECTIONS", 3)
    with served(daemon) as endpoint, strangers(endpoint.address, 3):
        wait_until(lambda: "all 3 connections of the remote endpoint are taken" in caplog.text)


def test_idle_connections_are_ended_so_that_a_stop_comes_through(
    daemon: FakeDaemon, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert endpoint_module.IDLE_S <= 3.0
    monkeypatch.setattr(endpoint_module, "IDLE_S", 0.2)
    with served(daemon) as endpoint, strangers(endpoint.address, MAXIMUM_CONNECTIONS) as held:
        wait_until(lambda: not any(each.is_open for each in held))
        with connected(endpoint.address) as stub:
            stub.Stop(pb.StopRequest(), timeout=PATIENCE_S)
    assert daemon.commands() == [OperatorCommand.STOP]


def test_that_all_places_are_taken_is_reported_once(caplog: pytest.LogCaptureFixture) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        slots = ConnectionSlots(port, 2)
        lines = [socket.create_connection(("127.0.0.1", port)) for _ in range(2)]
        ends = [listener.accept()[0] for _ in lines]
        for _ in range(3):
            slots.poll()
        assert caplog.text.count("all 2 connections") == 1
        for line in (*lines, *ends):
            line.close()
        slots.poll()
        assert caplog.text.count("all 2 connections") == 1
        with socket.create_connection(("127.0.0.1", port)) as first, socket.create_connection(("127.0.0.1", port)):
            slots.poll()
            assert caplog.text.count("all 2 connections") == 2
            first.close()


@pytest.mark.parametrize("path", ["/grpc.health.v1.Health/Check", "/robosc_api.v1.BridgeService/Stop"])
def test_a_call_without_its_request_is_ended(path: str, daemon: FakeDaemon, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(endpoint_module, "REQUEST_LIMIT_S", 0.1)
    with served(daemon) as endpoint, strangers(endpoint.address, 1) as (stranger,):
        stranger.call(1, path)
        wait_until(lambda: stranger.was_told(b"within 0.1 seconds"))


def test_a_stream_about_what_is_served_is_ended_when_it_says_nothing_more(
    daemon: FakeDaemon, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(endpoint_module, "REFLECTION_IDLE_S", 0.1)
    with served(daemon) as endpoint, strangers(endpoint.address, 1) as (stranger,):
        stranger.call(1, REFLECTION_METHODS[-1])
        stranger.message(1, reflection_pb2.ServerReflectionRequest(list_services="").SerializeToString())
        wait_until(lambda: stranger.was_told(b"each further one within 0.1"))


def test_health_is_not_watched(endpoint: RemoteEndpoint) -> None:
    with grpc.insecure_channel(endpoint.address) as channel:
        call = health_pb2_grpc.HealthStub(channel).Watch(health_pb2.HealthCheckRequest(), timeout=PATIENCE_S)
        with pytest.raises(grpc.RpcError) as raised:
            next(call)
        assert raised.value.code() is grpc.StatusCode.UNIMPLEMENTED
        request = health_pb2.HealthCheckRequest(service="another")
        with pytest.raises(grpc.RpcError) as raised:
            health_pb2_grpc.HealthStub(channel).Check(request, timeout=PATIENCE_S)
        assert raised.value.code() is grpc.StatusCode.NOT_FOUND


def test_health_follows_the_loop(daemon: FakeDaemon, endpoint: RemoteEndpoint) -> None:
    def is_well(**shown: Any) -> bool:
        daemon.show(**shown)
        request = health_pb2.HealthCheckRequest()
        answer = health_pb2_grpc.HealthStub(channel).Check(request, timeout=PATIENCE_S)
        return bool(answer.status == health_pb2.HealthCheckResponse.SERVING)

    with grpc.insecure_channel(endpoint.address) as channel:
        assert is_well(time_s=time.time() + 60.0)
        assert not is_well(time_s=time.time() - 2.1)
        assert not is_well(time_s=time.time() + 60.0, state=State.FAULT, problem="the drive base is lost")
        assert not is_well(time_s=time.time() + 60.0, state=State.OVER)


def test_calls_of_a_connection_are_bounded(endpoint: RemoteEndpoint) -> None:
    with strangers(endpoint.address, 1) as (stranger,):
        wait_until(lambda: any(kind == SETTINGS and not flags for kind, flags, _ in stranger.frames))
        payload = next(content for kind, flags, content in stranger.frames if kind == SETTINGS and not flags)
        settings = {struct.unpack_from(">HI", payload, at) for at in range(0, len(payload), 6)}
        assert (3, MAXIMUM_CALLS) in settings
