"""Commands that keep a token file: tokens are added, rotated, listed and revoked.

A changed file takes the place of the old one in one step, so that a service, which reads it again within a second,
never sees half of it. It has the digests of tokens alone: a token is shown once, when it is made.
"""

import argparse
import contextlib
import fcntl
import json
import os
import stat
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from robosc_api.security.arguments import (
    add_expiry_argument,
    add_token_options,
    expiry_of,
    quota_of,
    seconds_of,
    write_token,
)
from robosc_api.security.errors import SecurityError
from robosc_api.security.tokens import (
    SOON_S,
    Entry,
    Quota,
    Scope,
    TokenIndex,
    make_token,
    parse_line,
    parse_tokens,
    read_text,
    time_text,
)

_WRONG = 2
_OVERLAP = "7d"


def add_tokens_arguments(
    parser: argparse.ArgumentParser, scopes: tuple[Scope, ...], *, has_quotas: bool = False
) -> None:
    """Add the commands; `run_tokens` runs them.

    Args:
        parser: Parser of the word before them.
        scopes: Scopes of a token for which none are given.
        has_quotas: True if tokens of the service may have quotas.
    """
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def command(name: str, words: str, run: Callable[..., Any]) -> argparse.ArgumentParser:
        made = commands.add_parser(name, help=words, description=f"{words[0].upper()}{words[1:]}.", allow_abbrev=False)
        made.add_argument("file", type=Path, metavar="FILE", help="token file of the service")
        made.add_argument("--json", action="store_true", help="print one JSON document")
        made.set_defaults(run_tokens=run, program=parser.prog.partition(" ")[0])
        return made

    command("list", "list the tokens with their expiry", _list)
    add = command("add", "create a token for a new caller, and add it to the file", _add)
    add.add_argument("name", metavar="NAME", help="name of the token's owner, for the log")
    add_token_options(add, scopes, has_quotas=has_quotas)
    rotate = command(
        "rotate",
        "create another token for a caller, with the same scopes and quotas; the previous ones expire after a time",
        _rotate,
    )
    rotate.add_argument("name", metavar="NAME", help="name of the tokens' owner")
    add_expiry_argument(rotate, "needed if the latest token expires")
    rotate.add_argument(
        "--overlap",
        type=seconds_of,
        default=_OVERLAP,
        metavar="TIME",
        help="time until the previous tokens expire, such as 12h or 0s (default: %(default)s)",
    )
    rotate.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="new file for the token, readable by its owner only (default: standard output)",
    )
    revoke = command("revoke", "remove the tokens of a caller, or one of them, from the file", _revoke)
    revoke.add_argument("token", metavar="NAME|ID", help="name of their owner, or the id of one that `list` shows")


def run_tokens(arguments: argparse.Namespace, wall_clock: Callable[[], float] = time.time) -> int:
    """Run one of the commands; returns the exit status.

    Args:
        arguments: Arguments that its parser has read.
        wall_clock: Seconds since 1970.
    """
    try:
        arguments.run_tokens(arguments, wall_clock())
    except SecurityError as error:
        sys.stderr.write(f"{arguments.program}: {error}\n")
        if arguments.json:
            _print_json({"error": {"status": _WRONG, "message": str(error)}})
        return _WRONG
    return 0


def _list(arguments: argparse.Namespace, now_s: float) -> None:
    index = TokenIndex(parse_tokens(read_text(arguments.file), str(arguments.file)))
    if arguments.json:
        _print_json({"tokens": [_document(entry, index, now_s) for entry in index.entries]})
        return
    rows = [("NAME", "ID", "SCOPES", "EXPIRES", "STATE", "QUOTAS")]
    for entry in index.entries:
        expires = "never" if entry.expires_s is None else time_text(entry.expires_s)
        state = _state(entry, index, now_s)
        rows.append((entry.name, entry.id, _scopes(entry), expires, state, str(entry.quota)))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        line = "  ".join(word.ljust(width) for word, width in zip(row, widths, strict=True))
        sys.stdout.write(line.rstrip() + "\n")


def _add(arguments: argparse.Namespace, now_s: float) -> None:
    scopes = tuple(arguments.scope or arguments.default_scopes)
    expires_s = expiry_of(arguments.expires, now_s)
    token, line = make_token(arguments.name, scopes, quota_of(arguments), expires_s)
    with _editing(arguments.file, may_create=True) as lines:
        if any(entry.name == arguments.name for entry in _entries(lines, arguments.file)):
            raise SecurityError(f"{arguments.file}: '{arguments.name}' has a token already: use rotate for another one")
        lines.append(line)
        _deliver(arguments, token, line)


def _rotate(arguments: argparse.Namespace, now_s: float) -> None:
    end_s = round(now_s) + arguments.overlap
    with _editing(arguments.file) as lines:
        earlier = [entry for entry in _entries(lines, arguments.file) if entry.name == arguments.name]
        if not earlier:
            raise SecurityError(f"{arguments.file}: no token of '{arguments.name}'")
        latest = earlier[-1]
        if arguments.expires is None and latest.expires_s is not None:
            raise SecurityError(
                f"the latest token of '{latest.name}' expires: say when the new one does, such as --expires 90d, or "
                "--expires never"
            )
        expires_s = expiry_of(arguments.expires, now_s)
        if expires_s is not None and expires_s <= end_s:
            raise SecurityError("the new token expires before the end of the overlap: choose a later time")
        token, line = make_token(latest.name, latest.scopes, latest.quota, expires_s)
        kept = []
        for given in lines:
            entry = parse_line(given, str(arguments.file))
            if entry is None or entry.name != latest.name:
                kept.append(given)
            elif entry.is_valid(now_s):
                kept.append(given if not entry.is_valid(end_s) else _with_expiry(given, entry, end_s))
        lines[:] = [*kept, line]
        _deliver(arguments, token, line)


