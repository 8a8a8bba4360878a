"""Descriptors of this process: the soft limit is raised, and connections leave some for everything else."""

import resource

_RESERVED = 256
"""Descriptors for files, the database, the log, metrics and programs' libraries."""

_RESERVED_PER_WORKER = 8
"""Descriptors for the pipes of one worker process."""

_MOST = 65_536
"""Limit that the server sets: some systems have no other, and some programs go through all descriptors."""

_FEWEST_CONNECTIONS = 16


def raise_descriptor_limit() -> None:
    """Raise the soft limit on descriptors of this process: it is low because of select(2), which is not used here."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = highest_descriptor_limit()
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


def highest_descriptor_limit() -> int:
    """Return the limit on descriptors that a server has after `raise_descriptor_limit`."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft == resource.RLIM_INFINITY:
        return soft
    return max(soft, _MOST if hard == resource.RLIM_INFINITY else min(_MOST, hard))


def usable_connections(wanted: int, worker_processes: int, limit: int | None = None) -> int:
    """Return the number of connections that leaves descriptors for everything else.

    Args:
        wanted: Number of connections according to the settings.
        worker_processes: Number of worker processes.
        limit: Limit on descriptors; None: the soft limit of this process.
    """
    descriptors = resource.getrlimit(resource.RLIMIT_NOFILE)[0] if limit is None else limit
    if descriptors == resource.RLIM_INFINITY:
        return wanted
    left = descriptors - _RESERVED - _RESERVED_PER_WORKER * worker_processes
    return min(wanted, max(left, _FEWEST_CONNECTIONS))
