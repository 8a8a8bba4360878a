"""`robosc explore`: the graph of everything the controlled system may do."""

import argparse
import sys

from robosc.certification.reasons import reasons_json
from robosc.cli import automata, synth
from robosc.cli.arguments import add_deployment_argument, add_engine_options, add_model_arguments, read_bundle
from robosc.cli.output import ExitCode, print_json
from robosc.json_documents import diagnostics_json

DEFAULT_LIMIT = 100_000


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise ValueError
    return value


_positive.__name__ = "positive number"


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "explore",
        help="print the controlled system's states and transitions",
        description="Print every state that the robot, or automata (FILE.cif, .gen, .wmod), can be in under their "
        "supervisor, and every transition.",
    )
    add_model_arguments(parser)
    parser.add_argument("--dot", action="store_true", help="print a graph for Graphviz instead of a table")
    parser.add_argument(
        "--limit",
        type=_positive,
        default=DEFAULT_LIMIT,
        metavar="N",
        help="give up beyond N states (default: %(default)s)",
    )
    add_deployment_argument(parser)
    add_engine_options(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Synthesize and explore; 0 with a graph, 1 without."""
    from robosc.exploration import graph_dot, graph_json, graph_text
    from robosc.pipeline.exploring import graph_of

    if automata.is_given(arguments):
        return automata.explore(arguments)
    bundle = read_bundle(arguments)
    # The graph is of everything allowed, whatever an executor would choose.
    outcome = synth.make(arguments, bundle, allow_livelock=True, only_shown=True)
    if outcome.supervisor is None:
        if arguments.json:
            print_json(
                {"status": str(outcome.status), **reasons_json(outcome), **diagnostics_json(outcome.diagnostics)}
            )
        else:
            synth.report_problems(outcome, bundle)
        return ExitCode.FAILED
    graph = graph_of(outcome.supervisor, limit=arguments.limit)
    if arguments.json:
        print_json(graph_json(graph))
    else:
        sys.stdout.write(graph_dot(graph) if arguments.dot else graph_text(graph))
    return ExitCode.OK
