"""Bearer tokens (RFC 6750): random, kept as SHA-256 digests, each with a name and scopes.

A token has 256 random bits, so its digest needs neither salt nor many rounds: there is nothing to guess (NIST SP
800-63B, 5.1.2.2 on look-up secrets with at least 112 bits).
"""

import hashlib
import hmac
import logging
import math
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
from functools import lru_cache
from pathlib import Path

from robosc_api.security.errors import SecurityError

_log = logging.getLogger(__name__)

MAXIMUM_BYTES = 4 * 2**20
"""Maximum size of a token file, in bytes: 20,000 tokens with all that may stand in a line."""

ID_DIGITS = 8
"""Number of digits of a digest that name a token."""

MAXIMUM_TOKEN = 512
"""Maximum number of characters of a token."""

SOON_S = 14 * 86400.0
"""Time before the expiry of a token from which on there are warnings, in seconds."""

_CHECK_PERIOD_S = 1.0
_PREFIX = "robosc_"
_TIME = "%Y-%m-%dT%H:%M:%SZ"
_FULL_TIME = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2}Z\Z")
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


_SCOPES = frozenset(Scope)


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
    # This form takes a tenth of the time of the others: a file may have thousands of tokens.
    read = datetime.fromisoformat if _FULL_TIME.match(text) else _read_other_time
    return round(read(text).replace(tzinfo=UTC).timestamp())


def _read_other_time(text: str) -> datetime:
    return datetime.strptime(text, _TIME)


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
    try:
        scopes = _scopes_of(match["scopes"])
    except ValueError as error:
        raise SecurityError(f"{place}: unknown scope '{error}': use {', '.join(Scope)}") from None
    quota, expires_s = _options(match["more"].split(), place)
    return Entry(match["name"], scopes, match["digest"], quota, expires_s)


@lru_cache(maxsize=64)
def _scopes_of(text: str) -> frozenset[Scope]:
    """The scopes of a line; raises ValueError with a word that is none."""
    words = text.split(",")
    for word in words:
        if word not in _SCOPES:
            raise ValueError(word)
    return frozenset(Scope(word) for word in words)


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


class TokenIndex:
    """Tokens, found by digest and by name, with those that others replace; no lookup goes through all of them.

    Attributes:
        entries: The tokens, in the order of the file.
        unreplaced: Those that expire and that no other one replaces, the earliest first.
    """

    def __init__(self, entries: Iterable[Entry]) -> None:
        self.entries = tuple(entries)
        self._by_digest = {entry.digest: entry for entry in self.entries}
        self._by_name: dict[str, Entry] = {}
        # Last expiry of the tokens of an owner, by their scopes.
        self._last_s: dict[str, dict[frozenset[Scope], float]] = {}
        for entry in self.entries:
            self._by_name.setdefault(entry.name, entry)
            last_s = self._last_s.setdefault(entry.name, {})
            last_s[entry.scopes] = max(last_s.get(entry.scopes, 0.0), _end_s(entry))
        expiring = [entry for entry in self.entries if entry.expires_s is not None and not self.is_replaced(entry)]
        self.unreplaced = tuple(sorted(expiring, key=_end_s))

    def find(self, digest: str) -> Entry | None:
        """Return the token with a digest, valid or not; None: there is none.

        How long this takes tells nothing of use: whoever sends a token cannot choose its digest. It takes the same time
        for any number of tokens.
        """
        found = self._by_digest.get(digest)
        return found if found is not None and hmac.compare_digest(found.digest, digest) else None

    def named(self, name: str) -> Entry | None:
        """Return the first token of an owner; None: there is none."""
        return self._by_name.get(name)

    def is_replaced(self, entry: Entry) -> bool:
        """Return True if another token replaces one: of the same owner, for all its scopes, and valid for longer."""
        end_s = _end_s(entry)
        return any(
            last_s > end_s and scopes >= entry.scopes for scopes, last_s in self._last_s.get(entry.name, {}).items()
        )

    def last_s(self, scope: Scope) -> float:
        """Return the time at which the last token with a scope expires, in seconds since 1970; 0: there is none."""
        ends_s = (
            last_s for by_scopes in self._last_s.values() for scopes, last_s in by_scopes.items() if scope in scopes
        )
        return max(ends_s, default=0.0)


def _end_s(entry: Entry) -> float:
    """Return the time at which a token expires, in seconds since 1970; infinity: never."""
    return math.inf if entry.expires_s is None else entry.expires_s


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
        self._take(*_read(path))
        self._warn()
        self._checked_s = clock()

    def find(self, token: str) -> Entry | None:
        """Return the entry of a valid token; None: the token is unknown or has expired."""
        found = self._find(token)
        return found if found is not None and found.is_valid(self._wall_clock()) else None

    def find_expired(self, token: str) -> Entry | None:
        """Return the entry of a token that has expired, and log it once; None: it is none."""
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
        return self._current().find(_digest(token)) if len(token) <= MAXIMUM_TOKEN else None

    def named(self, name: str) -> Entry | None:
        """Return the first token of an owner; None: there is none."""
        return self._current().named(name)

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All of them, the expired ones included."""
        return self._current().entries

    def seconds_to_expiry(self) -> dict[str, float]:
        """Return the seconds until tokens expire, by id, if no other token replaces them; negative: expired."""
        now_s = self._wall_clock()
        return {entry.id: _end_s(entry) - now_s for entry in self._current().unreplaced}

    def _current(self) -> TokenIndex:
        with self._lock:
            if self._clock() - self._checked_s >= _CHECK_PERIOD_S:
                self._checked_s = self._clock()
                try:
                    if stamp_of(self._path.stat()) != self._stamp:
                        self._take(*_read(self._path))
                        _log.info("%s: reloaded", self._path)
                        known = {entry.digest for entry in self._index.entries}
                        self._reported_soon &= known
                        self._reported_expired &= known
                except (OSError, SecurityError) as error:
                    _log.error("the changed token file is not used: %s", error)
                self._warn()
            return self._index

    def _take(self, entries: tuple[Entry, ...], stamp: tuple[int, int, int]) -> None:
        self._index, self._stamp = TokenIndex(entries), stamp
        # Tokens that expire, the next one last.
        self._expiring = [*reversed(self._index.unreplaced)]
        self._last_needed_s = math.inf if self._needed is None else self._index.last_s(self._needed)

    def _warn(self) -> None:
        """Log a warning when a token expires soon, and when no token has the needed scope any more."""
        now_s = self._wall_clock()
        while self._expiring and not self._expiring[-1].is_valid(now_s + SOON_S):
            entry = self._expiring.pop()
            if entry.digest in self._reported_soon or entry.expires_s is None:
                continue
            self._reported_soon.add(entry.digest)
            verb = "expires" if entry.is_valid(now_s) else "has expired"
            _log.warning(
                "the token %s of '%s' %s at %s: rotate it", entry.id, entry.name, verb, time_text(entry.expires_s)
            )
        is_missing = now_s >= self._last_needed_s
        if self._needed is not None and is_missing and not self._is_scope_missing:
            _log.warning("%s: %s", self._path, missing_scope((), self._needed))
        self._is_scope_missing = is_missing


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
