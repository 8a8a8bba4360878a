"""Security options that all commands share."""

import argparse
import os
from pathlib import Path

from robosc_api.security.client import Credentials
from robosc_api.security.errors import SecurityError
from robosc_api.security.tokens import Quota, Scope, make_token

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
    """Add the arguments for a token's owner and scopes, and where the service has quotas, for its quotas."""
    parser.add_argument("name", metavar="NAME", help="name of the token's owner, for the log")
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


def issue_token(arguments: argparse.Namespace) -> tuple[str, str]:
    """Create a token; return the text for standard output and the line for the token file.

    Raises:
        SecurityError: The name is invalid, or the file for the token exists or cannot be created.
    """
    quota = Quota(arguments.waiting, arguments.per_minute, arguments.cpu_seconds_per_hour, arguments.calls)
    token, line = make_token(arguments.name, tuple(arguments.scope or arguments.default_scopes), quota)
    if arguments.output is None:
        return f"{token}\n", f"Keep the token secret; it is not shown again. The line for the token file:\n{line}\n"
    try:
        # Private from the start: no other user can open it before its mode is set.
        with os.fdopen(os.open(arguments.output, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as stream:
            stream.write(f"{token}\n")
    except OSError as error:
        raise SecurityError(f"{arguments.output}: {error.strerror}") from error
    return "", f"{arguments.output}: the token; keep it secret. The line for the token file:\n{line}\n"