def _with_expiry(line: str, entry: Entry, expires_s: int) -> str:
    """Return a line with another expiry, and its comment."""
    _, mark, comment = line.partition("#")
    return str(replace(entry, expires_s=expires_s)) + (f"  {mark}{comment}" if mark else "")


def _revoke(arguments: argparse.Namespace, now_s: float) -> None:
    with _editing(arguments.file) as lines:
        entries = _entries(lines, arguments.file)
        wanted = [entry for entry in entries if entry.name == arguments.token]
        wanted = wanted or [entry for entry in entries if entry.id == arguments.token]
        if not wanted:
            raise SecurityError(f"{arguments.file}: no token with the name or id '{arguments.token}'")
        lines[:] = [line for line in lines if parse_line(line, str(arguments.file)) not in wanted]
    if arguments.json:
        index = TokenIndex(entries)
        _print_json({"revoked": [_document(entry, index, now_s) for entry in wanted]})
    else:
        sys.stdout.writelines(f"{entry.name} {entry.id}: revoked\n" for entry in wanted)


def _deliver(arguments: argparse.Namespace, token: str, line: str) -> None:
    """Give the token to its owner, before it is valid: one that could not be written is of no use.

    Raises:
        SecurityError: It cannot be written.
    """
    entry = parse_line(line, "")
    assert entry is not None  # noqa: S101  # a line that was just made
    if arguments.output is not None:
        write_token(arguments.output, token)
    try:
        if arguments.json:
            document = {
                key: value for key, value in _document(entry, TokenIndex((entry,)), 0.0).items() if key != "state"
            }
            where = {"token": token} if arguments.output is None else {"token_file": str(arguments.output)}
            _print_json(document | where)
        elif arguments.output is None:
            sys.stdout.write(f"{token}\n")
            sys.stdout.flush()
    except OSError as error:
        # The interpreter would try again at its exit.
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if arguments.output is not None:
            arguments.output.unlink()
        raise SecurityError(
            f"the token cannot be written ({error.strerror}), so {arguments.file} is unchanged"
        ) from error
    if not arguments.json and arguments.output is None:
        sys.stderr.write("Keep the token secret; it is not shown again.\n")
    elif not arguments.json:
        sys.stderr.write(f"{arguments.output}: the token; keep it secret.\n")


def _scopes(entry: Entry) -> str:
    return ",".join(sorted(entry.scopes))


def _state(entry: Entry, index: TokenIndex, now_s: float) -> str:
    if not entry.is_valid(now_s):
        return "expired"
    if index.is_replaced(entry):
        return "replaced"
    return "valid" if entry.is_valid(now_s + SOON_S) else "expires soon"


def _document(entry: Entry, index: TokenIndex, now_s: float) -> dict[str, Any]:
    quotas = {name: getattr(entry.quota, name) for name in Quota.__slots__}
    return {
        "name": entry.name,
        "id": entry.id,
        "scopes": sorted(entry.scopes),
        "expires": None if entry.expires_s is None else time_text(entry.expires_s),
        "state": _state(entry, index, now_s),
        "quotas": {name: value for name, value in quotas.items() if value is not None},
    }


def _print_json(document: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(document, indent=2) + "\n")
    sys.stdout.flush()


def _entries(lines: list[str], path: Path) -> tuple[Entry, ...]:
    return parse_tokens("\n".join(lines), str(path))


@contextlib.contextmanager
def _editing(path: Path, *, may_create: bool = False) -> Iterator[list[str]]:
    """Yield the lines of a token file, and write them to it if the context ends without an error.

    Raises:
        SecurityError: The file cannot be read or written, or would be invalid.
    """
    try:
        # A link stays one.
        path = path.resolve()
        folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except OSError as error:
        raise SecurityError(f"{path}: {error.strerror}") from error
    try:
        # Two of these commands do not lose each other's changes.
        fcntl.flock(folder, fcntl.LOCK_EX)
        is_new = may_create and not path.exists()
        lines = [] if is_new else read_text(path).splitlines()
        with _replacement(path, is_new=is_new) as write:
            yield lines
            _entries(lines, path)
            write("".join(f"{line}\n" for line in lines))
    finally:
        os.close(folder)


@contextlib.contextmanager
def _replacement(path: Path, *, is_new: bool) -> Iterator[Callable[[str], None]]:
    """Make a file beside another one, of the same owner and mode; yield the function that has it take its place.

    Raises:
        SecurityError: It cannot be made.
    """
    try:
        descriptor, name = tempfile.mkstemp(prefix=f".{path.name}-", dir=path.parent)
    except OSError as error:
        raise SecurityError(f"{path.parent}: {error.strerror}") from error
    made = Path(name)

    def write(text: str) -> None:
        try:
            if not is_new:
                status = path.stat()
                os.fchmod(descriptor, stat.S_IMODE(status.st_mode))
                # The service itself may own it.
                if (status.st_uid, status.st_gid) != (os.geteuid(), os.getegid()):
                    os.fchown(descriptor, status.st_uid, status.st_gid)
            os.write(descriptor, text.encode())
            os.fsync(descriptor)
            made.replace(path)
        except OSError as error:
            raise SecurityError(f"{path} cannot be replaced: {error.strerror}") from error

    try:
        yield write
    finally:
        os.close(descriptor)
        made.unlink(missing_ok=True)
