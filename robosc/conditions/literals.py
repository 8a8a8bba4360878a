"""Tests that a place of the state has one of some values, in the model's words, with their lengths."""

from collections.abc import Callable, Collection, Hashable, Iterable, Iterator
from functools import cached_property
from typing import Literal

import msgspec

from robosc.expressions import (
    Binary,
    BinaryOperator,
    Conditional,
    Constant,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    StateTest,
    Unary,
    Value,
    VariableRead,
)
from robosc.expressions.text import cif_text, expression_text
from robosc.supervisor.diagram import Domains, Subject, SubjectDomain

Indices = tuple[range, ...]
"""Runs of indices into a domain, ascending and apart."""

Size = tuple[int, int]
"""Length of a formula: its operands, then the characters of its text."""


def merged(runs: Iterable[range]) -> Indices:
    """Runs that are apart, in ascending order, those that touch put together."""
    found: list[range] = []
    for run in sorted(runs, key=lambda item: item.start):
        if found and found[-1].stop == run.start:
            found[-1] = range(found[-1].start, run.stop)
        else:
            found.append(run)
    return tuple(found)


class Membership(msgspec.Struct, frozen=True):
    """A test whether a place holds one of some values.

    Attributes:
        operator: Operator that joins the parts.
        parts: Tests of one value or one range, at least one: of the values, or of all others.
        text: The test as text, however many parts it has.
        size: Length of the test.
    """

    operator: Literal["and", "or"]
    parts: tuple[Expression, ...]
    text: str
    size: Size

    @property
    def expression(self) -> Expression:
        """The test as an expression, as deep as it has parts."""
        return joined(self.operator, self.parts)


class Vocabulary:
    """Tests of the places of a state, each put into words once.

    Args:
        domains: Values that the places can hold.
        components: Names of all components; needed where texts are shown.
        is_cif: True if texts are in CIF's notation.

    Attributes:
        domains: The same.
        is_cif: The same.
        ranks: Position of each place in the model's text.
    """

    def __init__(self, domains: Domains, components: Collection[str] = (), *, is_cif: bool = False) -> None:
        self.domains = domains
        self._components = components
        self.is_cif = is_cif
        self.ranks: dict[Subject, int] = {subject: rank for rank, subject in enumerate(domains)}
        self._known: dict[tuple[Subject, Indices], Membership] = {}

    @cached_property
    def words(self) -> Hashable:
        """All that decides about tests: two vocabularies that have it in common put them into the same words."""
        values = ((subject, item.type, item[:]) for subject, item in self.domains.items())
        # A range may be wide, and is not listed.
        places = tuple((*place, found if isinstance(found, range) else tuple(found)) for *place, found in values)
        return _Hashed((places, frozenset(self._components), self.is_cif))

    def test(self, subject: Subject, indices: Indices) -> Membership:
        """The shortest test whether a place holds one of some values: some, but not all that it can hold."""
        found = self._known.get((subject, indices))
        if found is None:
            found = self._known[subject, indices] = membership(subject, self.domains[subject], indices, self._text)
        return found

    def _text(self, expression: Expression) -> str:
        return cif_text(expression) if self.is_cif else expression_text(expression, self._components)


class _Hashed:
    """A value whose hash is worked out once: that of all places of a large robot takes as long as a search.

    Args:
        value: The value.
    """

    def __init__(self, value: Hashable) -> None:
        self._value = value
        self._hash = hash(value)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Hashed) and self._value == other._value


def membership(
    subject: Subject,
    domain: SubjectDomain,
    indices: Indices,
    text: Callable[[Expression], str] = expression_text,
) -> Membership:
    """Return the shortest test whether a place holds one of some values: some, but not all that it can hold.

    Args:
        subject: The place.
        domain: Values that it can hold.
        indices: Indices of the values.
        text: Function that writes a test; needed where the text is shown.
    """
    inside = _membership("or", _one_of(subject, domain, indices), text)
    outside = _membership("and", _none_of(subject, domain, _others(indices, len(domain))), text)
    return min(inside, outside, key=lambda test: test.size)


def _membership(
    operator: Literal["and", "or"], parts: list[Expression], text: Callable[[Expression], str]
) -> Membership:
    texts = [text(part) for part in parts]
    if operator == "and" and len(parts) > 1:
        texts = [f"({text})" if _is_choice(part) else text for part, text in zip(parts, texts, strict=True)]
    whole = f" {operator} ".join(texts)
    return Membership(operator, tuple(parts), whole, (sum(map(operands, parts)), _length(whole)))


def _is_choice(part: Expression) -> bool:
    return isinstance(part, Binary) and part.operator == "or"


def size(expression: Expression) -> Size:
    """Return the length of a condition."""
    return operands(expression), _length(expression_text(expression))


