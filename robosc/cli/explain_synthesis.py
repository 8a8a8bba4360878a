"""`robosc explain-synthesis`: what is to blame, what restricts events, why one cannot happen, and warnings."""

import argparse
import sys

from robosc.cli import automata, synth
from robosc.cli.arguments import (
    add_deployment_argument,
    add_engine_options,
    add_model_arguments,
    engine_options,
    read_bundle,
)
from robosc.cli.output import ExitCode, ProgressLine, print_json
from robosc.json_documents import diagnostics_json
from robosc.model.structure import Deployment

_EPILOG = """\
examples:
  robosc explain-synthesis robot.rscd                                 every controllable event, and warnings
  robosc explain-synthesis robot.rscd --event move                    why move.request is restricted, or never happens
  robosc explain-synthesis robot.rscd --event move --state "Door.closed, Lift.n = 2"
  robosc explain-synthesis robot.rscd --after "up, Lift.tau_1"        what can happen then, and why the rest cannot
  robosc explain-synthesis plant.cif --event lane.start               the same for CIF models (.gen, .wmod)
"""


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "explain-synthesis",
        help="explain what synthesis did to a model",
        description="Explain the result of synthesis. Without a supervisor: a shortest run into trouble, and what is "
        "to blame. With one: what restricts each controllable event, why an event can never happen or cannot happen "
        "in a state, and warnings about what never restricts, never happens, is never reached or only waits. Takes "
        "automata (FILE.cif, .gen, .wmod), too.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_model_arguments(parser)
    parser.add_argument(
        "--event",
        metavar="EVENT",
        help="explain this event only: move.request, or move for the first event of a communication",
    )
    parser.add_argument(
        "--state",
        "--at",
        metavar="STATE",
        help="explain what can happen in a state of the controlled system that fits: Component.state, "
        "Component.variable = value, !Component.flag, service.waiting, separated by commas; of automata "
        "Automaton.location, Automaton.variable = value",
    )
    parser.add_argument(
        "--after", metavar="EVENTS", help="explain what can happen after this run: events separated by commas"
    )
    add_deployment_argument(parser)
    add_engine_options(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Synthesize and explain; 0 with a supervisor, 1 without."""
    if automata.is_given(arguments):
        return automata.explain_synthesis(arguments)
    from robosc.certification import SynthesisOutcome
    from robosc.explanation import document, explanation_text
    from robosc.pipeline.explaining import ExplanationSubject, explained

    bundle = read_bundle(arguments)
    progress = ProgressLine()
    try:
        found = explained(
            bundle,
            Deployment(arguments.deployment),
            engine_options(arguments),
            ExplanationSubject(arguments.event, arguments.state, arguments.after),
            lambda step: progress.show(step.message),
        )
    finally:
        progress.clear()
    if isinstance(found, SynthesisOutcome):
        if arguments.json:
            print_json(
                {"status": str(found.status), **synth.reasons_json(found), **diagnostics_json(found.diagnostics)}
            )
        else:
            synth.report_problems(found, bundle)
        return ExitCode.FAILED
    problem, explanation = found
    is_empty = explanation.empty is not None
    if arguments.json:
        status = "empty" if is_empty else "supervisor"
        print_json({"status": status, "explanation": document(explanation), **diagnostics_json(problem.diagnostics)})
    else:
        if is_empty:
            sys.stdout.write(f"{bundle.main.name}: no supervisor exists\n")
        sys.stdout.write(explanation_text(explanation))
    return ExitCode.FAILED if is_empty else ExitCode.OK
