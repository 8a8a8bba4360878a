"""`robosc-bridge status|start|standby|stop|resume|reset|watch|teleop|token|tokens`: commands for a terminal."""

import argparse
import json
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from robosc.cli.starting import interrupts_as_such
from robosc_api.security import (
    Scope,
    SecurityError,
    add_client_arguments,
    add_token_arguments,
    add_tokens_arguments,
    credentials_of,
    issue_token,
    run_tokens,
)
from robosc_api.security.addresses import BRIDGE_PORT, with_port

ADDRESS_VARIABLE, ADDRESS = "ROBOSC_BRIDGE", f"127.0.0.1:{BRIDGE_PORT}"
DONE, REFUSED, WRONG = 0, 1, 2

EPILOG = "exit status: 0 done; 1 the bridge refuses, or a fault has stopped it; 2 wrong use, or no bridge answers"

_COMMANDS = {
    "start": "execute the supervisor, in standby or after a fault",
    "standby": "bring the robot to rest and let the motors go",
    "resume": "let the robot go on after a stop",
    "reset": "clear faults whose cause is gone; standby follows",
}
NAMES = ("stop", *_COMMANDS, "status", "watch", "teleop", "token", "tokens")
"""Names of the commands."""


def add_commands(commands: Any) -> None:
    """Add the commands to subparsers of argparse."""
    stop = commands.add_parser("stop", help="stop a robot, whatever its bridge does", epilog=EPILOG)
    _finish(stop, lambda client, arguments: _stop(client))
    for name, text in _COMMANDS.items():
        parser = commands.add_parser(name, help=text, epilog=EPILOG)
        parser.set_defaults(command=name)
        _finish(parser, _want)

    status = commands.add_parser("status", help="print what a bridge is doing", epilog=EPILOG)
    status.add_argument("--json", action="store_true", help="for programs")
    _finish(status, _status)

    watch = commands.add_parser("watch", help="print what happens, until Ctrl-C", epilog=EPILOG)
    watch.add_argument("--json", action="store_true", help="for programs: one JSON document a line")
    watch.add_argument("--scans", action="store_true", help="with the LiDAR's revolutions (only with --json)")
    watch.add_argument("--rate", type=float, default=10.0, metavar="HZ", help="looks a second (default: %(default)g)")
    _finish(watch, _watch)

    teleop = commands.add_parser("teleop", help="drive by keys through a supervision layer", epilog=EPILOG)
    _finish(teleop, _teleop)

    token = commands.add_parser("token", help="make a token for a caller of a bridge", epilog=EPILOG)
    add_token_arguments(token, (Scope.WATCH, Scope.OPERATE))
    token.set_defaults(run=_token)

    tokens = commands.add_parser("tokens", help="keep the token file of a bridge: add, rotate, list, revoke")
    add_tokens_arguments(tokens, (Scope.WATCH, Scope.OPERATE))
    tokens.set_defaults(run=run_tokens)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one of these commands; returns the exit status."""
    return run_alone(add_commands, __doc__, argv)


def run_alone(add: Callable[[Any], None], description: str | None, argv: Sequence[str] | None) -> int:
    """Run commands without those of the daemon, which take longer to load; returns the exit status.

    Args:
        add: Function that adds them to subparsers of argparse.
        description: Description of them all.
        argv: Arguments; None: those of the program.
    """
    parser = argparse.ArgumentParser(prog="robosc-bridge", description=description)
    add(parser.add_subparsers(required=True, metavar="COMMAND"))
    arguments = parser.parse_args(argv)
    status: int = arguments.run(arguments)
    return status


def add_connection_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options for reaching a bridge."""
    parser.add_argument(
        "--address",
        type=_address,
        metavar="HOST[:PORT]",
        default=os.environ.get(ADDRESS_VARIABLE) or ADDRESS,
        help=f"address of the bridge (default: ${ADDRESS_VARIABLE}, or {ADDRESS}; default port: {BRIDGE_PORT})",
    )
    add_client_arguments(parser)


def _finish(parser: argparse.ArgumentParser, work: Callable[[Any, argparse.Namespace], int]) -> None:
    add_connection_arguments(parser)
    parser.set_defaults(run=lambda arguments: _connected(arguments, work))


def _address(text: str) -> str:
    try:
        return with_port(text, BRIDGE_PORT)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _connected(arguments: argparse.Namespace, work: Callable[[Any, argparse.Namespace], int]) -> int:
    # gRPC is imported where it is needed: help and wrong use are reported at once.
    from robosc_bridge.terminal.client import BridgeClient, RefusedError, UnreachableError

    try:
        with interrupts_as_such(), BridgeClient(arguments.address, credentials_of(arguments)) as client:
            return work(client, arguments)
    except RefusedError as error:
        return _failed(str(error), REFUSED)
    except UnreachableError as error:
        return _failed(str(error), WRONG)
    except KeyboardInterrupt:
        return _failed("interrupted", 130)
    except BrokenPipeError:
        # The reader has gone; Python would complain once more when it flushes.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE


def _failed(text: str, status: int) -> int:
    one_line = " ".join("".join(sign if sign.isprintable() else " " for sign in text).split())
    sys.stderr.write(f"robosc-bridge: {one_line}\n")
    return status


def _stop(client: Any) -> int:
    client.stop()
    sys.stdout.write("stopped\n")
    return DONE


def _want(client: Any, arguments: argparse.Namespace) -> int:
    from robosc_bridge.terminal.client import RequestedCommand

    client.request(RequestedCommand(arguments.command))
    sys.stdout.write(f"{arguments.command}: done\n")
    return DONE


def _status(client: Any, arguments: argparse.Namespace) -> int:
    from robosc_bridge.terminal.client import as_json, is_fault
    from robosc_bridge.terminal.formatting import STALE_S, status_lines

    snapshot = client.status()
    if snapshot is None:
        return _failed("the bridge answers, but its loop has not run yet", REFUSED)
    if arguments.json:
        sys.stdout.write(json.dumps(as_json(snapshot), indent=2) + "\n")
    else:
        sys.stdout.writelines(f"{line}\n" for line in status_lines(snapshot))
    return REFUSED if is_fault(snapshot) or snapshot.age_s > STALE_S else DONE


def _watch(client: Any, arguments: argparse.Namespace) -> int:
    from robosc_bridge.terminal.client import as_json
    from robosc_bridge.terminal.formatting import Lines

    lines = Lines()
    with suppress(KeyboardInterrupt), interrupts_as_such():
        for response in client.watch(with_scans=arguments.scans and arguments.json, rate_hz=arguments.rate):
            if arguments.json:
                sys.stdout.write(json.dumps(as_json(response), separators=(",", ":")) + "\n")
            else:
                sys.stdout.writelines(f"{line}\n" for line in lines.of(response))
            sys.stdout.flush()
    return DONE


def _teleop(client: Any, arguments: argparse.Namespace) -> int:
    from robosc_bridge.terminal.teleop import teleop

    return teleop(client)


def _token(arguments: argparse.Namespace) -> int:
    try:
        token, line = issue_token(arguments)
    except SecurityError as error:
        return _failed(str(error), WRONG)
    sys.stdout.write(token)
    sys.stderr.write(line)
    return DONE
