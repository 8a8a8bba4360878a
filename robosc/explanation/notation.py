"""Notation of values and runs in explanations."""

from collections.abc import Sequence

from robosc.expressions import Value

MAXIMUM_EVENTS = 30
"""Events of a run that a text shows."""

MAXIMUM_TEXT = 300
"""Characters of a text of the model that a sentence repeats."""

MAXIMUM_NAMES = 8
"""Names, and values, that a sentence lists."""


def value_text(value: Value) -> str:
    """A value as the language writes it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def events_text(events: Sequence[str]) -> str:
    """Events of a run, shortened if it is long."""
    shown = ", ".join(events[:MAXIMUM_EVENTS])
    return shown + (f", ... ({len(events)} in all)" if len(events) > MAXIMUM_EVENTS else "")


def cut(text: str) -> str:
    """A text of the model, shortened if it is long."""
    return text if len(text) <= MAXIMUM_TEXT else text[: MAXIMUM_TEXT - 4] + " ..."


def listed(names: Sequence[str]) -> str:
    """Names joined by `or`, at least one; only the first ones if there are very many."""
    shown = names[:MAXIMUM_NAMES]
    more = "" if len(names) <= MAXIMUM_NAMES else f" or {len(names) - MAXIMUM_NAMES} more"
    return (
        ", ".join(shown[:-1]) + (" or " if len(shown) > 1 and not more else ", " * (len(shown) > 1)) + shown[-1] + more
    )


def bracketed(words: Sequence[str]) -> str:
    """Values that were read, in brackets after a blank; empty if there are none."""
    shown = ", ".join(words[:MAXIMUM_NAMES]) + (", ..." if len(words) > MAXIMUM_NAMES else "")
    return f" ({shown})" if shown else ""
