"""How explanations write values and runs."""

from collections.abc import Sequence

from robosc.expressions import Value

MAXIMUM_EVENTS = 30
"""Events of a run that a text shows."""


def value_text(value: Value) -> str:
    """A value as the language writes it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def events_text(events: Sequence[str]) -> str:
    """Events of a run, cut where it is long."""
    shown = ", ".join(events[:MAXIMUM_EVENTS])
    return shown + (f", ... ({len(events)} in all)" if len(events) > MAXIMUM_EVENTS else "")
