"""Check whether a server could start with given settings: everything that can be checked without starting it.

Nothing is made or changed. Anything that another process holds now, such as the server that runs with the same
settings, is a warning.
"""

import asyncio
import contextlib
import datetime
import errno
import importlib.util
import json
import os
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from sqlalchemy import make_url
from sqlalchemy.exc import ArgumentError, NoSuchModuleError

from robosc_api.security import (
    Scope,
    SecurityError,
    TokenFile,
    check_files,
    check_listening,
    is_loopback_host,
    missing_scope,
)
from robosc_api.security.addresses import split_address
from robosc_api.security.listening import read
from robosc_api.security.tokens import SOON_S, TokenIndex, time_text
from robosc_server.clock import wall_clock_s
from robosc_server.operations.descriptors import highest_descriptor_limit, usable_connections
from robosc_server.operations.exposure import database_exposure, tracing_exposure
from robosc_server.operations.metrics import check_metrics_address
from robosc_server.operations.settings import Confinement, Settings, format_value
from robosc_server.signing import SigningError, read_signing_key
from robosc_server.store.errors import StoreError
from robosc_server.store.factory import DATABASE_FILE, is_in_use
from robosc_server.store.inspection import inspect_postgresql, inspect_sqlite
from robosc_server.store.migrate import latest_version
from robosc_server.workers import WorkersError
from robosc_server.workers.cluster_check import check_cluster

_CONNECT_S = 5.0
_TRY_S = 20.0
_SOON_DAYS = 14
_SOCKET_PATH_BYTES = 107


class CheckGrade(StrEnum):
    """Severity of a finding."""

    OK = "ok"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True, slots=True)
class SettingCheck:
    """Finding about one part.

    Attributes:
        part: Name of the part.
        grade: Severity of the finding; with an error a server does not start, or cannot work.
        message: One sentence, without a secret.
    """

    part: str
    grade: CheckGrade
    message: str


def check_settings(settings: Settings) -> tuple[SettingCheck, ...]:
    """Return the findings about every part of the settings, in the order in which a server uses them."""
    parts: dict[str, Callable[[Settings], Iterator[tuple[CheckGrade, str]]]] = {
        "listening": _listening,
        "certificates": _certificates,
        "tokens": _tokens,
        "signing": _signing,
        "database": _database,
        "workers": _workers,
        "confinement": _confinement,
        "metrics": _metrics,
        "tracing": _tracing,
    }
    return tuple(
        SettingCheck(part, grade, message) for part, look in parts.items() for grade, message in look(settings)
    )


def _listening(settings: Settings) -> Iterator[tuple[CheckGrade, str]]:
    try:
        check_listening(settings.address, settings.security)
    except (SecurityError, ValueError) as error:
        yield CheckGrade.ERROR, str(error)
        return
    if settings.socket is not None:
        yield _listenable(settings.socket.absolute())
        return
    yield _bindable(settings.host, settings.port)
    usable = usable_connections(settings.connections, settings.worker_processes, highest_descriptor_limit())
    if usable < settings.connections:
        yield (
            CheckGrade.WARNING,
            f"the limit on open files permits {usable} connections and not {settings.connections}: raise it"
            " (LimitNOFILE, ulimit -n), or lower connections",
        )
    security = settings.security
    if security.tokens is None and security.client_ca is None and not is_loopback_host(settings.host):
        yield CheckGrade.WARNING, "every host that reaches the address may use the server: set tokens or client_ca"


def _listenable(path: Path) -> tuple[CheckGrade, str]:
    """Check whether a server could listen on a Unix socket now."""
    if len(os.fsencode(path)) > _SOCKET_PATH_BYTES:
        return CheckGrade.ERROR, f"{path}: the path of a Unix socket has at most {_SOCKET_PATH_BYTES} bytes"
    if not path.parent.is_dir():
        return CheckGrade.ERROR, f"{path.parent} is not a folder"
    problem = _unwritable(path.parent)
    if problem is not None:
        return CheckGrade.ERROR, f"{path.parent} cannot be written: {problem}"
    if path.exists() and not path.is_socket():
        return CheckGrade.ERROR, f"{path} is there, and no socket: remove it, or choose another path"
    return CheckGrade.OK, f"{path}"


