"""Arguments for the server and the deadline of a command."""

import argparse
import os
from collections.abc import Callable
from pathlib import Path

from robosc.cli.output import UsageError
from robosc_api.security import Credentials, add_client_arguments
from robosc_api.security.addresses import SYNTHESIS_PORT, with_port
from robosc_client import Client
from robosc_client.profiles import Profile, read_profiles, require_profile

_PROFILE_VARIABLE = "ROBOSC_PROFILE"

SERVICE = "the server is unavailable, refused, failed or missed the deadline; or its answer was rejected"
SIGNED_SERVICE = f"{SERVICE}, such\n     as a supervisor that no key of --signed-by has signed"
"""Meaning of the exit status 3 of commands that check signatures; `SERVICE` for the others."""


def exit_statuses(done: str, failed: str | None = None, service: str | None = SERVICE) -> str:
    """Return the meanings of the exit statuses of a command, for its help.

    Args:
        done: Meaning of 0.
        failed: Meaning of 1; None: the command never ends with 1.
        service: Meaning of 3; None: the command calls no server.
    """
    meanings = {0: done, 1: failed, 2: "wrong options", 3: service, 130: "Ctrl-C"}
    return "exit status:\n" + "".join(f"  {status}  {what}\n" for status, what in meanings.items() if what is not None)


EPILOG = exit_statuses(
    "done; the model has no errors",
    "the model has errors, no supervisor exists, or a checked supervisor is wrong; or a watched job, or a job whose\n"
    "     result was requested, has failed or was cancelled",
    SIGNED_SERVICE,
)
"""Epilog of all commands together."""

_MODEL_EPILOG = exit_statuses("done; the model has no errors", "the model has errors, or no supervisor exists")

ADDRESS, ADDRESS_HELP = "HOST[:PORT]", f"address of the server (default port: {SYNTHESIS_PORT})"
"""Placeholder and help of an argument for the server's address."""

_ENDLESS_S = 1e9

_MAXIMUM_SENDABLE = 2**64 - 1

_FIELDS = ("ca", "certificate", "key", "token_file")


def add_connection_arguments(
    parser: argparse.ArgumentParser, *, deadline_s: float | None = None, epilog: str = _MODEL_EPILOG
) -> None:
    """Add the arguments for the server and for the time limit.

    Args:
        parser: Parser of the command.
        deadline_s: Default of the time limit, in seconds; None: no limit.
        epilog: Meanings of its exit statuses.
    """
    parser.epilog, parser.formatter_class = epilog, argparse.RawDescriptionHelpFormatter
    server = parser.add_mutually_exclusive_group()
    server.add_argument("--server", type=address, metavar=ADDRESS, help=ADDRESS_HELP)
    server.add_argument(
        "--profile",
        metavar="NAME",
        help=f"profile of the server, see 'profile --help' (default: ${_PROFILE_VARIABLE}, or the default profile)",
    )
    add_client_arguments(parser)
    # Environment variables apply to --server, not to profiles, so that no token reaches another server.
    parser.set_defaults(from_environment={name: parser.get_default(name) for name in _FIELDS})
    parser.set_defaults(**dict.fromkeys(_FIELDS))
    parser.add_argument(
        "--deadline",
        type=seconds,
        default=deadline_s,
        metavar="SECONDS",
        help="deadline of the call "
        f"(default: {'the time limit of the server' if deadline_s is None else f'{deadline_s:g}'})",
    )


def connect(arguments: argparse.Namespace) -> Client:
    """Return a client of the server that the arguments name.

    Raises:
        UsageError: The arguments name no server.
        CredentialsError: A certificate, key or token cannot be used.
    """
    return Client(*target_of(arguments))


def target_of(arguments: argparse.Namespace) -> tuple[str, Credentials]:
    """Return the address and credentials; raises UsageError as `connect`."""
    profile, defaults = _profile(arguments), arguments.from_environment
    if profile is not None:
        defaults = {name: getattr(profile, name) for name in _FIELDS}
    found: dict[str, Path | None] = {name: getattr(arguments, name) or defaults[name] for name in _FIELDS}
    if (found["certificate"] is None) != (found["key"] is None):
        raise UsageError("a certificate and its key must be given together: use both --certificate and --key")
    is_secure = arguments.tls or (profile is not None and profile.tls)
    credentials = Credentials(is_secure=is_secure, **found)
    return (arguments.server if profile is None else profile.server), credentials


def _profile(arguments: argparse.Namespace) -> Profile | None:
    if arguments.server is not None:
        return None
    known = read_profiles()
    name = arguments.profile or os.environ.get(_PROFILE_VARIABLE) or known.default
    if name is None:
        raise UsageError("no server is given: use --server HOST or a profile (see robosc-client profile --help)")
    return require_profile(known, name)


def address(text: str) -> str:
    """Return HOST:PORT from HOST or HOST:PORT, for a parser."""
    try:
        return with_port(text, SYNTHESIS_PORT)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def seconds(text: str) -> float:
    """Return a positive number of seconds, for a parser."""
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0 < number < _ENDLESS_S:
        raise argparse.ArgumentTypeError(f"must be a number of seconds above 0 and below {_ENDLESS_S:,.0f}")
    return number


def number_up_to(most: int) -> Callable[[str], int]:
    """Return a function that reads a number from 1 to a limit, for a parser."""

    def read(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            number = 0
        if not 0 < number <= most:
            raise argparse.ArgumentTypeError(f"must be a number from 1 to {most:,}")
        return number

    return read


def checked_number(number: int | None, option: str) -> int | None:
    """Return a number of an option, if a request can contain it.

    Raises:
        UsageError: The number is out of range.
    """
    if number is not None and number > _MAXIMUM_SENDABLE:
        raise UsageError(f"{option} must be at most {_MAXIMUM_SENDABLE}")
    return number
