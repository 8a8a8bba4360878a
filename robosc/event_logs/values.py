"""Values in the states of an event log: paths to them, and the kind that all values of a variable have in common."""

import json
from collections.abc import Iterator, Mapping, Set
from enum import Enum
from typing import Any

Path = tuple[str, ...]
"""Names that lead to a value: component, variable, and fields of an object."""

_DEEPEST = 8
_INT64 = 1 << 63
_NONFINITE = frozenset({"nan", "inf", "-inf"})


class Kind(Enum):
    """Kind of a value; its value is the name of the message of `std_msgs` that holds it."""

    BOOLEAN = "Bool"
    INTEGER = "Int64"
    NUMBER = "Float64"
    TEXT = "String"
    NONFINITE = "nan, inf and -inf, which logs write as texts"

    @property
    def is_number(self) -> bool:
        """True if a curve can be drawn of such values."""
        return self in (Kind.INTEGER, Kind.NUMBER)


def leaves(value: Any, path: Path) -> Iterator[tuple[Path, Any]]:
    """Return the values of an object's fields, each with its path; unknown ones (None) are left out."""
    if isinstance(value, Mapping) and len(path) < _DEEPEST:
        for name, part in value.items():
            yield from leaves(part, (*path, str(name)))
    elif value is not None:
        yield path, value


def kind_of(value: Any) -> Kind:
    """Return the kind of a value."""
    match value:
        case bool():
            return Kind.BOOLEAN
        case int():
            # A longer one fits no message, and perhaps no float.
            return Kind.INTEGER if -_INT64 <= value < _INT64 else Kind.TEXT
        case float():
            return Kind.NUMBER
        case str() if value in _NONFINITE:
            return Kind.NONFINITE
        case _:
            return Kind.TEXT


def common_kind(kinds: Set[Kind]) -> Kind:
    """Return the kind, not `NONFINITE`, of a variable whose values are of these kinds."""
    if len(kinds) == 1 and Kind.NONFINITE not in kinds:
        (kind,) = kinds
        return kind
    numbers = {kind for kind in kinds if kind.is_number}
    return Kind.NUMBER if numbers and kinds <= numbers | {Kind.NONFINITE} else Kind.TEXT


def as_kind(value: Any, kind: Kind) -> Any:
    """Return a value of a variable of this kind as a bool, int, float or text."""
    if kind is Kind.NUMBER:
        return float(value)
    return text_of(value) if kind is Kind.TEXT else value


def text_of(value: Any) -> str:
    """Return a value as a text: texts as they are, all else as JSON."""
    return value if isinstance(value, str) else json.dumps(value)
