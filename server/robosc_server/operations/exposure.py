"""Warnings of what others on the network could read or change between a server and its database or traces."""

import contextlib
from collections.abc import Iterator

from sqlalchemy import make_url
from sqlalchemy.exc import ArgumentError

from robosc_api.security import is_loopback_host
from robosc_api.security.addresses import split_address


def database_exposure(text: str | None) -> str | None:
    """Return a warning of a database on another machine whose certificate and name are not checked; None: it is safe.

    Args:
        text: URL of the database; None: a file.
    """
    if text is None or text.startswith("sqlite:"):
        return None
    with contextlib.suppress(ArgumentError, ValueError):
        url = make_url(text)
        hosts = [host for host in (url.host, *_words(url.query.get("host"))) if host and not host.startswith("/")]
        is_far = any(not is_loopback_host(host.rpartition(":")[0] or host) for host in hosts)
        if is_far and _words(url.query.get("sslmode")) != ["verify-full"]:
            return (
                "whoever is on the way to the database can read and change jobs: add ?sslmode=verify-full to "
                "database_url (and sslrootcert)"
            )
    return None


def tracing_exposure(endpoint: str | None) -> str | None:
    """Return a warning of traces that leave this machine without TLS; None: they do not.

    Args:
        endpoint: Receiver of the traces; None: there are no traces.
    """
    scheme, _, address = (endpoint or "").partition("://")
    if scheme != "http" or is_loopback_host(split_address(address.rstrip("/"))[0]):
        return None
    return f"{endpoint}: traces, with the names of callers, can be read on the way: use https"


def exposures(database_url: str | None, tracing_endpoint: str | None) -> Iterator[str]:
    """The warnings of a server with these settings."""
    for warning in (database_exposure(database_url), tracing_exposure(tracing_endpoint)):
        if warning is not None:
            yield warning


def _words(value: str | tuple[str, ...] | None) -> list[str]:
    return [] if value is None else [value] if isinstance(value, str) else list(value)
