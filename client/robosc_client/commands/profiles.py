"""The command `profile`, which manages named servers."""

import argparse
import getpass
import sys

from robosc.cli.arguments import given_path
from robosc.cli.output import ExitCode, UsageError, print_json
from robosc_api.security import Credentials, SecurityError, check_credentials
from robosc_api.security.addresses import is_loopback_host, split_address
from robosc_client.commands.connection import ADDRESS, ADDRESS_HELP, address, exit_statuses
from robosc_client.profiles import (
    MAXIMUM_TOKEN_BYTES,
    Profile,
    add_profile,
    profiles_file,
    read_profiles,
    remove_profile,
    require_profile,
)

_DESCRIPTION = """\
Named servers, stored in ~/.config/robosc/client.toml (or below $XDG_CONFIG_HOME). Every command without --server or
--profile uses the default profile.
"""


_EPILOG = exit_statuses("done", service=None)


def add_parsers(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command with its own commands."""
    parser = commands.add_parser("profile", help="manage named servers", description=_DESCRIPTION)
    actions = parser.add_subparsers(title="commands", dest="action", required=True, metavar="COMMAND")

    add = actions.add_parser("add", help="add a server")
    add.add_argument("name", metavar="NAME", help="name of the profile")
    add.add_argument("--server", type=address, required=True, metavar=ADDRESS, help=ADDRESS_HELP)
    add.add_argument("--tls", action="store_true", help="use TLS, and trust the system's certificate authorities")
    for name, what in (
        ("ca", "use TLS, and trust only these certificates (PEM)"),
        ("certificate", "client certificate chain (PEM)"),
        ("key", "private key of the certificate (PEM)"),
    ):
        add.add_argument(f"--{name}", type=given_path, metavar="FILE", help=what)
    token = add.add_mutually_exclusive_group()
    token.add_argument("--token-file", type=given_path, metavar="FILE", help="file with a token")
    token.add_argument(
        "--token", action="store_true", help="read a token from standard input, and store it in a private file"
    )
    add.add_argument("--default", action="store_true", help="make it the default profile (the first profile always is)")
    add.add_argument("--force", action="store_true", help="replace an existing profile")
    add.set_defaults(run_alone=_add)

    shown = actions.add_parser("list", help="list the profiles")
    shown.set_defaults(run_alone=_list)
    show = actions.add_parser("show", help="show a profile")
    show.add_argument("name", metavar="NAME", help="name of the profile")
    show.set_defaults(run_alone=_show)
    remove = actions.add_parser("remove", help="remove a profile and its stored token")
    remove.add_argument("name", metavar="NAME", help="name of the profile")
    remove.set_defaults(run_alone=_remove)
    for command in (add, shown, show, remove):
        command.epilog, command.formatter_class = _EPILOG, argparse.RawDescriptionHelpFormatter
        command.add_argument("--json", action="store_true", help="print one JSON document for machines")


def _add(arguments: argparse.Namespace) -> int:
    paths = {
        name: value if value is None else value.absolute()
        for name in ("ca", "certificate", "key", "token_file")
        for value in (getattr(arguments, name),)
    }
    profile = Profile(server=arguments.server, tls=arguments.tls, **paths)
    _require_usable(profile, has_token=arguments.token or profile.token_file is not None)
    token = _token() if arguments.token else None
    add_profile(arguments.name, profile, token=token, is_default=arguments.default, replaces=arguments.force)
    return _print(arguments, f"{profiles_file()}: profile {arguments.name} for {arguments.server}\n")


def _require_usable(profile: Profile, *, has_token: bool) -> None:
    """Do nothing if a server can be reached as a profile says, as far as that is known without asking it.

    Raises:
        UsageError: A file is not there or is not what it is to be, or a token would be sent in the clear.
    """
    credentials = Credentials(
        is_secure=profile.tls,
        ca=profile.ca,
        certificate=profile.certificate,
        key=profile.key,
        token_file=profile.token_file,
    )
    try:
        check_credentials(credentials)
    except SecurityError as error:
        raise UsageError(str(error)) from error
    is_secure = profile.tls or profile.ca is not None or profile.certificate is not None
    if has_token and not is_secure and not is_loopback_host(split_address(profile.server)[0]):
        raise UsageError(
            f"a token may be sent to another machine only with TLS: add --tls or --ca for {profile.server}"
        )


def _token() -> str:
    """Read a token without showing it on a terminal or in the list of processes."""
    if sys.stdin is None:
        raise UsageError("standard input is closed")
    try:
        given = getpass.getpass("token: ") if sys.stdin.isatty() else sys.stdin.read(MAXIMUM_TOKEN_BYTES + 1)
    except EOFError:
        # Ctrl-D at the prompt.
        given = ""
    token = given.strip()
    if not token or len(token) > MAXIMUM_TOKEN_BYTES or not token.isascii() or any(map(str.isspace, token)):
        raise UsageError("standard input must contain exactly one token")
    return token


def _list(arguments: argparse.Namespace) -> int:
    known = read_profiles()
    if arguments.json:
        profiles = {name: profile.document() for name, profile in known.by_name.items()}
        print_json({"default": known.default, "profiles": profiles})
        return ExitCode.OK
    for name, profile in known.by_name.items():
        sys.stdout.write(f"{'*' if name == known.default else ' '} {name:20} {profile.server}\n")
    return ExitCode.OK


def _show(arguments: argparse.Namespace) -> int:
    known = read_profiles()
    profile = require_profile(known, arguments.name)
    document = {"name": arguments.name, "default": arguments.name == known.default, **profile.document()}
    if arguments.json:
        print_json(document)
        return ExitCode.OK
    for key, value in document.items():
        sys.stdout.write(f"{key:12} {str(value).lower() if isinstance(value, bool) else value}\n")
    return ExitCode.OK


def _remove(arguments: argparse.Namespace) -> int:
    remove_profile(arguments.name)
    return _print(arguments, f"{profiles_file()}: removed profile {arguments.name}\n")


def _print(arguments: argparse.Namespace, text: str) -> int:
    if arguments.json:
        print_json({"file": str(profiles_file()), "profile": arguments.name})
    else:
        sys.stdout.write(text)
    return ExitCode.OK
