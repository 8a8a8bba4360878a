"""Results of jobs: their checks, as JSON, on the terminal and in files."""

import argparse
import sys
from collections.abc import Collection
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from robosc.certification.goals import GoalExplanation
from robosc.certification.reasons import reasons_json
from robosc.cli import automata
from robosc.cli.output import CommandError, ExitCode, UsageError, print_diagnostics, print_json, write_bytes
from robosc.cli.synth import report_reasons
from robosc.errors import Diagnostic
from robosc.json_documents import accepted_json, counts_text, diagnostics_json, json_text
from robosc.model.structure import Deployment
from robosc.pipeline.findings import Findings
from robosc.pipeline.results import NoSupervisor
from robosc.source import Bundle, SourceFile, visible
from robosc.targets import write_files
from robosc_client import Explained, Exploration, Formatted, Generation, Job, Synthesis, TaskResult, Verification
from robosc_client.commands.signature_checks import require_signature
from robosc_client.commands.supervisor_file import write_supervisor

if TYPE_CHECKING:
    from robosc.pipeline.systems import SystemSupervisor
    from robosc.signatures import PublicKey


def require_sound(arguments: argparse.Namespace, found: TaskResult, keys: "Collection[PublicKey]") -> None:
    """Do nothing if a supervisor that was found is one, and is as the arguments want it.

    Raises:
        CommandError: None of the keys has signed it, or it is no supervisor where one is wanted.
        ServiceError: The supervisor is no valid one, or for another deployment.
    """
    from robosc_client.outcomes import decoded, require_deployment

    supervisor = decoded(found.supervisor) if isinstance(found, Synthesis) and found.supervisor else None
    if supervisor is None or not isinstance(found, Synthesis):
        # Other results, such as graphs and reports, have no signature.
        if keys or arguments.deployment:
            raise CommandError(
                "the job has no supervisor, but --signed-by or --deployment requires one", ExitCode.SERVICE
            )
        return
    if arguments.deployment:
        require_deployment(supervisor, Deployment(arguments.deployment))
    if keys:
        require_signature(keys, found.supervisor, found.signature)


def sound_automata(
    arguments: argparse.Namespace, found: Synthesis, keys: "Collection[PublicKey]"
) -> "SystemSupervisor":
    """Return the supervisor of automata that a job has made, as the arguments want it.

    Raises:
        UsageError: An argument means nothing for it.
        CommandError: None of the keys has signed it.
        ServiceError: It is no valid one.
    """
    from robosc_client.outcomes import automata_supervisor_of

    automata.refuse(bool(arguments.deployment), "--deployment: automata are not a node of a robot")
    automata.refuse_output(arguments.output)
    supervisor = automata_supervisor_of(found.supervisor)
    if keys:
        require_signature(keys, found.supervisor, found.signature)
    return supervisor


def report_nothing(
    job: Job, found: Synthesis | Generation | Exploration | Verification | Explained | Formatted
) -> None:
    """Report why there is nothing to write, like the corresponding command."""
    if isinstance(found, Verification | Explained | Formatted):
        print_diagnostics(found.diagnostics, None)
        if not isinstance(found, Formatted) and found.reason:
            sys.stderr.write(f"{job.main_file}: {visible(found.reason)}\n")
        return
    from robosc_client.outcomes import outcome_from_response

    made = outcome_from_response(found)
    print_diagnostics(made.diagnostics, None)
    report_reasons(made, Bundle(SourceFile(job.main_file, "")))


def result_json(found: TaskResult) -> dict[str, Any]:
    """Return the result of a job as JSON values; content that is no text is only written by -o."""
    import msgspec

    from robosc.explanation import document

    match found:
        case tuple():
            return _findings_json(found)
        case Verification():
            return dict(found.report) or {"status": str(found.status), "reason": found.reason}
        case Formatted():
            return {"text": found.text, **diagnostics_json(found.diagnostics)}
        case Explained():
            why = found.explanation
            summary: dict[str, Any] = {"status": str(found.status), "reason": found.reason, "explanation": None}
            if isinstance(why, GoalExplanation):
                summary["goals"] = why.document()
            elif not isinstance(why, NoSupervisor):
                summary["explanation"] = document(why)
            return {**summary, **diagnostics_json(found.diagnostics)}
    result = {"status": str(found.status), **reasons_json(found), **_findings_json(found.diagnostics)}
    match found:
        case Synthesis():
            result["summary"] = found.summary and found.summary.text
            if found.summary and found.summary.goals:
                result["goals"] = asdict(found.summary.goals)
        case Generation():
            result["files"] = list(found.files or ())
        case Exploration():
            result["graph"] = found.graph and msgspec.to_builtins(found.graph)
    return result


def _findings_json(found: tuple[Diagnostic, ...]) -> dict[str, object]:
    """The findings of a result, and those that the model accepts, as JSON values."""
    return {**diagnostics_json(found), **(accepted_json(found.accepted) if isinstance(found, Findings) else {})}


def print_result(job: Job, found: TaskResult) -> None:
    """Print the result of a job."""
    if isinstance(found, Formatted) and found.text is not None:
        # Byte for byte to a file or program; without control characters to a terminal.
        sys.stdout.write(_printable(found.text) if sys.stdout.isatty() else found.text)
        return
    if isinstance(found, tuple):
        print_diagnostics(found, None)
        if not found:
            sys.stdout.write(f"{visible(job.main_file)}: {counts_text(found)}\n")
        return
    if isinstance(found, Synthesis | Generation | Exploration) and not is_success(found):
        print_diagnostics(found.diagnostics, None)
    print_json(result_json(found))


def _printable(text: str) -> str:
    """Return the lines of a text as a terminal may show them."""
    return "\n".join("\t".join(map(visible, line.split("\t"))) for line in text.split("\n"))


def is_success(found: TaskResult) -> bool:
    """Return True if the corresponding command would end with 0."""
    match found:
        case tuple():
            return not any(item.severity == "error" for item in found)
        case Verification():
            return found.status == "passed"
        case Formatted():
            return found.text is not None
    return found.status == "supervisor"


def write_result(arguments: argparse.Namespace, found: TaskResult, supervisor: "SystemSupervisor | None") -> bool:
    """Write the result of a job; return False if there is nothing to write.

    Args:
        arguments: Arguments of the command.
        found: The result.
        supervisor: Supervisor of automata in the result, whose controlled system is written; None: there is none.

    Raises:
        UsageError: It cannot be written, or is never anything for a file.
    """
    import msgspec

    match found:
        case tuple():
            raise UsageError("a check has no result file: use --result to print its findings")
        case Synthesis() if supervisor is not None and arguments.output.suffix != automata.SUPERVISOR:
            write_bytes(arguments.output, automata.controlled_system(supervisor, arguments.output.suffix))
        case Synthesis() if found.supervisor:
            write_supervisor(arguments.output, found.supervisor, found.signature)
        case Generation() if found.files is not None:
            write_files(found.files, arguments.output, arguments.force)
        case Exploration() if found.graph is not None:
            write_bytes(arguments.output, json_text(msgspec.to_builtins(found.graph)).encode("utf-8"))
        case Verification() if found.report:
            write_bytes(arguments.output, json_text(found.report).encode("utf-8"))
        case Explained() if not isinstance(found.explanation, NoSupervisor):
            write_bytes(arguments.output, json_text(result_json(found)).encode("utf-8"))
        case Formatted() if found.text is not None:
            write_bytes(arguments.output, found.text.encode("utf-8"))
        case _:
            return False
    return True
