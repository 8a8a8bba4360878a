"""Factory of workers from the setting `workers`: `local`, or the address of a cluster, which is checked before."""

import re

from robosc_api.security.addresses import is_loopback_host, split_address
from robosc_server.workers import WorkersError
from robosc_server.workers.dask_cluster import DaskWorkers
from robosc_server.workers.local import TASK_FUNCTION, LocalWorkers

CLUSTER = re.compile(r"dask(\+tls)?://(?P<address>(\[[0-9a-fA-F:.]+\]|[^\s/\[\]:@]+):\d{1,5})/?")
"""Form of the setting for a cluster."""


def open_workers(
    spec: str, processes: int, task_function: str = TASK_FUNCTION, *, must_be_confined: bool = False
) -> LocalWorkers | DaskWorkers:
    """Return workers that are not started yet: enter them.

    Args:
        spec: `local`, `dask://HOST:PORT` or `dask+tls://HOST:PORT`.
        processes: Maximum number of tasks that this machine runs at once; a cluster has its own number.
        task_function: Function that runs tasks, `package.module:name`.
        must_be_confined: True to start none on a machine without complete confinement.

    Raises:
        ValueError: The specification is none of these.
        WorkersError: A package that they need is missing.
    """
    if spec == "local":
        return LocalWorkers(processes, task_function, must_be_confined=must_be_confined)
    if found := CLUSTER.fullmatch(spec):
        address = f"{'tls' if found[1] else 'tcp'}://{found['address']}"
        return DaskWorkers(address, task_function, must_be_confined=must_be_confined)
    raise ValueError(f"workers are 'local', 'dask://HOST:PORT' or 'dask+tls://HOST:PORT', and not {spec!r}")


def check_cluster(spec: str, *, is_insecure_allowed: bool) -> None:
    """Check what can be known before a cluster is connected.

    Raises:
        WorkersError: It is on another machine and has no TLS: its parts run what they are sent as programs.
    """
    found = CLUSTER.fullmatch(spec)
    if found is None or found[1] or is_insecure_allowed:
        return
    if not is_loopback_host(split_address(found["address"])[0]):
        raise WorkersError(
            f"the cluster at {spec} is on other machines and has no TLS, so whoever can reach it can run programs there"
            " and here: use dask+tls://, or set insecure_workers_beyond_loopback on a network of its own"
        )
