"""Automata without a text of RoboSC in the commands that take them: CIF, libFAUDES and Supremica."""

import argparse
import sys
from typing import TYPE_CHECKING, Protocol

import msgspec

from robosc.cli.arguments import SYNTHESIS_STATES
from robosc.cli.machine import THIS_MACHINE, Machine, watched
from robosc.cli.output import (
    CommandError,
    ExitCode,
    UsageError,
    print_diagnostics,
    print_json,
    report_check,
    require_other_file,
    write_bytes,
)
from robosc.cli.statistics import Figures, timed
from robosc.errors import Diagnostic, InvalidSupervisorError, UnsupportedModelError
from robosc.json_documents import diagnostics_json, json_text
from robosc.model.structure import Deployment
from robosc.pipeline.automata_files import SUFFIXES, is_automata
from robosc.source import SourceFile, visible

if TYPE_CHECKING:
    from enum import StrEnum
    from pathlib import Path

    from robosc.certification.goals import GoalExplanation
    from robosc.explanation import EmptyExplanation
    from robosc.pipeline.exploring import Exploration
    from robosc.pipeline.loading import LoadedAutomata
    from robosc.pipeline.options import SynthesisOptions
    from robosc.pipeline.results import Generation, SynthesisStatus, Verification
    from robosc.pipeline.systems import SystemSupervisor, SystemSynthesis

NO_FILE = "FILE.rsup: 'robosc verify' verifies a supervisor's file of automata, and no server does"
"""Refusal of such a file for a server."""

SUPERVISOR = ".rsup"
"""Ending of a supervisor's file."""


def is_given(arguments: argparse.Namespace) -> bool:
    """Return True if the model of a command holds automata, by the ending of its name."""
    return is_automata(arguments.model)


def synthesized(arguments: argparse.Namespace, text: str | None = None) -> "tuple[LoadedAutomata, SystemSynthesis]":
    """Read the model of a command, check it, and synthesize on this machine if it has no errors.

    Args:
        arguments: Arguments of the command.
        text: All of the model, whose file only gives it a name then; None: the file's.

    Raises:
        UsageError: An argument means nothing for it, or it cannot be read.
    """
    model = loaded(arguments, text)
    return model, THIS_MACHINE.synthesize(model, synthesis_options(arguments), is_modular=False)


def controlled_system(supervisor: "SystemSupervisor", suffix: str) -> bytes:
    """Return the content of a file whose name ends so: a CIF model, or one automaton of libFAUDES or Supremica.

    Raises:
        CommandError: It has too many states for one automaton.
        UnsupportedModelError: A name in it is none of that format, or it is too large.
    """
    from robosc.exploration import DEFAULT_LIMIT, graph_automaton
    from robosc.pipeline.exploring import graph_of
    from robosc.plain_automata import WRITERS
    from robosc.targets.cif import automata

    if suffix not in WRITERS:
        return automata.controlled_system(supervisor).encode()
    try:
        graph = graph_of(supervisor, limit=DEFAULT_LIMIT)
    except UnsupportedModelError as error:
        problem = f"-o: the controlled system has more than {DEFAULT_LIMIT:,} states, or very many transitions"
        raise CommandError(f"{problem}: write it to a file that ends in .cif", ExitCode.FAILED) from error
    return WRITERS[suffix](graph_automaton(graph, supervisor.system)).encode()


def check(arguments: argparse.Namespace, machine: Machine = THIS_MACHINE) -> ExitCode:
    """Check automata, with `--synthesize` also by synthesis; 0 without errors, else 1.

    Raises:
        UsageError: An argument means nothing for it, or it cannot be read.
    """
    from robosc.pipeline.results import SynthesisStatus

    model = loaded(arguments)
    outcome_json: dict[str, object] = {}
    synthesis = None
    if arguments.synthesize:
        synthesis = machine.synthesize(model, synthesis_options(arguments), is_modular=False)
        if synthesis.status is not SynthesisStatus.MODEL_ERRORS:
            outcome_json = {"status": str(synthesis.status), "reason": synthesis.reason}
    diagnostics = machine.check(model) if synthesis is None else synthesis.diagnostics
    status = report_check(arguments, diagnostics, model, outcome_json)
    if outcome_json and synthesis is not None and synthesis.supervisor is None:
        if not arguments.json:
            sys.stderr.write(f"{arguments.model}: {visible(synthesis.reason)}\n")
        return ExitCode.FAILED
    return status


