"""Callers without a token who hold connections and calls, over real sockets."""

import logging
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import grpc
import pytest
from grpc_health.v1 import health_pb2, health_pb2_grpc

from robosc_api.v1 import bridge_pb2 as pb
from robosc_bridge.daemon.states import Command, State
from robosc_bridge.remote import RemoteFace, prompt
from robosc_bridge.remote.connections import Places
from robosc_bridge.remote.face import IDLE_S, MAXIMUM_CALLS, MAXIMUM_CONNECTIONS
from support.remote import PATIENCE_S, FakeDaemon, connected, eventually, served

PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + b"\0\0\0\4\0\0\0\0\0"
PING, SETTINGS, ACKNOWLEDGED = 6, 4, 1


@pytest.fixture
def daemon() -> Any:
    with FakeDaemon() as made:
        yield made


@pytest.fixture
def face(daemon: FakeDaemon) -> Any:
    with served(daemon) as made:
        yield made


class Stranger:
    """A connection that speaks HTTP/2 and answers pings, and otherwise says what a test says (RFC 9113)."""

    def __init__(self, face: RemoteFace) -> None:
        host, _, port = face.address.rpartition(":")
        self.line = socket.create_connection((host, int(port)))
        self.line.sendall(PREFACE)
        self.is_open = True
        self.frames: list[tuple[int, int, bytes]] = []
        self._thread = threading.Thread(target=self._answer)
        self._thread.start()

    def send(self, kind: int, flags: int, stream: int, content: bytes) -> None:
        """A frame."""
        self.line.sendall(struct.pack(">I", len(content))[1:] + struct.pack(">BBI", kind, flags, stream) + content)

    def close(self) -> None:
        with suppress(OSError):
            self.line.shutdown(socket.SHUT_RDWR)
        self._thread.join(PATIENCE_S)
        self.line.close()

    def _answer(self) -> None:
        data = b""
        try:
            while more := self.line.recv(65536):
                data += more
                while len(data) >= 9 and len(data) >= 9 + int.from_bytes(data[:3]):
                    size, kind, flags = int.from_bytes(data[:3]), data[3], data[4]
                    content, data = data[9 : 9 + size], data[9 + size :]
                    self.frames.append((kind, flags, content))
                    if kind in (PING, SETTINGS) and not flags & ACKNOWLEDGED:
                        self.send(kind, ACKNOWLEDGED, 0, content if kind == PING else b"")
        except OSError:
            pass
        self.is_open = False


@contextmanager
def strangers(face: RemoteFace, count: int) -> Iterator[list[Stranger]]:
    made = [Stranger(face) for _ in range(count)]
    try:
        yield made
    finally:
        for each in made:
            each.close()


def test_idle_connections_are_ended_so_that_a_stop_comes_through(
    daemon: FakeDaemon, face: RemoteFace, caplog: pytest.LogCaptureFixture
) -> None:
    with strangers(face, MAXIMUM_CONNECTIONS) as held:
        begin_s = time.monotonic()
        eventually(lambda: "connections of the remote face are taken" in caplog.text)
        eventually(lambda: not any(each.is_open for each in held))
        assert time.monotonic() - begin_s < IDLE_S + PATIENCE_S / 2
        with connected(face.address) as stub:
            stub.Stop(pb.StopRequest(), timeout=PATIENCE_S)
    assert daemon.commands() == [Command.STOP]


def test_that_all_places_are_taken_is_told_once(caplog: pytest.LogCaptureFixture) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        places = Places(port, 2)
        lines = [socket.create_connection(("127.0.0.1", port)) for _ in range(2)]
        ends = [listener.accept()[0] for _ in lines]
        for _ in range(3):
            places.look()
        assert caplog.text.count("all 2 connections") == 1
        for line in (*lines, *ends):
            line.close()
        places.look()
        assert caplog.text.count("all 2 connections") == 1
        with socket.create_connection(("127.0.0.1", port)) as first, socket.create_connection(("127.0.0.1", port)):
            places.look()
            assert caplog.text.count("all 2 connections") == 2
            first.close()


