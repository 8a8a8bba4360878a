"""Log: one line for each event, with the id of the request, as text or as JSON.

Only the level debug logs parts of models. At other levels, exceptions are logged with their type and place and
without their message, which may quote a request.
"""

import contextlib
import json
import logging
import re
import secrets
import sys
import time
import traceback
from collections.abc import MutableMapping
from types import TracebackType
from typing import Any, TextIO

import grpc.aio
import msgspec
import structlog

from robosc_api.calls import REQUEST_ID_HEADER, request_id
from robosc_server.operations.settings import LogFormat, LogLevel
from robosc_server.operations.worker_output import last_part, loggable_fields

_LEVELS = {
    LogLevel.DEBUG: logging.DEBUG,
    LogLevel.INFO: logging.INFO,
    LogLevel.WARNING: logging.WARNING,
    LogLevel.ERROR: logging.ERROR,
}
# Their lines at the level info help only their developers.
_VERBOSE_LIBRARIES = ("alembic", "asyncio", "distributed", "opentelemetry", "sqlalchemy")
_GRPC_CALLS = "grpc._cython.cygrpc"
"""Logger of gRPC that reports what its handlers raise."""

_FRAMES = 12
_PLAIN = re.compile(r"[A-Za-z0-9._:/+@,%'()\[\]-]+\Z")

type _Line = MutableMapping[str, Any]


_REQUEST_ID_FORM = re.compile(r"[A-Za-z0-9._:/+=@-]{1,128}\Z")


class _RandomIds:
    """Source of random ids, which takes many at once from the system: a call of the kernel for each takes longer.

    The process that has it does not fork: a fork would give out the same ids.
    """

    _AT_ONCE = 256

    def __init__(self) -> None:
        self._digits = ""
        self._place = 0

    def __call__(self) -> str:
        """Return 16 random hexadecimal digits."""
        place = self._place
        if place >= len(self._digits):
            self._digits, place = secrets.token_hex(_ID_DIGITS // 2 * self._AT_ONCE), 0
        self._place = place + _ID_DIGITS
        return self._digits[place : self._place]


_ID_DIGITS = 16
_random_ids = _RandomIds()


def request_id_of(metadata: Any) -> str:
    """Return the valid request id in the metadata of a call, or a random one."""
    found = None
    for key, value in metadata or ():
        if key == REQUEST_ID_HEADER:
            if found is not None or not _REQUEST_ID_FORM.match(value):
                return _random_ids()
            found = value
    return found or _random_ids()


def configure_logging(log_format: LogFormat, log_level: LogLevel, stream: TextIO | None = None) -> None:
    """Write the log of this program and of libraries to one stream in one format.

    Args:
        log_format: Text or JSON.
        log_level: Lowest level that is logged.
        stream: Destination; None: standard error.
    """
    target = sys.stderr if stream is None else stream
    level = _LEVELS[log_level]
    renderer = _json if log_format is LogFormat.JSON else _text
    exceptions = _exception_in_full if log_level is LogLevel.DEBUG else _exception_without_message
    common = [_time_and_request, exceptions]
    structlog.configure(
        processors=[structlog.processors.add_log_level, *common, renderer],
        wrapper_class=structlog.make_filtering_bound_logger(level),
        logger_factory=structlog.WriteLoggerFactory(target),
        cache_logger_on_first_use=False,
    )
    handler = logging.StreamHandler(target)
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(
            foreign_pre_chain=[structlog.stdlib.add_log_level, structlog.stdlib.add_logger_name, *common],
            processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, renderer],
            keep_exc_info=False,
            # Remaining exception information is dropped.
            use_get_message=True,
        )
    )
    root = logging.getLogger()
    for old in tuple(root.handlers):
        if isinstance(old.formatter, structlog.stdlib.ProcessorFormatter):
            root.removeHandler(old)
    root.addHandler(handler)
    root.setLevel(level)
    for name in _VERBOSE_LIBRARIES:
        logging.getLogger(name).setLevel(max(level, logging.WARNING))
    logging.getLogger(_GRPC_CALLS).addFilter(_is_no_departure)


def _is_no_departure(record: logging.LogRecord) -> bool:
    """Return False for what gRPC logs as an error if a caller goes while a response is sent; the call has a line."""
    return record.exc_info is None or not isinstance(record.exc_info[1], grpc.aio.InternalError)


