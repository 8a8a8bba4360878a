"""Types of CIF."""

from collections.abc import Callable
from dataclasses import dataclass, field
from operator import eq

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
        size: Number of types that it is made of, itself included.
    """

    kind: str
    low: int | None = None
    high: int | None = None
    parts: tuple["CifType", ...] = ()
    names: tuple[str, ...] = ()
    name: str = ""
    size: int = field(init=False, compare=False, default=1)

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", 1 + sum(part.size for part in self.parts))

    @property
    def is_number(self) -> bool:
        """True for integers and reals."""
        return self.kind in ("int", "real")

    @property
    def range(self) -> tuple[int, int]:
        """Least and greatest integer, or length of a list."""
        if self.low is None or self.high is None:
            return (0 if self.kind == "list" else MINIMUM_INTEGER), MAXIMUM_INTEGER
        return self.low, self.high

    @property
    def has_equality(self) -> bool:
        """True if values of it can be compared."""
        return self.kind not in ("func", "dist", "void", "automaton") and all(part.has_equality for part in self.parts)

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


Relation = Callable[[tuple[int, int], tuple[int, int]], bool]
"""Question about two ranges of integers, or about lengths of lists."""


def _is_within(value: tuple[int, int], target: tuple[int, int]) -> bool:
    return target[0] <= value[0] and value[1] <= target[1]


def _meets(value: tuple[int, int], target: tuple[int, int]) -> bool:
    return value[0] <= target[1] and target[0] <= value[1]


def _related(value: CifType, target: CifType, relation: Relation) -> bool:
    """Return True if values of one type may stand for those of another, by what is asked of their ranges."""
    if "unknown" in (value.kind, target.kind):
        return True
    if value.kind != target.kind or len(value.parts) != len(target.parts):
        return False
    if value.kind == "enum" and value.names != target.names:
        return False
    if value.kind in ("int", "list") and not relation(value.range, target.range):
        return False
    # The result of a function that is assigned must fit wherever it is called.
    first = _is_within if value.kind == "func" and relation is _meets else relation
    pairs = zip(value.parts, target.parts, strict=True)
    return all(_related(*pair, relation if place else first) for place, pair in enumerate(pairs))


def is_compatible(one: CifType, other: CifType) -> bool:
    """Return True if two types are equal, ranges and names aside."""
    return _related(one, other, lambda _, __: True)


def is_equal(one: CifType, other: CifType) -> bool:
    """Return True if two types are equal, names aside."""
    return _related(one, other, eq)


def fits(value: CifType, target: CifType) -> bool:
    """Return True if every value of a type is one of another: what constants and arguments need."""
    return _related(value, target, _is_within)


def overlaps(value: CifType, target: CifType) -> bool:
    """Return True if an expression of one type may be assigned to a variable of another."""
    return _related(value, target, _meets)


def merged(one: CifType, other: CifType) -> CifType:
    """The type of values of two compatible types, such as those of the branches of an `if`; fields lose their names."""
    if "unknown" in (one.kind, other.kind):
        return other if one.kind == "unknown" else one
    low = high = None
    if one.low is not None and other.low is not None:
        low, high = min(one.low, other.low), max(one.range[1], other.range[1])
    parts = tuple(map(merged, one.parts, other.parts))
    return CifType(one.kind, low, high, parts, one.names if one.kind == "enum" else (), one.name)


def declared(written: CifType, value: CifType) -> CifType:
    """The type of a constant or algebraic variable: that of its declaration, of its value for integers of no range."""
    return value if written.kind == value.kind == "int" and written.low is None else written
