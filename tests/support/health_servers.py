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
    """Run a server, healthy or not, that answers up to `most_calls` calls at once; yield its address.

    Args:
        whole: Health of the server itself.
        security: Security of its listening port.
        most_calls: Maximum number of calls at once; None: any number.
        **services: Health of each service.
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
