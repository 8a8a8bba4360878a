"""Expressions and data in the language's own words, for comments and messages."""

from robosc.expressions import Expression, children
from robosc.expressions.text import expression_text
from robosc.model.structure import ObjectValue, ProvidedValue
from robosc.targets.cif.text import shortened

_MAXIMUM_DEPTH = 300
"""Levels beyond which an expression is not shown."""


def expression_words(expression: Expression) -> str:
    """An expression as its author would write it, cut where it is long."""
    return shortened(expression_text(expression)) if _is_shallow(expression) else "..."


def data_words(value: ProvidedValue) -> str:
    """Provided data as its author would write it, cut where it is long."""
    return shortened(_data_text(value))


def _data_text(value: ProvidedValue) -> str:
    if not isinstance(value, ObjectValue):
        return expression_words(value)
    return f"{{ {', '.join(f'{name}: {_data_text(inner)}' for name, inner in value.properties)} }}"


def _is_shallow(expression: Expression) -> bool:
    """Return True if an expression is shallow enough to be gone down recursively."""
    level = [expression]
    for _ in range(_MAXIMUM_DEPTH):
        level = [child for node in level for child in children(node)]
        if not level:
            return True
    return False
