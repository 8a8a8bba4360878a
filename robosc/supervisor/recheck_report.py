"""Findings about a supervisor that was handed over, for machines."""

from robosc.errors import InvalidSupervisorError
from robosc.json_documents import diagnostics_json
from robosc.signatures import SignatureError
from robosc.supervisor.recheck import Fault, Recheck
from robosc.supervisor.structure import Supervisor


def has_passed(found: Recheck, *, is_strict: bool) -> bool:
    """Return True if a supervisor has passed.

    Args:
        found: Findings about it.
        is_strict: True if everything must have been checked, permissiveness too.
    """
    return found.has_passed and not (is_strict and found.unchecked())


def recheck_json(found: Recheck, supervisor: Supervisor, *, is_strict: bool) -> dict[str, object]:
    """Return the findings as JSON values; `status` is `passed`, `failed` or `not checked`."""
    judgement = found.judgement
    is_right = has_passed(found, is_strict=is_strict)
    return {
        "status": "passed" if is_right else "failed" if found.faults or found.diagnostics else "not checked",
        "model": supervisor.model.name,
        "deployment": str(supervisor.deployment),
        "checks": {name: str(outcome) for name, outcome in found.outcomes().items()},
        "faults": [_fault_json(fault) for fault in found.faults],
        "remarks": list(found.notes),
        "states": judgement.verification.states if judgement else None,
        "transitions": judgement.verification.transitions if judgement else None,
        "method": judgement.method if judgement else None,
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
