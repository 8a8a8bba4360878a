"""Automata without a text of RoboSC in the commands that take them: CIF, libFAUDES and Supremica."""

import argparse
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from robosc.cli.output import (
    CommandError,
    ExitCode,
    ProgressLine,
    UsageError,
    has_errors,
    print_diagnostics,
    print_json,
    require_other_file,
    write_bytes,
)
from robosc.cli.statistics import Figures, timed
from robosc.errors import Diagnostic, InvalidSupervisorError, UnsupportedModelError
from robosc.json_documents import counts_text, diagnostics_json
from robosc.model.structure import Deployment
from robosc.pipeline.automata_files import SUFFIXES, is_automata
from robosc.source import Bundle, SourceFile, visible

if TYPE_CHECKING:
    from collections.abc import Callable

    from robosc.automata import CheckedSystem
    from robosc.explanation import EmptyExplanation
    from robosc.pipeline.options import SynthesisOptions
    from robosc.pipeline.results import SynthesisStatus
    from robosc.pipeline.synthesis import OnProgress
    from robosc.pipeline.systems import SystemSupervisor, SystemSynthesis


_SUPERVISOR = ".rsup"
"""Ending of a supervisor's file."""


def is_given(arguments: argparse.Namespace) -> bool:
    """Return True if the model of a command holds automata: the ending of its name tells."""
    return is_automata(arguments.model)


@dataclass(frozen=True, slots=True)
class Synthesized:
    """Result of checking and synthesis.

    Attributes:
        bundle: The model, with the files that it imports.
        status: Outcome of the synthesis.
        diagnostics: Every finding.
        reason: Reason why there is no supervisor; empty if there is one, or the findings tell.
        supervisor: The supervisor, or None.
        explanation: Explanation of what is to blame if no supervisor exists.
        figures: Figures of the synthesis; None if there was none.
    """

    bundle: Bundle
    status: "SynthesisStatus"
    diagnostics: tuple[Diagnostic, ...]
    reason: str
    supervisor: "SystemSupervisor | None"
    explanation: "EmptyExplanation | None" = None
    figures: Figures | None = None


def synthesized(arguments: argparse.Namespace, initial: str | None = None, text: str | None = None) -> Synthesized:
    """Check the model of a command, and synthesize if it has no errors.

    Args:
        arguments: Arguments of the command.
        initial: Description of the states in which automata begin, such as `tank.level = 1`; None: as the model says.
        text: All of the model, whose file only gives it a name then; None: the file's.

    Raises:
        UsageError: An argument means nothing for it, it cannot be read, or the initial states name what is not there.
    """
    from robosc.pipeline.results import NoSupervisor, SynthesisStatus

    bundle, found = _checked(arguments, text)
    if found.system is None:
        return Synthesized(bundle, SynthesisStatus.MODEL_ERRORS, found.diagnostics, "", None)
    if initial is not None:
        found = _beginning(found, initial)
    made, seconds = timed(lambda: _synthesis(arguments, found))
    explanation = None if isinstance(made.explanation, NoSupervisor) else made.explanation
    figures = Figures(made.statistics, seconds)
    return Synthesized(bundle, made.status, found.diagnostics, made.reason, made.supervisor, explanation, figures)


def _beginning(found: "CheckedSystem", initial: str) -> "CheckedSystem":
    from robosc.explanation import RequestError
    from robosc.explanation.requests import SystemRequests
    from robosc.expressions import conjunction

    system = found.system
    assert system is not None  # noqa: S101 - asked only of models without errors
    try:
        condition = SystemRequests(system).state(initial)
    except RequestError as error:
        raise UsageError(f"--initial: {error}") from error
    return replace(found, system=replace(system, initial=conjunction(system.initial, condition)))


