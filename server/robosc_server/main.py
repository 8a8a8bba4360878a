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

from robosc_api.malformed import MalformedRequests
from robosc_api.security import Guard, Rule, Scope, SecurityError, TokenFile, add_port, joined
from robosc_server import convert
from robosc_server.pool import WORKER_COMMAND, StartError, WorkerPool
from robosc_server.service import SynthesisService
from robosc_server.settings import Settings, new_token, parse_settings

GRACE_S = 5.0
"""Seconds that requests under way are given when the server stops."""


_RULE = Rule(frozenset({Scope.SYNTHESIZE}))


class AddressError(Exception):
    """The server cannot listen where it should, or not as securely as it should."""


def main(argv: Sequence[str] | None = None) -> int:
    """Serve until a signal, or make a token; returns the exit status."""
    words = sys.argv[1:] if argv is None else list(argv)
    if words[:1] == ["token"]:
        return new_token(words[1:])
    settings = parse_settings(words)
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
        AddressError: The address is not ours or in use, or a file with certificates or tokens cannot be used.
        StartError: No worker can be started.
    """
    security = settings.security
    try:
        tokens = None if security.tokens is None else TokenFile(security.tokens)
    except SecurityError as error:
        raise AddressError(str(error)) from error
    guard = Guard(
        {f"/{convert.SERVICE_NAME}/{name}": _RULE for name in convert.METHODS},
        tokens,
        has_client_certificates=security.client_ca is not None,
    )
    server = grpc.aio.server(
        interceptors=[guard, MalformedRequests(convert.SERVICE_NAME)],
        options=[
            # Without this two servers could share a port and each get some of the requests.
            ("grpc.so_reuseport", 0),
            # Room for what is not text in a request; the bundle itself is measured when it is there.
            ("grpc.max_receive_message_length", settings.max_bundle_bytes + 2**20),
        ],
    )
    try:
        address = add_port(server, joined(settings.host, settings.port), security)
    except (SecurityError, ValueError) as error:
        raise AddressError(str(error)) from error
    async with WorkerPool(settings.workers, worker_command) as pool:
        convert.add_service(SynthesisService(pool, settings), server)  # type: ignore[no-untyped-call]  # generated
        condition = _add_health_and_reflection(server)
        await _set_serving(condition)
        await server.start()
        try:
            yield address
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
