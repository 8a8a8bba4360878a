"""Verification of properties of the controlled system: the options, and what is printed."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from robosc.certification.reasons import reasons_json
from robosc.cli import synth
from robosc.cli.arguments import engine_options, given_path, read_bundle
from robosc.cli.output import ExitCode, ProgressLine, UsageError, print_diagnostics, print_json
from robosc.errors import LanguageError
from robosc.json_documents import diagnostics_json
from robosc.source import Bundle, SourceFile

if TYPE_CHECKING:
    from robosc.automata import System
    from robosc.model.structure import Model
    from robosc.model_checking import Property, Verdict
    from robosc.supervisor import Supervisor

EPILOG = """\
properties:
  invariant E           E is true in every state (the same as AG E)
  reachable E           E is true in some state (the same as EF E)
  AG p  AF p  AX p      in every run: always p, some time p, p after the next step
  EG p  EF p  EX p      in some run: the same
  A[p U q]  E[p U q]    in every run, in some run: p until q, and q comes
  enabled(c.request)    the event can happen
  !p or not p, p and q, p or q, p => q
  name: p               a property with a name

E is a condition of the language over component states and synthesis variables; service.location and
action.location give the state of a call (idle, waiting or executing, ready, failed). Operators take one
operand, as '!' does: write AG (a or b). docs/verification.md has more.

exit status:
  0  every property holds
  1  a property fails, the model has errors, or no supervisor exists
  2  wrong use, or a property that cannot be understood
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments for the properties to verify."""
    parser.add_argument(
        "--property",
        action="append",
        default=[],
        metavar="PROPERTY",
        help="property that is to hold of the robot, such as 'invariant !Base.moving or Gate.open' (may be repeated)",
    )
    parser.add_argument(
        "--properties",
        action="append",
        default=[],
        type=given_path,
        metavar="FILE",
        help="a file with a property on each line; lines that begin with # are comments (may be repeated)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Synthesize and verify; 0 if every property holds, 1 if one fails or there is no supervisor, 2 for wrong ones."""
    from robosc.model.check import check

    bundle = read_bundle(arguments)
    # Errors of properties are reported before the synthesis, which may take long.
    model = check(bundle).model
    if model is not None and read_properties(arguments, model) is None:
        return ExitCode.USAGE
    outcome = synth.make(arguments, bundle, allow_livelock=True, only_shown=True)
    if outcome.supervisor is None:
        if arguments.json:
            print_json(
                {"status": str(outcome.status), **reasons_json(outcome), **diagnostics_json(outcome.diagnostics)}
            )
        else:
            synth.report_problems(outcome, bundle)
        return ExitCode.FAILED
    return verify(arguments, outcome.supervisor)


def verify(arguments: argparse.Namespace, supervisor: "Supervisor") -> int:
    """Verify the properties that the arguments name in a supervisor's controlled system, and print the verdicts."""
    from robosc.pipeline.verifying import verdicts_of

    properties = read_properties(arguments, supervisor.model)
    if properties is None:
        return ExitCode.USAGE
    progress = ProgressLine()
    try:
        verdicts, system = verdicts_of(
            supervisor,
            properties,
            engine_options(arguments),
            on_progress=lambda step: progress.show(f"verification: {step}"),
        )
    finally:
        progress.clear()
    return report_verdicts(arguments, verdicts, system, supervisor.model)


def report_verdicts(
    arguments: argparse.Namespace, verdicts: "Sequence[Verdict]", system: "System", model: "Model"
) -> ExitCode:
    """Print verdicts as asked, and return the exit status."""
    from robosc.model_checking import verdict_text, verdicts_json

    if arguments.json:
        print_json(verdicts_json(verdicts, system, model))
    else:
        for verdict in (item for item in verdicts if not (arguments.quiet and item.holds)):
            sys.stdout.write(verdict_text(verdict, system, model))
    return ExitCode.OK if all(verdict.holds for verdict in verdicts) else ExitCode.FAILED


def read_properties(arguments: argparse.Namespace, model: "Model") -> "tuple[Property, ...] | None":
    """The properties that the arguments name, or None after reporting what is wrong with them.

    Raises:
        UsageError: A file cannot be read, or there is no property in any.
    """
    from robosc.model_checking import properties_of

    texts = [SourceFile(f"property {number}", text) for number, text in enumerate(arguments.property, start=1)]
    listings: list[SourceFile] = []
    try:
        listings += [property_file(path) for path in arguments.properties]
        properties = properties_of(model, texts, listings)
    except LanguageError as error:
        _report_faults(arguments, error, [*texts, *listings])
        return None
    if not properties:
        raise UsageError(f"there is no property in {' and '.join(map(str, arguments.properties))}")
    return properties


def property_file(path: Path) -> SourceFile:
    """A file of properties.

    Raises:
        UsageError: It is not there or cannot be read.
        LanguageError: It is no text.
    """
    from robosc.pipeline import loading
    from robosc.pipeline.files import FileAccessError

    try:
        return loading.property_file(path)
    except FileAccessError as error:
        raise UsageError(str(error)) from error


def _report_faults(arguments: argparse.Namespace, error: LanguageError, files: Sequence[SourceFile]) -> None:
    from robosc.model_checking import property_errors_json

    if arguments.json:
        print_json(property_errors_json(error.diagnostics))
    else:
        print_diagnostics(error.diagnostics, Bundle(files[0], tuple(files[1:])) if files else None)
