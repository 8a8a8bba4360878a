"""Bearer tokens (RFC 6750): random, kept as SHA-256 digests, each with a name and scopes.

A token has 256 random bits, so its digest needs neither salt nor many rounds: there is nothing to guess (NIST SP
800-63B, 5.1.2.2 on look-up secrets with at least 112 bits).
"""

import hashlib
import hmac
import logging
import os
import re
import secrets
import stat
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from enum import StrEnum
from pathlib import Path

from robosc_api.security.errors import SecurityError

_log = logging.getLogger(__name__)

MAXIMUM_BYTES = 64 * 1024
"""Maximum size of a token file, in bytes."""

MAXIMUM_TOKEN = 512
"""Maximum number of characters of a token."""

_CHECK_PERIOD_S = 1.0
_PREFIX = "robosc_"
_LINE = re.compile(
    r"(?P<name>[A-Za-z0-9._-]{1,64})\s+(?P<scopes>[a-z,]+)\s+sha256:(?P<digest>[0-9a-f]{64})(?P<quota>(\s+\S+)*)\Z"
)


class Scope(StrEnum):
    """Purpose of a token."""

    WATCH = "watch"
    OPERATE = "operate"
    SYNTHESIZE = "synthesize"
    ADMIN = "admin"


@dataclass(frozen=True, slots=True)
class Quota:
    """Quotas of a token; None: only the general limits of the server apply.

    Attributes:
        waiting: Maximum number of waiting tasks.
        per_minute: Maximum number of tasks per minute.
        cpu_seconds_per_hour: Maximum CPU time of tasks per hour, in seconds.
        calls: Maximum number of open calls.
    """

    waiting: int | None = None
    per_minute: int | None = None
    cpu_seconds_per_hour: int | None = None
    calls: int | None = None

    def __str__(self) -> str:
        """Return the quotas in the form of the token file."""
        pairs = ((field.name, getattr(self, field.name)) for field in fields(self))
        return " ".join(f"{name}={value}" for name, value in pairs if value is not None)


_QUOTAS = tuple(field.name for field in fields(Quota))
_AMOUNT = re.compile(r"[1-9][0-9]{0,8}\Z")


@dataclass(frozen=True, slots=True)
class Entry:
    """One token of a file.

    Attributes:
        name: Name of its owner, for the log.
        scopes: Scopes that it is for.
        digest: SHA-256 of the token, in hexadecimal digits.
        quota: Quota of what it may ask for.
    """

    name: str
    scopes: frozenset[Scope]
    digest: str
    quota: Quota = Quota()


def make_token(name: str, scopes: tuple[Scope, ...], quota: Quota = Quota()) -> tuple[str, str]:
    """Create a token; return it and the line for the token file.

    Raises:
        SecurityError: The name cannot stand in the file, or there is no scope.
    """
    token = _PREFIX + secrets.token_urlsafe(32)
    line = f"{name} {','.join(dict.fromkeys(scopes))} sha256:{_digest(token)} {quota}".rstrip()
    if not _LINE.match(line):
        raise SecurityError(
            "a token needs a scope, and a name of 1 to 64 letters, digits, dots, dashes and underscores"
        )
    return token, line


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode("utf-8", "backslashreplace")).hexdigest()


def parse_tokens(text: str, place: str) -> tuple[Entry, ...]:
    """The entries of a file: a line each, `NAME SCOPE,SCOPE sha256:DIGEST QUOTA=N ...`; `#` begins a comment.

    Raises:
        SecurityError: A line is none, or a name stands twice.
    """
    found: dict[str, Entry] = {}
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.partition("#")[0].strip()
        if not bare:
            continue
        match = _LINE.match(bare)
        if not match:
            # Not the line itself, which may contain the token by mistake.
            raise SecurityError(f"{place}:{number}: expected NAME SCOPE,SCOPE sha256:DIGEST")
        unknown = [word for word in match["scopes"].split(",") if word not in set(Scope)]
        if unknown:
            raise SecurityError(f"{place}:{number}: unknown scope '{unknown[0]}': use {', '.join(Scope)}")
        if match["name"] in found:
            raise SecurityError(f"{place}:{number}: the name '{match['name']}' occurs twice")
        scopes = frozenset(Scope(word) for word in match["scopes"].split(","))
        quota = _quota(match["quota"].split(), f"{place}:{number}")
        found[match["name"]] = Entry(match["name"], scopes, match["digest"], quota)
    return tuple(found.values())