def _headers(path: str) -> bytes:
    """Of a call, in HPACK without indexing (RFC 7541, 6.2.2)."""
    found = b""
    fields = {":method": "POST", ":scheme": "http", ":path": path, ":authority": "robot"}
    fields |= {"te": "trailers", "content-type": "application/grpc"}
    for name, value in fields.items():
        found += b"\0" + bytes([len(name)]) + name.encode() + bytes([len(value)]) + value.encode()
    return found


@pytest.mark.parametrize("path", ["/grpc.health.v1.Health/Check", "/robosc_api.v1.BridgeService/Stop"])
def test_a_call_without_its_request_is_ended(path: str, face: RemoteFace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prompt, "REQUEST_LIMIT_S", 0.1)
    with strangers(face, 1) as (stranger,):
        end_of_headers = 4
        stranger.send(1, end_of_headers, 1, _headers(path))
        eventually(lambda: any(kind == 1 and b"within 0.1 seconds" in content for kind, _, content in stranger.frames))


def test_health_is_not_watched(face: RemoteFace) -> None:
    with grpc.insecure_channel(face.address) as channel:
        call = health_pb2_grpc.HealthStub(channel).Watch(health_pb2.HealthCheckRequest(), timeout=PATIENCE_S)
        with pytest.raises(grpc.RpcError) as raised:
            next(call)
        assert raised.value.code() is grpc.StatusCode.UNIMPLEMENTED
        request = health_pb2.HealthCheckRequest(service="another")
        with pytest.raises(grpc.RpcError) as raised:
            health_pb2_grpc.HealthStub(channel).Check(request, timeout=PATIENCE_S)
        assert raised.value.code() is grpc.StatusCode.NOT_FOUND


def test_health_follows_the_loop(daemon: FakeDaemon, face: RemoteFace) -> None:
    def is_well(**shown: Any) -> bool:
        daemon.show(**shown)
        request = health_pb2.HealthCheckRequest()
        answer = health_pb2_grpc.HealthStub(channel).Check(request, timeout=PATIENCE_S)
        return bool(answer.status == health_pb2.HealthCheckResponse.SERVING)

    with grpc.insecure_channel(face.address) as channel:
        assert is_well(time_s=time.time() + 60.0)
        assert not is_well(time_s=time.time() - 2.1)
        assert not is_well(time_s=time.time() + 60.0, state=State.FAULT, problem="the drive base is lost")
        assert not is_well(time_s=time.time() + 60.0, state=State.OVER)


def test_calls_of_a_connection_are_bounded(face: RemoteFace) -> None:
    with strangers(face, 1) as (stranger,):
        eventually(lambda: any(kind == SETTINGS and not flags for kind, flags, _ in stranger.frames))
        told = next(content for kind, flags, content in stranger.frames if kind == SETTINGS and not flags)
        settings = {struct.unpack_from(">HI", told, at) for at in range(0, len(told), 6)}
        assert (3, MAXIMUM_CALLS) in settings


def test_streams_without_an_end_do_not_keep_it_from_ending(
    daemon: FakeDaemon, face: RemoteFace, caplog: pytest.LogCaptureFixture
) -> None:
    forever = threading.Event()

    def nothing() -> Iterator[bytes]:
        forever.wait(PATIENCE_S)
        yield from ()

    channel: Any
    with grpc.insecure_channel(face.address) as channel:
        reflect = channel.stream_stream("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo")
        attach = channel.stream_stream("/robosc_api.v1.BridgeService/Attach")
        calls = [reflect(nothing()) for _ in range(20)] + [attach(nothing()) for _ in range(5)]
        # What comes after them on the same connection is answered after them.
        health_pb2_grpc.HealthStub(channel).Check(health_pb2.HealthCheckRequest(), timeout=PATIENCE_S)
        begin_s = time.monotonic()
        face.stop()
        assert time.monotonic() - begin_s < 4.0
        forever.set()
        # The last ones on a busy machine are ended by gRPC itself.
        assert "the bridge ends" in {call.details() for call in calls} <= {"the bridge ends", "CANCELLED"}
    assert not [record for record in caplog.records if record.levelno >= logging.ERROR or record.exc_info]
