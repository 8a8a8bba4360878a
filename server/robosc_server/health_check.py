"""`robosc-server health`: ask the server that the same settings have started how it is."""

import argparse
import sys
from collections.abc import Sequence

from robosc.cli.running import Parser
from robosc_api.health import Condition, ask_alive, ask_health, local_address
from robosc_api.security import SecurityError
from robosc_server.operations.settings import Settings, SettingsError, add_settings_arguments, settings_of

_EPILOG = """\
Settings come from flags, environment and file as for the server itself, so that in its container and its unit nothing
more needs to be said. Its certificate is the only one that is believed, and is shown to a server that wants callers'
certificates: one of the authorities in client_ca must have signed it, for clients, too. Else use --alive.

exit status:
  0  it is well; with --alive: it answers, if by refusing the connection for a certificate
  1  it is not
  2  wrong use, or wrong settings
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Ask; returns the exit status."""
    parser = Parser(
        prog="robosc-server health",
        description="Ask the server that the same settings have started how it is, by gRPC's health check.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--service", default="", metavar="NAME", help="one of its services (default: all of them)")
    parser.add_argument("--alive", action="store_true", help="be content with any answer, such as that it is not well")
    parser.add_argument("--timeout", type=_seconds, default=4.0, metavar="S", help="seconds to wait (default: 4)")
    add_settings_arguments(parser)
    given = parser.parse_args(argv)
    try:
        condition = _ask(settings_of(given), given.service, given.timeout, is_alive_enough=given.alive)
    except SettingsError as error:
        for problem in error.problems:
            sys.stderr.write(f"robosc-server: {problem}\n")
        return 2
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
        raise argparse.ArgumentTypeError("a number of seconds above 0, at most 3600, is needed")
    return number


# How argparse calls it in "invalid ... value".
_seconds.__name__ = "number"


if __name__ == "__main__":
    sys.exit(main())