def _bindable(host: str, port: int) -> tuple[CheckGrade, str]:
    """Check whether a server could listen on a host and port now."""
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (OSError, UnicodeError) as error:
        return CheckGrade.ERROR, f"{host}: {getattr(error, 'strerror', None) or 'no such name'}"
    family, kind, protocol, _, address = found[0]
    with contextlib.closing(socket.socket(family, kind, protocol)) as place:
        place.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            place.bind(address)
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                return CheckGrade.WARNING, f"{host}, port {port} is in use"
            return CheckGrade.ERROR, f"cannot listen on {host}, port {port}: {error.strerror}"
    return CheckGrade.OK, f"{host}, port {port or 'any that is free'}"


def _certificates(settings: Settings) -> Iterator[tuple[CheckGrade, str]]:
    security = settings.security
    if security.certificate is None or security.key is None:
        yield CheckGrade.OK, "no TLS"
        return
    try:
        check_files(settings.model_copy(update={"tokens": None}).security)
    except SecurityError as error:
        yield CheckGrade.ERROR, str(error)
        return
    for file in (security.certificate, security.client_ca):
        if file is not None:
            yield _valid(file)


def _valid(file: Path) -> tuple[CheckGrade, str]:
    """Check whether the certificates of a file are valid today."""
    if importlib.util.find_spec("cryptography") is None:
        return CheckGrade.OK, f"{file}: usable; its expiry date can be checked only with the extra `signing`"
    from cryptography import x509

    try:
        certificates = x509.load_pem_x509_certificates(read(file))
    except ValueError as error:
        return CheckGrade.ERROR, f"{file}: {error}"
    now = datetime.datetime.now(datetime.UTC)
    begins = max(certificate.not_valid_before_utc for certificate in certificates)
    ends = min(certificate.not_valid_after_utc for certificate in certificates)
    if begins > now:
        return CheckGrade.ERROR, f"{file}: not valid before {begins:%Y-%m-%d %H:%M} UTC"
    if ends <= now:
        return CheckGrade.ERROR, f"{file}: expired at {ends:%Y-%m-%d %H:%M} UTC; install a new certificate"
    grade = CheckGrade.WARNING if ends - now < datetime.timedelta(days=_SOON_DAYS) else CheckGrade.OK
    return grade, f"{file}: valid until {ends:%Y-%m-%d %H:%M} UTC"


def _tokens(settings: Settings) -> Iterator[tuple[CheckGrade, str]]:
    if settings.forwarded_identity:
        yield CheckGrade.OK, "a proxy names callers and their scopes"
        return
    if settings.tokens is None:
        yield CheckGrade.OK, "callers need no token"
        return
    try:
        entries = TokenFile(settings.tokens).entries
    except SecurityError as error:
        yield CheckGrade.ERROR, str(error)
        return
    now_s = wall_clock_s()
    valid = [entry for entry in entries if entry.is_valid(now_s)]
    problem = missing_scope(valid, Scope.SYNTHESIZE)
    useful = sum(Scope.SYNTHESIZE in entry.scopes for entry in valid)
    if problem is not None:
        yield CheckGrade.WARNING, f"{settings.tokens}: {problem}"
    else:
        yield CheckGrade.OK, f"{settings.tokens}: tokens with the scope '{Scope.SYNTHESIZE}': {useful}"
    index = TokenIndex(entries)
    for entry in entries:
        if entry.expires_s is None or entry.is_valid(now_s + SOON_S):
            continue
        verb = "expires" if entry.is_valid(now_s) else "has expired"
        words = f"{settings.tokens}: the token {entry.id} of '{entry.name}' {verb} at {time_text(entry.expires_s)}"
        if index.is_replaced(entry):
            yield CheckGrade.OK, f"{words}; another one replaces it"
        else:
            yield CheckGrade.WARNING, f"{words}: robosc-server tokens rotate {settings.tokens} {entry.name}"


