"""Model checking of the controlled system: properties in computation tree logic, verdicts, and runs as evidence."""

from robosc.model_checking.checking import verify_properties
from robosc.model_checking.formulas import Property, formula_text
from robosc.model_checking.outcome import EvidenceRun, Remainder, RunKind, Verdict
from robosc.model_checking.report import property_errors_json, verdict_text, verdicts_json
from robosc.model_checking.resolution import properties_of

__all__ = [
    "EvidenceRun",
    "Property",
    "Remainder",
    "RunKind",
    "Verdict",
    "formula_text",
    "properties_of",
    "property_errors_json",
    "verdict_text",
    "verdicts_json",
    "verify_properties",
]
