"""Settings: one definition, from which flags, environment variables, the settings file and the manual follow."""

import os
import re
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError, PydanticUndefined

from robosc_api.security import ServerSecurity, joined
from robosc_api.security.addresses import UNIX, split_address
from robosc_server.tasks.task import TaskLimits

_SIZE = re.compile(r"([0-9]{1,18})\s*(B|KiB|MiB|GiB|TiB)?\Z")
_UNITS = {None: 1, "B": 1, "KiB": 2**10, "MiB": 2**20, "GiB": 2**30, "TiB": 2**40}


class LogFormat(StrEnum):
    """Format of the lines of the log."""

    TEXT = "text"
    JSON = "json"


class LogLevel(StrEnum):
    """Lowest level of log lines that are written."""

    DEBUG = "debug"
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


class Confinement(StrEnum):
    """Policy for machines that lack a part of the confinement of workers."""

    REQUIRED = "required"
    BEST_EFFORT = "best-effort"


def _bytes(value: object) -> object:
    """Read a number of bytes, also with a unit."""
    if isinstance(value, str):
        match = _SIZE.match(value.strip())
        if match is None:
            raise PydanticCustomError("size", "must be a number of bytes, such as 1048576 or 1MiB")
        return int(match[1]) * _UNITS[match[2]]
    return value


def _require_integer(value: object) -> object:
    """Reject booleans, which Python takes for 1 and 0, and floats such as 2.0."""
    if isinstance(value, bool | float):
        raise PydanticCustomError("whole", "must be a whole number")
    return value


def _host_and_port(text: str) -> str:
    try:
        split_address(text)
    except ValueError as error:
        raise PydanticCustomError("address", "must be HOST:PORT") from error
    return text


def _workers(text: str) -> str:
    kind, _, address = text.partition("://")
    if text == "local":
        return text
    if kind not in ("dask", "dask+tls"):
        raise PydanticCustomError("workers", "must be 'local', 'dask://HOST:PORT' or 'dask+tls://HOST:PORT'")
    try:
        split_address(address)
    except ValueError as error:
        raise PydanticCustomError("workers", "must have HOST:PORT after ://") from error
    return text


def _database(text: str) -> str:
    scheme, separator, rest = text.partition("://")
    is_known = scheme in ("postgresql", "postgresql+psycopg") or (scheme == "sqlite" and len(rest) > 1)
    if not separator or not is_known:
        # The message does not have the text, which may hold a password.
        raise PydanticCustomError("database", "must be postgresql://USER:PASSWORD@HOST:PORT/NAME or sqlite:///FILE")
    return text


def _endpoint(text: str) -> str:
    scheme, _, address = text.partition("://")
    try:
        if scheme not in ("http", "https"):
            raise ValueError
        split_address(address.rstrip("/"))
    except ValueError as error:
        raise PydanticCustomError("endpoint", "must be http://HOST:PORT or https://HOST:PORT") from error
    return text


def _host(text: str) -> str:
    if not text or any(character.isspace() or not character.isprintable() for character in text):
        raise PydanticCustomError("host", "must be a host name or an address")
    return text


type _Bytes = Annotated[int, BeforeValidator(_bytes), BeforeValidator(_require_integer), Field(ge=1, le=2**50)]
type _Count = Annotated[int, BeforeValidator(_require_integer), Field(ge=1, le=1_000_000_000)]
type _Seconds = Annotated[float, Field(gt=0, le=1e9, allow_inf_nan=False)]


def _processors() -> int:
    return max(1, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1)


def _state_folder() -> Path:
    try:
        return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "robosc-server"
    except RuntimeError:  # A user without a home, as in many containers.
        return Path("/var/lib/robosc-server")


def _setting(default: Any, words: str, group: str, **more: Any) -> Any:
    """Return a field with its default or default factory, its description and its group in the manual."""
    extra = {"group": group, "default": more.pop("default_words", None), "metavar": more.pop("metavar", None)}
    if callable(default):
        return Field(default_factory=default, description=words, json_schema_extra=extra, **more)
    return Field(default=default, description=words, json_schema_extra=extra, **more)


_LISTENING, _SECURITY, _LIMITS, _QUEUE = "listening", "security", "limits of one task", "queue"
_STORAGE, _WORKERS, _OPERATIONS = "jobs and results", "workers", "operations"


