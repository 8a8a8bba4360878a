"""`robosc-bridge health`: ask the bridge that a configuration belongs to how it is."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from robosc_api.health import Condition, ask_alive, ask_health, local_address
from robosc_api.security import SecurityError
from robosc_bridge.configuration import ConfigurationError, load
from robosc_bridge.configuration.structure import Remote
from robosc_bridge.terminal.commands import run_alone

NAME = "health"
"""Name of the command."""

WELL, NOT_WELL, WRONG_USE = 0, 1, 2

_EPILOG = (
    "Its certificate is the only one that is believed, and is shown to a bridge that wants callers' certificates: "
    "one of the authorities in remote.client_ca must have signed it, for clients, too; else use --alive. "
    "exit status: 0 it is well, or answers (--alive); 1 it is not; 2 wrong use or files"
)


def add_command(commands: Any) -> None:
    """Add the command to subparsers of argparse."""
    parser = commands.add_parser(
        NAME, help="ask the bridge that a configuration belongs to how it is: for containers", epilog=_EPILOG
    )
    parser.add_argument("--config", metavar="FILE", type=Path, required=True, help="the configuration (YAML)")
    parser.add_argument("--alive", action="store_true", help="be content with any answer, such as that it is not well")
    parser.add_argument("--timeout", type=_seconds, default=4.0, metavar="S", help="seconds to wait (default: 4)")
    parser.set_defaults(run=_run)


def main(argv: Sequence[str] | None = None) -> int:
    """Run this command alone; returns the exit status."""
    return run_alone(add_command, __doc__, argv)


def _run(arguments: argparse.Namespace) -> int:
    try:
        remote = load(arguments.config).configuration.remote
        condition = _ask(remote, arguments.timeout, is_alive_enough=arguments.alive)
    except (ConfigurationError, SecurityError) as error:
        for line in str(error).splitlines():
            sys.stderr.write(f"robosc-bridge: {line}\n")
        return WRONG_USE
    is_well = condition.is_alive if arguments.alive else condition.is_serving
    (sys.stdout if is_well else sys.stderr).write(condition.message + "\n")
    return WELL if is_well else NOT_WELL


def _ask(remote: Remote, timeout_s: float, *, is_alive_enough: bool) -> Condition:
    if remote.grpc_address is None:
        raise SecurityError("remote.grpc_address is not set: nobody can ask this bridge")
    certificate = _path(remote.tls_certificate)
    key = _path(remote.tls_key)
    shown = (certificate, key) if remote.client_ca is not None and certificate is not None and key is not None else None
    ask = ask_alive if is_alive_enough else ask_health
    return ask(
        local_address(remote.grpc_address), timeout_s=timeout_s, certificate=certificate, client_certificate=shown
    )


def _path(text: str | None) -> Path | None:
    return None if text is None else Path(text)


def _seconds(text: str) -> float:
    number = float(text)
    if not 0 < number <= 3600:
        raise argparse.ArgumentTypeError("a number of seconds above 0, at most 3600, is needed")
    return number


# Argparse prints the name in "invalid ... value".
_seconds.__name__ = "number"