def _quota(words: list[str], place: str) -> Quota:
    amounts: dict[str, int] = {}
    for word in words:
        name, _, amount = word.partition("=")
        # Not the word itself, as above.
        if name not in _QUOTAS:
            raise SecurityError(f"{place}: only {', '.join(f'{known}=N' for known in _QUOTAS)} may follow the digest")
        if not _AMOUNT.match(amount):
            raise SecurityError(f"{place}: {name} must be a whole number from 1 to 999999999")
        if name in amounts:
            raise SecurityError(f"{place}: {name} occurs twice")
        amounts[name] = int(amount)
    return Quota(**amounts)


def missing_scope(entries: Iterable[Entry], needed: Scope) -> str | None:
    """Return a message if no token of a file has the scope that every call needs; None: one has it."""
    if any(needed in entry.scopes for entry in entries):
        return None
    return f"no token has the scope '{needed}', so every call is refused"


class TokenFile:
    """Tokens of a file, which is reloaded within a second after a change, so that tokens can be revoked.

    If the changed file cannot be read or is invalid, the previous tokens stay valid, and the log says so.

    Args:
        path: Path of the file.
        clock: Seconds of a monotonic clock.
        needed: Scope that every call needs; a warning is logged if no token has it. None: no such scope.

    Raises:
        SecurityError: The file cannot be read, is invalid, or other users can write it.
    """

    def __init__(self, path: Path, clock: Callable[[], float] = time.monotonic, *, needed: Scope | None = None) -> None:
        self._path = path
        self._clock = clock
        self._needed = needed
        self._is_scope_missing = False
        self._lock = threading.Lock()
        self._entries, self._stamp = _read(path)
        self._warn_if_scope_is_missing()
        self._checked_s = clock()

    def find(self, token: str) -> Entry | None:
        """Return the entry of a token in constant time; None: unknown token."""
        digest = _digest(token[:MAXIMUM_TOKEN])
        found = None
        for entry in self._current():
            if hmac.compare_digest(entry.digest, digest):
                found = entry
        return found if len(token) <= MAXIMUM_TOKEN else None

    def named(self, name: str) -> Entry | None:
        """Return the token of a name; None: there is none."""
        return next((entry for entry in self._current() if entry.name == name), None)

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All of them."""
        return self._current()

    def _current(self) -> tuple[Entry, ...]:
        with self._lock:
            if self._clock() - self._checked_s >= _CHECK_PERIOD_S:
                self._checked_s = self._clock()
                try:
                    if _stamp(self._path.stat()) != self._stamp:
                        self._entries, self._stamp = _read(self._path)
                        _log.info("%s: reloaded", self._path)
                        self._warn_if_scope_is_missing()
                except (OSError, SecurityError) as error:
                    _log.error("the changed token file is not used: %s", error)
            return self._entries

    def _warn_if_scope_is_missing(self) -> None:
        """Log a warning when no token has the needed scope any more."""
        words = None if self._needed is None else missing_scope(self._entries, self._needed)
        if words is not None and not self._is_scope_missing:
            _log.warning("%s: %s", self._path, words)
        self._is_scope_missing = words is not None


def _stamp(status: os.stat_result) -> tuple[int, int, int]:
    return status.st_mtime_ns, status.st_size, status.st_ino


def _read(path: Path) -> tuple[tuple[Entry, ...], tuple[int, int, int]]:
    try:
        with path.open("rb") as stream:
            status = os.fstat(stream.fileno())
            data = stream.read(MAXIMUM_BYTES + 1)
    except OSError as error:
        raise SecurityError(f"{path}: {error.strerror}") from error
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise SecurityError(f"{path}: other users may write this file: run chmod go-w on it")
    if len(data) > MAXIMUM_BYTES:
        raise SecurityError(f"{path}: larger than {MAXIMUM_BYTES} bytes")
    try:
        return parse_tokens(data.decode(), str(path)), _stamp(status)
    except UnicodeDecodeError as error:
        raise SecurityError(f"{path}: not UTF-8") from error