def synth(arguments: argparse.Namespace, machine: Machine = THIS_MACHINE) -> ExitCode:
    """Synthesize, and print what the supervisor adds to each event; 0 with a supervisor, 1 without.

    Raises:
        UsageError: An argument means nothing for it, or it cannot be read.
    """
    from robosc.pipeline.systems import system_summary_text

    output = arguments.output
    refuse_output(output)
    model = loaded_for_synthesis(arguments)
    options = synthesis_options(arguments)
    made, seconds = timed(lambda: machine.synthesize(model, options, is_modular=arguments.modular))
    # A server has no option for figures.
    figures = Figures(made.statistics, seconds) if getattr(arguments, "statistics", False) else None
    if made.supervisor is None:
        return report_none(arguments, made, model, figures)
    if output is not None:
        for file in model.files:
            require_other_file(output, arguments.model.parent / file.name)
        if output.suffix == SUPERVISOR:
            machine.write_supervisor(output, made.supervisor)
        else:
            write_bytes(output, controlled_system(made.supervisor, output.suffix))
    initial = made.supervisor.initial_condition
    if arguments.json:
        print_json(
            {
                "status": str(made.status),
                "reason": "",
                "file": None if output is None else str(output),
                "system": made.supervisor.system.name,
                "states": made.supervisor.states or None,
                "modules": [
                    {"automata": list(item.automata), "states": item.states, "group": item.group}
                    for item in made.supervisor.modules
                ],
                "conditions": {name: str(item) for name, item in made.supervisor.conditions.items()},
                "initial": None if initial is None else str(initial),
                **({} if figures is None else {"statistics": figures.document()}),
                **diagnostics_json(made.diagnostics),
            }
        )
        return ExitCode.OK
    print_diagnostics(made.diagnostics, model)
    sys.stdout.write(system_summary_text(made.supervisor))
    if output is not None:
        sys.stdout.write(f"written to {output}\n")
    sys.stdout.write("" if figures is None else str(figures))
    return ExitCode.OK


def explore(arguments: argparse.Namespace, machine: Machine = THIS_MACHINE) -> ExitCode:
    """Print the graph of the controlled system; 0 with one, 1 without.

    Raises:
        UsageError: An argument means nothing for it, or it cannot be read.
        UnsupportedModelError: There are too many states.
    """
    from robosc.exploration import graph_dot, graph_json, graph_text

    model = loaded(arguments)
    found = machine.explore(model, synthesis_options(arguments), maximum_states=arguments.limit)
    require_supported(found)
    if found.graph is None:
        return report_none(arguments, found, model)
    if arguments.json:
        print_json(graph_json(found.graph))
    else:
        print_diagnostics(found.diagnostics, model)
        sys.stdout.write(graph_dot(found.graph) if arguments.dot else graph_text(found.graph))
    return ExitCode.OK


def verify(arguments: argparse.Namespace, machine: Machine = THIS_MACHINE) -> ExitCode:
    """Synthesize, or read a supervisor's file, and verify the supervisor by other means; 0 if it passed, else 1.

    Raises:
        UsageError: An argument means nothing for it, or it cannot be read.
        UnsupportedModelError: The automata cannot be handled.
    """
    from robosc.cli.sign import report_malformed
    from robosc.explanation import from_text
    from robosc.pipeline.results import SynthesisStatus, VerificationStatus
    from robosc.pipeline.systems import system_verification_text
    from robosc.signatures import SignatureError

    model, options = loaded_for_verification(arguments), synthesis_options(arguments)
    if arguments.supervisor is None:
        found = machine.verify(
            model,
            options,
            maximum_states=arguments.limit,
            is_strict=arguments.strict,
            controller=arguments.controller,
            as_is=arguments.as_is,
        )
    else:
        refuse(machine is not THIS_MACHINE, NO_FILE)
        refuse(arguments.as_is, "--as-is: the supervisor is FILE.rsup")
        try:
            found = _verified(arguments, model, options)
        except (InvalidSupervisorError, SignatureError) as error:
            return report_malformed(arguments, error)
    require_supported(found)
    if found.status is VerificationStatus.NO_SUPERVISOR:
        blame = found.report["explanation"]
        explanation = from_text(json_text(blame)) if blame else None
        status = SynthesisStatus(found.report["status"])
        return report_none(arguments, WithoutSupervisor(status, found.diagnostics, found.reason, explanation), model)
    if arguments.json:
        print_json(found.report)
    else:
        print_diagnostics(found.diagnostics, model)
        if not (found.passed and arguments.quiet):
            sys.stdout.write(system_verification_text(found.report))
    return ExitCode.OK if found.passed else ExitCode.FAILED


