"""Check of the address of a cluster, before anything is connected.

Not in `factory`, which a machine without a network service uses, too: what is asked here loads gRPC.
"""

from robosc_api.security.addresses import is_loopback_host, split_address
from robosc_server.workers import WorkersError
from robosc_server.workers.factory import CLUSTER


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