def log_fault(fault: BaseException | str, reason: str = "INTERNAL_FAULT") -> str:
    """Log an internal error and return its id, which is all that the caller gets.

    Args:
        fault: The error, or another process's report of it, such as a traceback, whose text is logged only at the level
            debug; see `worker_output`.
        reason: The reason that the caller receives, as in google.rpc.ErrorInfo.
    """
    identity = secrets.token_hex(4)
    log = structlog.get_logger()
    if isinstance(fault, str):
        known, words = loggable_fields(fault), last_part(fault)
    else:
        known = {"error": type(fault).__qualname__, "places": _code_locations(fault.__traceback__)}
        words = "".join(traceback.format_exception(fault))
    log.error("fault", fault=identity, reason=str(reason), **known)
    log.debug("fault in full", fault=identity, traceback=words)
    return identity


def log_limit(words: str, reason: str) -> None:
    """Log the end of a task that exceeded a limit.

    Args:
        words: Report of the worker, whose text is logged only at the level debug; see `worker_output`.
        reason: The reason that the caller receives, as in google.rpc.ErrorInfo.
    """
    log = structlog.get_logger()
    log.info("limit", reason=str(reason), **loggable_fields(words))
    log.debug("limit in full", reason=str(reason), words=last_part(words))


def _code_locations(begin: TracebackType | None) -> list[str]:
    frames = traceback.extract_tb(begin)[-_FRAMES:]
    return [f"{frame.filename}:{frame.lineno} {frame.name}" for frame in frames]


def _time_and_request(logger: Any, name: str, line: _Line) -> _Line:
    now_ns = time.time_ns()
    line["time"] = f"{_second(now_ns // 1_000_000_000)}.{now_ns // 1_000_000 % 1000:03d}Z"
    request = request_id()
    if request and "request" not in line:
        line["request"] = request
    return line


_last_second = (0, "")


def _second(second: int) -> str:
    """Format a second as ISO 8601; the last one is cached, since many lines fall into one second."""
    global _last_second
    known, text = _last_second
    if known != second:
        text = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(second))
        _last_second = second, text
    return text


def _error_of(line: _Line) -> BaseException | None:
    given = line.pop("exc_info", None)
    if given is True:
        given = sys.exc_info()[1]
    if isinstance(given, tuple):
        given = given[1]
    return given if isinstance(given, BaseException) else None


def _exception_without_message(logger: Any, name: str, line: _Line) -> _Line:
    error = _error_of(line)
    if error is not None:
        line["error"] = type(error).__qualname__
        if isinstance(error, OSError) and error.strerror:
            line["cause"] = error.strerror
        line["places"] = _code_locations(error.__traceback__)
    return line


def _exception_in_full(logger: Any, name: str, line: _Line) -> _Line:
    error = _error_of(line)
    if error is not None:
        line["traceback"] = "".join(traceback.format_exception(error))
    return line


_encode = msgspec.json.Encoder(enc_hook=str).encode


def _json(logger: Any, name: str, line: _Line) -> str:
    first = {"time": line.pop("time"), "level": line.pop("level"), "event": line.pop("event")}
    with contextlib.suppress(UnicodeEncodeError, TypeError):  # Half a pair of UTF-16; keys of a dict.
        text = _encode(first | dict(line)).decode()
        if text.isprintable():
            return text
    # Characters that JSON permits but terminals interpret, such as U+2028 or U+009B, are escaped, too.
    return json.dumps(first | dict(line), default=str, skipkeys=True)


def _text(logger: Any, name: str, line: _Line) -> str:
    head = f"{line.pop('time')} {line.pop('level'):<7} {_quoted(line.pop('event'))[1:-1]}"
    return " ".join((head, *(f"{key}={_shown(value)}" for key, value in line.items())))


def _shown(value: Any) -> str:
    """Format a value on one line, so that no text can imitate another log line."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_shown, value))}]"
    text = str(value)
    return text if _PLAIN.match(text) else _quoted(text)


def _quoted(value: Any) -> str:
    text = json.dumps(str(value), ensure_ascii=False)
    return text if text.isprintable() else json.dumps(str(value))