def _length(text: str) -> int:
    """Characters of a text in which `!` will be written as `not`."""
    return len(text) + 3 * (text.count("!") - text.count("!="))


def length(expression: Expression) -> tuple[int, bool, int]:
    """Return the length of a formula; of two with as many operands the one without relations reads better."""
    count, characters = size(expression)
    return count, has_relation(expression), characters


def operands(expression: Expression) -> int:
    """The tests in a condition: of a location, a boolean or an integer; each choice counts as one more.

    A comparison of several variables counts once for each of them.
    """
    count, stack = 0, [expression]
    while stack:
        match stack.pop():
            case Binary(left=left, right=right):
                stack += [left, right]
            case Unary(operand=operand):
                stack.append(operand)
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                count += 1
                stack += [condition, then, otherwise]
            case StateTest() | VariableRead():
                count += 1
            case other if not isinstance(other, Constant | EnumValue):
                raise TypeError(f"no condition of a supervisor: {other!r}")
    return count


def has_relation(expression: Expression) -> bool:
    """Return True if a condition compares variables with each other."""
    stack = [expression]
    while stack:
        match stack.pop():
            case Binary(operator="and" | "or", left=left, right=right):
                stack += [left, right]
            case Unary(operand=operand):
                stack.append(operand)
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                stack += [condition, then, otherwise]
            case Binary() as comparison if operands(comparison) > 1:
                return True
    return False


def joined(operator: BinaryOperator, parts: Iterable[Expression]) -> Expression:
    """Conditions put together by `and` or `or`, without parentheses around what the same operator joins already."""
    flat = [item for part in parts for item in spine(operator, part)]
    result = flat[0]
    for item in flat[1:]:
        result = Binary(operator, result, item)
    return result


def spine(operator: BinaryOperator, expression: Expression) -> list[Expression]:
    """The operands of a chain of one operator."""
    found: list[Expression] = []
    while isinstance(expression, Binary) and expression.operator == operator:
        found.append(expression.right)
        expression = expression.left
    return [expression, *reversed(found)]


def _others(indices: Indices, count: int) -> Indices:
    """The indices up to `count` that are not among some."""
    found, end = [], 0
    for run in indices:
        if run.start > end:
            found.append(range(end, run.start))
        end = run.stop
    return (*found, range(end, count)) if end < count else tuple(found)


def _flat(indices: Indices) -> Iterator[int]:
    return (index for run in indices for index in run)


def _one_of(subject: Subject, domain: SubjectDomain, indices: Indices) -> list[Expression]:
    if isinstance(domain.type, IntegerType):
        return [_between(subject, domain, run) for run in indices]
    return [_is(subject, domain, index) for index in _flat(indices)]


def _none_of(subject: Subject, domain: SubjectDomain, indices: Indices) -> list[Expression]:
    if isinstance(domain.type, IntegerType):
        return [_beyond(subject, domain, run) for run in indices]
    return [_is_not(subject, domain, index) for index in _flat(indices)]


def _is(subject: Subject, domain: SubjectDomain, index: int) -> Expression:
    name, variable = subject
    if variable is None:
        return StateTest(name, str(domain[index]))
    read = VariableRead(name, variable)
    if isinstance(domain.type, EnumType):
        return Binary("=", read, EnumValue(domain.type.name, str(domain[index])))
    return read if domain[index] else Unary("not", read)


def _is_not(subject: Subject, domain: SubjectDomain, index: int) -> Expression:
    test = _is(subject, domain, index)
    match test:
        case Binary(left=left, right=right):
            return Binary("!=", left, right)
        case Unary(operand=operand):
            return operand
        case _:
            return Unary("not", test)


def _compared(subject: Subject, operator: BinaryOperator, value: Value) -> Expression:
    name, variable = subject
    return Binary(operator, VariableRead(name, str(variable)), Constant(value))


def _between(subject: Subject, domain: SubjectDomain, run: range) -> Expression:
    low, high = domain[run[0]], domain[run[-1]]
    if len(run) == 1:
        return _compared(subject, "=", low)
    ends = []
    if run.start > 0:
        ends.append(_compared(subject, ">=", low))
    if run.stop < len(domain):
        ends.append(_compared(subject, "<=", high))
    return joined("and", ends)


def _beyond(subject: Subject, domain: SubjectDomain, run: range) -> Expression:
    if len(run) == 1 and 0 < run.start < len(domain) - 1:
        return _compared(subject, "!=", domain[run[0]])
    ends = []
    if run.start > 0:
        ends.append(_between(subject, domain, range(run.start)))
    if run.stop < len(domain):
        ends.append(_between(subject, domain, range(run.stop, len(domain))))
    return joined("or", ends)
