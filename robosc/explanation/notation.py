"""Notation of values and runs in explanations."""

from collections.abc import Collection, Sequence

from robosc.expressions import Value
from robosc.expressions.text import expression_text
from robosc.model.structure import Requirement, RequirementForm

MAXIMUM_EVENTS = 30
"""Events of a run that a text shows."""


def value_text(value: Value) -> str:
    """A value as the language writes it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def events_text(events: Sequence[str]) -> str:
    """Events of a run, cut where it is long."""
    shown = ", ".join(events[:MAXIMUM_EVENTS])
    return shown + (f", ... ({len(events)} in all)" if len(events) > MAXIMUM_EVENTS else "")


def requirement_text(item: Requirement, components: Collection[str]) -> str:
    """A requirement on requests, as the language writes it.

    Args:
        item: The requirement.
        components: Names of all components.
    """
    names = item.communications
    shown = names[0] if len(names) == 1 else f"{{{', '.join(names)}}}"
    expression = expression_text(item.expression, components)
    if item.form is RequirementForm.NEEDS:
        return f"requirement {shown} needs {expression}"
    return f"requirement {expression} disables {shown}"
