"""The commands `targets` and `version`."""

import argparse
import dataclasses
import sys

from robosc import __version__
from robosc.cli.output import ExitCode, print_json
from robosc.source import visible
from robosc_client import Client
from robosc_client.commands.connection import add_connection_arguments, exit_statuses


def add_parsers(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the commands."""
    targets = commands.add_parser("targets", help="list the targets that a server can generate")
    targets.set_defaults(run=_targets)
    version = commands.add_parser("version", help="print the version, engines and limits of a server")
    version.set_defaults(run=_version)
    for parser in (targets, version):
        parser.add_argument("--json", action="store_true", help="print one JSON document for machines")
        add_connection_arguments(parser, epilog=exit_statuses("done"))


def _targets(arguments: argparse.Namespace, client: Client) -> int:
    found = client.list_targets(deadline_s=arguments.deadline)
    if arguments.json:
        print_json({"targets": [{"name": item.name, "description": item.description} for item in found]})
    else:
        for item in found:
            sys.stdout.write(f"{visible(item.name):10} {visible(item.description)}\n")
    return ExitCode.OK


def _version(arguments: argparse.Namespace, client: Client) -> int:
    found = client.get_version(deadline_s=arguments.deadline)
    limits = dataclasses.asdict(found.limits)
    if arguments.json:
        print_json({"version": found.version, "engines": list(found.engines), "limits": limits, "client": __version__})
        return ExitCode.OK
    sys.stdout.write(f"RoboSC {visible(found.version)}; engines: {visible(', '.join(found.engines))}\n")
    for name, value in limits.items():
        sys.stdout.write(f"  {name.replace('_', ' '):26} {value:,.10g}\n")
    return ExitCode.OK
