"""Values as texts, by a pattern of CIF's function `fmt`."""

import re
from collections.abc import Callable, Sequence
from typing import Any

from robosc.cif.terms import Term
from robosc.cif.types import CifType

_SPECIFIER = re.compile(r"%(?:([1-9][0-9]*)\$)?([-+ 0,]*)([1-9][0-9]*)?(?:\.([0-9]+))?([bBsSdxXeEfgG%])|%|[^%]+")
_KINDS = {"b": "bool", "d": "int", "x": "int"} | dict.fromkeys("efg", "real")
_FLAGS = {"b": "-", "s": "-", "x": "-0", "d": "-+ 0,", "e": "-+ 0", "f": "-+ 0,", "g": "-+ 0,", "%": ""}
_LONGEST = 1000
"""Digits or characters of a value beyond which a pattern is refused."""


def formatted(pattern: str, values: Sequence[Term], text: Callable[[Any, CifType], str]) -> str | None:
    """The text of a pattern with values put in; None if not all of them are known beforehand.

    Args:
        pattern: The pattern, with a specifier such as `%d` or `%2$.3f` for each value.
        values: Values.
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
            continue
        _check(match[0], flags, width, precision, kind)
        if kind == "%":
            if match[0] != "%%":
                raise ValueError(f"'{match[0]}' has more than its two signs")
            found.append("%")
            continue
        index = following
        if position:
            index = int(position[:6]) - 1
        else:
            following += 1
        if index >= len(values):
            raise ValueError(f"'{match[0]}' has no value")
        found.append(_one(match[0], values[index], flags, width or "", precision, kind, text))
    return "".join(found) if all(value.is_static for value in values) else None


def _check(whole: str, flags: str, width: str | None, precision: str | None, kind: str) -> None:
    """Refuse flags that contradict each other or mean nothing."""
    if len(set(flags)) < len(flags):
        raise ValueError(f"'{whole}' has a flag twice")
    for one, other in ("-0", "+ "):
        if one in flags and other in flags:
            raise ValueError(f"'{whole}' has the flags '{one}' and '{other}', which contradict each other")
    if width is None and ("-" in flags or "0" in flags):
        raise ValueError(f"'{whole}' has a flag that needs a width")
    if set(flags) - set(_FLAGS[kind.lower()]):
        raise ValueError(f"'{whole}' has a flag that it does not take")
    if precision is not None and kind.lower() in "bdxs":
        raise ValueError(f"'{whole}' has a precision, which is for real numbers")
    if any(len(number) > 4 or int(number) > _LONGEST for number in (width, precision) if number):
        raise ValueError(f"'{whole}' makes a text of more than {_LONGEST} characters")


def _one(
    whole: str,
    term: Term,
    flags: str,
    width: str,
    precision: str | None,
    kind: str,
    text: Callable[[Any, CifType], str],
) -> str:
    if term.type.kind != _KINDS.get(kind.lower(), term.type.kind) or term.type.kind == "automaton":
        raise ValueError(f"'{whole}' does not take {term.type}")
    if not term.is_static:
        return ""
    return _padded(_digits(term, flags, precision, kind, text), flags, int(width or "0"))


def _digits(term: Term, flags: str, precision: str | None, kind: str, text: Callable[[Any, CifType], str]) -> str:
    """A value without what its width adds."""
    if kind in "bBsS":
        found = text(term.value, term.type)
        return found.upper() if kind.isupper() else found
    if kind in "xX":
        return format(term.value & 0xFFFFFFFF, kind)
    sign = "+" if "+" in flags else " " if " " in flags else ""
    comma = "," if "," in flags else ""
    if kind == "d":
        return format(term.value, f"{sign}{comma}d")
    if kind in "gG":
        return _general(term.value, sign, comma, int(precision or "6") or 1, "e" if kind == "g" else "E")
    return format(term.value, f"{sign}{comma}.{precision or '6'}{kind}")


def _padded(digits: str, flags: str, width: int) -> str:
    if "-" in flags:
        return digits.ljust(width)
    if "0" not in flags:
        return digits.rjust(width)
    # Zeros that fill a width stand behind the sign, without commas.
    sign = digits[: digits[:1] in ("+", "-", " ")]
    return sign + digits[len(sign) :].rjust(width - len(sign), "0")


def _general(value: float, sign: str, comma: str, figures: int, kind: str) -> str:
    """A number with as many figures, in powers of ten where it is below 1e-4 or has more; zeros are kept."""
    scientific = format(value, f"{sign}.{figures - 1}{kind}")
    power = int(scientific.lower().partition("e")[2]) if value else 0
    if not -4 <= power < figures:
        return scientific
    return format(value, f"{sign}{comma}.{max(0, figures - 1 - power)}f")
