"""Expressions as predicates, with three truth values and exact numbers.

Integers are bit vectors. A number that is or may become a double is a partition: a predicate for each value that it can
have. Partitions are exact for every operation, and small because only variables with finitely many values take part.
Their arithmetic is that of `robosc.expressions.values` itself.
"""

from typing import Any

import msgspec

from robosc.automata.state import Subject
from robosc.errors import InternalError, UnsupportedModelError
from robosc.expressions import (
    MAXIMUM_INTEGER,
    MINIMUM_INTEGER,
    Binary,
    BooleanType,
    Call,
    Conditional,
    Constant,
    Element,
    EnumValue,
    Expression,
    IntegerType,
    Quantifier,
    Received,
    Reduction,
    StateTest,
    Unary,
    Value,
    VariableRead,
)
from robosc.expressions.evaluate import BINARY, CALL, UNARY
from robosc.expressions.text import expression_text
from robosc.synthesis.encoding import Bits, Encoding, Inputs, offset_of
from robosc.synthesis.vectors import Arithmetic, Vector, width_for

MAXIMUM_PARTITION = 100_000
"""Different values, or pairs of them, beyond which arithmetic with doubles is refused."""

_COMPARISONS = frozenset({"=", "!=", "<", "<=", ">", ">="})
_NEGATED = frozenset({"!=", "<=", ">="})
"""Comparisons that are worked out as the negation of `=`, or of `<` one way or the other."""


class Truth(msgspec.Struct, frozen=True):
    """A boolean: where it is true and where it is false; elsewhere it is unknown."""

    true: Any
    false: Any


class Number(msgspec.Struct, frozen=True):
    """An integer: its value, and where it is known."""

    vector: Vector
    known: Any


class Partition(msgspec.Struct, frozen=True):
    """A value of any kind: where it has each of its values; elsewhere it is unknown."""

    cases: tuple[tuple[Value, Any], ...]


Symbolic = Truth | Number | Partition


