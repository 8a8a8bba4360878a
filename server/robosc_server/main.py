"""`robosc-server`: start, tell where, stop gracefully."""

import asyncio
import logging
import os
import signal
import sys
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager

# gRPC's own log would tell once more, in its words, what we tell; it is read at its import.
os.environ.setdefault("GRPC_VERBOSITY", "NONE")

import grpc
import grpc.aio
from grpc_health.v1 import health, health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection

from robosc_server import convert
from robosc_server.malformed import MalformedRequests
from robosc_server.pool import WORKER_COMMAND, StartError, WorkerPool
from robosc_server.service import SynthesisService
from robosc_server.settings import Settings, parse_settings

GRACE_S = 5.0
"""Seconds that requests under way are given when the server stops."""


class AddressError(Exception):
    """The server cannot listen where it should."""


def main(argv: Sequence[str] | None = None) -> int:
    """Serve until a signal; returns the exit status."""
    settings = parse_settings(argv)
    logging.basicConfig(format="%(asctime)s %(levelname)s %(name)s: %(message)s", stream=sys.stderr)
    try:
        asyncio.run(_serve_until_signal(settings))
    except (AddressError, StartError) as error:
        sys.stderr.write(f"robosc-server: {error}\n")
        return 1
    return 0


async def _serve_until_signal(settings: Settings) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, stop.set)
    async with running_server(settings) as address:
        sys.stdout.write(f"robosc-server listening on {address}\n")
        sys.stdout.flush()
        await stop.wait()


@asynccontextmanager
async def running_server(settings: Settings, worker_command: Sequence[str] = WORKER_COMMAND) -> AsyncIterator[str]:
    """A server that answers inside the context, with its workers; yields `HOST:PORT`.

    Raises:
        AddressError: The address is not ours or in use.
        StartError: No worker can be started.
    """
    server = grpc.aio.server(
        interceptors=[MalformedRequests(convert.SERVICE_NAME)],
        options=[
            # Without this two servers could share a port and each get some of the requests.
            ("grpc.so_reuseport", 0),
            # Room for what is not text in a request; the bundle itself is measured when it is there.
            ("grpc.max_receive_message_length", settings.max_bundle_bytes + 2**20),
        ],
    )
    host = f"[{settings.host}]" if ":" in settings.host and not settings.host.startswith("[") else settings.host
    try:
        port = server.add_insecure_port(f"{host}:{settings.port}")
    except RuntimeError:
        port = 0
    if port == 0:
        raise AddressError(f"cannot listen on {host}:{settings.port}: the address is in use or not this machine's")
    async with WorkerPool(settings.workers, worker_command) as pool:
        convert.add_service(SynthesisService(pool, settings), server)  # type: ignore[no-untyped-call]  # generated
        condition = _add_health_and_reflection(server)
        await _set_serving(condition)
        await server.start()
        try:
            yield f"{host}:{port}"
        finally:
            await condition.enter_graceful_shutdown()
            await server.stop(GRACE_S)


def _add_health_and_reflection(server: grpc.aio.Server) -> "health.aio.HealthServicer":
    """The standard services by which others find out whether the server is well and what it offers."""
    condition = health.aio.HealthServicer()
    health_pb2_grpc.add_HealthServicer_to_server(condition, server)
    reflection.enable_server_reflection((convert.SERVICE_NAME, health.SERVICE_NAME, reflection.SERVICE_NAME), server)
    return condition


async def _set_serving(condition: "health.aio.HealthServicer") -> None:
    for name in ("", convert.SERVICE_NAME):
        await condition.set(name, health_pb2.HealthCheckResponse.SERVING)


if __name__ == "__main__":
    sys.exit(main())