def _verified(arguments: argparse.Namespace, model: "LoadedAutomata", options: "SynthesisOptions") -> "Verification":
    """Verify the supervisor's file of a command, which has to be of the automata of its model.

    Raises:
        InvalidSupervisorError: It is malformed, or one of other automata.
        SignatureError: It is not signed as it must be.
        UsageError: A file cannot be read.
    """
    from robosc.cli.sign import read_supervisor, report_signer, signer_of
    from robosc.pipeline.automata_models import file_verification
    from robosc.pipeline.systems import decode_system
    from robosc.verification import Limits

    content = read_supervisor(arguments.supervisor)
    if arguments.signed_by:
        report_signer(arguments, signer_of(arguments.supervisor, content, arguments.signed_by))
    supervisor, limits = decode_system(content), Limits.of(arguments.limit)
    return watched(
        lambda report: file_verification(
            model,
            supervisor,
            options,
            limits,
            report,
            lambda: False,
            is_strict=arguments.strict,
            controller=arguments.controller,
        )
    )


def generate(
    arguments: argparse.Namespace, package: str | None, machine: Machine = THIS_MACHINE
) -> "tuple[LoadedAutomata, Generation]":
    """Generate the files of a target from automata, which may be called as a package is.

    Raises:
        UsageError: An argument means nothing for it, or it cannot be read.
        UnsupportedModelError: The target cannot do the automata.
    """
    from robosc.targets import GenerateOptions

    model = loaded_for_generation(arguments)
    made = machine.generate(
        model,
        arguments.target,
        GenerateOptions(package=package),
        synthesis_options(arguments),
        initial=arguments.initial,
        is_modular=arguments.modular,
    )
    require_supported(made)
    return model, made


def _require_beginning(model: "LoadedAutomata", initial: str) -> None:
    """Do nothing if a description of where automata begin can be understood.

    Raises:
        UsageError: It names what is not there.
    """
    from robosc.explanation import RequestError
    from robosc.pipeline.automata_models import begun, checked_automata

    system = checked_automata(model).system
    try:
        if system is not None:
            begun(system, initial)
    except RequestError as error:
        raise UsageError(f"--initial: {error}") from error


def explain_synthesis(arguments: argparse.Namespace, machine: Machine = THIS_MACHINE) -> ExitCode:
    """Explain what synthesis did to automata; 0 with a supervisor, 1 without.

    Raises:
        UsageError: An argument means nothing for it, or it cannot be read.
    """
    from robosc.explanation import Explanation, document, explanation_text

    model, options = loaded(arguments), synthesis_options(arguments)
    made = machine.explain(model, options, event=arguments.event, state=arguments.state, after=arguments.after)
    if not isinstance(made.explanation, Explanation):
        return report_none(arguments, made, model)
    is_empty = made.explanation.empty is not None
    if arguments.json:
        explanation = document(made.explanation)
        print_json({"status": str(made.status), "explanation": explanation, **diagnostics_json(made.diagnostics)})
    else:
        print_diagnostics(made.diagnostics, model)
        if is_empty:
            sys.stdout.write(f"{arguments.model}: no supervisor exists\n")
        sys.stdout.write(explanation_text(made.explanation))
    return ExitCode.FAILED if is_empty else ExitCode.OK


def loaded_for_synthesis(arguments: argparse.Namespace) -> "LoadedAutomata":
    """Read the model of a command that synthesizes; raises as `loaded`."""
    refuse(arguments.allow_livelock, "--allow-livelock: automata have no silent steps of a controller")
    refuse(
        arguments.verify_limit != SYNTHESIS_STATES,
        "--verify-limit: the supervisor of automata is verified by the command verify",
    )
    return loaded(arguments)


def loaded_for_verification(arguments: argparse.Namespace) -> "LoadedAutomata":
    """Read the model of a command that verifies; raises as `loaded`."""
    refuse(bool(arguments.property or arguments.properties), "--property: properties are of robots, not of automata")
    refuse(arguments.supervisor is None and bool(arguments.signed_by), "--signed-by: automata need FILE.rsup for it")
    return loaded(arguments)


def loaded_for_generation(arguments: argparse.Namespace) -> "LoadedAutomata":
    """Read the model of a command that generates; raises as `loaded`."""
    from robosc.targets import ALL

    refuse(arguments.target == ALL, "--target all: of automata name one target: c99, cif or python")
    refuse(
        arguments.target == "cif" and arguments.package is not None,
        "--package: of automata, --target cif makes one file and no package",
    )
    refuse(arguments.allow_livelock, "--allow-livelock: automata have no silent steps of a controller")
    model = loaded(arguments)
    if arguments.initial is not None:
        _require_beginning(model, arguments.initial)
    return model


