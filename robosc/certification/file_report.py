"""Report on the verification of a supervisor file, as JSON values and as text."""

from collections.abc import Mapping
from typing import Any

from robosc.certification.supervisor_file import GOALS, Fault, FileVerification, StateInWords
from robosc.errors import InvalidSupervisorError
from robosc.json_documents import diagnostics_json
from robosc.signatures import SignatureError
from robosc.source import visible
from robosc.supervisor import Supervisor
from robosc.verification import CheckOutcome


def has_passed(found: FileVerification, *, is_strict: bool) -> bool:
    """Return True if a supervisor has passed.

    Args:
        found: Findings about it.
        is_strict: True if everything must have been checked, permissiveness too.
    """
    return found.has_passed and not (is_strict and found.unchecked())


def file_verification_json(found: FileVerification, supervisor: Supervisor, *, is_strict: bool) -> dict[str, object]:
    """Return the findings as JSON values; `status` is `passed`, `failed` or `not checked`."""
    report = found.report
    is_right = has_passed(found, is_strict=is_strict)
    return {
        "status": "passed" if is_right else "failed" if found.faults or found.diagnostics else "not checked",
        "model": supervisor.model.name,
        "deployment": str(supervisor.deployment),
        "checks": {name: str(outcome) for name, outcome in found.outcomes().items()},
        "faults": [_fault_json(fault) for fault in found.faults],
        "remarks": list(found.notes),
        "states": report.verification.states if report else None,
        "transitions": report.verification.transitions if report else None,
        "method": found.method if report else None,
        **diagnostics_json(found.diagnostics),
    }


def malformed_json(error: InvalidSupervisorError | SignatureError) -> dict[str, object]:
    """Report as JSON values that a file is no supervisor, or not signed as it must be."""
    return {"status": "failed", "reason": str(error)}


def _fault_json(fault: Fault) -> dict[str, object]:
    document: dict[str, object] = {"check": fault.check, "message": fault.message}
    if fault.trace is not None and fault.state is not None:
        document |= {
            "trace": list(fault.trace),
            "shortest": fault.is_shortest,
            "state": {
                "components": fault.state.components,
                "variables": fault.state.variables,
                "communications": fault.state.communications,
            },
        }
    return document


def file_verification_text(
    document: Mapping[str, Any], supervisor: str = "", model: str = "its model", *, is_quiet: bool = False
) -> str:
    """Return the findings for people, as lines.

    Args:
        document: Document as `file_verification_json` makes it.
        supervisor: Name of the supervisor; empty: the lines begin without one.
        model: Name of the model.
        is_quiet: True if only what is wrong is reported.
    """
    lines: list[str] = []
    checks, is_right = document["checks"], document["status"] == "passed"
    subject = f"{supervisor}: " if supervisor else ""
    if document["diagnostics"]:
        lines.append(f"{subject}failed: the texts hold no model that it could be for")
    elif document["faults"]:
        lines.append(f"{subject}failed: no right supervisor of {model}")
    elif not is_right:
        unchecked = [name.replace("_", " ") for name, outcome in checks.items() if outcome == CheckOutcome.NOT_CHECKED]
        lines.append(f"{subject}not checked: {', '.join(unchecked)}")
    else:
        lines.append(f"{subject}passed: a right supervisor of {model}")
    if not document["diagnostics"] and not is_quiet:
        lines += [f"  {name.replace('_', ' '):<21} {outcome}" for name, outcome in checks.items()]
        if document["method"] is not None:
            figures = [f"{document[name]} {name}" for name in ("states", "transitions") if document[name] is not None]
            lines += [f"  {'controlled':<21} {', '.join(figures) or 'not counted'} ({document['deployment']})"]
            lines.append(f"  {'method':<21} {document['method']}")
    for fault in document["faults"]:
        lines += _fault_lines(fault)
    if not is_quiet:
        lines += [f"note: {note}" for note in document["remarks"]]
    return "" if is_right and is_quiet else "".join(f"{visible(line)}\n" for line in lines)


def _fault_lines(fault: Mapping[str, Any]) -> list[str]:
    name = fault["check"].replace("_", " ")
    if "trace" not in fault:
        return [f"{name}: {fault['message']}"]
    run = "after" if fault["shortest"] else "after (there may be shorter runs)"
    return [
        f"{name if fault['check'] == GOALS else f'not {name}'}: {fault['message']}",
        f"  {run}: {', '.join(fault['trace']) or 'nothing: it is so at the start'}",
        f"  in: {StateInWords(**fault['state']).text()}",
    ]
