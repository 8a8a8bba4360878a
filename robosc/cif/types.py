"""Types of CIF."""

from collections.abc import Callable
from dataclasses import dataclass, field

from robosc.expressions import MAXIMUM_INTEGER, MINIMUM_INTEGER


@dataclass(frozen=True, slots=True)
class CifType:
    """A type.

    Attributes:
        kind: `bool`, `int`, `real`, `string`, `enum`, `list`, `set`, `dict`, `tuple`, `func`, `dist`, `void`,
            `automaton`, or `unknown` behind an error that has been reported.
        low: Least integer, or least length of a list; None where there is no range.
        high: Greatest one.
        parts: Types that it is made of.
        names: Literals of an enum, in order, or fields of a tuple.
        name: Name of an enum.
        is_open: True for a container that is written out: its elements become what is expected of them.
        size: Number of types that it is made of, itself included.
    """

    kind: str
    low: int | None = None
    high: int | None = None
    parts: tuple["CifType", ...] = ()
    names: tuple[str, ...] = ()
    name: str = ""
    is_open: bool = field(compare=False, default=False)
    size: int = field(init=False, compare=False, default=1)

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", 1 + sum(part.size for part in self.parts))

    @property
    def is_number(self) -> bool:
        """True for integers and reals."""
        return self.kind in ("int", "real")

    @property
    def range(self) -> tuple[int, int]:
        """Least and greatest integer."""
        return (
            MINIMUM_INTEGER if self.low is None else self.low,
            MAXIMUM_INTEGER if self.high is None else self.high,
        )

    @property
    def is_finite(self) -> bool:
        """True if a variable of a model for synthesis may have it."""
        if self.kind == "tuple":
            return all(part.is_finite for part in self.parts)
        return self.kind in ("bool", "enum") or (self.kind == "int" and self.low is not None)

    def __str__(self) -> str:
        match self.kind:
            case "int":
                return "int" if self.low is None else f"int[{self.low}..{self.high}]"
            case "enum":
                return self.name
            case "list":
                length = f"{self.low}" if self.low == self.high else f"{self.low}..{self.high}"
                bounds = "" if self.low is None else f"[{length}]"
                return f"list{bounds} {self.parts[0]}"
            case "set" | "dist":
                return f"{self.kind} {self.parts[0]}"
            case "dict":
                return f"dict({self.parts[0]}: {self.parts[1]})"
            case "tuple":
                if not self.names:
                    return f"tuple({', '.join(map(str, self.parts))})"
                return f"tuple({'; '.join(map(' '.join, zip(map(str, self.parts), self.names, strict=True)))})"
            case _:
                return self.kind


BOOL, REAL, STRING, AUTOMATON, UNKNOWN = map(CifType, ("bool", "real", "string", "automaton", "unknown"))


def integer(low: int, high: int) -> CifType:
    """Integers of a range."""
    return CifType("int", low, high)


def _related(value: CifType, target: CifType, ranges: Callable[[CifType, CifType], bool], *, widens: bool) -> bool:
    """Return True if values of one type may stand for those of another, by what is asked of their ranges."""
    if "unknown" in (value.kind, target.kind):
        return True
    if value.kind == "int" and target.kind == "real":
        return widens
    if _is_empty(value) and target.kind == "dict":
        return True
    if value.kind != target.kind or len(value.parts) != len(target.parts):
        return False
    if (value.kind == "enum" and value.names != target.names) or not ranges(value, target):
        return False
    pairs = zip(value.parts, target.parts, strict=True)
    return all(_related(one, other, ranges, widens=value.is_open) for one, other in pairs)


def _is_empty(type_: CifType) -> bool:
    """Return True for the type of `{}`, which is a set or a dictionary."""
    return type_.is_open and type_.kind == "set" and type_.parts[0].kind == "unknown"


def _is_within(value: CifType, target: CifType) -> bool:
    if value.kind not in ("int", "list") or target.low is None:
        return True
    if value.low is None and value.kind == "list":
        return False
    return target.range[0] <= value.range[0] and value.range[1] <= target.range[1]


def _meets(value: CifType, target: CifType) -> bool:
    return value.kind != "int" or max(value.range[0], target.range[0]) <= min(value.range[1], target.range[1])


def is_compatible(one: CifType, other: CifType) -> bool:
    """Return True if two types are equal, ranges and names aside."""
    return _related(one, other, lambda _, __: True, widens=False)


def fits(value: CifType, target: CifType) -> bool:
    """Return True if every value of a type is one of another: what constants and arguments need."""
    return _related(value, target, _is_within, widens=True)


def overlaps(value: CifType, target: CifType) -> bool:
    """Return True if an expression of one type may be assigned to a variable of another."""
    return _related(value, target, _meets, widens=True)


def joined(one: CifType, other: CifType, *, widens: tuple[bool, bool] = (True, True)) -> CifType | None:
    """The type of values of two types, such as those of the branches of an `if`; None if there is none.

    Args:
        one: First type.
        other: Second type.
        widens: True for each of them whose integers may become reals.
    """
    if "unknown" in (one.kind, other.kind):
        return other if one.kind == "unknown" else one
    if {one.kind, other.kind} == {"int", "real"}:
        return REAL if widens[one.kind == "real"] else None
    if _is_empty(one) and other.kind == "dict":
        return other
    if _is_empty(other) and one.kind == "dict":
        return one
    if one.kind != other.kind or len(one.parts) != len(other.parts):
        return None
    if one.kind == "enum" and one.names != other.names:
        return None
    low = high = None
    if one.kind in ("int", "list") and one.low is not None and other.low is not None:
        low, high = min(one.low, other.low), max(one.range[1], other.range[1])
    pairs = zip(one.parts, other.parts, strict=True)
    parts = [joined(a, b, widens=(one.is_open, other.is_open)) for a, b in pairs]
    known = tuple(part for part in parts if part is not None)
    if len(known) < len(parts):
        return None
    names = one.names or other.names
    return CifType(one.kind, low, high, known, names, one.name, is_open=one.is_open and other.is_open)


def declared(written: CifType, value: CifType) -> CifType:
    """The type of a constant or algebraic variable: that of its declaration, of its value for integers of no range."""
    return value if written.kind == value.kind == "int" and written.low is None else written
