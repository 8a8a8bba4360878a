"""Expressions of a synthesis problem as CIF expressions, exactly or not at all.

CIF knows no unknown value. So a condition becomes two predicates, where it is true and where it is false, and a value
comes with a predicate that tells where it is known (strong Kleene logic, as in `robosc.expressions.values`). Functions
become `if` expressions. What CIF cannot compute is tabulated (`robosc.targets.cif.tables`); what is too large for that
is refused.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from robosc.errors import UnsupportedModelError
from robosc.expressions import (
    Binary,
    BooleanType,
    Call,
    Conditional,
    Constant,
    EnumType,
    EnumValue,
    Expression,
    Received,
    StateTest,
    Unary,
    VariableRead,
    children,
)
from robosc.recursion import allow_depth
from robosc.targets.cif.logic import Predicate, Symbol, connected, implication, opposite, same_truth
from robosc.targets.cif.numbers import Number, Term, combined, comparison, fits, number_text, scaled
from robosc.targets.cif.subjects import Place, Reader, Source
from robosc.targets.cif.tables import TableTooLargeError, tabulate
from robosc.targets.cif.text import (
    FALSE,
    TRUE,
    Level,
    Text,
    all_of,
    any_of,
    chosen,
    compared,
    negated,
)
from robosc.targets.cif.words import expression_words

MAXIMUM_REPEATED = 5_000
"""Longest text that is written several times in one expression."""

_FRAMES_PER_LEVEL = 6
"""Python frames that a level of an expression takes, translated or evaluated."""

MAXIMUM_TEXT = 1_000_000
"""Longest text of one expression."""


Result = Predicate | Number | Symbol


class Translator:
    """Writes the expressions of one synthesis problem down.

    Args:
        reader: Writes down what they read.
    """

    def __init__(self, reader: Reader) -> None:
        self.reader = reader
        # A transition that stands in every state has the same expressions in each of them. The expression is kept with
        # its result, so that no other one ever gets its id.
        self._known: dict[tuple[int, Place], tuple[Expression, Result]] = {}

    def predicate(self, expression: Expression, place: Place) -> Predicate:
        """A condition.

        Raises:
            UnsupportedModelError: It would be too large in CIF.
        """
        result = self.value(expression, place)
        assert isinstance(result, Predicate)  # noqa: S101  # the check has typed it
        return result

    def value(self, expression: Expression, place: Place) -> Result:
        """The new value of a variable.

        Raises:
            UnsupportedModelError: It would be too large in CIF.
        """
        key = id(expression), place
        if key not in self._known:
            self._known[key] = expression, _Translation(self.reader, place, expression).whole()
        return self._known[key][1]


def _too_large(expression: Expression, place: Place) -> UnsupportedModelError:
    return UnsupportedModelError(
        f"target cif: {place.what} computes with too many values to be written in CIF: "
        f"'{expression_words(expression)}'; make the ranges of what it reads smaller, or split it up"
    )


@dataclass(frozen=True, slots=True)
class _Translation:
    """The translation of one expression.

    Its methods return None for a number that CIF cannot compute: a double, or more than 32 bits.

    Attributes:
        reader: Writer of what is read.
        place: Place of the expression.
        root: The expression.
    """

    reader: Reader
    place: Place
    root: Expression

    def whole(self) -> Result:
        """The result of the root."""
        allow_depth(_levels(self.root), _FRAMES_PER_LEVEL)
        result = self._result(self.root)
        if result is None:
            result = self._tabulated_number(self.root)
        _require_short(self._texts(result), MAXIMUM_TEXT, self)
        return result

    @staticmethod
    def _texts(result: Result) -> list[Text]:
        match result:
            case Predicate(true=true, false=false):
                return [true] if false is None else [true, false]
            case Symbol(value=value, known=known):
                return [value, known]
            case Number(terms=terms, known=known):
                return [*(term.atom for term in terms), known]

    def _result(self, expression: Expression) -> Result | None:
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
                operands = [result, *(self._result(item.right) for item in items)]
                result = connected(operator, [item for item in operands if isinstance(item, Predicate)])
                continue
            for item in items:
                result = self._binary(item, result, self._result(item.right))
        return result

    def _operand(self, expression: Expression) -> Result | None:
        match expression:
            case Constant(value=bool(value)):
                return Predicate(TRUE if value else FALSE)
            case Constant(value=int(value)):
                return Number((), value)
            case EnumValue(enum=enum, value=value):
                return Symbol(self.reader.literal(enum, value))
            case StateTest(component=automaton, state=location):
                return Predicate(self.reader.location(automaton, location, self.place))
            case VariableRead() | Received():
                return self._read(self.reader.source(expression, self.place))
            case Unary(operator=operator, operand=operand):
                return self._unary(operator, self._result(operand))
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                return self._conditional(self._condition(condition), self._result(then), self._result(otherwise))
            case Call():
                return self._call(expression)
            case _:  # A double or a text.
                return None

    def _condition(self, expression: Expression) -> Predicate:
        result = self._result(expression)
        assert isinstance(result, Predicate)  # noqa: S101  # the check has typed it
        return result

    def _read(self, source: Source) -> Result:
        known = self.reader.known(source, self.place)
        match self.reader.type(source):
            case BooleanType():
                value = self.reader.reference(source, self.place)
                if known == TRUE:
                    return Predicate(value)
                return Predicate(all_of([known, value]), all_of([known, negated(value)]))
            case EnumType():
                return Symbol(self.reader.reference(source, self.place), known)
            case _:
                return self.reader.number(source, self.place)

    def _unary(self, operator: str, operand: Result | None) -> Result | None:
        match operator, operand:
            case "not", Predicate():
                return opposite(operand)
            case "holds", Predicate(true=true):
                return Predicate(true)
            case "-", Number(known=known):
                return _fitting(scaled(operand, -1, known))
            case _:
                return None

    def _binary(self, node: Binary, left: Result | None, right: Result | None) -> Result | None:
        match node.operator, left, right:
            case "implies", Predicate(), Predicate():
                return implication(left, right)
            case "+" | "-" | "*", Number(), Number():
                return self._arithmetic(node.operator, left, right)
            case "+" | "-" | "*" | "/", _, _:
                return None
        compared = self._compared(node.operator, left, right)
        return self._tabulated_predicate(node) if compared is None else compared

    def _arithmetic(self, operator: str, left: Number, right: Number) -> Number | None:
        known = all_of([left.known, right.known])
        if operator in ("+", "-"):
            return _fitting(combined(left, right, 1 if operator == "+" else -1, known))
        if not left.terms or not right.terms:
            factor, number = (left.constant, right) if not left.terms else (right.constant, left)
            return _fitting(scaled(number, factor, known))
        first, second = (number_text(item) for item in (left, right))
        ends = [a * b for a in left.bounds for b in right.bounds]
        atom = Text(f"{first.within(Level.PRODUCT)} * {second.within(Level.UNARY)}", Level.PRODUCT)
        return _fitting(Number((Term(atom, min(ends), max(ends)),), 0, known))

    def _compared(self, operator: str, left: Result | None, right: Result | None) -> Predicate | None:
        match left, right:
            case Number(), Number():
                difference = combined(left, right, -1, TRUE)
                if not fits(difference):
                    return None
                known, test = all_of([left.known, right.known]), comparison(operator, left, right)
            case Symbol(), Symbol():
                known, test = all_of([left.known, right.known]), _same_symbol(left.value, right.value, self.reader)
                test = test if operator == "=" else negated(test)
            case Predicate(), Predicate():
                if left.false is not None or right.false is not None:
                    texts = [left.true, left.is_false, right.true, right.is_false]
                    _require_short(texts, MAXIMUM_REPEATED, self)
                same = same_truth(left, right)
                return same if operator == "=" else opposite(same)
            case _:
                return None
        return Predicate(test) if known == TRUE else Predicate(all_of([known, test]), all_of([known, negated(test)]))

    def _conditional(self, test: Predicate, then: Result | None, otherwise: Result | None) -> Result | None:
        def branches(first: Text, second: Text) -> Text:
            """Return the condition under which the choice is something that has a property."""
            if test.false is not None or TRUE in (first, second) or FALSE in (first, second):
                _require_short([test.true, test.is_false], MAXIMUM_REPEATED, self)
                if test.false is None and first == TRUE:
                    return any_of([test.true, second])
                if test.false is None and second == TRUE:
                    return any_of([test.is_false, first])
                return any_of([all_of([test.true, first]), all_of([test.is_false, second])])
            return chosen([(test.true, first)], second)

        def known(first: Text, second: Text) -> Text:
            return test.known if first == second == TRUE else branches(first, second)

        match then, otherwise:
            case Predicate(), Predicate():
                true = branches(then.true, otherwise.true)
                if test.false is None and then.false is None and otherwise.false is None:
                    return Predicate(true)
                return Predicate(true, branches(then.is_false, otherwise.is_false))
            case Symbol(), Symbol():
                value = chosen([(test.true, then.value)], otherwise.value)
                return Symbol(value, known(then.known, otherwise.known))
            case Number(), Number():
                ends = (*then.bounds, *otherwise.bounds)
                value = chosen([(test.true, number_text(then))], number_text(otherwise))
                is_known = known(then.known, otherwise.known)
                if test.true in (TRUE, FALSE):
                    chosen_number = then if test.true == TRUE else otherwise
                    return Number(chosen_number.terms, chosen_number.constant, is_known)
                if min(ends) == max(ends):
                    return Number((), ends[0], is_known)
                return Number((Term(value, min(ends), max(ends)),), 0, is_known)
            case _:
                return None

    def _call(self, node: Call) -> Number | None:
        arguments = [self._result(item) for item in node.arguments]
        numbers = [item for item in arguments if isinstance(item, Number)]
        if node.function == "double":
            return None
        if len(numbers) < len(arguments):
            return self._tabulated_number(node) if node.function == "integer" else None
        match node.function, numbers:
            case "integer", [number]:
                return number
            case "abs", [number]:
                return self._extreme(">=", number, scaled(number, -1, number.known))
            case "min", [a, b]:
                return self._extreme("<=", a, b)
            case "max", [a, b]:
                return self._extreme(">=", a, b)
            case _, [value, low, high]:
                raised = self._extreme(">=", value, low)
                return None if raised is None else self._extreme("<=", raised, high)
        return None

    def _extreme(self, operator: str, a: Number, b: Number) -> Number | None:
        """`a` where it compares so with `b`, else `b`."""
        known = all_of([a.known, b.known])
        if not (fits(a) and fits(b) and fits(combined(a, b, -1, TRUE))):
            return None
        test = comparison(operator, a, b)
        if test in (TRUE, FALSE):
            winner = a if test == TRUE else b
            return Number(winner.terms, winner.constant, known)
        first, second = number_text(a), number_text(b)
        if len(first.text) + len(second.text) > MAXIMUM_REPEATED:
            return None
        ends = (*a.bounds, *b.bounds)
        return Number((Term(chosen([(test, first)], second), min(ends), max(ends)),), 0, known)

    def _tabulated_predicate(self, node: Expression) -> Predicate:
        try:
            table = tabulate(node, self.reader, self.place)
        except TableTooLargeError:
            raise _too_large(node, self.place) from None
        true = table.where(lambda value: value is True)
        return Predicate(true, table.where(lambda value: value is False) if None in table.results() else None)

    def _tabulated_number(self, node: Expression) -> Number:
        try:
            return tabulate(node, self.reader, self.place).number()
        except TableTooLargeError:
            raise _too_large(node, self.place) from None


def _same_symbol(left: Text, right: Text, reader: Reader) -> Text:
    """Return the condition that two values of one enum are equal."""
    if left == right:
        return TRUE
    if reader.is_literal(left) and reader.is_literal(right):
        return FALSE
    return compared(left.within(Level.SUM), "=", right.within(Level.SUM))


def _fitting(number: Number) -> Number | None:
    """The number, or None if it can exceed 32 bits."""
    return number if fits(number) else None


def _levels(expression: Expression) -> int:
    """Levels of an expression, a chain of operators counted as one."""
    deepest, stack = 1, [(expression, 1)]
    while stack:
        node, level = stack.pop()
        deepest = max(deepest, level)
        stack += [(child, level + 1) for child in children(node)]
        if isinstance(node, Binary):
            stack[-2] = node.left, level
    return deepest


def _require_short(texts: Sequence[Text], limit: int, translation: _Translation) -> None:
    """Refuse texts that would make an expression explode."""
    if sum(len(item.text) for item in texts) > limit:
        raise _too_large(translation.root, translation.place)