def loaded(arguments: argparse.Namespace, text: str | None = None) -> "LoadedAutomata":
    """Read the model of a command.

    Args:
        arguments: Arguments of the command.
        text: All of the model, which imports nothing then: its file only gives it a name; None: the file's.

    Raises:
        UsageError: An argument means nothing for it, or it cannot be read.
    """
    from robosc.pipeline.files import FileAccessError
    from robosc.pipeline.loading import LoadedAutomata, load

    refuse(bool(arguments.library_path), "-L: automata import no libraries, and CIF models files by their places")
    refuse(bool(arguments.interface_path), "-I: automata have no types of ROS")
    refuse(getattr(arguments, "distribution", None) is not None, "--distribution: automata have no types of ROS")
    deployment = getattr(arguments, "deployment", None)
    refuse(deployment == str(Deployment.LAYER), "--deployment: automata are not a node of a robot")
    if text is not None:
        return LoadedAutomata(SourceFile(str(arguments.model), text))
    try:
        model = load(arguments.model)
    except FileAccessError as error:
        raise UsageError(str(error)) from error
    assert isinstance(model, LoadedAutomata)  # noqa: S101 - asked only of models whose name says so
    return model


def refuse_output(output: "Path | None") -> None:
    """Do nothing if a supervisor of automata, or its controlled system, can be written to a file of this name.

    Raises:
        UsageError: It cannot.
    """
    refuse(
        output is not None and output.suffix not in {*SUFFIXES, SUPERVISOR},
        f"-o: the supervisor of automata is written to a file that ends in {SUPERVISOR}, and the controlled system "
        f"to one that ends in {', '.join(sorted(SUFFIXES))}",
    )


def refuse(is_given: bool, message: str) -> None:
    """Do nothing if an argument that means nothing for automata is not given.

    Raises:
        UsageError: It is.
    """
    if is_given:
        raise UsageError(message)


def synthesis_options(arguments: argparse.Namespace) -> "SynthesisOptions":
    """Return the options of a command that are for the synthesis of automata."""
    from robosc.pipeline.options import SynthesisOptions

    return SynthesisOptions(
        engine=arguments.engine or "auto",
        allow_reordering=arguments.reorder,
        maximum_nodes=arguments.max_nodes,
        condition_seconds=getattr(arguments, "condition_seconds", None),
    )


class _Outcome(Protocol):
    """Outcome without a supervisor."""

    @property
    def status(self) -> "StrEnum":
        """Outcome of the synthesis."""

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Every finding."""

    @property
    def reason(self) -> str:
        """Reason why there is no supervisor; empty if the findings say it."""

    @property
    def explanation(self) -> object:
        """Explanation of what is to blame."""


class WithoutSupervisor(msgspec.Struct, frozen=True):
    """Outcome of a command for which there is no supervisor."""

    status: "SynthesisStatus"
    diagnostics: tuple[Diagnostic, ...]
    reason: str
    explanation: "EmptyExplanation | GoalExplanation | None"


def require_supported(outcome: "Exploration | Generation | Verification") -> None:
    """Do nothing unless automata are outside of what can be done.

    Raises:
        UnsupportedModelError: They are.
    """
    if outcome.status == "unsupported model":
        raise UnsupportedModelError(outcome.reason)


def report_none(
    arguments: argparse.Namespace, made: _Outcome, model: "LoadedAutomata", figures: Figures | None = None
) -> ExitCode:
    """Report that there is no supervisor, what is to blame, and the figures of the synthesis if they are wanted."""
    from robosc.explanation import EmptyExplanation, document, empty_text

    explanation = made.explanation if isinstance(made.explanation, EmptyExplanation) else None
    if arguments.json:
        outcome_json = {
            "status": str(made.status),
            "reason": made.reason,
            "explanation": document(explanation) if explanation else None,
            **({} if figures is None else {"statistics": figures.document()}),
        }
        print_json({**outcome_json, **diagnostics_json(made.diagnostics)})
    else:
        print_diagnostics(made.diagnostics, model)
        if made.reason:
            sys.stderr.write(f"{arguments.model}: {visible(made.reason)}\n")
        if explanation is not None:
            sys.stderr.write(empty_text(explanation))
        sys.stdout.write("" if figures is None else str(figures))
    return ExitCode.FAILED
