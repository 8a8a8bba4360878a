"""Typed expressions of generated code: trees that know their sort, their range and how they can be unknown.

A generator builds expressions, asks them which variables they read, and prints them at the end. A `Language` defines
the form of every operation in one programming language, and adds parentheses where operators need them.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from math import copysign

from robosc.expressions import MAXIMUM_INTEGER, MINIMUM_INTEGER, BooleanType, DoubleType, EnumType, IntegerType, Type


class Sort(Enum):
    """Sort of a value, as far as the choice of operators goes."""

    BOOLEAN = "boolean"
    INTEGER = "integer"
    DOUBLE = "double"
    ENUM = "enum"
    TEXT = "text"


class Unknown(Enum):
    """Way in which a value can be unknown at run time."""

    NEVER = "never"
    NAN = "as NaN"
    VALUE = "as a value that stands for it"


class Kind(Enum):
    """Kind of a piece of code."""

    PLACE = "place"
    LITERAL = "literal"
    SIGNED = "literal with a sign"
    CALL = "call"
    OPERATION = "operation"


@dataclass(frozen=True, slots=True)
class Code:
    """An expression and what is known about its value.

    Attributes:
        kind: Kind of the outermost piece.
        word: Text of a place or a literal, name of a function or an operation.
        operands: Arguments of a function or operands of an operation; of a place what it is a part of, if anything.
        sort: Sort of the value that it yields.
        unknown: Way in which it can be unknown.
        low: Least value of an integer.
        high: Greatest value of an integer.
    """

    kind: Kind
    word: str
    operands: tuple["Code", ...] = ()
    sort: Sort = field(default=Sort.BOOLEAN, compare=False)
    unknown: Unknown = field(default=Unknown.NEVER, compare=False)
    low: int = field(default=MINIMUM_INTEGER, compare=False)
    high: int = field(default=MAXIMUM_INTEGER, compare=False)

    @property
    def is_known(self) -> bool:
        """True if it can never be unknown."""
        return self.unknown is Unknown.NEVER

    @property
    def is_literal(self) -> bool:
        """True if it is a constant."""
        return self.kind in (Kind.LITERAL, Kind.SIGNED)

    def is_within(self, low: int, high: int) -> bool:
        """Return True if it is known and an integer in a range, whatever happens."""
        return self.is_known and low <= self.low and self.high <= high

    def typed(self, type_: Type, unknown: Unknown = Unknown.NEVER) -> "Code":
        """The same expression, which yields a value of a type."""
        return replace(self, sort=sort_of(type_), unknown=unknown, low=bounds_of(type_)[0], high=bounds_of(type_)[1])

    def held_in(self, name: str) -> "Code":
        """The code of a local variable that holds its value."""
        return replace(self, kind=Kind.PLACE, word=name, operands=())

    def pieces(self) -> Iterator["Code"]:
        """The expression and everything in it."""
        stack = [self]
        while stack:
            code = stack.pop()
            yield code
            stack += code.operands


def sort_of(type_: Type) -> Sort:
    """The sort of a type's values."""
    match type_:
        case BooleanType():
            return Sort.BOOLEAN
        case IntegerType():
            return Sort.INTEGER
        case DoubleType():
            return Sort.DOUBLE
        case EnumType():
            return Sort.ENUM
        case _:
            return Sort.TEXT


def bounds_of(type_: Type) -> tuple[int, int]:
    """The least and greatest integer of a type; those of 32 bits where it has no range."""
    match type_:
        case IntegerType(low=int(low), high=int(high)):
            return low, high
        case _:
            return MINIMUM_INTEGER, MAXIMUM_INTEGER


def place(text: str, type_: Type, unknown: Unknown = Unknown.NEVER) -> Code:
    """The code of a place (a member or a local variable) that holds a value of a type."""
    return Code(Kind.PLACE, text).typed(type_, unknown)


def words_of(codes: Iterable[Code]) -> set[str]:
    """The places that expressions read, and the functions that they call."""
    return {piece.word for code in codes for piece in code.pieces() if piece.kind in (Kind.PLACE, Kind.CALL)}


def variable(name: str, sort: Sort = Sort.BOOLEAN) -> Code:
    """The code of a local variable of the generator's own."""
    return Code(Kind.PLACE, name, sort=sort)


def literal(text: str, sort: Sort, value: int | None = None, is_signed: bool = False) -> Code:
    """The code of a constant; of an integer with its value."""
    low, high = (MINIMUM_INTEGER, MAXIMUM_INTEGER) if value is None else (value, value)
    return Code(Kind.SIGNED if is_signed else Kind.LITERAL, text, (), sort, low=low, high=high)


def integer(value: int) -> Code:
    """An integer in plain digits."""
    return literal(str(value), Sort.INTEGER, value, value < 0)


def double(value: float) -> Code:
    """A double in the fewest digits that distinguish it from every other."""
    return literal(repr(value), Sort.DOUBLE, is_signed=copysign(1, value) < 0)


def call(function: str, *arguments: Code, sort: Sort = Sort.BOOLEAN, unknown: Unknown = Unknown.NEVER) -> Code:
    """A call of a function."""
    return Code(Kind.CALL, function, arguments, sort, unknown)


def operation(operator: str, *operands: Code, sort: Sort = Sort.BOOLEAN, unknown: Unknown = Unknown.NEVER) -> Code:
    """An operation of the language."""
    return Code(Kind.OPERATION, operator, operands, sort, unknown)


TRUE_CODE = operation("true")
FALSE_CODE = operation("false")

CHAINS = ("and", "or", "list")
"""Operations that join any number of operands."""


@dataclass(frozen=True, slots=True)
class Shape:
    """Form of an operation in a language.

    Attributes:
        text: Text with a pair of braces for each operand; of a chain, what stands between two of them.
        level: Binding strength; a larger number binds tighter.
        needs: Binding strength that each operand needs in order to stand without parentheses; of a chain, that of all.
    """

    text: str
    level: int
    needs: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Language:
    """Printer of expressions.

    Attributes:
        shapes: The shape of every operation.
        sign: Binding strength of a negative literal.
        atom: Binding strength of what never needs parentheses.
    """

    shapes: Mapping[str, Shape]
    sign: int
    atom: int

    def text(self, code: Code) -> str:
        """The text of an expression."""
        if code.kind is Kind.CALL:
            return f"{code.word}({', '.join([self.text(item) for item in code.operands])})"
        if code.kind is not Kind.OPERATION:
            return code.word
        shape = self.shapes[code.word]
        if code.word in CHAINS:
            return shape.text.join([self.within(item, shape.needs[0]) for item in code.operands])
        operands = [self.within(item, need) for item, need in zip(code.operands, shape.needs, strict=True)]
        return shape.text.format(*operands)

    def within(self, code: Code, level: int) -> str:
        """The text, in parentheses unless it binds at least as tightly as `level`."""
        return self.text(code) if self._level(code) >= level else f"({self.text(code)})"

    def _level(self, code: Code) -> int:
        if code.kind is Kind.OPERATION:
            return self.shapes[code.word].level
        return self.sign if code.kind is Kind.SIGNED else self.atom
