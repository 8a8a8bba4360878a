"""What an operator may set."""

import argparse
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field

from robosc import __version__
from robosc_api.security import (
    Scope,
    SecurityError,
    ServerSecurity,
    add_server_arguments,
    add_token_arguments,
    server_security_of,
    written_token,
)

_EPILOG = """\
Where other machines reach it, it listens with TLS only. `robosc-server token NAME` prints a new token and its
line for the file of tokens. SIGTERM and SIGINT end it gracefully.

exit status:
  0  stopped by a signal
  1  the address, a certificate or the tokens cannot be used, or no worker started
  2  wrong use
"""


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of one server.

    Attributes:
        host: Address to listen on.
        port: TCP port; 0 picks a free one.
        max_bundle_bytes: Largest bundle of one request, in bytes of its names and texts.
        max_synthesis_seconds: Longest time for one request, in seconds, whatever deadline its caller set.
        workers: Worker processes, which is how many requests are worked on at once.
        security: Certificates and tokens.
    """

    host: str = "127.0.0.1"
    port: int = 50051
    max_bundle_bytes: int = 2**20
    max_synthesis_seconds: float = 600.0
    workers: int = 2
    security: ServerSecurity = field(default_factory=ServerSecurity)


def parse_settings(argv: Sequence[str] | None = None) -> Settings:
    """The settings in a command line; leaves the program with status 2 where it is wrong."""
    parser = argparse.ArgumentParser(
        prog="robosc-server",
        description="Check models, synthesize supervisors and generate packages over gRPC.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    default = Settings()
    parser.add_argument("--version", action="version", version=f"robosc-server {__version__}")
    parser.add_argument("--host", default=default.host, help="address to listen on (default: %(default)s)")
    parser.add_argument("--port", type=_port, default=default.port, help="TCP port, 0 picks one (default: %(default)s)")
    parser.add_argument(
        "--max-bundle-bytes",
        type=_positive_integer,
        default=default.max_bundle_bytes,
        metavar="N",
        help="largest model with its libraries (default: %(default)s)",
    )
    parser.add_argument(
        "--max-synthesis-seconds",
        type=_positive_seconds,
        default=default.max_synthesis_seconds,
        metavar="S",
        help="longest time for one request, whatever its deadline (default: %(default)s)",
    )
    parser.add_argument(
        "--workers",
        type=_positive_integer,
        default=max(1, os.cpu_count() or 1),
        metavar="N",
        help="requests worked on at once, each in its own process (default: the number of processors)",
    )
    add_server_arguments(parser)
    given = parser.parse_args(argv)
    return Settings(
        given.host,
        given.port,
        given.max_bundle_bytes,
        given.max_synthesis_seconds,
        given.workers,
        server_security_of(given),
    )


def new_token(argv: Sequence[str]) -> int:
    """Print a new token, and to standard error the line for the file of tokens; the exit status."""
    parser = argparse.ArgumentParser(prog="robosc-server token", description="Make a token for a caller.")
    add_token_arguments(parser, (Scope.SYNTHESIZE,))
    try:
        token, line = written_token(parser.parse_args(argv))
    except SecurityError as error:
        sys.stderr.write(f"robosc-server: {error}\n")
        return 2
    sys.stdout.write(token)
    sys.stderr.write(line)
    return 0


def _port(text: str) -> int:
    number = int(text)
    if not 0 <= number <= 65535:
        raise argparse.ArgumentTypeError("a port is a number from 0 to 65535")
    return number


def _positive_integer(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError("at least 1 is needed")
    return number


def _positive_seconds(text: str) -> float:
    number = float(text)
    if not 0 < number < 1e9:
        raise argparse.ArgumentTypeError("a positive number of seconds is needed")
    return number


# How argparse calls them in "invalid ... value".
_port.__name__ = "port"
_positive_integer.__name__ = "whole number"
_positive_seconds.__name__ = "number"