class ExpressionEncoder:
    """Translates the expressions of one encoding.

    Args:
        encoding: The variables.
        inputs: Received data that can be read, by path.
    """

    def __init__(self, encoding: Encoding, inputs: Inputs | None = None) -> None:
        self._encoding = encoding
        self._manager = encoding.manager
        self._arithmetic = Arithmetic(encoding.manager, encoding.pause)
        self._inputs = inputs or {}

    def holds(self, expression: Expression) -> Any:
        """Return the predicate that is true where a condition is true (not unknown)."""
        return self._truth(self.translate(expression)).true

    def translate(self, expression: Expression) -> Symbolic:
        """The value of an expression in every state.

        Raises:
            UnsupportedModelError: Doubles with too many different values.
        """
        match expression:
            case Constant(value=bool(value)):
                yes, no = self._manager.true, self._manager.false
                return Truth(yes, no) if value else Truth(no, yes)
            case Constant(value=int(value)):
                return Number(self._arithmetic.constant(value), self._manager.true)
            case Constant(value=value) | EnumValue(value=value):
                return Partition(((value, self._manager.true),))
            case StateTest(component=component, state=state):
                inside = self._encoding.in_location(component, state)
                return Truth(inside, ~inside)
            case VariableRead(component=component, variable=variable):
                return self._read(self._encoding.subjects[Subject(component, variable)])
            case Received(path=path):
                return self._read(self._inputs[path])
            case Unary(operator=operator, operand=operand):
                return self._unary(operator, self.translate(operand))
            case Binary(operator=operator, left=left, right=right):
                return self._binary(operator, self.translate(left), self.translate(right))
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                test = self._truth(self.translate(condition))
                return self._choose(test, self.translate(then), self.translate(otherwise))
            case Call(function=function, arguments=arguments):
                return self._call(function, [self.translate(item) for item in arguments])
            case Element() | Reduction() | Quantifier():
                # Arrays have infinitely many values, so no synthesis variable is fed by one.
                raise InternalError(f"an array in a synthesis problem: {expression_text(expression)}")

    def _read(self, bits: Bits) -> Symbolic:
        known = self._manager.true if bits.known is None else self._manager.var(bits.known)
        match bits.type:
            case BooleanType():
                value = self._manager.var(bits.names[0])
                return Truth(known & value, known & ~value)
            case IntegerType():
                return Number(self._integer(bits), known)
            case _:
                values = enumerate(bits.domain)
                return Partition(tuple((value, known & self._encoding.code(bits, index)) for index, value in values))

    def _integer(self, bits: Bits) -> Vector:
        offset = offset_of(bits)
        index = self._arithmetic.unsigned(
            [self._manager.var(name) for name in reversed(bits.names)], len(bits.domain) - 1
        )
        return index if offset == 0 else self._arithmetic.add(index, self._arithmetic.constant(offset))

    # Choices and functions

    def _choose(self, test: Truth, then: Symbolic, otherwise: Symbolic) -> Symbolic:
        """Return the value of a conditional expression; unknown where its condition is."""
        yes, no = test.true, test.false
        match then, otherwise:
            case Truth(), Truth():
                return Truth((yes & then.true) | (no & otherwise.true), (yes & then.false) | (no & otherwise.false))
            case Number(), Number():
                vector = self._arithmetic.choose(yes, then.vector, otherwise.vector)
                return Number(vector, (yes & then.known) | (no & otherwise.known))
        first, second = self._partition(then), self._partition(otherwise)
        cases = [(value, yes & predicate) for value, predicate in first.cases]
        return self._collect([*cases, *((value, no & predicate) for value, predicate in second.cases)])

    def _call(self, function: str, arguments: list[Symbolic]) -> Symbolic:
        if function == "clamp":
            value, low, high = arguments
            return self._call("min", [self._call("max", [value, low]), high])
        first = arguments[0]
        if function == "integer" and isinstance(first, Number):
            return first
        if function == "abs" and isinstance(first, Number):
            negative = self._arithmetic.less(first.vector, self._arithmetic.constant(0))
            vector = self._arithmetic.choose(negative, self._arithmetic.negate(first.vector), first.vector)
            most = max(abs(first.vector.low), abs(first.vector.high))
            return self._within_32_bits(self._arithmetic.within(vector, 0, most), first.known)
        if function in ("min", "max") and all(isinstance(item, Number) for item in arguments):
            return self._extreme(function, *arguments)  # type: ignore[arg-type]  # two numbers
        if function == "integer":
            return self._rounded(self._partition(first))
        if len(arguments) == 1:
            cases = self._partition(first).cases
            return self._collect((CALL[function](value), predicate) for value, predicate in cases)
        pairs = self._pairs(self._partition(first), self._partition(arguments[1]))
        return self._collect((CALL[function](a, b), predicate) for a, b, predicate in pairs)

    def _rounded(self, partition: Partition) -> Number:
        """The whole numbers that the values of a partition become."""
        found = self._collect((CALL["integer"](value), predicate) for value, predicate in partition.cases)
        if not found.cases:
            return Number(self._arithmetic.constant(0), self._manager.false)
        low, high = (choose(int(value) for value, _ in found.cases) for choose in (min, max))
        bits = tuple(
            self._encoding.any_of(predicate for value, predicate in found.cases if (int(value) >> place) & 1)
            for place in range(width_for(low, high))
        )
        # The bits of an unknown number are those of zero.
        return Number(Vector(bits, min(low, 0), max(high, 0)), self._known(found))

    def _extreme(self, function: str, a: Number, b: Number) -> Number:
        """The lesser or greater of two integers."""
        less = self._arithmetic.less(a.vector, b.vector)
        chosen = self._arithmetic.choose(less if function == "min" else ~less, a.vector, b.vector)
        choose = min if function == "min" else max
        low, high = choose(a.vector.low, b.vector.low), choose(a.vector.high, b.vector.high)
        return Number(self._arithmetic.within(chosen, low, high), a.known & b.known)

    # Operators

    def _unary(self, operator: str, operand: Symbolic) -> Symbolic:
        match operator, operand:
            case "not", Truth(true=true, false=false):
                return Truth(false, true)
            case "holds", Truth(true=true):
                return Truth(true, ~true)
            case "-", Number(vector=vector, known=known):
                return self._within_32_bits(self._arithmetic.negate(vector), known)
            case "-", Partition(cases=cases):
                return self._collect((UNARY["-"](value), predicate) for value, predicate in cases)
        raise InternalError(f"no operator {operator} on {type(operand).__name__}")

    def _binary(self, operator: str, left: Symbolic, right: Symbolic) -> Symbolic:
        match left, right:
            case Truth(), Truth():
                return self._logic(operator, left, right)
            case Number(), Number() if operator != "/":
                return self._integers(operator, left, right)
        first, second = self._partition(left), self._partition(right)
        if operator in _COMPARISONS:
            return self._compare(operator, first, second)
        pairs = self._pairs(first, second)
        return self._collect((BINARY[operator](a, b), predicate) for a, b, predicate in pairs)

    def _logic(self, operator: str, a: Truth, b: Truth) -> Truth:
        match operator:
            case "and":
                return Truth(a.true & b.true, a.false | b.false)
            case "or":
                return Truth(a.true | b.true, a.false & b.false)
            case "implies":
                return Truth(a.false | b.true, a.true & b.false)
        same, different = (a.true & b.true) | (a.false & b.false), (a.true & b.false) | (a.false & b.true)
        return Truth(same, different) if operator == "=" else Truth(different, same)

    def _integers(self, operator: str, a: Number, b: Number) -> Symbolic:
        known = a.known & b.known
        arithmetic, first, second = self._arithmetic, a.vector, b.vector
        match operator:
            case "+":
                return self._within_32_bits(arithmetic.add(first, second), known)
            case "-":
                return self._within_32_bits(arithmetic.subtract(first, second), known)
            case "*":
                return self._within_32_bits(arithmetic.multiply(first, second), known)
            case "div" | "mod":
                quotient, remainder = arithmetic.divide(first, second)
                known = known & ~arithmetic.equal(second, arithmetic.constant(0))
                return self._within_32_bits(quotient if operator == "div" else remainder, known)
            case "=" | "!=":
                outcome = arithmetic.equal(first, second)
            case "<" | ">=":
                outcome = arithmetic.less(first, second)
            case _:
                outcome = arithmetic.less(second, first)
        if operator in _NEGATED:
            outcome = ~outcome
        return Truth(known & outcome, known & ~outcome)

    def _within_32_bits(self, vector: Vector, known: Any) -> Number:
        """A result of integer arithmetic: unknown where it does not fit into 32 bits."""
        if vector.low < MINIMUM_INTEGER:
            known = known & ~self._arithmetic.less(vector, self._arithmetic.constant(MINIMUM_INTEGER))
        if vector.high > MAXIMUM_INTEGER:
            known = known & ~self._arithmetic.less(self._arithmetic.constant(MAXIMUM_INTEGER), vector)
        low, high = max(vector.low, MINIMUM_INTEGER), min(vector.high, MAXIMUM_INTEGER)
        if low > high:
            return Number(self._arithmetic.constant(0), self._manager.false)
        if (low, high) == (vector.low, vector.high):
            return Number(vector, known)
        # Values beyond are unknown, so their bits do not matter; zero keeps the bounds true.
        kept = tuple(known & bit for bit in vector.bits)
        return Number(Vector(kept, min(low, 0), max(high, 0)), known)

    # Partitions

    def _truth(self, value: Symbolic) -> Truth:
        if not isinstance(value, Truth):
            raise InternalError("a condition is not boolean")
        return value

    def _partition(self, value: Symbolic) -> Partition:
        match value:
            case Partition():
                return value
            case Truth(true=true, false=false):
                return Partition(((True, true), (False, false)))
            case Number(vector=vector, known=known):
                return self._values_of(vector, known)

    def _values_of(self, vector: Vector, known: Any) -> Partition:
        """The values that an integer has somewhere: its bits split what is known, the sign first."""
        sign = len(vector.bits) - 1
        cases: list[tuple[int, Any]] = [(0, known)]
        for place in range(sign, -1, -1):
            bit = vector.bits[place]
            weight = -(1 << place) if place == sign else 1 << place
            split = [(value, where & ~bit) for value, where in cases]
            split += [(value + weight, where & bit) for value, where in cases]
            cases = [case for case in split if case[1] != self._manager.false]
            self._encoding.pause()
            if len(cases) > MAXIMUM_PARTITION:
                raise self._too_large()
        return Partition(tuple(cases))

    def _compare(self, operator: str, a: Partition, b: Partition) -> Truth:
        known = self._known(a) & self._known(b)
        match operator:
            case "=" | "!=":
                outcome = self._equal(a, b)
            case "<" | ">=":
                outcome = self._less(a, b)
            case _:
                outcome = self._less(b, a)
        true, false = outcome, known & ~outcome
        return Truth(false, true) if operator in _NEGATED else Truth(true, false)

    def _known(self, a: Partition) -> Any:
        return self._encoding.any_of(predicate for _, predicate in a.cases)

    def _equal(self, a: Partition, b: Partition) -> Any:
        """Return the predicate that both are known and equal, in time linear in their values: enums can have many."""
        false = self._manager.false
        others: dict[Value, Any] = {}
        for value, predicate in b.cases:
            others[value] = others.get(value, false) | predicate
        return self._encoding.any_of(predicate & others.get(value, false) for value, predicate in a.cases)

    def _less(self, a: Partition, b: Partition) -> Any:
        """Return the predicate that both are known and a < b: for each value of b, from below, where a is smaller."""
        cases = [(value, 0, predicate) for value, predicate in b.cases]
        cases += [(value, 1, predicate) for value, predicate in a.cases]
        # Equal values of b come first, so that only smaller ones of a have been met.
        smaller = outcome = self._manager.false
        for _, is_left, predicate in sorted(cases, key=lambda case: case[:2]):
            if is_left:
                smaller = smaller | predicate
            else:
                outcome = outcome | (predicate & smaller)
        return outcome

    def _pairs(self, a: Partition, b: Partition) -> list[tuple[Value, Value, Any]]:
        if len(a.cases) * len(b.cases) > MAXIMUM_PARTITION:
            raise self._too_large()
        pairs = ((first, second, p & q) for first, p in a.cases for second, q in b.cases)
        return [pair for pair in pairs if pair[2] != self._manager.false]

    def _collect(self, cases: Any) -> Partition:
        """Cases with equal values put together; impossible and unknown ones left out."""
        found: dict[tuple[str, Value], Any] = {}
        for value, predicate in cases:
            self._encoding.pause()
            if value is not None and predicate != self._manager.false:
                # 1 and 1.0 are the same key but not the same arithmetic: whole numbers overflow.
                key = (type(value).__name__, value)
                found[key] = found.get(key, self._manager.false) | predicate
        return Partition(tuple((value, predicate) for (_, value), predicate in found.items()))

    @staticmethod
    def _too_large() -> UnsupportedModelError:
        return UnsupportedModelError(
            f"a condition computes with doubles over more than {MAXIMUM_PARTITION} combinations of values; "
            "use integers, or smaller ranges"
        )

    # Values that an update writes

    def written(self, bits: Bits, expression: Expression) -> tuple[dict[str, Any], Any]:
        """For each bit of a variable its value after an update, and where the update leaves the range."""
        value = self.translate(expression)
        match value:
            case Truth(true=true, false=false):
                name = bits.names[0]
                return {name: true | (self._manager.var(name) & ~false)}, self._manager.false
            case Number(vector=vector, known=known):
                return self._written_integer(bits, vector, known)
            case Partition(cases=cases):
                known = self._known(value)
                indexed = [(bits.domain.index(case), predicate) for case, predicate in cases]
                new: dict[str, Any] = {}
                for place, name in enumerate(reversed(bits.names)):
                    chosen = self._encoding.any_of(p for index, p in indexed if (index >> place) & 1)
                    new[name] = chosen | (self._manager.var(name) & ~known)
                return new, self._manager.false

    def _written_integer(self, bits: Bits, vector: Vector, known: Any) -> tuple[dict[str, Any], Any]:
        low, high = int(bits.domain[0]), int(bits.domain[-1])
        below = self._arithmetic.less(vector, self._arithmetic.constant(low))
        above = self._arithmetic.less(self._arithmetic.constant(high), vector)
        index = self._arithmetic.subtract(vector, self._arithmetic.constant(low))
        padded = [*index.bits, *([index.bits[-1]] * len(bits.names))]
        new = {
            name: self._manager.ite(known, bit, self._manager.var(name))
            for name, bit in zip(reversed(bits.names), padded, strict=False)
        }
        return new, known & (below | above)
