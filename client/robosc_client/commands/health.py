"""The command `health`, which queries the gRPC health check of a server."""

import argparse
import sys

from robosc.cli.output import CommandError, ExitCode, print_json
from robosc.source import visible
from robosc_client.calls import CHANNEL_OPTIONS
from robosc_client.commands.connection import add_connection_arguments, exit_statuses, target_of
from robosc_client.convert.failures import first_line
from robosc_client.errors import CredentialsError

_DESCRIPTION = """\
Query the gRPC health check of a server once, for scripts and monitoring.
"""

_EPILOG = exit_statuses(
    "the server is serving",
    "the server is not serving, for example while it shuts down, or has no such service",
    "the server is unavailable, refused, or missed the deadline",
)

_DEADLINE_S = 5.0

# Status of a health check for an unknown service (gRPC Health Checking Protocol).
_NO_SUCH_SERVICE = "NOT_FOUND:"


def add_parsers(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser("health", help="query the health of a server", description=_DESCRIPTION)
    parser.add_argument(
        "--service",
        default="",
        metavar="NAME",
        help="check only this service, such as robosc_api.v1.JobService (default: the whole server)",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
    add_connection_arguments(parser, deadline_s=_DEADLINE_S, epilog=_EPILOG)
    parser.set_defaults(run_alone=_health)


def _health(arguments: argparse.Namespace) -> int:
    from robosc_api.health import ask_service
    from robosc_api.security import SecurityError

    address, credentials = target_of(arguments)
    try:
        found = ask_service(
            address, arguments.service, credentials, timeout_s=arguments.deadline, options=CHANNEL_OPTIONS
        )
    except SecurityError as error:
        raise CredentialsError(str(error)) from error
    if not found.has_answered:
        if found.message.startswith(_NO_SUCH_SERVICE):
            raise CommandError(f"the server at {address} has no service {arguments.service!r}", ExitCode.FAILED)
        raise CommandError(f"no server answers at {address}: {first_line(found.message)}", ExitCode.SERVICE)
    if arguments.json:
        print_json({"server": address, "service": arguments.service, "status": found.message})
    else:
        sys.stdout.write(f"{visible(found.message)}\n")
    return ExitCode.OK if found.is_serving else ExitCode.FAILED
