"""`robosc`: check, synthesize, verify, explore and generate on this machine.

Every command is a module with `add_parser` and `run`; what a command needs is imported when it runs, so
that `robosc check` does not pay for decision diagrams. Other packages add commands (`robosc.cli.plugins`).
"""

import argparse
import sys
from collections.abc import Sequence

from robosc._version import __version__
from robosc.cli import (
    check,
    check_log,
    completion,
    convert_log,
    doc,
    doctor,
    explain,
    explain_synthesis,
    explore,
    generate,
    new,
    plot,
    sign,
    simulate,
    synth,
    verify,
)
from robosc.cli import format as format_
from robosc.cli.plugins import Plugin, wanted_plugins
from robosc.cli.running import Parser, guarded, parse

__all__ = ["guarded", "main", "make_parser", "parse"]

_COMMANDS = (
    new, check, format_, synth, simulate, verify, sign, explore, generate, explain_synthesis, explain, doc, plot,
    check_log, convert_log, doctor, completion,
)  # fmt: skip
"""Modules of the commands, in the order of `robosc --help`."""

_NAMES = (
    "new", "check", "format", "synth", "simulate", "verify", "key", "sign", "explore", "generate", "explain-synthesis",
    "explain", "doc", "plot", "check-log", "convert-log", "doctor", "completion",
)  # fmt: skip
"""Names of the commands: a call of one of them needs no search for commands of other packages."""

_EPILOG = """\
exit status:
  0  done; the model has no errors
  1  the model has errors, no supervisor exists, or one that was checked is wrong; what is generated would overwrite
     files that were changed
  2  wrong use
"""


def make_parser(plugins: Sequence[Plugin] = ()) -> Parser:
    """The parser of the whole command line.

    Args:
        plugins: Commands of other packages.
    """
    parser = Parser(
        prog="robosc",
        description="Supervisory controllers for robots, correct by construction.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"robosc {__version__}")
    commands = parser.add_subparsers(title="commands", dest="command", required=True, metavar="COMMAND")
    for command in (
        new,
        check,
        format_,
        synth,
        simulate,
        verify,
        sign,
        explore,
        generate,
        explain_synthesis,
        explain,
        doc,
        plot,
        check_log,
        convert_log,
        doctor,
        completion,
    ):
        command.add_parser(commands)
    for plugin in plugins:
        plugin.add_parser(commands)
    return parser


def make_whole_parser() -> Parser:
    """The parser with the commands of all other packages that can be loaded."""
    return make_parser([plugin for plugin in wanted_plugins((), _NAMES) if plugin.module is not None])


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit status.

    Raises:
        SystemExit: The arguments are no command's, or ask for help.
    """
    parser = make_parser(wanted_plugins(sys.argv[1:] if argv is None else argv, _NAMES))
    arguments = parse(parser, argv)
    return guarded("robosc", lambda: int(arguments.run(arguments)), as_json=getattr(arguments, "json", False))


if __name__ == "__main__":
    sys.exit(main())
