"""The command `robosc-client`, which runs the commands of `robosc` on a server."""

import argparse
import os
import sys
from collections.abc import Sequence

# gRPC would log the same errors again; it reads this variable at its import.
os.environ.setdefault("GRPC_VERBOSITY", "NONE")

from robosc import __version__
from robosc.cli.arguments import Parser
from robosc.cli.main import guarded, parse
from robosc.cli.output import CommandError, ExitCode, UsageError
from robosc_client import ClientError, CredentialsError, NotThereError
from robosc_client.commands import bench, health, jobs, profiles, server_info, submit, tasks, top
from robosc_client.commands.connection import EPILOG, connect


def make_parser() -> Parser:
    """Return the parser of the whole command line."""
    parser = Parser(
        prog="robosc-client",
        description="Check models, synthesize supervisors and generate packages on a RoboSC server.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"robosc-client {__version__}")
    commands = parser.add_subparsers(title="commands", dest="command", required=True, metavar="COMMAND")
    for module in (tasks, server_info, health, submit, jobs, top, profiles, bench):
        module.add_parsers(commands)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit status."""
    arguments = parse(make_parser(), argv)

    def run() -> int:
        try:
            if "run_alone" in arguments:
                return int(arguments.run_alone(arguments))
            with connect(arguments) as client:
                return int(arguments.run(arguments, client))
        except (CredentialsError, NotThereError) as error:
            raise UsageError(str(error)) from error
        except ClientError as error:
            raise CommandError(str(error), ExitCode.SERVICE) from error

    return guarded("robosc-client", run, as_json=arguments.json)


if __name__ == "__main__":
    sys.exit(main())