class Settings(BaseModel):
    """Settings of one server; each field's description is what the manual says about it.

    Creating an instance reads neither the file nor the environment: `settings_sources.load_settings` does.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", hide_input_in_errors=True)

    host: Annotated[str, AfterValidator(_host)] = _setting("127.0.0.1", "address to listen on", _LISTENING)
    port: Annotated[int, BeforeValidator(_require_integer)] = _setting(
        50051, "TCP port to listen on; 0 selects a free port", _LISTENING, ge=0, le=65535
    )
    socket: Path | None = _setting(
        None,
        "Unix socket to listen on instead of host and port, such as for a proxy; this user and its group may connect",
        _LISTENING,
        metavar="FILE",
        default_words="host and port",
    )
    drain_seconds: Annotated[float, Field(ge=0, le=86400, allow_inf_nan=False)] = _setting(
        30.0, "maximum time in seconds for open calls to finish when the server shuts down", _LISTENING
    )

    tls_certificate: Path | None = _setting(
        None, "certificate chain (PEM); enables TLS", _SECURITY, metavar="FILE", default_words="no TLS"
    )
    tls_key: Path | None = _setting(None, "private key of the certificate (PEM)", _SECURITY, metavar="FILE")
    client_ca: Path | None = _setting(
        None,
        "require client certificates signed by one of these authorities (PEM)",
        _SECURITY,
        metavar="FILE",
        default_words="callers need no certificate",
    )
    tokens: Path | None = _setting(
        None,
        "require a token of this file (see `robosc-server token`)",
        _SECURITY,
        metavar="FILE",
        default_words="callers need no token",
    )
    insecure_beyond_loopback: bool = _setting(
        False, "allow connections from other machines without TLS, on a trusted network", _SECURITY
    )
    forwarded_identity: bool = _setting(
        False,
        "take the name and scopes of callers from a proxy's headers x-robosc-caller and x-robosc-scopes; only with"
        " socket, or with a client_ca that has signed the proxy's certificate and no others",
        _SECURITY,
    )
    signing_key: Path | None = _setting(
        None,
        "Ed25519 private key (PEM) for signing supervisors",
        _SECURITY,
        metavar="FILE",
        default_words="supervisors are not signed",
    )

    bundle_bytes: _Bytes = _setting(2**20, "maximum size of a model with its libraries: all names and texts", _LIMITS)
    bundle_files: _Count = _setting(1000, "maximum number of files of a model with its libraries", _LIMITS)
    task_seconds: _Seconds = _setting(
        600.0, "maximum wall-clock time of one task in seconds, regardless of its deadline", _LIMITS
    )
    task_cpu_seconds: _Seconds = _setting(600.0, "maximum CPU time of one task in seconds", _LIMITS)
    task_memory_bytes: Annotated[_Bytes, Field(ge=256 * 2**20)] = _setting(
        2 * 2**30, "maximum address space of the worker process of one task, program code included", _LIMITS
    )
    task_nodes: _Count = _setting(20_000_000, "maximum number of decision diagram nodes of one task", _LIMITS)
    result_bytes: _Bytes = _setting(64 * 2**20, "maximum size of the result of one task", _LIMITS)

    waiting_tasks: _Count = _setting(1000, "maximum number of waiting tasks of all callers", _QUEUE)
    waiting_tasks_per_caller: _Count = _setting(
        100, "maximum number of waiting tasks of one caller, unless its token has a quota", _QUEUE
    )

    open_calls: _Count = _setting(10_000, "maximum number of open calls, watches included", _QUEUE)
    open_calls_per_caller: _Count = _setting(
        2000,
        "maximum number of open calls of one caller, unless its token has a quota; without tokens, of one host",
        _QUEUE,
    )
    connections: _Count = _setting(
        4096,
        "maximum number of connections, as far as the limit on open files (RLIMIT_NOFILE) permits; above three quarters"
        " of it, connections without an open call are closed",
        _QUEUE,
    )
    request_seconds: _Seconds = _setting(
        30.0, "maximum time in seconds between the start of a call and the arrival of its request", _QUEUE
    )

    workers: Annotated[str, AfterValidator(_workers)] = _setting(
        "local",
        "location of the workers: `local` processes, or the Dask cluster at `dask://HOST:PORT` or `dask+tls://HOST:PORT`",
        _WORKERS,
        metavar="WHERE",
    )
    insecure_workers_beyond_loopback: bool = _setting(
        False,
        "allow a Dask cluster without TLS on other machines: whoever can reach it can run programs there and here",
        _WORKERS,
    )
    worker_processes: Annotated[_Count, Field(le=1024)] = _setting(
        _processors,
        "maximum number of tasks that run at once on this machine, each in its own process",
        _WORKERS,
        default_words="the number of processors",
    )

    confinement: Confinement = _setting(
        Confinement.BEST_EFFORT,
        "required: no task runs if the kernel cannot fully isolate its process from files, network and other processes;"
        " best-effort: the log names the missing parts, and tasks run",
        _WORKERS,
    )

    state_dir: Path = _setting(
        _state_folder,
        "folder of the SQLite database for jobs and results, if database_url is not set",
        _STORAGE,
        metavar="FOLDER",
        default_words="$XDG_STATE_HOME/robosc-server, or ~/.local/state/robosc-server",
    )
    database_url: Annotated[str, AfterValidator(_database)] | None = _setting(
        None,
        "database for jobs and results: postgresql://USER:PASSWORD@HOST:PORT/NAME, which several servers may share, or"
        " sqlite:///FILE",
        _STORAGE,
        metavar="URL",
        default_words="SQLite in state_dir",
        repr=False,
    )
    retention_seconds: _Seconds = _setting(
        7 * 86400.0, "time in seconds for which a job and its result are stored after its end", _STORAGE
    )
    jobs_per_caller: _Count = _setting(
        10_000,
        "maximum number of stored jobs of one caller; beyond it, the jobs that ended first are deleted",
        _STORAGE,
    )
    results_bytes: _Bytes = _setting(
        2 * 2**30,
        "maximum size of all results in the database; beyond it, the least recently used results of the caller with the"
        " most data are deleted first",
        _STORAGE,
    )
    share_results: bool = _setting(
        False,
        "answer a request with the cached result of another caller's equal request; whoever has the exact text of a"
        " model then finds out whether somebody else has sent it",
        _STORAGE,
    )
    memory_cache_bytes: Annotated[
        int, BeforeValidator(_bytes), BeforeValidator(_require_integer), Field(ge=0, le=2**50)
    ] = _setting(64 * 2**20, "maximum size of the results cached in memory; 0 disables the cache", _STORAGE)

    log_format: LogFormat = _setting(LogFormat.TEXT, "format of log lines: text or json", _OPERATIONS)
    log_level: LogLevel = _setting(
        LogLevel.INFO,
        "lowest level that is logged: debug, info, warning or error; only debug logs parts of models",
        _OPERATIONS,
    )
    metrics_address: Annotated[str, AfterValidator(_host_and_port)] | None = _setting(
        None,
        "address of the metrics endpoint for Prometheus, over HTTP at /metrics",
        _OPERATIONS,
        metavar="HOST:PORT",
        default_words="disabled",
    )
    metrics_beyond_loopback: bool = _setting(
        False, "allow other machines to read the metrics, without TLS and without a token", _OPERATIONS
    )
    tracing_endpoint: Annotated[str, AfterValidator(_endpoint)] | None = _setting(
        None,
        "OTLP receiver of traces over gRPC, such as http://127.0.0.1:4317",
        _OPERATIONS,
        metavar="URL",
        default_words="disabled",
    )

    @property
    def address(self) -> str:
        """`HOST:PORT` to listen on, or `unix:` and the path of a socket."""
        if self.socket is not None:
            return f"{UNIX}{self.socket.absolute()}"
        return joined(self.host, self.port)

    @property
    def security(self) -> ServerSecurity:
        """Security of the service."""
        return ServerSecurity(
            certificate=self.tls_certificate,
            key=self.tls_key,
            client_ca=self.client_ca,
            tokens=self.tokens,
            insecure_beyond_loopback=self.insecure_beyond_loopback,
            forwarded_identity=self.forwarded_identity,
        )

    @property
    def task_limits(self) -> TaskLimits:
        """Limits of one task."""
        return TaskLimits(
            seconds=self.task_seconds,
            cpu_seconds=self.task_cpu_seconds,
            memory_bytes=self.task_memory_bytes,
            nodes=self.task_nodes,
            result_bytes=self.result_bytes,
        )


def default_text(name: str) -> str:
    """Return the default of a setting as text."""
    field = Settings.model_fields[name]
    extra: Any = field.json_schema_extra
    if extra["default"] is not None:
        return str(extra["default"])
    if field.default is None or field.default is PydanticUndefined:
        return "none"
    return str(field.default).lower() if isinstance(field.default, bool) else format_value(name, field.default)


def format_value(name: str, value: Any) -> str:
    """Format a value as in the manual and in files: bytes with a unit, seconds without needless digits."""
    if isinstance(value, bool):
        return str(value).lower()
    if name.endswith("_bytes"):
        for unit in ("GiB", "MiB", "KiB"):
            if value and value % _UNITS[unit] == 0:
                return f"{value // _UNITS[unit]}{unit}"
    return f"{value:.15g}" if isinstance(value, float) else str(value)


def group_of(name: str) -> str:
    """Return the group of a setting."""
    extra: Any = Settings.model_fields[name].json_schema_extra
    return str(extra["group"])


def description_of(name: str) -> str:
    """Return the description of a setting."""
    return Settings.model_fields[name].description or ""
