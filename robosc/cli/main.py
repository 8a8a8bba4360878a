"""`robosc`: check, synthesize, explore and generate on this machine.

Every command is a module with `add_parser` and `run`; what a command needs is imported when it runs, so
that `robosc check` does not pay for decision diagrams.
"""

import argparse
import sys
from collections.abc import Callable, Sequence

from robosc._version import __version__
from robosc.cli import check, doc, explain, explore, generate, new, synth, verify
from robosc.cli import format as format_
from robosc.cli.output import ExitCode, UsageError, prepare_streams, print_diagnostics
from robosc.errors import LanguageError, RoboscError
from robosc.source import visible

_EPILOG = """\
exit status:
  0  done; the model has no errors
  1  the model has errors, or no supervisor exists
  2  wrong use
"""


def make_parser() -> argparse.ArgumentParser:
    """The parser of the whole command line."""
    parser = argparse.ArgumentParser(
        prog="robosc",
        description="Supervisory controllers for robots, correct by construction.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"robosc {__version__}")
    commands = parser.add_subparsers(title="commands", dest="command", required=True, metavar="COMMAND")
    for command in (new, check, format_, synth, explore, verify, generate, explain, doc):
        command.add_parser(commands)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit status."""
    arguments = make_parser().parse_args(argv)
    return guarded("robosc", lambda: int(arguments.run(arguments)))


def guarded(program: str, run: Callable[[], int]) -> int:
    """Run a command and turn every error into one clear message and an exit status."""
    prepare_streams()
    try:
        status = run()
        sys.stdout.flush()
        return status
    except LanguageError as error:
        print_diagnostics(error.diagnostics, None)
        return ExitCode.FAILED
    except UsageError as error:
        _complain(program, error)
        return ExitCode.USAGE
    except RoboscError as error:
        _complain(program, error)
        # An engine or target that nobody has, or a folder that cannot be written, is no fault of the model.
        return ExitCode.USAGE if isinstance(error, LookupError | OSError) else ExitCode.FAILED
    except KeyboardInterrupt:
        sys.stderr.write(f"{program}: interrupted\n")
        return ExitCode.INTERRUPTED
    except BrokenPipeError:
        # The reader (head, less) left: that is no fault, but the interpreter must not flush into it at exit.
        sys.stdout = None
        return ExitCode.OK
    except OSError as error:
        place = error.filename or "the results"
        _complain(program, f"cannot write {place}: {error.strerror or error}")
        sys.stdout = None
        return ExitCode.USAGE


def _complain(program: str, problem: object) -> None:
    sys.stderr.write(f"{program}: {visible(str(problem))}\n")


if __name__ == "__main__":
    sys.exit(main())
