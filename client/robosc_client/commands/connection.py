"""Which server a command asks, and how long it waits for it."""

import argparse
import os
from pathlib import Path

from robosc.cli.output import UsageError
from robosc_api.security import Credentials, add_client_arguments
from robosc_client import Client
from robosc_client.profiles import Profile, is_address, read_profiles, require_profile

PROFILE_VARIABLE = "ROBOSC_PROFILE"

EPILOG = """\
exit status:
  0  done; the model has no errors
  1  the model has errors, no supervisor exists, one that was checked is wrong, or a job has failed
  2  wrong use
  3  the server is not there, refused, failed or did not answer before the deadline
"""

_FIELDS = ("ca", "certificate", "key", "token_file")


def add_connection_arguments(parser: argparse.ArgumentParser) -> None:
    """Which server is asked, and how long."""
    parser.epilog, parser.formatter_class = EPILOG, argparse.RawDescriptionHelpFormatter
    server = parser.add_mutually_exclusive_group()
    server.add_argument("--server", type=address, metavar="HOST:PORT", help="where the server listens")
    server.add_argument(
        "--profile",
        metavar="NAME",
        help=f"a server of 'robosc-client profile' (default: ${PROFILE_VARIABLE}, or the default profile)",
    )
    add_client_arguments(parser)
    # What the environment says is about a server that is named, not about a profile: no token goes to another server.
    parser.set_defaults(from_environment={name: parser.get_default(name) for name in _FIELDS})
    parser.set_defaults(**dict.fromkeys(_FIELDS))
    parser.add_argument(
        "--deadline",
        type=seconds,
        metavar="SECONDS",
        help="give up after so long (default: as long as the server works on it)",
    )


def connect(arguments: argparse.Namespace) -> Client:
    """A client of the server that the arguments name.

    Raises:
        UsageError: They name none.
        CredentialsError: A certificate, key or token cannot be used.
    """
    return Client(*target_of(arguments))


def target_of(arguments: argparse.Namespace) -> tuple[str, Credentials]:
    """Address and credentials; raises UsageError as `connect`."""
    profile, defaults = _profile(arguments), arguments.from_environment
    if profile is not None:
        defaults = {name: getattr(profile, name) for name in _FIELDS}
    found: dict[str, Path | None] = {name: getattr(arguments, name) or defaults[name] for name in _FIELDS}
    is_secure = arguments.tls or (profile is not None and profile.tls)
    credentials = Credentials(is_secure=is_secure, **found)
    return (arguments.server if profile is None else profile.server), credentials


def _profile(arguments: argparse.Namespace) -> Profile | None:
    if arguments.server is not None:
        return None
    known = read_profiles()
    name = arguments.profile or os.environ.get(PROFILE_VARIABLE) or known.default
    if name is None:
        raise UsageError("no server is named: --server HOST:PORT, or a profile (see robosc-client profile --help)")
    return require_profile(known, name)


def address(text: str) -> str:
    """HOST:PORT, for a parser."""
    if not is_address(text):
        raise argparse.ArgumentTypeError(f"not HOST:PORT: '{text}'")
    return text


def seconds(text: str) -> float:
    """A positive number of seconds, for a parser."""
    number = float(text)
    if not 0 < number < 1e9:
        raise argparse.ArgumentTypeError("a positive number of seconds is needed")
    return number


# How argparse calls it in "invalid ... value".
seconds.__name__ = "number"
