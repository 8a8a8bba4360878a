"""Running of a command: it reads arguments, reports lost output, and turns errors into a message.

The module loads no command, so that other programs than `robosc` run their commands in the same way.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from robosc.cli.output import CommandError, ExitCode, prepare_streams, print_diagnostics, print_json
from robosc.cli.starting import interrupts_as_such
from robosc.errors import Diagnostic, LanguageError, RoboscError
from robosc.json_documents import counts_text, diagnostics_json
from robosc.source import visible


class WrongArguments(SystemExit):
    """Arguments that are wrong, which has been reported on standard error.

    Attributes:
        message: Description of what is wrong.
    """

    def __init__(self, message: str) -> None:
        super().__init__(int(ExitCode.USAGE))
        self.message = message


class Parser(argparse.ArgumentParser):
    """A parser that says what is wrong in its exception, too; so do those of its commands.

    One that has commands, and is given nothing at all, prints its help; it reports options before the command.
    """

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse arguments; none at all where a command must be named ask for help.

        Raises:
            SystemExit: They are wrong, or ask for help.
        """
        given = list(sys.argv[1:] if args is None else args)
        if self._subparsers is not None and not given:
            self.print_help()
            self.exit()
        if self._subparsers is not None and given[0].startswith("--") and len(given[0]) > 2:
            option = given[0].partition("=")[0]
            if not any(each.startswith(option) for each in self._option_string_actions):
                message = f"put the options of a command after it: {self.prog} COMMAND {option} ..."
                self.error(message)
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        """Raise an error that says what is wrong.

        Raises:
            WrongArguments: Always.
        """
        try:
            super().error(message)
        except SystemExit as exit_:
            raise WrongArguments(message) from exit_

    def _print_message(self, message: str, file: Any = None) -> None:
        """Print help or a version; where that cannot be written, it ends as a command does whose results cannot."""
        if file is None or file is not sys.stdout:
            super()._print_message(message, file)
            return

        def write() -> int:
            sys.stdout.write(message)
            return ExitCode.OK

        status = guarded(self.prog.partition(" ")[0], write)
        if status != ExitCode.OK:
            raise SystemExit(status)


def parse(parser: Parser, argv: Sequence[str] | None) -> argparse.Namespace:
    """The arguments; where `--json` is one of those that are wrong, that is reported on standard output, too.

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
        program: Beginning of the message.
        run: The command.
        as_json: True if standard output gets a JSON document, which then reports the error.
    """
    prepare_streams()
    diagnostics: Sequence[Diagnostic] = ()
    try:
        with interrupts_as_such():
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
        # An unknown engine or target, or a folder that cannot be written, is no fault of the model.
        status = ExitCode.USAGE if isinstance(error, LookupError | OSError) else ExitCode.FAILED
        message = _complain(program, error)
    except MemoryError as error:
        status, message = ExitCode.FAILED, _complain(program, str(error) or "there is not enough memory")
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
    """Print what is wrong on standard error, and return it."""
    message = visible(str(problem))
    sys.stderr.write(f"{program}: {message}\n")
    return message


def _print_error(status: int, message: str, diagnostics: Sequence[Diagnostic] = ()) -> None:
    found = diagnostics_json(diagnostics) if diagnostics else {}
    try:
        print_json({"error": {"status": int(status), "message": message, **found}})
        sys.stdout.flush()
    except OSError:
        # It was reported on standard error.
        sys.stdout = None