def controlled_system(supervisor: "SystemSupervisor", suffix: str) -> str:
    """The controlled system as the text of a file: a CIF model, or one automaton of libFAUDES or Supremica.

    Raises:
        CommandError: It has too many states for one automaton.
        UnsupportedModelError: A name in it is none of that format.
    """
    from robosc.exploration import DEFAULT_LIMIT, graph_automaton
    from robosc.pipeline.exploring import graph_of
    from robosc.plain_automata import WRITERS
    from robosc.targets.cif import automata

    if suffix not in WRITERS:
        return automata.controlled_system(supervisor)
    try:
        graph = graph_of(supervisor, limit=DEFAULT_LIMIT)
    except UnsupportedModelError as error:
        problem = f"-o: the controlled system has more than {DEFAULT_LIMIT:,} states, or very many transitions"
        raise CommandError(f"{problem}: write it to a file that ends in .cif", ExitCode.FAILED) from error
    return WRITERS[suffix](graph_automaton(graph, supervisor.system))


def check(arguments: argparse.Namespace) -> ExitCode:
    """Check automata, and synthesize if that is asked for; 0 without errors, else 1.

    Raises:
        UsageError: An argument means nothing for it, or it cannot be read.
    """
    bundle, found = _checked(arguments)
    told: dict[str, object] = {}
    synthesis = None
    if arguments.synthesize and found.system is not None:
        synthesis = _synthesis(arguments, found)
        told = {"status": str(synthesis.status), "reason": synthesis.reason}
    if arguments.json:
        print_json({"file": str(arguments.model), **told, **diagnostics_json(found.diagnostics)})
    elif found.diagnostics:
        print_diagnostics(found.diagnostics, bundle)
    else:
        sys.stdout.write(f"{arguments.model}: {counts_text(found.diagnostics)}\n")
    if synthesis is not None and synthesis.supervisor is None:
        if not arguments.json:
            sys.stderr.write(f"{arguments.model}: {synthesis.reason}\n")
        return ExitCode.FAILED
    return ExitCode.FAILED if has_errors(found.diagnostics, strict=arguments.strict) else ExitCode.OK


def synth(arguments: argparse.Namespace) -> ExitCode:
    """Synthesize, and print what the supervisor adds to each event; 0 with a supervisor, 1 without.

    Raises:
        UsageError: An argument means nothing for it, or it cannot be read.
    """
    output = arguments.output
    refuse(
        output is not None and output.suffix not in {*SUFFIXES, _SUPERVISOR},
        f"-o: the supervisor of automata is written to a file that ends in {_SUPERVISOR}, and the controlled system "
        f"to one that ends in {', '.join(sorted(SUFFIXES))}",
    )
    refuse(arguments.allow_livelock, "--allow-livelock: automata have no silent steps of a controller")
    made = synthesized(arguments)
    if made.supervisor is None:
        return report_none(arguments, made)
    if output is not None:
        for file in (made.bundle.main, *made.bundle.libraries):
            require_other_file(output, Path(file.name))
        is_supervisor = output.suffix == _SUPERVISOR
        write_bytes(
            output,
            made.supervisor.encode() if is_supervisor else controlled_system(made.supervisor, output.suffix).encode(),
        )
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
                **_statistics_json(arguments, made),
                **diagnostics_json(made.diagnostics),
            }
        )
        return ExitCode.OK
    print_diagnostics(made.diagnostics, made.bundle)
    told = [str(made.supervisor)] if initial is None else [str(made.supervisor), f"it begins only where {initial}"]
    # Names of plain automata may be anything.
    sys.stdout.write("".join(f"{visible(line)}\n" for text in told for line in text.split("\n")))
    if output is not None:
        sys.stdout.write(f"written to {output}\n")
    sys.stdout.write(_statistics_text(arguments, made))
    return ExitCode.OK


def explore(arguments: argparse.Namespace) -> ExitCode:
    """Print the graph of the controlled system; 0 with one, 1 without.

    Raises:
        UsageError: An argument means nothing for it, or it cannot be read.
    """
    from robosc.exploration import graph_dot, graph_json, graph_text
    from robosc.pipeline.exploring import graph_of

    made = synthesized(arguments)
    if made.supervisor is None:
        return report_none(arguments, made)
    graph = graph_of(made.supervisor, limit=arguments.limit)
    if arguments.json:
        print_json(graph_json(graph))
    else:
        print_diagnostics(made.diagnostics, made.bundle)
        sys.stdout.write(graph_dot(graph) if arguments.dot else graph_text(graph))
    return ExitCode.OK


