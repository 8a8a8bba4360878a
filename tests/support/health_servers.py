"""Servers that say how their services are, and nothing else."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import grpc
from grpc_health.v1 import health, health_pb2_grpc

from robosc_api.security import ServerSecurity, add_port

_IN_THE_CLEAR = ServerSecurity()


@contextmanager
def answering(
    whole: int, security: ServerSecurity = _IN_THE_CLEAR, most_calls: int | None = None, **services: int
) -> Iterator[str]:
    """A server that is well or not, and answers so many calls at once; yields its address.

    Args:
        whole: How the server itself is.
        security: How it listens.
        most_calls: At once; None: any number.
        **services: How each service is.
    """
    servicer = health.HealthServicer()
    servicer.set("", whole)
    for name, status in services.items():
        servicer.set(name, status)
    with ThreadPoolExecutor(2) as threads:
        server = grpc.server(threads, maximum_concurrent_rpcs=most_calls)
        health_pb2_grpc.add_HealthServicer_to_server(servicer, server)
        address = add_port(server, "127.0.0.1:0", security)
        server.start()
        try:
            yield address
        finally:
            server.stop(None).wait()
