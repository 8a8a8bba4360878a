"""`robosc`: check, synthesize, verify, explore and generate on this machine.

Every command is a module with `add_parser` and `run`. The module is imported when the command is called, and imports
large packages only when it runs, so that `robosc check` does not load decision diagrams. Other packages add commands
(`robosc.cli.plugins`).
"""

import argparse
import importlib
import sys
from collections.abc import Sequence

from robosc._version import __version__
from robosc.cli.plugins import Plugin, wanted_plugins
from robosc.cli.running import Parser, guarded, parse

__all__ = ["COMMANDS", "guarded", "main", "make_parser", "parse"]

COMMANDS = {
    "new": "new",
    "check": "check",
    "format": "format",
    "synth": "synth",
    "simulate": "simulate",
    "verify": "verify",
    "key": "sign",
    "sign": "sign",
    "explore": "explore",
    "generate": "generate",
    "explain-synthesis": "explain_synthesis",
    "explain": "explain",
    "doc": "doc",
    "plot": "plot",
    "check-log": "check_log",
    "convert-log": "convert_log",
    "doctor": "doctor",
    "completion": "completion",
}
"""Modules of the commands, in the order of `robosc --help`; who calls one of them needs none of other packages."""

_EPILOG = """\
exit status:
  0  done; the model has no errors
  1  the model has errors, no supervisor exists, or one that was checked is wrong; what is generated would overwrite
     files that were changed
  2  wrong use
"""


def make_parser(plugins: Sequence[Plugin] = (), called: str | None = None) -> Parser:
    """The parser of the command line.

    Args:
        plugins: Commands of other packages.
        called: The one command that is called, whose module alone is loaded; None: all of them.
    """
    parser = Parser(
        prog="robosc",
        description="Supervisory controllers for robots, correct by construction.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"robosc {__version__}")
    commands = parser.add_subparsers(title="commands", dest="command", required=True, metavar="COMMAND")
    for module in dict.fromkeys(COMMANDS.values() if called is None else (COMMANDS[called],)):
        importlib.import_module(f"robosc.cli.{module}").add_parser(commands)
    for plugin in plugins:
        plugin.add_parser(commands)
    return parser


def make_whole_parser() -> Parser:
    """The parser with the commands of all other packages that can be loaded."""
    return make_parser([plugin for plugin in wanted_plugins((), COMMANDS) if plugin.module is not None])


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit status.

    Raises:
        SystemExit: The arguments are no command's, or ask for help.
    """
    given = sys.argv[1:] if argv is None else argv
    parser = make_parser(wanted_plugins(given, COMMANDS), given[0] if given and given[0] in COMMANDS else None)
    arguments = parse(parser, argv)
    return guarded("robosc", lambda: int(arguments.run(arguments)), as_json=getattr(arguments, "json", False))


if __name__ == "__main__":
    sys.exit(main())
