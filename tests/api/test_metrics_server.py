"""The server of metrics, for well-behaved and for hostile scrapers."""

import contextlib
import gzip
import socket
import threading
import urllib.request
from collections.abc import Callable, Iterator
from typing import Any
from wsgiref.simple_server import WSGIServer

import pytest
from prometheus_client import CollectorRegistry, Gauge
from prometheus_client.parser import text_string_to_metric_families

from robosc_api import metrics_server
from robosc_api.metrics_server import CONNECTION_S, CONNECTIONS, HEAD_BYTES, MetricsServer
from support.waiting import PATIENCE_S, wait_until


class Timer:
    """A timer that runs out when a test says so."""

    def __init__(self, seconds: float, run: Callable[[], None]) -> None:
        assert seconds == CONNECTION_S
        self.run = run
        self.is_running = False

    def start(self) -> None:
        self.is_running = True

    def cancel(self) -> None:
        self.is_running = False


class Timers(list[Timer]):
    def __init__(self) -> None:
        super().__init__()
        self.is_first_there = threading.Event()

    def __call__(self, seconds: float, run: Callable[[], None]) -> Timer:
        self.append(Timer(seconds, run))
        self.is_first_there.set()
        return self[-1]


@pytest.fixture
def timers() -> Timers:
    return Timers()


@pytest.fixture
def registry() -> CollectorRegistry:
    registry = CollectorRegistry()
    Gauge("height", "A height.", registry=registry).set(7)
    Gauge("width", "A width.", registry=registry).set(8)
    return registry


@pytest.fixture
def server(registry: CollectorRegistry, timers: Timers) -> Iterator[MetricsServer]:
    server = MetricsServer(registry, "127.0.0.1", 0, make_timer=timers)
    server.start()
    yield server
    server.stop()


def opened(server: MetricsServer) -> socket.socket:
    return socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE_S)


def answer(connection: socket.socket) -> bytes:
    """All that comes until the connection ends, in whichever way."""
    found = b""
    with contextlib.suppress(ConnectionError):
        while part := connection.recv(65536):
            found += part
    return found


def asked(server: MetricsServer, request: bytes) -> bytes:
    with opened(server) as connection:
        connection.sendall(request)
        return answer(connection)


def test_prometheus_is_answered(server: MetricsServer, timers: Timers) -> None:
    def get(query: str = "", **headers: str) -> tuple[Any, bytes]:
        request = urllib.request.Request(f"http://127.0.0.1:{server.port}/metrics{query}", headers=headers)
        with urllib.request.urlopen(request, timeout=PATIENCE_S) as found:
            return found.headers, found.read()

    headers, text = get()
    assert headers["Content-Type"].startswith("text/plain")
    assert {family.name for family in text_string_to_metric_families(text.decode())} == {"height", "width"}
    headers, packed = get(**{"Accept-Encoding": "gzip"})
    assert headers["Content-Encoding"] == "gzip"
    assert gzip.decompress(packed) == text
    assert b"width" not in get("?name[]=height")[1]
    assert get(Accept="application/openmetrics-text; version=1.0.0")[1].endswith(b"# EOF\n")
    assert len(timers) == 4


@pytest.mark.parametrize(
    ("request_", "status"),
    [
        (b"GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n", b"200 OK"),
        (b"POST /metrics HTTP/1.1\r\nContent-Length: 5\r\n\r\nhello", b"405 Method Not Allowed"),
        (b"GET /metrics HTTP/1.1\r\n" + b"x: y\r\n" * 101 + b"\r\n", b"431 Too many headers"),
        (b"nonsense\r\n\r\n", b"400"),
        (b"\x16\x03\x01 \x00 \x00\r\n\r\n", b"400"),
    ],
)
def test_requests_of_all_kinds(
    request_: bytes, status: bytes, server: MetricsServer, capfd: pytest.CaptureFixture[str]
) -> None:
    found = asked(server, request_)
    assert status in found.partition(b"\r\n")[0] or b"Error code: " + status in found
    assert (b"height 7" in found) is (status == b"200 OK")
    assert "".join(capfd.readouterr()) == ""


