"""`robosc explain-synthesis`: what is to blame, what restricts events, why one cannot happen, and warnings."""

import argparse
import sys
from typing import TYPE_CHECKING

from robosc.certification.reasons import reasons_json
from robosc.cli import automata, synth
from robosc.cli.arguments import (
    add_deployment_argument,
    add_engine_options,
    add_model_arguments,
    engine_options,
    read_bundle,
)
from robosc.cli.output import ExitCode, ProgressLine, UsageError, print_json
from robosc.errors import UnsupportedModelError
from robosc.json_documents import diagnostics_json
from robosc.model.structure import Deployment
from robosc.source import Bundle, visible

if TYPE_CHECKING:
    from collections.abc import Callable

    from robosc.pipeline.results import Explained

_EPILOG = """\
examples:
  robosc explain-synthesis robot.rscd                                 every controllable event, and warnings
  robosc explain-synthesis robot.rscd --event move                    why move.request is restricted, or never happens
  robosc explain-synthesis robot.rscd --event move --state "Door.closed, Lift.n = 2"
  robosc explain-synthesis robot.rscd --after "up, Lift.tau_1"        what can happen then, and why the rest cannot
  robosc explain-synthesis large.rscd --event move --modular          in each module that has move, for large robots
  robosc explain-synthesis plant.cif --event lane.start               the same for CIF models (.gen, .wmod)
"""


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "explain-synthesis",
        help="explain what synthesis did to a model",
        description="Explain the result of synthesis. Without a supervisor: a shortest run into trouble, and what is "
        "to blame. With one: what restricts each controllable event, why an event can never happen or cannot happen "
        "in a state, and warnings about what never restricts, never happens, is never reached or only waits. If goals "
        "or missions cannot be reached: what is to blame for that, unless --event, --state or --after asks for "
        "something else. Takes automata (FILE.cif, .gen, .wmod), too.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_model_arguments(parser)
    add_question_arguments(parser)
    add_deployment_argument(parser)
    add_engine_options(parser)
    parser.set_defaults(run=run)


def add_question_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments for what is to be explained."""
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
    parser.add_argument(
        "--modular",
        action="store_true",
        help="explain events of a robot in each module of a synthesis in modules that has them, by runs of it alone",
    )


def refuse_modular(arguments: argparse.Namespace) -> None:
    """Do nothing unless something that is about the whole is to be explained in modules.

    Raises:
        UsageError: It is.
    """
    if arguments.modular and automata.is_given(arguments):
        raise UsageError("--modular explains robots in modules: automata are explained as a whole")
    if arguments.modular and (arguments.state is not None or arguments.after is not None):
        raise UsageError("--modular explains events: leave it out with --state and --after, which are about the whole")


def run(arguments: argparse.Namespace) -> int:
    """Synthesize and explain; 0 with a supervisor, 1 without."""
    refuse_modular(arguments)
    if automata.is_given(arguments):
        return automata.explain_synthesis(arguments)
    return run_with(arguments, lambda bundle: _explained(arguments, bundle))


def run_with(arguments: argparse.Namespace, explain: "Callable[[Bundle], Explained]") -> ExitCode:
    """Explain a robot with a given function, such as one that asks a server; 0 with a supervisor, 1 without.

    Raises:
        UnsupportedModelError: The model is outside what synthesis handles.
    """
    from robosc.certification.goals import GoalExplanation
    from robosc.explanation import document, explanation_text
    from robosc.pipeline.results import NoSupervisor, SynthesisStatus

    bundle = read_bundle(arguments)
    found = explain(bundle)
    if found.status is SynthesisStatus.UNSUPPORTED_MODEL:
        raise UnsupportedModelError(found.reason)
    if isinstance(found.explanation, GoalExplanation):
        goals = automata.WithoutSupervisor(found.status, found.diagnostics, found.reason, found.explanation)
        if arguments.json:
            print_json({"status": str(found.status), **reasons_json(goals), **diagnostics_json(found.diagnostics)})
        else:
            sys.stdout.write(f"{bundle.main.name}: {visible(found.reason)}\n{synth.why_text(found.explanation)}")
        return ExitCode.FAILED
    if isinstance(found.explanation, NoSupervisor):
        why = automata.WithoutSupervisor(found.status, found.diagnostics, found.reason, None)
        if arguments.json:
            print_json({"status": str(found.status), **reasons_json(why), **diagnostics_json(found.diagnostics)})
        else:
            synth.report_problems(why, bundle)
        return ExitCode.FAILED
    is_empty = found.status is SynthesisStatus.EMPTY
    if arguments.json:
        explanation = document(found.explanation)
        print_json({"status": str(found.status), "explanation": explanation, **diagnostics_json(found.diagnostics)})
    else:
        if is_empty:
            sys.stdout.write(f"{bundle.main.name}: no supervisor exists\n")
        sys.stdout.write(explanation_text(found.explanation))
    return ExitCode.FAILED if is_empty else ExitCode.OK


def _explained(arguments: argparse.Namespace, bundle: Bundle) -> "Explained":
    from robosc.pipeline.explaining import ExplanationSubject, explained, result_of

    progress = ProgressLine()
    try:
        found = explained(
            bundle,
            Deployment(arguments.deployment),
            engine_options(arguments),
            ExplanationSubject(arguments.event, arguments.state, arguments.after, arguments.modular),
            lambda step: progress.show(step.message),
        )
    finally:
        progress.clear()
    return result_of(found, bundle)
