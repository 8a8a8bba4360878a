"""`robosc`: check, synthesize, verify, explore and generate on this machine.

Every command is a module with `add_parser` and `run`; what a command needs is imported when it runs, so
that `robosc check` does not pay for decision diagrams. Other packages add commands (`robosc.cli.plugins`).
"""

import argparse
import sys
from collections.abc import Callable, Sequence

from robosc._version import __version__
from robosc.cli import (
    check,
    check_log,
    doc,
    explain,
    explain_synthesis,
    explore,
    generate,
    new,
    plot,
    sign,
    synth,
    verify,
)
from robosc.cli import format as format_
from robosc.cli.arguments import Parser, WrongArguments
from robosc.cli.output import CommandError, ExitCode, counts_text, prepare_streams, print_diagnostics, print_json
from robosc.cli.plugins import Plugin, wanted_plugins
from robosc.errors import Diagnostic, LanguageError, RoboscError
from robosc.json_documents import diagnostics_json
from robosc.source import visible

_COMMANDS = (
    new, check, format_, synth, verify, sign, explore, generate, explain_synthesis, explain, doc, plot, check_log
)  # fmt: skip
"""In the order of `robosc --help`."""

_NAMES = (
    "new", "check", "format", "synth", "verify", "key", "sign", "explore", "generate", "explain-synthesis", "explain",
    "doc", "plot", "check-log",
)  # fmt: skip
"""What they are called: nobody who calls one of them pays for a look at what other packages bring."""

_EPILOG = """\
exit status:
  0  done; the model has no errors
  1  the model has errors, no supervisor exists, or one that was checked is wrong
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
        verify,
        sign,
        explore,
        generate,
        explain_synthesis,
        explain,
        doc,
        plot,
        check_log,
    ):
        command.add_parser(commands)
    for plugin in plugins:
        plugin.add_parser(commands)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit status.

    Raises:
        SystemExit: The arguments are no command's, or ask for help.
    """
    parser = make_parser(wanted_plugins(sys.argv[1:] if argv is None else argv, _NAMES))
    arguments = parse(parser, argv)
    return guarded("robosc", lambda: int(arguments.run(arguments)), as_json=getattr(arguments, "json", False))


def parse(parser: Parser, argv: Sequence[str] | None) -> argparse.Namespace:
    """The arguments; where `--json` is one of those that are wrong, that is told on standard output, too.

    Raises:
        SystemExit: They are wrong, or ask for help.
    """
    try:
        return parser.parse_args(argv)
    except WrongArguments as error:
        if _asks_for_json(sys.argv[1:] if argv is None else argv):
            prepare_streams()
            _print_error(ExitCode.USAGE, error.message)
        raise


def _asks_for_json(argv: Sequence[str]) -> bool:
    options = argv[: argv.index("--")] if "--" in argv else argv
    return any(len(item) > 2 and "--json".startswith(item) for item in options)


def guarded(program: str, run: Callable[[], int], *, as_json: bool = False) -> int:
    """Run a command and turn every error into one clear message and an exit status.

    Args:
        program: What the message begins with.
        run: The command.
        as_json: Whether standard output gets a JSON document, which then tells the error.
    """
    prepare_streams()
    diagnostics: Sequence[Diagnostic] = ()
    try:
        status = run()
        sys.stdout.flush()
        return status
    except LanguageError as error:
        diagnostics = error.diagnostics
        print_diagnostics(diagnostics, None)
        status, message = ExitCode.FAILED, f"the model has errors: {counts_text(diagnostics)}"
    except CommandError as error:
        status, message = error.status, _complain(program, error)
    except RoboscError as error:
        # An engine or target that nobody has, or a folder that cannot be written, is no fault of the model.
        status = ExitCode.USAGE if isinstance(error, LookupError | OSError) else ExitCode.FAILED
        message = _complain(program, error)
    except KeyboardInterrupt:
        status, message = ExitCode.INTERRUPTED, _complain(program, "interrupted")
    except BrokenPipeError:
        # The reader (head, less) left: that is no fault, but the interpreter must not flush into it at exit.
        sys.stdout = None
        return ExitCode.OK
    except OSError as error:
        place = error.filename or "the results"
        status, message = ExitCode.USAGE, _complain(program, f"cannot write {place}: {error.strerror or error}")
        if not error.filename:
            # Standard output itself: neither we nor the interpreter at exit can write any more to it.
            sys.stdout = None
            return status
    if as_json:
        _print_error(status, message, diagnostics)
    return status


def _complain(program: str, problem: object) -> str:
    """Tell what is wrong on standard error; returns that."""
    message = visible(str(problem))
    sys.stderr.write(f"{program}: {message}\n")
    return message


def _print_error(status: int, message: str, diagnostics: Sequence[Diagnostic] = ()) -> None:
    found = diagnostics_json(diagnostics) if diagnostics else {}
    try:
        print_json({"error": {"status": int(status), "message": message, **found}})
        sys.stdout.flush()
    except OSError:
        # It was told on standard error.
        sys.stdout = None


if __name__ == "__main__":
    sys.exit(main())