def verify(arguments: argparse.Namespace) -> ExitCode:
    """Synthesize, and verify the supervisor by other means; 0 if it passed, else 1.

    Raises:
        UsageError: An argument means nothing for it, or it cannot be read.
    """
    from robosc.pipeline.results import VerificationStatus
    from robosc.pipeline.systems import verify_system
    from robosc.signatures import SignatureError
    from robosc.verification import Limits

    refuse(bool(arguments.property or arguments.properties), "--property: properties are of robots, not of automata")
    refuse(arguments.supervisor is None and bool(arguments.signed_by), "--signed-by: it needs FILE.rsup")
    try:
        made = synthesized(arguments) if arguments.supervisor is None else _read(arguments)
    except (InvalidSupervisorError, SignatureError) as error:
        from robosc.cli.verify import report_malformed

        return report_malformed(arguments, error)
    if made.supervisor is None:
        return report_none(arguments, made)
    supervisor, options, limits = made.supervisor, _options(arguments), Limits.of(arguments.limit)
    result = _watched(
        lambda on_progress: verify_system(
            supervisor, options, limits, on_progress, lambda: False, is_strict=arguments.strict
        )
    )
    has_passed = result.status is VerificationStatus.PASSED
    if arguments.json:
        print_json({**result.report, **diagnostics_json(made.diagnostics)})
    else:
        print_diagnostics(made.diagnostics, made.bundle)
        if not (has_passed and arguments.quiet):
            sys.stdout.write(str(result) if str(result).endswith("\n") else f"{result}\n")
    return ExitCode.OK if has_passed else ExitCode.FAILED


def _read(arguments: argparse.Namespace) -> Synthesized:
    """Read the supervisor's file of a command, which has to be of the automata of its model.

    Raises:
        InvalidSupervisorError: It is malformed, or one of other automata.
        SignatureError: It is not signed as it must be.
        UsageError: A file cannot be read.
    """
    from robosc.cli.sign import read_supervisor, signer_of
    from robosc.cli.verify import tell_signer
    from robosc.pipeline.results import SynthesisStatus
    from robosc.pipeline.systems import decode_system

    content = read_supervisor(arguments.supervisor)
    bundle, found = _checked(arguments)
    if found.system is None:
        return Synthesized(bundle, SynthesisStatus.MODEL_ERRORS, found.diagnostics, "", None)
    if arguments.signed_by:
        tell_signer(arguments, signer_of(arguments.supervisor, content, arguments.signed_by))
    supervisor = decode_system(content)
    if supervisor.system != found.system:
        raise InvalidSupervisorError(f"the supervisor is one of other automata than those of {bundle.main.name}")
    return Synthesized(bundle, SynthesisStatus.SUPERVISOR, found.diagnostics, "", supervisor)


def explain_synthesis(arguments: argparse.Namespace) -> ExitCode:
    """Explain what synthesis did to automata; 0 with a supervisor, 1 without.

    Raises:
        UsageError: An argument means nothing for it, or it cannot be read.
    """
    from robosc.explanation import Explanation, SystemWords, document, explanation_text
    from robosc.pipeline.explaining import ExplanationSubject, explained_system
    from robosc.pipeline.results import SynthesisStatus

    bundle, found = _checked(arguments)
    if found.system is None:
        return report_none(arguments, Synthesized(bundle, SynthesisStatus.MODEL_ERRORS, found.diagnostics, "", None))
    words, engine = SystemWords(found.system, found.places), _options(arguments).engine_options()
    asked = ExplanationSubject(arguments.event, arguments.state, arguments.after)
    made = _watched(lambda on_progress: explained_system(words, engine, asked, on_progress))
    if not isinstance(made.explanation, Explanation):
        return report_none(arguments, Synthesized(bundle, made.status, found.diagnostics, made.reason, None))
    is_empty = made.explanation.empty is not None
    if arguments.json:
        explanation = document(made.explanation)
        print_json({"status": str(made.status), "explanation": explanation, **diagnostics_json(found.diagnostics)})
    else:
        print_diagnostics(found.diagnostics, bundle)
        if is_empty:
            sys.stdout.write(f"{arguments.model}: no supervisor exists\n")
        sys.stdout.write(explanation_text(made.explanation))
    return ExitCode.FAILED if is_empty else ExitCode.OK


