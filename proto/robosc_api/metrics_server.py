"""HTTP server of metrics for Prometheus: the application of prometheus_client, bounded against hostile scrapers.

Its own server starts a thread for each connection, and waits for each of them for ever.
"""

import contextlib
import io
import logging
import socket
import threading
from collections.abc import Callable
from socketserver import TCPServer, ThreadingMixIn
from typing import Any, BinaryIO
from wsgiref.simple_server import WSGIRequestHandler, WSGIServer

from prometheus_client import make_wsgi_app
from prometheus_client.registry import Collector

_log = logging.getLogger(__name__)

CONNECTIONS = 16
"""Connections at a time; further ones are closed at once."""

CONNECTION_S = 5.0
"""Time from the start of a connection to its end, in seconds."""

HEAD_BYTES = 8192
"""Maximum size of the head of a request."""

_POLL_S = 0.1
_JOIN_S = 3.0
_PAUSE_S = 0.2
"""Time without further attempts after a connection that could not be accepted, as where no descriptor is left."""

type MakeTimer = Callable[[float, Callable[[], None]], Any]


class MetricsServer:
    """Server that answers a GET with the metrics, one for each connection, in threads of its own.

    Args:
        registry: Registry of the metrics, which is asked in these threads.
        host: Address to listen on.
        port: Port to listen on; 0 picks a free one.
        make_timer: Maker of the timers that cut connections off, as `threading.Timer`.
    """

    def __init__(self, registry: Collector, host: str, port: int, *, make_timer: MakeTimer = threading.Timer) -> None:
        self._registry, self._host, self._port = registry, host, port
        self._make_timer = make_timer
        self._served: tuple[_Server, threading.Thread] | None = None

    @property
    def port(self) -> int:
        """Port that it listens on, once it has started."""
        return self._port

    def start(self) -> None:
        """Begin to serve.

        Raises:
            OSError: The address cannot be used.
        """
        family, _, _, _, address = socket.getaddrinfo(
            self._host, self._port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        server = _Server(family, address, self._make_timer)
        server.set_app(make_wsgi_app(self._registry))
        self._port = server.server_port
        thread = threading.Thread(target=server.serve_forever, args=(_POLL_S,), name="metrics", daemon=True)
        thread.start()
        self._served = server, thread

    def stop(self) -> None:
        """Stop serving, and cut connections off; this takes a moment."""
        served, self._served = self._served, None
        if served is not None:
            server, thread = served
            server.shutdown()
            server.server_close()
            server.cut_all()
            thread.join(_JOIN_S)


class _Server(ThreadingMixIn, WSGIServer):
    daemon_threads = True
    request_queue_size = CONNECTIONS

    def __init__(self, family: int, address: Any, make_timer: MakeTimer) -> None:
        self.address_family = family
        self._make_timer = make_timer
        self._slots = threading.BoundedSemaphore(CONNECTIONS)
        self._pause = threading.Event()
        self._lock = threading.Lock()
        self._open: dict[Any, Any] = {}
        super().__init__(address, _Handler)

    def server_bind(self) -> None:
        """Bind without asking for the name of the host, for which HTTPServer may wait long."""
        TCPServer.server_bind(self)
        host, port = self.server_address[:2]
        self.server_name, self.server_port = str(host), int(port)
        self.setup_environ()

    def get_request(self) -> Any:
        """Accept a connection; where that fails, it would be tried again at once, and for ever."""
        try:
            return super().get_request()
        except OSError:
            self._pause.wait(_PAUSE_S)
            raise

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer in a thread, if there is room for one more."""
        if not self._slots.acquire(blocking=False):
            request.close()
            return
        timer = self._make_timer(CONNECTION_S, lambda: _cut(request))
        timer.daemon = True
        with self._lock:
            self._open[request] = timer
        try:
            timer.start()
            super().process_request(request, client_address)
        except RuntimeError:
            # No thread can be started.
            self._end(request)
            raise

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer one request."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._end(request)

    def _end(self, request: Any) -> None:
        with self._lock:
            timer = self._open.pop(request)
        timer.cancel()
        self._slots.release()

    def cut_all(self) -> None:
        """Cut all connections off."""
        self._pause.set()
        with self._lock:
            for request in self._open:
                _cut(request)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Leave alone what went wrong with a connection."""
        _log.debug("a request for metrics has failed", exc_info=True)


def _cut(request: Any) -> None:
    """End a connection, also for a thread that waits for it."""
    with contextlib.suppress(OSError):
        request.shutdown(socket.SHUT_RDWR)


class _Handler(WSGIRequestHandler):
    def setup(self) -> None:
        """Prepare to read a head of limited size."""
        super().setup()
        self.rfile: Any = _Head(self.rfile)

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002  # named by the base class
        """Log nothing: callers decide how many lines there would be."""

    def get_stderr(self) -> Any:
        """Return a place for tracebacks that is not read."""
        return io.StringIO()


class _Head:
    """Stream of a connection that ends where a head may have no more bytes.

    Args:
        stream: Stream of the connection.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._left = HEAD_BYTES

    def readline(self, limit: int) -> bytes:
        """Read a line.

        Raises:
            ConnectionError: The head is too large.
        """
        line = self._stream.readline(min(limit, self._left + 1))
        self._left -= len(line)
        if self._left < 0:
            raise ConnectionError("the head of the request is too large")
        return line

    def close(self) -> None:
        """Close the stream."""
        self._stream.close()
