"""The least that gRPC in Python can do: a server of grpc.aio that answers with bytes that it has, as a process.

Called as a program with the sizes of its answers by method (`Check=0 Synthesize=7456`), it prints its port and serves
until its standard input ends. With `--layers N` it has the first N layers of the service around its handlers.
"""

import argparse
import asyncio
import gc
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import grpc
import grpc.aio

SERVICE = "benchmark.Echo"
METHOD = f"/{SERVICE}/"

LAYERS = (
    "id, log and metrics of calls",
    "authorization without tokens",
    "limits on open calls",
    "time limit of requests",
    "requests by connection",
)
"""Layers of the service, the outermost first."""

_LIMIT_S = 60.0


def _handler(size: int) -> Any:
    content = bytes(size)

    async def answer(request: bytes, context: Any) -> bytes:
        return content

    # On the wire, a unary response is a stream of one message: callers may read it as one.
    return grpc.unary_unary_rpc_method_handler(answer)


def _layered(count: int, methods: Mapping[str, int]) -> Any:
    """Return services inside the first layers of the service, with its limits."""
    from robosc_api.connection_watch import Arrivals
    from robosc_api.layers import LayeredServices
    from robosc_api.request_timeouts import RequestTimeouts
    from robosc_api.security import Guard, Rule, Scope, token_or_host_of
    from robosc_server.operations.interceptor import CallInterceptor
    from robosc_server.operations.logs import configure_logging
    from robosc_server.operations.metrics import Metrics
    from robosc_server.operations.open_calls import CallLimits, OpenCalls
    from robosc_server.operations.settings import LogFormat, LogLevel

    configure_logging(LogFormat.TEXT, LogLevel.WARNING)
    arrivals = Arrivals()
    rules = {METHOD + name: Rule(frozenset({Scope.SYNTHESIZE})) for name in methods}
    every = (
        CallInterceptor(Metrics("")),
        Guard(rules, None),
        OpenCalls(CallLimits(10_000, 2_000), token_or_host_of, arrivals=arrivals),
        RequestTimeouts(30.0),
        arrivals,
    )
    assert len(every) == len(LAYERS)
    return LayeredServices(*every[:count], most_calls=20_000)


async def serve(sizes: Mapping[str, int], layers: int) -> None:
    """Serve until standard input ends."""
    server = grpc.aio.server(options=(("grpc.so_reuseport", 0),))
    services: Any = server
    if layers:
        services = _layered(layers, sizes)
        server.add_generic_rpc_handlers((services,))
    handlers = {name: _handler(size) for name, size in sizes.items()}
    services.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(SERVICE, handlers),))
    port = server.add_insecure_port("127.0.0.1:0")
    await server.start()
    if layers:
        # The service does the same.
        gc.collect()
        gc.freeze()
        gc.set_threshold(20_000, *gc.get_threshold()[1:])
    print(port, flush=True)
    await asyncio.to_thread(sys.stdin.read)
    await server.stop(None)


@contextmanager
def echo_server(sizes: Mapping[str, int], layers: int = 0) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Such a server; yields its process and address.

    Args:
        sizes: Size of the answers of each method, in bytes.
        layers: Number of layers of the service around its handlers.
    """
    words = [sys.executable, __file__, *(f"{name}={size}" for name, size in sizes.items()), f"--layers={layers}"]
    process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdin is not None and process.stdout is not None
    try:
        yield process, f"127.0.0.1:{int(process.stdout.readline())}"
    finally:
        process.stdin.close()
        process.wait(_LIMIT_S)
        process.stdout.close()


def main() -> None:
    """Serve with the given sizes and layers."""
    parser = argparse.ArgumentParser()
    parser.add_argument("sizes", nargs="+")
    parser.add_argument("--layers", type=int, default=0)
    given = parser.parse_args()
    sizes = {name: int(size) for name, _, size in (word.partition("=") for word in given.sizes)}
    # The loop of the service.
    import uvloop

    with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
        runner.run(serve(sizes, given.layers))


if __name__ == "__main__":
    main()
