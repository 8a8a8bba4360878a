"""`robosc synth`: the supervisor of a model, as a file and as a summary."""

import argparse
import sys
from enum import StrEnum
from typing import TYPE_CHECKING, Protocol

from robosc.certification.reasons import Reasons, reasons_json
from robosc.cli import automata
from robosc.cli.arguments import (
    SYNTHESIS_STATES,
    add_condition_seconds_argument,
    add_deployment_argument,
    add_engine_options,
    add_livelock_argument,
    add_model_arguments,
    add_verify_limit_argument,
    engine_options,
    given_path,
    read_bundle,
)
from robosc.cli.output import (
    ExitCode,
    ProgressLine,
    print_diagnostics,
    print_json,
    require_other_file,
    write_bytes,
)
from robosc.cli.statistics import Figures, timed
from robosc.errors import Diagnostic
from robosc.json_documents import diagnostics_json
from robosc.model.structure import Deployment
from robosc.source import Bundle

if TYPE_CHECKING:
    from robosc.certification import SynthesisOutcome
    from robosc.certification.goals import GoalExplanation
    from robosc.explanation import EmptyExplanation


class Outcome(Reasons, Protocol):
    """Outcome of a synthesis, or of what needs one."""

    @property
    def status(self) -> StrEnum:
        """Status at the end."""

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Every finding about the model, sorted by place."""


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "synth",
        help="synthesize a supervisor",
        description="Synthesize the supervisor of a model: safe, controllable, nonblocking, maximally permissive. Of "
        "automata (FILE.cif, .gen, .wmod) the conditions are printed; -o FILE.cif writes the controlled system as a "
        "CIF model, -o FILE.gen and -o FILE.wmod as one automaton of libFAUDES or Supremica.",
    )
    add_model_arguments(parser)
    add_output_argument(parser)
    add_deployment_argument(parser)
    add_engine_options(parser)
    add_condition_seconds_argument(parser)
    add_verify_limit_argument(parser, "--verify-limit", SYNTHESIS_STATES)
    add_livelock_argument(parser)
    add_modular_argument(parser)
    parser.add_argument(
        "--statistics",
        action="store_true",
        help="also print the figures of the synthesis: how it went about the search, its size and its time",
    )
    parser.set_defaults(run=run)


def add_modular_argument(parser: argparse.ArgumentParser) -> None:
    """Add the option for a synthesis in modules."""
    parser.add_argument(
        "--modular",
        action="store_true",
        help="synthesize in modules: for robots and automata of many parts, of which each requirement is about few",
    )


def add_output_argument(parser: argparse.ArgumentParser) -> None:
    """The supervisor's file."""
    parser.add_argument(
        "-o", "--output", type=given_path, metavar="FILE.rsup", help="write the supervisor to this file"
    )


def run(arguments: argparse.Namespace) -> int:
    """Synthesize; 0 with a supervisor, 1 without."""
    from robosc.supervisor import encode

    if automata.is_given(arguments):
        return automata.synth(arguments)
    require_other_file(arguments.output, arguments.model)
    bundle = read_bundle(arguments)
    allow_livelock, verify_limit = arguments.allow_livelock, arguments.verify_limit
    is_modular = arguments.modular
    outcome, seconds = timed(
        lambda: make(arguments, bundle, allow_livelock=allow_livelock, is_modular=is_modular, verify_limit=verify_limit)
    )
    if outcome.supervisor is not None and arguments.output is not None:
        write_bytes(arguments.output, encode(outcome.supervisor))
    figures = Figures(outcome.statistics, seconds) if arguments.statistics else None
    return report_written(arguments, outcome, bundle, figures)


def make(
    arguments: argparse.Namespace,
    bundle: Bundle,
    *,
    allow_livelock: bool,
    only_shown: bool = False,
    is_modular: bool = False,
    verify_limit: int = SYNTHESIS_STATES,
) -> "SynthesisOutcome":
    """Synthesize as the arguments say, with a progress line on a terminal."""
    from robosc.certification import make_supervisor

    progress = ProgressLine()
    try:
        return make_supervisor(
            bundle,
            deployment=Deployment(arguments.deployment),
            engine=engine_options(arguments),
            verify_limit=verify_limit,
            allow_livelock=allow_livelock,
            only_shown=only_shown,
            is_modular=is_modular,
            on_progress=lambda step: progress.show(f"{step.stage}: {step.message}"),
        )
    finally:
        progress.clear()


def report_written(
    arguments: argparse.Namespace, outcome: "SynthesisOutcome", bundle: Bundle, figures: Figures | None = None
) -> ExitCode:
    """Print the outcome as asked and return the exit status.

    Args:
        arguments: Arguments of the command.
        outcome: The outcome; the file of a supervisor is written already, if it is to have one.
        bundle: The model.
        figures: Figures that are printed, too.
    """
    from robosc.conditions.summary import summary_json, summary_text

    if arguments.json:
        print_json(
            {
                "status": str(outcome.status),
                **reasons_json(outcome),
                "summary": summary_json(outcome.supervisor) if outcome.supervisor else None,
                "file": str(arguments.output) if outcome.supervisor and arguments.output else None,
                **({} if figures is None else {"statistics": figures.document()}),
                **diagnostics_json(outcome.diagnostics),
            }
        )
    else:
        report_problems(outcome, bundle)
        if outcome.supervisor is not None:
            sys.stdout.write(summary_text(outcome.supervisor))
            if arguments.output is not None:
                sys.stdout.write(f"written to {arguments.output}\n")
        sys.stdout.write("" if figures is None else str(figures))
    return ExitCode.OK if outcome.supervisor is not None else ExitCode.FAILED


def report_problems(outcome: Outcome, bundle: Bundle) -> None:
    """Findings and, where there is no supervisor, why, on standard error."""
    print_diagnostics(outcome.diagnostics, bundle)
    report_reasons(outcome, bundle)


def report_reasons(outcome: Reasons, bundle: Bundle) -> None:
    """Write the reason why there is no supervisor to standard error, if there is none."""
    if outcome.reason:
        sys.stderr.write(f"{bundle.main.name}: {outcome.reason}\n")
    if outcome.explanation is not None:
        sys.stderr.write(why_text(outcome.explanation))


def why_text(explanation: "EmptyExplanation | GoalExplanation") -> str:
    """Return the text on why there is no supervisor, and how a person can play against the surroundings."""
    from robosc.explanation import EmptyExplanation, empty_text

    if isinstance(explanation, EmptyExplanation):
        return empty_text(explanation)
    hint = "'robosc simulate' and 'robosc view' with '--counter-strategy' play the surroundings, against you\n"
    return f"{explanation}\n{hint if explanation.has_counter_strategy else ''}"
