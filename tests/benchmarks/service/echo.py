"""The least that gRPC in Python can do: a server of grpc.aio that sends back what it was sent, as a process.

Called as a program, it prints its port and serves until its standard input ends.
"""

import asyncio
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import grpc
import grpc.aio

SERVICE = "benchmark.Echo"
METHOD = f"/{SERVICE}/Echo"
REQUEST = bytes(2048)

_LIMIT_S = 60.0


async def _echo(request: bytes, context: Any) -> bytes:
    return request


async def serve() -> None:
    """Serve until standard input ends."""
    server = grpc.aio.server(options=(("grpc.so_reuseport", 0),))
    handlers: dict[str, Any] = {"Echo": grpc.unary_unary_rpc_method_handler(_echo)}
    server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(SERVICE, handlers),))
    port = server.add_insecure_port("127.0.0.1:0")
    await server.start()
    print(port, flush=True)
    await asyncio.to_thread(sys.stdin.read)
    await server.stop(None)


@contextmanager
def echo_server() -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Such a server; yields its process and address."""
    process = subprocess.Popen([sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdin is not None and process.stdout is not None
    try:
        yield process, f"127.0.0.1:{int(process.stdout.readline())}"
    finally:
        process.stdin.close()
        process.wait(_LIMIT_S)
        process.stdout.close()


if __name__ == "__main__":
    asyncio.run(serve())