def _signing(settings: Settings) -> Iterator[tuple[CheckGrade, str]]:
    if settings.signing_key is None:
        yield CheckGrade.OK, "supervisors are not signed"
        return
    try:
        read_signing_key(settings.signing_key)
    except SigningError as error:
        yield CheckGrade.ERROR, str(error)
    else:
        yield CheckGrade.OK, f"{settings.signing_key}"


def _database(settings: Settings) -> Iterator[tuple[CheckGrade, str]]:
    url = settings.database_url
    if url is None:
        yield _sqlite(settings.state_dir.absolute() / DATABASE_FILE)
    elif url.startswith("sqlite:///"):
        yield _sqlite(Path(url.removeprefix("sqlite:///")).absolute())
    else:
        yield _postgresql(url)
        warning = database_exposure(url)
        if warning is not None:
            yield CheckGrade.WARNING, warning


def _postgresql(text: str) -> tuple[CheckGrade, str]:
    try:
        url = make_url(text)
        name = url.render_as_string(hide_password=True)
        server, version = inspect_postgresql(url, _CONNECT_S)
    except (ArgumentError, ValueError):
        return CheckGrade.ERROR, "database_url must have the form postgresql://USER:PASSWORD@HOST:PORT/NAME"
    except (ImportError, NoSuchModuleError):
        return CheckGrade.ERROR, "PostgreSQL needs the extra `postgresql`: pip install 'robosc[postgresql]'"
    except StoreError as error:
        return CheckGrade.ERROR, f"{name}: {error}"
    return CheckGrade.OK, f"{name}: PostgreSQL {server}{_migration(version)}"


def _migration(version: int | None) -> str:
    """Return a clause about the migration at the next start; empty: there will be none."""
    latest = latest_version()
    if version is None or version == latest:
        return ""
    return f"; the next start migrates the tables from schema version {version} to {latest}"


def _sqlite(file: Path) -> tuple[CheckGrade, str]:
    """Check whether the file can be used, or made."""
    folder = file.parent
    try:
        there = next(place for place in (folder, *folder.parents) if place.exists())
        if not there.is_dir():
            return CheckGrade.ERROR, f"{there} is not a folder"
        problem = _unwritable(there)
        if problem is not None:
            return CheckGrade.ERROR, f"{there} cannot be written: {problem}"
        is_there = file.exists()
        version = inspect_sqlite(file) if is_there else None
        if is_in_use(file):
            return CheckGrade.WARNING, f"{file} is in use by another robosc-server"
    except (OSError, StoreError) as error:
        return CheckGrade.ERROR, f"{file}: {getattr(error, 'strerror', None) or error}"
    return CheckGrade.OK, f"SQLite in {file}{_migration(version)}" if is_there else f"{file} will be created"


def _unwritable(folder: Path) -> str | None:
    """Return the reason why nothing can be made in a folder; None: something can.

    The permissions alone do not show it: root has them all.
    """
    try:
        try:
            # An unnamed temporary file.
            os.close(os.open(folder, os.O_TMPFILE | os.O_RDWR | os.O_CLOEXEC, 0o600))
        except OSError as error:
            if error.errno not in (errno.EOPNOTSUPP, errno.EISDIR, errno.ENOENT):
                raise
            # The file system does not support unnamed files.
            Path(tempfile.mkdtemp(prefix=".robosc-", dir=folder)).rmdir()
    except OSError as error:
        return error.strerror or str(error)
    return None


