"""`robosc check`: everything that is wrong with a model, in one run."""

import argparse
import sys

from robosc.cli.arguments import add_model_arguments, read_bundle
from robosc.cli.output import ExitCode, counts_text, diagnostics_json, has_errors, print_diagnostics, print_json
from robosc.errors import Diagnostic, LanguageError
from robosc.source import Bundle


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "check",
        help="find everything that is wrong with a model",
        description="Check a model or library and print every finding with its place and how to mend it.",
    )
    add_model_arguments(parser)
    parser.add_argument("--strict", action="store_true", help="exit with 1 for warnings too")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Check the model; 0 without errors, else 1."""
    from robosc.model import check

    bundle = None
    try:
        bundle = read_bundle(arguments)
        diagnostics = check(bundle).diagnostics
    except LanguageError as error:
        diagnostics = error.diagnostics
    return report_check(arguments, diagnostics, bundle)


def report_check(arguments: argparse.Namespace, diagnostics: tuple[Diagnostic, ...], bundle: Bundle | None) -> ExitCode:
    """Print the findings as asked and return the exit status."""
    if arguments.json:
        print_json({"file": str(arguments.model), **diagnostics_json(diagnostics)})
    elif diagnostics:
        print_diagnostics(diagnostics, bundle)
    else:
        sys.stdout.write(f"{arguments.model}: {counts_text(diagnostics)}\n")
    return ExitCode.FAILED if has_errors(diagnostics, strict=arguments.strict) else ExitCode.OK
