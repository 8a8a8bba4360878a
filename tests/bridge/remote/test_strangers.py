"""Callers without a token who hold connections and calls, over real sockets."""

import socket
import struct
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import grpc
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection_pb2

from robosc_api import connection_watch
from robosc_api.request_timeouts import REFLECTION_METHODS
from robosc_api.v1 import bridge_pb2 as pb
from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.remote import RemoteEndpoint
from robosc_bridge.remote import endpoint as endpoint_module
from robosc_bridge.remote.connection_slots import ConnectionSlots
from robosc_bridge.remote.data import value_of
from robosc_bridge.remote.endpoint import MAXIMUM_CALLS, MAXIMUM_CONNECTIONS
from support.floods import MOST_BYTES, endless_headers, resets
from support.remote import Attachment, FakeDaemon, connected, served
from support.strangers import SETTINGS, Stranger, strangers
from support.waiting import PATIENCE_S, wait_until


def test_connections_that_take_all_places_are_reported(
    daemon: FakeDaemon, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(endpoint_module, "IDLE_S", 3600.0)
    monkeypatch.setattr(endpoint_module, "_LOOK_S", 0.01)
    monkeypatch.setattr(endpoint_module, "MAXIMUM_CONNECTIONS", 3)
    # Watched connections without a call give way before all places are taken.
    monkeypatch.setattr(connection_watch, "can_watch", lambda: False)
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
        wait_until(lambda: stranger.has_received(b"within 0.1 seconds"))


def test_a_stream_about_what_is_served_is_ended_when_it_says_nothing_more(
    daemon: FakeDaemon, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(endpoint_module, "REFLECTION_IDLE_S", 0.1)
    with served(daemon) as endpoint, strangers(endpoint.address, 1) as (stranger,):
        stranger.call(1, REFLECTION_METHODS[-1])
        stranger.message(1, reflection_pb2.ServerReflectionRequest(list_services="").SerializeToString())
        wait_until(lambda: stranger.has_received(b"each further one within 0.1"))


def test_a_packed_request_is_not_unpacked(daemon: FakeDaemon, endpoint: RemoteEndpoint) -> None:
    with connected(endpoint.address) as stub:
        with pytest.raises(grpc.RpcError) as caught:
            stub.Stop(pb.StopRequest(), timeout=PATIENCE_S, compression=grpc.Compression.Gzip)
        error: Any = caught.value
        assert error.code() is grpc.StatusCode.UNIMPLEMENTED
    assert daemon.commands() == []


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


STOP = "/robosc_api.v1.BridgeService/Stop"

needs_counts = pytest.mark.skipif(
    not connection_watch.can_watch(), reason="the kernel of this system does not count bytes"
)


def resets_of_stops(port: int, between: Callable[[], object]) -> int:
    return resets(port, STOP, between)


@needs_counts
@pytest.mark.parametrize("flood", [endless_headers, resets_of_stops])
def test_floods_are_cut_off_while_others_are_answered_and_can_stop(
    flood: Callable[[int, Callable[[], object]], int],
    daemon: FakeDaemon,
    endpoint: RemoteEndpoint,
    caplog: pytest.LogCaptureFixture,
) -> None:
    port = int(endpoint.address.rpartition(":")[2])
    with connected(endpoint.address) as stub:
        # The caller has the time that it takes to be answered once for each chunk of the flood.
        sent = flood(port, lambda: stub.GetStatus(pb.GetStatusRequest(), timeout=PATIENCE_S))
        assert sent < MOST_BYTES
        # By the watch: gRPC itself ends connections on which its pings are not answered.
        wait_until(lambda: "closed connections" in caplog.text)
        stub.Stop(pb.StopRequest(), timeout=PATIENCE_S)
    assert daemon.commands()[-1] is OperatorCommand.STOP


def one_is_ended(held: Sequence[Stranger]) -> bool:
    return not all(each.is_open for each in held)


@needs_counts
def test_unused_connections_give_way_before_all_places_are_taken(
    daemon: FakeDaemon, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(endpoint_module, "IDLE_S", 3600.0)
    monkeypatch.setattr(endpoint_module, "MAXIMUM_CONNECTIONS", 8)
    with served(daemon) as endpoint, connected(endpoint.address) as stub:
        watch = stub.Watch(pb.WatchRequest(), timeout=PATIENCE_S)
        assert next(watch).HasField("snapshot")
        for _ in range(3):
            with strangers(endpoint.address, 6) as held:
                wait_until(partial(one_is_ended, held))
        assert next(watch).HasField("snapshot")
        watch.cancel()


@needs_counts
def test_the_messages_of_a_program_are_no_flood(daemon: FakeDaemon, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[connection_watch.ConnectionWatch] = []

    def noted(*arguments: Any, **more: Any) -> connection_watch.ConnectionWatch:
        made.append(connection_watch.ConnectionWatch(*arguments, **more))
        return made[0]

    monkeypatch.setattr(endpoint_module, "ConnectionWatch", noted)
    with served(daemon) as endpoint, connected(endpoint.address) as stub:
        program = Attachment(stub, name="arm")
        assert program.receive().HasField("welcome")
        # Far more than an open call and the slack explain.
        for _ in range(60):
            # A name that is too long, so that each is answered at once.
            program.send(give=pb.Message(identifier="/order", data=value_of({"x" * 30_000: 1})))
            assert "a name of more than" in program.receive().refused.why
            made[0].look()
        assert not made[0].closed.total()
        program.end()