@pytest.mark.parametrize("line", [b"x: y\r\n", b"x" * 90_000, b"\r\n"])
def test_a_head_without_end_is_dropped(line: bytes, server: MetricsServer, capfd: pytest.CaptureFixture[str]) -> None:
    with opened(server) as connection:
        with contextlib.suppress(ConnectionError):
            connection.sendall(b"GET /metrics HTTP/1.1\r\nA: ")
            for _ in range(20 * HEAD_BYTES // len(line) + 2):
                connection.sendall(line)
        assert b"200 OK" not in answer(connection) or line == b"\r\n"
    assert "".join(capfd.readouterr()) == ""


def test_who_keeps_connections_open_is_dropped_and_leaves_others_none_for_no_longer(
    server: MetricsServer, timers: Timers
) -> None:
    with contextlib.ExitStack() as stack:
        silent = [stack.enter_context(opened(server)) for _ in range(CONNECTIONS)]
        # A byte from time to time keeps nobody waiting.
        for connection in silent:
            connection.sendall(b"G")
        # Connections are accepted in their order, and there is no room for these.
        for _ in range(3):
            assert asked(server, b"GET /metrics HTTP/1.1\r\n\r\n") == b""
        assert [timer.is_running for timer in timers] == [True] * CONNECTIONS
        for timer in tuple(timers):
            timer.run()
        assert [answer(connection) for connection in silent] == [b""] * CONNECTIONS
        while b"200 OK" not in asked(server, b"GET /metrics HTTP/1.1\r\n\r\n"):
            pass
    # Each thread cancels its timer at its end, in any order.
    wait_until(lambda: not any(timer.is_running for timer in timers[:CONNECTIONS]))


def test_who_does_not_read_is_dropped(registry: CollectorRegistry, timers: Timers) -> None:
    for number in range(300):
        Gauge(f"filler_{number}", "x" * 20_000, registry=registry)
    server = MetricsServer(registry, "127.0.0.1", 0, make_timer=timers)
    server.start()
    with socket.socket() as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.settimeout(PATIENCE_S)
        connection.connect(("127.0.0.1", server.port))
        connection.sendall(b"GET /metrics HTTP/1.1\r\n\r\n")
        assert connection.recv(1)
        assert timers[0].is_running
        timers[0].run()
        assert len(answer(connection)) < 6_000_000
    server.stop()


def test_its_end_ends_connections(registry: CollectorRegistry, timers: Timers) -> None:
    server = MetricsServer(registry, "127.0.0.1", 0, make_timer=timers)
    server.start()
    with opened(server) as connection:
        connection.sendall(b"G")
        assert timers.is_first_there.wait(PATIENCE_S)
        server.stop()
        assert answer(connection) == b""
    with pytest.raises(ConnectionError):
        opened(server)
    server.stop()


def test_a_fault_of_the_metrics_is_no_page_of_its_code(
    registry: CollectorRegistry, server: MetricsServer, capfd: pytest.CaptureFixture[str]
) -> None:
    class Faulty:
        def collect(self) -> Any:
            raise KeyError("secret")

    registry.register(Faulty())
    found = asked(server, b"GET /metrics HTTP/1.1\r\n\r\n")
    assert b"500" in found and b"secret" not in found
    assert "".join(capfd.readouterr()) == ""


def test_no_descriptor_left_is_waited_for(server: MetricsServer, monkeypatch: pytest.MonkeyPatch) -> None:
    """The listening socket stays readable where a connection cannot be accepted."""
    tries: list[int] = []
    accept = WSGIServer.get_request

    def failing(self: Any) -> Any:
        tries.append(1)
        if len(tries) < 3:
            raise OSError(24, "Too many open files")
        return accept(self)

    waits: list[float] = []
    served: Any = server._served
    monkeypatch.setattr(served[0]._pause, "wait", waits.append)
    monkeypatch.setattr(WSGIServer, "get_request", failing)
    assert b"200 OK" in asked(server, b"GET /metrics HTTP/1.1\r\n\r\n")
    assert waits == [metrics_server._PAUSE_S] * 2
