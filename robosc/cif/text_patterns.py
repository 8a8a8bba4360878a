"""Values as texts, by a pattern of CIF's function `fmt`."""

import re
from collections.abc import Callable, Sequence
from typing import Any

from robosc.cif.terms import Term
from robosc.cif.types import CifType

_SPECIFIER = re.compile(r"%(?:([1-9][0-9]?)\$)?([-+ 0,]*)([0-9]{0,3})(?:\.([0-9]{1,2}))?([bdxXeEfgGs%])|%|[^%]+")
_KINDS = {"b": ("bool",), "d": ("int",), "x": ("int",)} | dict.fromkeys("efg", ("int", "real"))


def formatted(pattern: str, values: Sequence[Term], text: Callable[[Any, CifType], str]) -> str:
    """The text of a pattern with values put in.

    Args:
        pattern: The pattern, with a specifier such as `%d` or `%2$.3f` for each value.
        values: Values, which are static.
        text: Gives a value as the language writes it.

    Raises:
        ValueError: The pattern is none, or does not fit the values; the message says why.
    """
    found = []
    following = 0
    for match in _SPECIFIER.finditer(pattern):
        position, flags, width, precision, kind = match.groups()
        if kind is None:
            if match[0] == "%":
                raise ValueError(f"'{pattern[match.start() : match.start() + 8]}' is no specifier")
            found.append(match[0])
        elif kind == "%":
            found.append("%")
        else:
            index = int(position) - 1 if position else following
            following += not position
            if index >= len(values):
                raise ValueError(f"'{match[0]}' has no value")
            found.append(_one(match[0], values[index], flags, width, precision, kind, text))
    return "".join(found)


def _one(
    whole: str,
    term: Term,
    flags: str,
    width: str,
    precision: str | None,
    kind: str,
    text: Callable[[Any, CifType], str],
) -> str:
    if term.type.kind not in _KINDS.get(kind.lower(), (term.type.kind,)):
        raise ValueError(f"'{whole}' does not take {term.type}")
    if precision is not None and kind in "bdxXs":
        raise ValueError(f"'{whole}' has a precision, which is for real numbers")
    fill = "<" if "-" in flags else "0>" if "0" in flags and kind in "xX" else "0=" if "0" in flags else ">"
    if kind in "bs":
        return format(text(term.value, term.type), f"{'<' if '-' in flags else '>'}{width}")
    if kind in "xX":
        return format(format(term.value & 0xFFFFFFFF, kind), f"{fill}{width}")
    sign = "+" if "+" in flags else " " if " " in flags else ""
    comma = "," if "," in flags and kind in "df" else ""
    value = term.value if kind == "d" else float(term.value)
    return format(value, f"{fill}{sign}{width}{comma}{'' if kind == 'd' else '.' + (precision or '6')}{kind}")