def _checked(arguments: argparse.Namespace, text: str | None = None) -> "tuple[Bundle, CheckedSystem]":
    from robosc.pipeline.automata_files import check_automata_file, load_automata_file

    refuse(bool(arguments.library_path), "-L: automata import no libraries, and CIF models files by their places")
    refuse(bool(arguments.interface_path), "-I: automata have no types of ROS")
    refuse(arguments.deployment == str(Deployment.LAYER), "--deployment: automata are no node of a robot")
    from robosc.pipeline.files import FileAccessError

    try:
        bundle = load_automata_file(arguments.model) if text is None else Bundle(SourceFile(str(arguments.model), text))
    except FileAccessError as error:
        raise UsageError(str(error)) from error
    return bundle, check_automata_file(bundle)


def refuse(is_given: bool, message: str) -> None:
    """Do nothing if an argument that means nothing for automata is not given.

    Raises:
        UsageError: It is.
    """
    if is_given:
        raise UsageError(message)


def _options(arguments: argparse.Namespace) -> "SynthesisOptions":
    from robosc.pipeline.options import SynthesisOptions

    return SynthesisOptions(
        engine=arguments.engine or "auto",
        allow_reordering=arguments.reorder,
        maximum_nodes=arguments.max_nodes,
        condition_seconds=getattr(arguments, "condition_seconds", None),
    )


def _synthesis(arguments: argparse.Namespace, found: "CheckedSystem") -> "SystemSynthesis":
    from robosc.pipeline.systems import synthesize_system

    system, options = found.system, _options(arguments)
    assert system is not None  # noqa: S101 - asked only of models without errors
    is_modular = getattr(arguments, "modular", False)
    return _watched(
        lambda on_progress: synthesize_system(
            system, options, on_progress, lambda: False, found.places, is_modular=is_modular
        )
    )


def _watched[T](work: "Callable[[OnProgress], T]") -> T:
    """Return the result of some work, with a progress line on a terminal meanwhile."""
    progress = ProgressLine()
    try:
        return work(lambda step: progress.show(f"{step.stage}: {step.message}"))
    finally:
        progress.clear()


def report_none(arguments: argparse.Namespace, made: Synthesized) -> ExitCode:
    """Report that there is no supervisor, and what is to blame."""
    from robosc.explanation import document, empty_text

    if arguments.json:
        explanation = document(made.explanation) if made.explanation else None
        told = {"status": str(made.status), "reason": made.reason, "explanation": explanation}
        print_json({**told, **_statistics_json(arguments, made), **diagnostics_json(made.diagnostics)})
    else:
        print_diagnostics(made.diagnostics, made.bundle)
        if made.reason:
            sys.stderr.write(f"{arguments.model}: {visible(made.reason)}\n")
        if made.explanation is not None:
            sys.stderr.write(empty_text(made.explanation))
        sys.stdout.write(_statistics_text(arguments, made))
    return ExitCode.FAILED


def _statistics_json(arguments: argparse.Namespace, made: Synthesized) -> dict[str, object]:
    is_asked = getattr(arguments, "statistics", False)
    return {"statistics": made.figures.document() if made.figures else None} if is_asked else {}


def _statistics_text(arguments: argparse.Namespace, made: Synthesized) -> str:
    return str(made.figures or "") if getattr(arguments, "statistics", False) else ""
