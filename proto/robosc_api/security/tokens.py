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
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path

from robosc_api.security.errors import SecurityError

_log = logging.getLogger(__name__)

MAXIMUM_BYTES = 64 * 1024
"""Maximum size of a token file, in bytes."""

ID_DIGITS = 8
"""Number of digits of a digest that name a token."""

MAXIMUM_TOKEN = 512
"""Maximum number of characters of a token."""

SOON_S = 14 * 86400.0
"""Time before the expiry of a token from which on there are warnings, in seconds."""

_CHECK_PERIOD_S = 1.0
_PREFIX = "robosc_"
_TIME = "%Y-%m-%dT%H:%M:%SZ"
_EXPIRES = "expires"
_LINE = re.compile(
    r"(?P<name>[A-Za-z0-9._-]{1,64})\s+(?P<scopes>[a-z,]+)\s+sha256:(?P<digest>[0-9a-f]{64})(?P<more>(\s+\S+)*)\Z"
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
        expires_s: Time of its expiry, in whole seconds since 1970; None: it never expires.
    """

    name: str
    scopes: frozenset[Scope]
    digest: str
    quota: Quota = Quota()
    expires_s: int | None = None

    @property
    def id(self) -> str:
        """First digits of its digest, which distinguish the tokens of one owner."""
        return self.digest[:ID_DIGITS]

    def is_valid(self, now_s: float) -> bool:
        """Return True if it has not expired.

        Args:
            now_s: Seconds since 1970.
        """
        return self.expires_s is None or now_s < self.expires_s

    def __str__(self) -> str:
        """Return the line of the token file."""
        expiry = "" if self.expires_s is None else f"expires={time_text(self.expires_s)}"
        scopes = ",".join(scope for scope in Scope if scope in self.scopes)
        return " ".join(filter(None, (self.name, scopes, f"sha256:{self.digest}", expiry, str(self.quota))))


def make_token(
    name: str, scopes: Iterable[Scope], quota: Quota = Quota(), expires_s: int | None = None
) -> tuple[str, str]:
    """Create a token; return it and the line for the token file.

    Raises:
        SecurityError: The name cannot stand in the file, or there is no scope.
    """
    token = _PREFIX + secrets.token_urlsafe(32)
    line = str(Entry(name, frozenset(scopes), _digest(token), quota, expires_s))
    if not _LINE.match(line):
        raise SecurityError(
            "a token needs a scope, and a name of 1 to 64 letters, digits, dots, dashes and underscores"
        )
    return token, line


def time_text(time_s: float) -> str:
    """Return a time since 1970 as it stands in a token file, such as `2027-01-31T00:00:00Z`."""
    return datetime.fromtimestamp(time_s, UTC).strftime(_TIME)


def read_time(text: str) -> int:
    """Return the time of a text of that form, in seconds since 1970.

    Raises:
        ValueError: It has another form.
    """
    return round(datetime.strptime(text, _TIME).replace(tzinfo=UTC).timestamp())


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode("utf-8", "backslashreplace")).hexdigest()


def parse_tokens(text: str, place: str) -> tuple[Entry, ...]:
    """The entries of a file: a line each, `NAME SCOPE,SCOPE sha256:DIGEST expires=TIME QUOTA=N ...`.

    A `#` begins a comment. An owner may have several tokens, all with the same quotas.

    Raises:
        SecurityError: A line is none, or does not fit the others.
    """
    found: dict[str, Entry] = {}
    quotas: dict[str, Quota] = {}
    for number, line in enumerate(text.splitlines(), 1):
        entry = parse_line(line, f"{place}:{number}")
        if entry is None:
            continue
        if entry.digest in found:
            raise SecurityError(f"{place}:{number}: the same token occurs twice")
        if quotas.setdefault(entry.name, entry.quota) != entry.quota:
            raise SecurityError(f"{place}:{number}: another token of '{entry.name}' has other quotas: make them equal")
        found[entry.digest] = entry
    return tuple(found.values())


def parse_line(line: str, place: str) -> Entry | None:
    """The entry of one line; None: it has only a comment.

    Raises:
        SecurityError: The line is none of a token file.
    """
    bare = line.partition("#")[0].strip()
    if not bare:
        return None
    match = _LINE.match(bare)
    if not match:
        # Not the line itself, which may contain the token by mistake.
        raise SecurityError(f"{place}: expected NAME SCOPE,SCOPE sha256:DIGEST")
    unknown = [word for word in match["scopes"].split(",") if word not in set(Scope)]
    if unknown:
        raise SecurityError(f"{place}: unknown scope '{unknown[0]}': use {', '.join(Scope)}")
    scopes = frozenset(Scope(word) for word in match["scopes"].split(","))
    quota, expires_s = _options(match["more"].split(), place)
    return Entry(match["name"], scopes, match["digest"], quota, expires_s)


def _options(words: list[str], place: str) -> tuple[Quota, int | None]:
    """The quotas and the time of expiry behind a digest."""
    amounts: dict[str, int] = {}
    expires_s = None
    for word in words:
        name, _, value = word.partition("=")
        # Not the word itself, as above.
        if name not in (_EXPIRES, *_QUOTAS):
            known = ", ".join((f"{_EXPIRES}=TIME", *(f"{known}=N" for known in _QUOTAS)))
            raise SecurityError(f"{place}: only {known} may follow the digest")
        if name in amounts or (name == _EXPIRES and expires_s is not None):
            raise SecurityError(f"{place}: {name} occurs twice")
        if name == _EXPIRES:
            try:
                expires_s = read_time(value)
            except ValueError:
                raise SecurityError(f"{place}: {name} must be a time in UTC such as 2027-01-31T00:00:00Z") from None
        elif not _AMOUNT.match(value):
            raise SecurityError(f"{place}: {name} must be a whole number from 1 to 999999999")
        else:
            amounts[name] = int(value)
    return Quota(**amounts), expires_s


def lasting_longer(entry: Entry, entries: Iterable[Entry]) -> Entry | None:
    """Return a token that replaces another one: of the same owner, for all its scopes, and valid for longer."""
    if entry.expires_s is None:
        return None
    for other in entries:
        if other.name == entry.name and other.scopes >= entry.scopes and other.is_valid(entry.expires_s):
            return other
    return None


def unreplaced(entries: Iterable[Entry]) -> list[Entry]:
    """Return the tokens that expire and that no other one replaces."""
    by_owner: dict[str, list[Entry]] = {}
    for entry in entries:
        by_owner.setdefault(entry.name, []).append(entry)
    return [
        entry
        for owned in by_owner.values()
        for entry in owned
        if entry.expires_s is not None and lasting_longer(entry, owned) is None
    ]


def missing_scope(entries: Iterable[Entry], needed: Scope) -> str | None:
    """Return a message if none of the valid tokens has the scope that every call needs; None: one has it."""
    if any(needed in entry.scopes for entry in entries):
        return None
    return f"no valid token has the scope '{needed}', so every call is refused"


class TokenFile:
    """Tokens of a file, which is reloaded within a second after a change, so that tokens can be revoked.

    If the changed file cannot be read or is invalid, the previous tokens stay valid, and the log says so.

    Args:
        path: Path of the file.
        clock: Seconds of a monotonic clock.
        needed: Scope that every call needs; a warning is logged if no token has it. None: no such scope.
        wall_clock: Seconds since 1970, by which tokens expire.

    Raises:
        SecurityError: The file cannot be read, is invalid, or other users can write it.
    """

    def __init__(
        self,
        path: Path,
        clock: Callable[[], float] = time.monotonic,
        *,
        needed: Scope | None = None,
        wall_clock: Callable[[], float] = time.time,
    ) -> None:
        self._path = path
        self._clock, self._wall_clock = clock, wall_clock
        self._needed = needed
        # Digests of tokens whose expiry, near or past, is in the log already.
        self._reported_soon: set[str] = set()
        self._reported_expired: set[str] = set()
        self._is_scope_missing = False
        self._lock = threading.Lock()
        self._entries, self._stamp = _read(path)
        self._warn()
        self._checked_s = clock()

    def find(self, token: str) -> Entry | None:
        """Return the entry of a valid token in constant time; None: the token is unknown or has expired."""
        found = self._find(token)
        return found if found is not None and found.is_valid(self._wall_clock()) else None

    def find_expired(self, token: str) -> Entry | None:
        """Return the entry of a token that has expired, in constant time, and log it once; None: it is none."""
        found = self._find(token)
        if found is None or found.expires_s is None or found.is_valid(self._wall_clock()):
            return None
        if found.digest not in self._reported_expired:
            # No more than the file has lines.
            self._reported_expired.add(found.digest)
            _log.warning(
                "the token %s of '%s' has expired at %s and is still used: give its owner a new one, or revoke it",
                found.id,
                found.name,
                time_text(found.expires_s),
            )
        return found

    def _find(self, token: str) -> Entry | None:
        digest = _digest(token[:MAXIMUM_TOKEN])
        found = None
        for entry in self._current():
            if hmac.compare_digest(entry.digest, digest):
                found = entry
        return found if len(token) <= MAXIMUM_TOKEN else None

    def named(self, name: str) -> Entry | None:
        """Return a token of an owner; None: there is none."""
        return next((entry for entry in self._current() if entry.name == name), None)

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All of them, the expired ones included."""
        return self._current()

    def seconds_to_expiry(self) -> dict[str, float]:
        """Return the seconds until tokens expire, by id, if no other token replaces them; negative: expired."""
        now_s = self._wall_clock()
        return {
            entry.id: entry.expires_s - now_s for entry in unreplaced(self._current()) if entry.expires_s is not None
        }

    def _current(self) -> tuple[Entry, ...]:
        with self._lock:
            if self._clock() - self._checked_s >= _CHECK_PERIOD_S:
                self._checked_s = self._clock()
                try:
                    if stamp_of(self._path.stat()) != self._stamp:
                        self._entries, self._stamp = _read(self._path)
                        _log.info("%s: reloaded", self._path)
                        known = {entry.digest for entry in self._entries}
                        self._reported_soon &= known
                        self._reported_expired &= known
                except (OSError, SecurityError) as error:
                    _log.error("the changed token file is not used: %s", error)
                self._warn()
            return self._entries

    def _warn(self) -> None:
        """Log a warning when a token expires soon, and when no token has the needed scope any more."""
        now_s = self._wall_clock()
        for entry in unreplaced(self._entries):
            if entry.digest in self._reported_soon or entry.is_valid(now_s + SOON_S) or entry.expires_s is None:
                continue
            self._reported_soon.add(entry.digest)
            verb = "expires" if entry.is_valid(now_s) else "has expired"
            _log.warning(
                "the token %s of '%s' %s at %s: rotate it", entry.id, entry.name, verb, time_text(entry.expires_s)
            )
        valid = [entry for entry in self._entries if entry.is_valid(now_s)]
        words = None if self._needed is None else missing_scope(valid, self._needed)
        if words is not None and not self._is_scope_missing:
            _log.warning("%s: %s", self._path, words)
        self._is_scope_missing = words is not None


def stamp_of(status: os.stat_result) -> tuple[int, int, int]:
    """Return what changes with a file: time, size and inode."""
    return status.st_mtime_ns, status.st_size, status.st_ino


def read_text(path: Path) -> str:
    """Return the text of a token file.

    Raises:
        SecurityError: The file cannot be read, or other users can write it.
    """
    return _read_text(path)[0]


def _read(path: Path) -> tuple[tuple[Entry, ...], tuple[int, int, int]]:
    text, stamp = _read_text(path)
    return parse_tokens(text, str(path)), stamp


def _read_text(path: Path) -> tuple[str, tuple[int, int, int]]:
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
        return data.decode(), stamp_of(status)
    except UnicodeDecodeError as error:
        raise SecurityError(f"{path}: not UTF-8") from error
