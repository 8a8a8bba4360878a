"""`robosc-server health`: query the health of the server that runs with the same settings."""

import argparse
import sys
from collections.abc import Sequence

from robosc.cli.running import Parser
from robosc_api.health import Condition, ask_alive, ask_health, local_address
from robosc_api.security import SecurityError
from robosc_server.operations.settings import Settings
from robosc_server.operations.settings_sources import SettingsError, add_settings_arguments, settings_of

_EPILOG = """\
The settings come from flags, environment variables and the settings file, as for the server itself; inside its
container or unit no further options are needed. The check trusts only the certificate of the server. If the server
requires client certificates, the check presents that same certificate: an authority in
client_ca must have signed it for client use. Otherwise use --alive.

exit status:
  0  the server is serving; with --alive: it answers, even if it refuses the certificate of the check
  1  the server is not serving, or does not answer
  2  wrong options or settings
"""


def make_parser() -> Parser:
    """Return the parser of the command."""
    parser = Parser(
        prog="robosc-server health",
        description="Query the gRPC health check of the server that was started with the same settings.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument(
        "--service", default="", metavar="NAME", help="check only this service (default: the whole server)"
    )
    parser.add_argument("--alive", action="store_true", help="succeed on any answer, also NOT_SERVING")
    parser.add_argument("--timeout", type=_seconds, default=4.0, metavar="S", help="timeout in seconds (default: 4)")
    add_settings_arguments(parser)
    return parser


def main(argv: Sequence[str]) -> int:
    """Query the health; returns the exit status."""
    given = make_parser().parse_args(argv)
    try:
        condition = _ask(settings_of(given), given.service, given.timeout, is_alive_enough=given.alive)
    except SettingsError as error:
        return error.report()
    except SecurityError as error:
        sys.stderr.write(f"robosc-server: {error}\n")
        return 2
    is_well = condition.is_alive if given.alive else condition.is_serving
    (sys.stdout if is_well else sys.stderr).write(condition.message + "\n")
    return 0 if is_well else 1


def _ask(settings: Settings, service: str, timeout_s: float, *, is_alive_enough: bool) -> Condition:
    certificate, key = settings.tls_certificate, settings.tls_key
    shown = None
    if settings.client_ca is not None and certificate is not None and key is not None:
        shown = certificate, key
    ask = ask_alive if is_alive_enough else ask_health
    return ask(
        local_address(settings.address), service, timeout_s=timeout_s, certificate=certificate, client_certificate=shown
    )


def _seconds(text: str) -> float:
    number = float(text)
    if not 0 < number <= 3600:
        raise argparse.ArgumentTypeError("must be a number of seconds above 0 and up to 3600")
    return number


# Argparse prints the name in "invalid ... value".
_seconds.__name__ = "number"
