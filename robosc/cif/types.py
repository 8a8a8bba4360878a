"""Types of CIF."""

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
        """Least and greatest integer."""
        return (
            MINIMUM_INTEGER if self.low is None else self.low,
            MAXIMUM_INTEGER if self.high is None else self.high,
        )

    @property
    def is_finite(self) -> bool:
        """True if a variable of a model for synthesis may have it."""
        return self.kind in ("bool", "enum") or (self.kind == "int" and self.low is not None)

    def __str__(self) -> str:
        match self.kind:
            case "int":
                return "int" if self.low is None else f"int[{self.low}..{self.high}]"
            case "enum":
                return self.name
            case "list":
                bounds = "" if self.low is None else f"[{self.low}..{self.high}]"
                return f"list{bounds} {self.parts[0]}"
            case "set" | "dist":
                return f"{self.kind} {self.parts[0]}"
            case "dict":
                return f"dict({self.parts[0]}: {self.parts[1]})"
            case "tuple":
                return f"tuple({', '.join(map(str, self.parts))})"
            case _:
                return self.kind


BOOL, REAL, STRING, AUTOMATON, UNKNOWN = map(CifType, ("bool", "real", "string", "automaton", "unknown"))


def integer(low: int, high: int) -> CifType:
    """Integers of a range."""
    return CifType("int", low, high)


def is_compatible(one: CifType, other: CifType) -> bool:
    """Return True if two types are equal, ranges and names aside."""
    if "unknown" in (one.kind, other.kind):
        return True
    if one.kind != other.kind or len(one.parts) != len(other.parts):
        return False
    if one.kind == "enum" and one.names != other.names:
        return False
    return all(is_compatible(a, b) for a, b in zip(one.parts, other.parts, strict=True))


def _related(value: CifType, target: CifType) -> bool | None:
    """Return True if a value may stand for another whatever the ranges, False if never; None: the ranges decide."""
    if (value.kind, target.kind) == ("int", "real") or "unknown" in (value.kind, target.kind):
        return True
    return None if is_compatible(value, target) else False


def fits(value: CifType, target: CifType) -> bool:
    """Return True if every value of a type is one of another: what constants and arguments need."""
    related = _related(value, target)
    if related is not None:
        return related
    if value.kind in ("int", "list") and target.low is not None:
        if value.kind == "int" or value.low is not None:
            low, high = value.range
            if low < target.range[0] or high > target.range[1]:
                return False
        elif value.kind == "list":
            return False
    return all(fits(a, b) for a, b in zip(value.parts, target.parts, strict=True))


def overlaps(value: CifType, target: CifType) -> bool:
    """Return True if an expression of one type may be assigned to a variable of another."""
    related = _related(value, target)
    if related is not None:
        return related
    if value.kind == "int":
        return max(value.range[0], target.range[0]) <= min(value.range[1], target.range[1])
    return all(overlaps(a, b) for a, b in zip(value.parts, target.parts, strict=True))


def joined(one: CifType, other: CifType) -> CifType | None:
    """The type of values of two types, such as those of the branches of an `if`; None if there is none."""
    if "unknown" in (one.kind, other.kind):
        return other if one.kind == "unknown" else one
    if {one.kind, other.kind} == {"int", "real"}:
        return REAL
    if not is_compatible(one, other):
        return None
    low = high = None
    if one.kind in ("int", "list") and one.low is not None and other.low is not None:
        low, high = min(one.low, other.low), max(one.range[1], other.range[1])
    parts = tuple(joined(a, b) or UNKNOWN for a, b in zip(one.parts, other.parts, strict=True))
    return CifType(one.kind, low, high, parts, one.names, one.name)
