"""Security options that all commands share."""

import argparse
import os
import re
import time
from collections.abc import Callable
from pathlib import Path

from robosc_api.security.client import Credentials
from robosc_api.security.errors import SecurityError
from robosc_api.security.tokens import Quota, Scope, make_token, read_time

CA_VARIABLE = "ROBOSC_CA"
TOKEN_VARIABLE = "ROBOSC_TOKEN_FILE"  # its name


def add_client_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options for reaching a service."""
    group = parser.add_argument_group("security")
    group.add_argument("--tls", action="store_true", help="use TLS, and trust the system's certificate authorities")
    group.add_argument(
        "--ca",
        type=Path,
        metavar="FILE",
        default=_from_environment(CA_VARIABLE),
        help=f"use TLS, and trust only these certificates (PEM; default: ${CA_VARIABLE})",
    )
    group.add_argument("--certificate", type=Path, metavar="FILE", help="client certificate chain (PEM)")
    group.add_argument("--key", type=Path, metavar="FILE", help="private key of the certificate (PEM)")
    group.add_argument(
        "--token-file",
        type=Path,
        metavar="FILE",
        default=_from_environment(TOKEN_VARIABLE),
        help=f"file with a token (default: ${TOKEN_VARIABLE})",
    )


def credentials_of(arguments: argparse.Namespace) -> Credentials:
    """Return the credentials that those options describe."""
    return Credentials(
        is_secure=arguments.tls,
        ca=arguments.ca,
        certificate=arguments.certificate,
        key=arguments.key,
        token_file=arguments.token_file,
    )


def _from_environment(name: str) -> Path | None:
    value = os.environ.get(name)
    return Path(value) if value else None


def add_token_arguments(
    parser: argparse.ArgumentParser, scopes: tuple[Scope, ...], *, has_quotas: bool = False
) -> None:
    """Add the arguments for a token's owner and `add_token_options`."""
    parser.add_argument("name", metavar="NAME", help="name of the token's owner, for the log")
    add_token_options(parser, scopes, has_quotas=has_quotas)


def add_token_options(parser: argparse.ArgumentParser, scopes: tuple[Scope, ...], *, has_quotas: bool = False) -> None:
    """Add the options for a token's scopes, its expiry, its file, and where the service has quotas, for its quotas."""
    parser.add_argument(
        "--scope",
        action="append",
        type=_scope,
        metavar="SCOPE",
        help=f"scope of the token; may be repeated (default: {', '.join(scopes)}). {_SCOPES_HELP}",
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="new file for the token, readable by its owner only (default: standard output)",
    )
    add_expiry_argument(parser, "default: never")
    parser.set_defaults(default_scopes=scopes, waiting=None, per_minute=None, cpu_seconds_per_hour=None, calls=None)
    if has_quotas:
        for name, words in _QUOTA_HELP.items():
            parser.add_argument(f"--{name.replace('_', '-')}", type=_amount, metavar="N", help=words)


_SCOPES_HELP = (
    "Scopes of a synthesis server: synthesize: needed by every call; admin, besides synthesize: access to the jobs of "
    "all callers. Scopes of a bridge: watch: status and the stream of states; operate: these and commands"
)


def _scope(text: str) -> Scope:
    try:
        return Scope(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"unknown scope {text!r}: use {', '.join(Scope)}") from None


_QUOTA_HELP = {
    "waiting": "maximum number of waiting tasks (default: the server's setting)",
    "per_minute": "maximum number of tasks per minute (default: unlimited)",
    "cpu_seconds_per_hour": "maximum CPU time of its tasks per hour, in seconds (default: unlimited)",
    "calls": "maximum number of open calls (default: the server's setting)",
}


def _amount(text: str) -> int:
    if not text.isascii() or not text.isdecimal() or not 1 <= len(text) <= 9 or int(text) == 0:
        raise argparse.ArgumentTypeError("must be a whole number from 1 to 999999999")
    return int(text)


def add_expiry_argument(parser: argparse.ArgumentParser, words: str) -> None:
    """Add the option for the expiry of a token.

    Args:
        parser: Parser of the command.
        words: Description of what follows without the option.
    """
    parser.add_argument(
        "--expires",
        type=_expiry,
        metavar="WHEN",
        help=f"expiry of the token: after a time such as 90d or 12h, at 2027-01-31 or 2027-01-31T08:00:00Z (UTC), or "
        f"never ({words})",
    )


_NEVER = "never"
_DURATION = re.compile(r"([0-9]{1,6})([smhd])\Z")
_UNIT_S = {"s": 1, "m": 60, "h": 3600, "d": 86400}


def seconds_of(text: str) -> int:
    """Return the seconds of a time such as `90d`; a type of arguments."""
    match = _DURATION.match(text)
    if match is None:
        raise argparse.ArgumentTypeError(f"not a time such as 90d, 12h, 30m or 10s: {text!r}")
    return int(match[1]) * _UNIT_S[match[2]]


def _expiry(text: str) -> Callable[[float], int | None]:
    """Return the function from the time now to the time of expiry, in seconds since 1970; a type of arguments."""
    if text == _NEVER:
        return lambda now_s: None
    if _DURATION.match(text):
        duration_s = seconds_of(text)
        return lambda now_s: round(now_s) + duration_s
    try:
        time_s = read_time(text if "T" in text else f"{text}T00:00:00Z")
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"neither a time such as 90d, nor a date such as 2027-01-31, nor never: {text!r}"
        ) from None
    return lambda now_s: time_s


def expiry_of(given: Callable[[float], int | None] | None, now_s: float) -> int | None:
    """Return the time of expiry that the option names, in seconds since 1970; None: never.

    Args:
        given: Value of the option; None: it was not given.
        now_s: Seconds since 1970.

    Raises:
        SecurityError: It is past.
    """
    expires_s = None if given is None else given(now_s)
    if expires_s is not None and expires_s <= now_s:
        raise SecurityError("the token would have expired already: choose a later time")
    return expires_s


def quota_of(arguments: argparse.Namespace) -> Quota:
    """Return the quotas that the options describe."""
    return Quota(arguments.waiting, arguments.per_minute, arguments.cpu_seconds_per_hour, arguments.calls)


def issue_token(arguments: argparse.Namespace) -> tuple[str, str]:
    """Create a token; return the text for standard output and the line for the token file.

    Args:
        arguments: Arguments of `add_token_arguments`.

    Raises:
        SecurityError: The name or expiry is invalid, or the file for the token exists or cannot be created.
    """
    expires_s = expiry_of(arguments.expires, time.time())
    scopes = tuple(arguments.scope or arguments.default_scopes)
    token, line = make_token(arguments.name, scopes, quota_of(arguments), expires_s)
    if arguments.output is None:
        return f"{token}\n", f"Keep the token secret; it is not shown again. The line for the token file:\n{line}\n"
    write_token(arguments.output, token)
    return "", f"{arguments.output}: the token; keep it secret. The line for the token file:\n{line}\n"


def write_token(path: Path, token: str) -> None:
    """Write a token to a new file, which only its owner can read.

    Raises:
        SecurityError: The file exists or cannot be created.
    """
    try:
        # Private from the start: no other user can open it before its mode is set.
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as stream:
            stream.write(f"{token}\n")
    except OSError as error:
        raise SecurityError(f"{path}: {error.strerror}") from error
