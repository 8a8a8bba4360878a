"""Expressions in a language without unknown values, translated exactly or refused: one pass for CIF and Promela.

A condition becomes two predicates: one is true where the condition is true, the other where it is false. A value comes
with a predicate that is true where the value is known (strong Kleene logic, as in `robosc.expressions.values`). An
expression that the language cannot compute, with doubles or beyond 32 bits, becomes a table of its value for every
combination of the values that it reads.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from robosc.expressions import (
    Binary,
    Call,
    Conditional,
    Constant,
    EnumValue,
    Expression,
    Received,
    StateTest,
    Unary,
    VariableRead,
)


@dataclass(frozen=True, slots=True)
class Predicate[T]:
    """A condition.

    Attributes:
        true: Text that holds where it is true.
        false: Text that holds where it is false.
        is_known: True if it is always one of the two.
    """

    true: T
    false: T
    is_known: bool = False


@dataclass(frozen=True, slots=True)
class Logic[T]:
    """Logic of a language with two truth values, and Kleene's in two predicates.

    Attributes:
        true: Text that always holds.
        false: Text that never holds.
        all_of: A conjunction.
        any_of: A disjunction.
        negated: A negation.
        implied: An implication.
        equal: A comparison of two truth values, by `=` or `!=`.
    """

    true: T
    false: T
    all_of: Callable[[Sequence[T]], T]
    any_of: Callable[[Sequence[T]], T]
    negated: Callable[[T], T]
    implied: Callable[[T, T], T]
    equal: Callable[[str, T, T], T]

    def known(self, text: T) -> Predicate[T]:
        """A condition that is always known."""
        return Predicate(text, self.negated(text), True)

    def where(self, known: T, text: T) -> Predicate[T]:
        """A condition that is known where another one holds."""
        if known == self.true:
            return self.known(text)
        return Predicate(self.all_of([known, text]), self.all_of([known, self.negated(text)]))

    def knownness(self, predicate: Predicate[T]) -> T:
        """Text that holds where a condition is known."""
        return self.true if predicate.is_known else self.any_of([predicate.true, predicate.false])

    def connected(self, operator: str, parts: Sequence[Predicate[T]]) -> Predicate[T]:
        """A conjunction or disjunction."""
        join, opposite = (self.all_of, self.any_of) if operator == "and" else (self.any_of, self.all_of)
        true = join([item.true for item in parts])
        if all(item.is_known for item in parts):
            return self.known(true)
        return Predicate(true, opposite([item.false for item in parts]))

    def implication(self, left: Predicate[T], right: Predicate[T]) -> Predicate[T]:
        """`left => right`."""
        if left.is_known and right.is_known:
            return self.known(self.implied(left.true, right.true))
        return Predicate(self.any_of([left.false, right.true]), self.all_of([left.true, right.false]))

    def compared(self, operator: str, left: Predicate[T], right: Predicate[T]) -> Predicate[T]:
        """Return the condition that two conditions are equal, or are not."""
        if left.is_known and right.is_known:
            return self.known(self.equal(operator, left.true, right.true))
        pairs = (left.true, right.true), (left.false, right.false)
        crossed = (left.true, right.false), (left.false, right.true)
        same, other = (self.any_of([self.all_of(pair) for pair in found]) for found in (pairs, crossed))
        return Predicate(same, other) if operator == "=" else Predicate(other, same)

    def opposite(self, predicate: Predicate[T]) -> Predicate[T]:
        """The negation of a condition."""
        return self.known(predicate.false) if predicate.is_known else Predicate(predicate.false, predicate.true)


class PredicateWriter[T, N](ABC):
    """Writes expressions of one place; `None` stands for a value that the language cannot compute."""

    logic: Logic[T]

    @abstractmethod
    def _location(self, automaton: str, location: str) -> T:
        """Return the condition that an automaton is in a location."""

    @abstractmethod
    def _read(self, leaf: VariableRead | Received) -> Predicate[T] | N | None:
        """A variable or received data."""

    @abstractmethod
    def _integer(self, value: int) -> N:
        """An integer."""

    @abstractmethod
    def _enum_value(self, enum: str, value: str) -> N:
        """A value of an enum."""

    @abstractmethod
    def _negative(self, operand: N) -> N | None:
        """Minus a number."""

    @abstractmethod
    def _arithmetic(self, operator: str, left: N, right: N) -> N | None:
        """A sum, difference or product."""

    @abstractmethod
    def _function(self, node: Call, arguments: Sequence[N]) -> N | None:
        """A function of numbers."""

    @abstractmethod
    def _values_compared(self, operator: str, left: N, right: N) -> Predicate[T] | None:
        """A comparison."""

    @abstractmethod
    def _value_chosen(self, test: Predicate[T], then: N, otherwise: N) -> N | None:
        """A conditional value."""

    @abstractmethod
    def _tabulated(self, node: Expression) -> Predicate[T]:
        """A condition, tried for every value of what it reads."""

    def _uncomputed(self, node: Call) -> N | None:
        """A function of something that the language cannot compute."""
        return None

    def _truths_compared(self, operator: str, left: Predicate[T], right: Predicate[T]) -> Predicate[T]:
        """A comparison of two conditions."""
        return self.logic.compared(operator, left, right)

    def _branches(self, test: Predicate[T], first: T, second: T) -> T:
        """Return the condition under which a choice has a property, given that for each branch."""
        logic = self.logic
        return logic.any_of([logic.all_of([test.true, first]), logic.all_of([test.false, second])])

    def _choice_known(self, test: Predicate[T], first: T, second: T) -> T:
        """Return the condition under which a choice is known, given that for each branch."""
        is_known = first == second == self.logic.true
        return self.logic.knownness(test) if is_known else self._branches(test, first, second)

    def truth(self, expression: Expression) -> Predicate[T]:
        """A condition."""
        result = self.result(expression)
        assert isinstance(result, Predicate)  # noqa: S101  # the check has typed it
        return result

    def result(self, expression: Expression) -> Predicate[T] | N | None:
        """The result of an expression; a chain of operators, which leans left, is taken by a loop."""
        spine: list[Binary] = []
        node = expression
        while isinstance(node, Binary):
            spine.append(node)
            node = node.left
        result = self._operand(node)
        for operator, group in groupby(reversed(spine), key=lambda item: item.operator):
            items = tuple(group)
            if operator in ("and", "or"):
                operands = [result, *(self.result(item.right) for item in items)]
                result = self.logic.connected(operator, [item for item in operands if isinstance(item, Predicate)])
                continue
            for item in items:
                result = self._binary(item, result, self.result(item.right))
        return result

    def _operand(self, expression: Expression) -> Predicate[T] | N | None:
        match expression:
            case Constant(value=bool(value)):
                return self.logic.known(self.logic.true if value else self.logic.false)
            case Constant(value=int(value)):
                return self._integer(value)
            case EnumValue(enum=enum, value=value):
                return self._enum_value(enum, value)
            case StateTest(component=automaton, state=location):
                return self.logic.known(self._location(automaton, location))
            case VariableRead() | Received():
                return self._read(expression)
            case Unary(operator=operator, operand=operand):
                return self._unary(operator, self.result(operand))
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                return self._conditional(self.truth(condition), self.result(then), self.result(otherwise))
            case Call():
                arguments = [_computed(self.result(item)) for item in expression.arguments]
                found = [item for item in arguments if item is not None]
                is_whole = len(found) == len(arguments)
                return self._function(expression, found) if is_whole else self._uncomputed(expression)
            case _:  # A double or a text.
                return None

    def _unary(self, operator: str, operand: Predicate[T] | N | None) -> Predicate[T] | N | None:
        if isinstance(operand, Predicate):
            return self.logic.opposite(operand) if operator == "not" else self.logic.known(operand.true)
        return None if operand is None else self._negative(operand)

    def _binary(
        self, node: Binary, left: Predicate[T] | N | None, right: Predicate[T] | N | None
    ) -> Predicate[T] | N | None:
        if isinstance(left, Predicate) and isinstance(right, Predicate):
            if node.operator == "implies":
                return self.logic.implication(left, right)
            return self._truths_compared(node.operator, left, right)
        first, second = _computed(left), _computed(right)
        if node.operator in ("+", "-", "*", "/"):
            if first is None or second is None or node.operator == "/":
                return None
            return self._arithmetic(node.operator, first, second)
        compared = None if first is None or second is None else self._values_compared(node.operator, first, second)
        return self._tabulated(node) if compared is None else compared

    def _conditional(
        self, test: Predicate[T], then: Predicate[T] | N | None, otherwise: Predicate[T] | N | None
    ) -> Predicate[T] | N | None:
        if isinstance(then, Predicate) and isinstance(otherwise, Predicate):
            true = self._branches(test, then.true, otherwise.true)
            if test.is_known and then.is_known and otherwise.is_known:
                return self.logic.known(true)
            return Predicate(true, self._branches(test, then.false, otherwise.false))
        first, second = _computed(then), _computed(otherwise)
        return None if first is None or second is None else self._value_chosen(test, first, second)


def _computed[N](result: Predicate[Any] | N | None) -> N | None:
    """A result that is a value, or None for another one."""
    return None if isinstance(result, Predicate) else result