def _workers(settings: Settings) -> Iterator[tuple[CheckGrade, str]]:
    if settings.workers != "local":
        try:
            check_cluster(settings.workers, is_insecure_allowed=settings.insecure_workers_beyond_loopback)
        except WorkersError as error:
            yield CheckGrade.ERROR, str(error)
            return
        yield _cluster(settings.workers)
        return
    wanted = settings.worker_processes * settings.task_memory_bytes
    there = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if wanted > there:
        size = format_value("task_memory_bytes", settings.task_memory_bytes)
        yield (
            CheckGrade.WARNING,
            f"{settings.worker_processes} worker processes with {size} each may exceed the memory of this machine: "
            "lower worker_processes or task_memory_bytes",
        )
    else:
        yield CheckGrade.OK, f"{settings.worker_processes} local processes"


def _confinement(settings: Settings) -> Iterator[tuple[CheckGrade, str]]:
    """Check what the kernel keeps workers from, in a process of its own: confinement cannot be undone."""
    if settings.workers != "local":
        yield CheckGrade.OK, "each machine of the cluster confines its own workers"
        return
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    try:
        probe = subprocess.run(
            [sys.executable, "-P", "-m", "robosc_server.workers.sandbox"],
            env=environment,
            capture_output=True,
            timeout=_TRY_S,
            check=True,
        )
        missing = json.loads(probe.stdout)
    except (OSError, subprocess.SubprocessError, ValueError):
        missing = ["the confinement test could not be run"]
    grade = CheckGrade.ERROR if settings.confinement is Confinement.REQUIRED else CheckGrade.WARNING
    for part in missing:
        yield grade, part
    if not missing:
        yield CheckGrade.OK, "workers can access only program files, no network and no other process"


def _cluster(spec: str) -> tuple[CheckGrade, str]:
    if importlib.util.find_spec("distributed") is None:
        return CheckGrade.ERROR, "a Dask cluster needs the extra `dask`: pip install 'robosc[dask]'"
    protocol, _, rest = spec.partition("://")
    address = rest.rstrip("/")
    error = _unreachable(address)
    if error is None and protocol == "dask+tls":
        from robosc_server.workers.dask_tls import tls_fault

        fault = asyncio.run(tls_fault(*split_address(address), _CONNECT_S))
        error = None if fault is None else f"{address}: {fault}"
    return (CheckGrade.OK, f"{address} answers") if error is None else (CheckGrade.ERROR, error)


def _unreachable(address: str) -> str | None:
    """Return the reason why an address cannot be connected to; None: it can."""
    try:
        socket.create_connection(split_address(address), timeout=_CONNECT_S).close()
    except (OSError, UnicodeError) as error:
        return f"{address}: {getattr(error, 'strerror', None) or error}"
    return None


def _metrics(settings: Settings) -> Iterator[tuple[CheckGrade, str]]:
    if settings.metrics_address is None:
        yield CheckGrade.OK, "disabled"
        return
    try:
        check_metrics_address(settings.metrics_address, beyond_loopback=settings.metrics_beyond_loopback)
    except SecurityError as error:
        yield CheckGrade.ERROR, str(error)
        return
    yield _bindable(*split_address(settings.metrics_address))


def _tracing(settings: Settings) -> Iterator[tuple[CheckGrade, str]]:
    endpoint = settings.tracing_endpoint
    if endpoint is None:
        yield CheckGrade.OK, "disabled"
        return
    try:
        is_there = importlib.util.find_spec("opentelemetry.exporter.otlp.proto.grpc") is not None
    except ImportError:
        is_there = False
    if not is_there:
        yield CheckGrade.ERROR, "traces need the extra `tracing`: pip install 'robosc[tracing]'"
        return
    warning = tracing_exposure(endpoint)
    if warning is not None:
        yield CheckGrade.WARNING, warning
    error = _unreachable(endpoint.partition("://")[2].rstrip("/"))
    # A server works without who takes its traces.
    yield (CheckGrade.OK, endpoint) if error is None else (CheckGrade.WARNING, error)
