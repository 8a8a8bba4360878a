"""Factory of workers from the setting `workers`: `local`, or the address of a cluster."""

import re

from robosc_server.workers.dask_cluster import DaskWorkers
from robosc_server.workers.local import LocalWorkers

CLUSTER = re.compile(r"dask(\+tls)?://(?P<address>(\[[0-9a-fA-F:.]+\]|[^\s/\[\]:@]+):\d{1,5})/?")
"""Form of the setting for a cluster."""


def open_workers(spec: str, processes: int, *, must_be_confined: bool = False) -> LocalWorkers | DaskWorkers:
    """Return workers that are not started yet: enter them.

    Args:
        spec: `local`, `dask://HOST:PORT` or `dask+tls://HOST:PORT`.
        processes: Maximum number of tasks that this machine runs at once; a cluster has its own number.
        must_be_confined: True to start none on a machine without complete confinement.

    Raises:
        ValueError: The specification is none of these.
        WorkersError: A package that they need is missing.
    """
    if spec == "local":
        return LocalWorkers(processes, must_be_confined=must_be_confined)
    if found := CLUSTER.fullmatch(spec):
        address = f"{'tls' if found[1] else 'tcp'}://{found['address']}"
        return DaskWorkers(address, must_be_confined=must_be_confined)
    raise ValueError(f"workers are 'local', 'dask://HOST:PORT' or 'dask+tls://HOST:PORT', and not {spec!r}")
