"""`robosc check`: everything that is wrong with a model, in one run."""

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING

import msgspec

from robosc.certification.reasons import reasons_json
from robosc.cli import automata, synth
from robosc.cli.arguments import add_deployment_argument, add_engine_options, add_model_arguments, read_bundle
from robosc.cli.output import ExitCode, UsageError, report_check
from robosc.errors import Diagnostic, LanguageError, UnsupportedModelError
from robosc.model.structure import Deployment
from robosc.source import Bundle

if TYPE_CHECKING:
    from robosc.certification import SynthesisOutcome
    from robosc.certification.goals import GoalExplanation
    from robosc.explanation import EmptyExplanation
    from robosc.pipeline.findings import Findings


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "check",
        help="find everything that is wrong with a model",
        description="Check a model, library or automata (FILE.cif, .gen, .wmod) and print every finding with its place "
        "and how to fix it.",
    )
    add_model_arguments(parser)
    parser.add_argument("--strict", action="store_true", help="exit with 1 for warnings too")
    parser.add_argument(
        "--all", action="store_true", help="also print the findings that the model accepts, with the reasons"
    )
    parser.add_argument(
        "--synthesize",
        action="store_true",
        help="also synthesize, to find what only synthesis shows: no supervisor at all, events that can never happen, "
        "states that are never reached, requirements that never restrict, requests that compete",
    )
    add_deployment_argument(parser)
    add_engine_options(parser)
    # None marks options that were not given: given without --synthesize, they are refused.
    parser.set_defaults(run=run, deployment=None, engine=None)


def run(arguments: argparse.Namespace) -> int:
    """Check the model; 0 without errors (and, with `--synthesize`, with a supervisor), else 1."""
    require_synthesis(arguments)
    if automata.is_given(arguments):
        return automata.check(arguments)
    return run_with(arguments, _checked, lambda bundle: synth.make(arguments, bundle, allow_livelock=False))


def run_with(
    arguments: argparse.Namespace,
    check: "Callable[[Bundle], Findings]",
    make: "Callable[[Bundle], SynthesisOutcome]",
) -> int:
    """Check the model wherever that is done.

    Args:
        arguments: Of the command.
        check: Gives every finding about a model.
        make: Synthesizes as the arguments say; raises UnsupportedModelError.

    Raises:
        UsageError: The arguments say how to synthesize, and not to; or a file is not there.
    """
    require_synthesis(arguments)
    try:
        bundle = read_bundle(arguments)
    except LanguageError as error:
        return report_check(arguments, error.diagnostics, None)
    if not arguments.synthesize:
        checked = check(bundle)
        return report_check(arguments, checked, bundle, accepted=checked.accepted if arguments.all else ())
    arguments.deployment = arguments.deployment or str(Deployment.CONTROLLER)
    try:
        found = _synthesized(make(bundle))
    except UnsupportedModelError as error:
        checked = check(bundle)
        found = _Synthesized(checked, "unsupported model", str(error), has_failed=True, accepted=checked.accepted)
    return _report_synthesized(arguments, found, bundle)


def require_synthesis(arguments: argparse.Namespace) -> None:
    """Do nothing unless the arguments say how to synthesize, and not to.

    Raises:
        UsageError: They do.
    """
    engine = arguments.engine or arguments.reorder or arguments.max_nodes
    if not arguments.synthesize and (arguments.deployment or engine):
        raise UsageError(
            "--deployment, --engine, --reorder and --max-nodes say how to synthesize: they need --synthesize"
        )


def _checked(bundle: Bundle) -> "Findings":
    from robosc.model.check import check
    from robosc.pipeline.findings import Findings

    found = check(bundle)
    return Findings(found.diagnostics, bundle, found.accepted)


class _Synthesized(msgspec.Struct, frozen=True):
    """Result of checking and synthesis.

    Attributes:
        diagnostics: Every finding.
        status: Outcome of the synthesis.
        reason: Reason why there is no supervisor; empty if there is one.
        has_failed: True if a robot without errors has no supervisor.
        explanation: Explanation of what is to blame if no supervisor exists, or goals cannot be reached.
        accepted: Findings that the model accepts.
    """

    diagnostics: tuple[Diagnostic, ...]
    status: str
    reason: str
    has_failed: bool
    explanation: "EmptyExplanation | GoalExplanation | None" = None
    accepted: tuple[Diagnostic, ...] = ()


def _synthesized(outcome: "SynthesisOutcome") -> _Synthesized:
    from robosc.certification import OutcomeStatus

    has_failed = outcome.status is OutcomeStatus.EMPTY
    return _Synthesized(
        outcome.diagnostics, str(outcome.status), outcome.reason, has_failed, outcome.explanation, outcome.accepted
    )


def _report_synthesized(arguments: argparse.Namespace, found: _Synthesized, bundle: Bundle) -> ExitCode:
    """Print the findings and what became of the synthesis as asked, and return the exit status."""
    summary = {"status": found.status, **reasons_json(found)}
    status = report_check(arguments, found.diagnostics, bundle, summary, found.accepted if arguments.all else ())
    if not arguments.json:
        synth.report_reasons(found, bundle)
    return ExitCode.FAILED if found.has_failed else status
