"""The same options for the same thing in every command."""

import argparse
import os
from pathlib import Path

from robosc_api.security.client import Credentials
from robosc_api.security.errors import SecurityError
from robosc_api.security.listening import ServerSecurity
from robosc_api.security.tokens import Quota, Scope, make_token

CA_VARIABLE = "ROBOSC_CA"
TOKEN_VARIABLE = "ROBOSC_TOKEN_FILE"  # its name


def add_server_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options for securing a service."""
    group = parser.add_argument_group("security")
    group.add_argument("--tls-certificate", type=Path, metavar="FILE", help="certificate chain (PEM): listen with TLS")
    group.add_argument("--tls-key", type=Path, metavar="FILE", help="its private key (PEM)")
    group.add_argument(
        "--client-ca", type=Path, metavar="FILE", help="callers need a certificate that one of these (PEM) has signed"
    )
    group.add_argument("--tokens", type=Path, metavar="FILE", help="callers need a token of this file (see `token`)")
    group.add_argument(
        "--insecure-beyond-loopback",
        action="store_true",
        help="listen without TLS where other machines reach it, on a network that you trust",
    )


def server_security_of(arguments: argparse.Namespace) -> ServerSecurity:
    """Return the security that those options describe."""
    return ServerSecurity(
        certificate=arguments.tls_certificate,
        key=arguments.tls_key,
        client_ca=arguments.client_ca,
        tokens=arguments.tokens,
        insecure_beyond_loopback=arguments.insecure_beyond_loopback,
    )


def add_client_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options for reaching a service."""
    group = parser.add_argument_group("security")
    group.add_argument("--tls", action="store_true", help="with TLS, believing the usual certificate authorities")
    group.add_argument(
        "--ca",
        type=Path,
        metavar="FILE",
        default=_from_environment(CA_VARIABLE),
        help=f"with TLS, believing these certificates alone (PEM; default: ${CA_VARIABLE})",
    )
    group.add_argument("--certificate", type=Path, metavar="FILE", help="own certificate chain (PEM)")
    group.add_argument("--key", type=Path, metavar="FILE", help="its private key (PEM)")
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
    parser.add_argument("name", metavar="NAME", help="whose token it is, for the log")
    parser.add_argument(
        "--scope",
        action="append",
        type=_scope,
        metavar="SCOPE",
        help=f"what it is for; may be given again (default: {', '.join(scopes)}). {_SCOPES_HELP}",
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="where the token is written, for its owner alone; a file that is there stays; default: standard output",
    )
    parser.set_defaults(default_scopes=scopes, waiting=None, per_minute=None, cpu_seconds_per_hour=None, calls=None)
    if has_quotas:
        for name, words in _QUOTA_HELP.items():
            parser.add_argument(f"--{name.replace('_', '-')}", type=_amount, metavar="N", help=words)


_SCOPES_HELP = (
    "Of a synthesis server: synthesize: everything that is the caller's own, without which nothing can be called; "
    "admin, besides synthesize: jobs of all callers. Of a bridge: watch: status and the stream of states; operate: "
    "this, and commands"
)


def _scope(text: str) -> Scope:
    try:
        return Scope(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"there is no scope {text!r}, only {', '.join(Scope)}") from None


_QUOTA_HELP = {
    "waiting": "tasks of it that may wait at once (default: what the server's settings say)",
    "per_minute": "tasks that it may ask for in a minute (default: any number)",
    "cpu_seconds_per_hour": "seconds of a processor's time that its tasks may take in an hour (default: any number)",
    "calls": "calls of it that may be open at once (default: what the server's settings say)",
}


def _amount(text: str) -> int:
    if not text.isascii() or not text.isdecimal() or not 1 <= len(text) <= 9 or int(text) == 0:
        raise argparse.ArgumentTypeError("a whole number from 1 to 999999999 is needed")
    return int(text)


def issue_token(arguments: argparse.Namespace) -> tuple[str, str]:
    """A new token for standard output, if it is not in a file, and for people the line that lets it in.

    Raises:
        SecurityError: The name cannot stand in a file of tokens, or the file for the token is there or cannot be made.
    """
    quota = Quota(arguments.waiting, arguments.per_minute, arguments.cpu_seconds_per_hour, arguments.calls)
    token, line = make_token(arguments.name, tuple(arguments.scope or arguments.default_scopes), quota)
    if arguments.output is None:
        return f"{token}\n", f"Keep the token secret; it is not shown again. The line for the file of tokens:\n{line}\n"
    try:
        # For its owner alone from the beginning: nobody can open it before its mode is set.
        with os.fdopen(os.open(arguments.output, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as stream:
            stream.write(f"{token}\n")
    except OSError as error:
        raise SecurityError(f"{arguments.output}: {error.strerror}") from error
    return "", f"{arguments.output}: the token; keep it secret. The line for the file of tokens:\n{line}\n"
