"""Expressions of a synthesis problem as CIF expressions, translated exactly or refused.

CIF has no unknown values: see `robosc.targets.code.predicates`. Functions become `if` expressions. An expression that
CIF cannot compute becomes a table (`robosc.targets.cif.tables`); if the table is too large, the model is refused.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from robosc.errors import UnsupportedModelError
from robosc.expressions import (
    Binary,
    BooleanType,
    Call,
    EnumType,
    Expression,
    Received,
    VariableRead,
    children,
)
from robosc.recursion import allow_depth
from robosc.targets.cif.expression_words import expression_words
from robosc.targets.cif.numbers import Number, combined, comparison, fits, has_multiples, number_text, scaled, selected
from robosc.targets.cif.subjects import Place, Reader
from robosc.targets.cif.tables import Table, TableTooLargeError, tabulate
from robosc.targets.cif.text import (
    FALSE,
    TRUE,
    Level,
    Text,
    all_of,
    any_of,
    chosen,
    compared,
    equivalent,
    implied,
    negated,
)
from robosc.targets.code.predicates import Logic, Predicate, PredicateWriter

MAXIMUM_REPEATED = 5_000
"""Longest text that is written several times in one expression."""

_FRAMES_PER_LEVEL = 6
"""Python frames that a level of an expression takes, translated or evaluated."""

MAXIMUM_TEXT = 1_000_000
"""Longest text of one expression."""


@dataclass(frozen=True, slots=True)
class Symbol:
    """A value of an enum, and where it is known."""

    value: Text
    known: Text = TRUE


def _equal(operator: str, left: Text, right: Text) -> Text:
    same = equivalent(left, right)
    return same if operator == "=" else negated(same)


LOGIC = Logic(TRUE, FALSE, all_of, any_of, negated, implied, _equal)

Result = Predicate[Text] | Number | Symbol


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

    def predicate(self, expression: Expression, place: Place) -> Predicate[Text]:
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


class _Translation(PredicateWriter[Text, Number | Symbol]):
    """The translation of one expression.

    Args:
        reader: Writer of what is read.
        place: Place of the expression.
        root: The expression.
    """

    logic = LOGIC

    def __init__(self, reader: Reader, place: Place, root: Expression) -> None:
        self.reader = reader
        self.place = place
        self.root = root

    def whole(self) -> Result:
        """The result of the root."""
        allow_depth(_levels(self.root), _FRAMES_PER_LEVEL)
        result = self.result(self.root)
        if result is None:
            result = self._table(self.root).number()
        _require_short(self._texts(result), MAXIMUM_TEXT, self)
        return result

    @staticmethod
    def _texts(result: Result) -> list[Text]:
        match result:
            case Predicate(true=true, false=false, is_known=is_known):
                return [true] if is_known else [true, false]
            case Symbol(value=value, known=known):
                return [value, known]
            case Number(terms=terms, known=known):
                return [*(term.atom for term in terms), known]

    def _location(self, automaton: str, location: str) -> Text:
        return self.reader.location(automaton, location, self.place)

    def _integer(self, value: int) -> Number:
        return Number((), value)

    def _enum_value(self, enum: str, value: str) -> Symbol:
        return Symbol(self.reader.literal(enum, value))

    def _read(self, leaf: VariableRead | Received) -> Result:
        source = self.reader.source(leaf, self.place)
        match self.reader.type(source):
            case BooleanType():
                return LOGIC.where(self.reader.known(source, self.place), self.reader.reference(source, self.place))
            case EnumType():
                return Symbol(self.reader.reference(source, self.place), self.reader.known(source, self.place))
            case _:
                return self.reader.number(source, self.place)

    def _negative(self, operand: Number | Symbol) -> Number | None:
        return _fitting(scaled(operand, -1, operand.known)) if isinstance(operand, Number) else None

    def _arithmetic(self, operator: str, left: Number | Symbol, right: Number | Symbol) -> Number | None:
        if isinstance(left, Symbol) or isinstance(right, Symbol):
            return None
        known = all_of([left.known, right.known])
        if operator in ("+", "-"):
            return _fitting(combined(left, right, 1 if operator == "+" else -1, known))
        if not left.terms or not right.terms:
            factor, number = (left.constant, right) if not left.terms else (right.constant, left)
            found = scaled(number, factor, known)
            return None if has_multiples(found) else _fitting(found)
        # Synthesis of CIF takes no products of what is not constant.
        return None

    def _values_compared(self, operator: str, left: Number | Symbol, right: Number | Symbol) -> Predicate[Text] | None:
        match left, right:
            case Number(), Number():
                if not fits(combined(left, right, -1, TRUE)):
                    return None
                test = comparison(operator, left, right)
            case Symbol(), Symbol():
                test = _same_symbol(left.value, right.value, self.reader)
                test = test if operator == "=" else negated(test)
            case _:
                return None
        return LOGIC.where(all_of([left.known, right.known]), test)

    def _truths_compared(self, operator: str, left: Predicate[Text], right: Predicate[Text]) -> Predicate[Text]:
        if not (left.is_known and right.is_known):
            _require_short([left.true, left.false, right.true, right.false], MAXIMUM_REPEATED, self)
        return super()._truths_compared(operator, left, right)

    def _branches(self, test: Predicate[Text], first: Text, second: Text) -> Text:
        """Return the condition under which a choice has a property, given that for each branch."""
        if test.is_known and not (TRUE in (first, second) or FALSE in (first, second)):
            return chosen([(test.true, first)], second)
        _require_short([test.true, test.false], MAXIMUM_REPEATED, self)
        if test.is_known and first == TRUE:
            return any_of([test.true, second])
        if test.is_known and second == TRUE:
            return any_of([test.false, first])
        return super()._branches(test, first, second)

    def _value_chosen(
        self, test: Predicate[Text], then: Number | Symbol, otherwise: Number | Symbol
    ) -> Number | Symbol | None:
        match then, otherwise:
            case Symbol(), Symbol():
                value = chosen([(test.true, then.value)], otherwise.value)
                return Symbol(value, self._choice_known(test, then.known, otherwise.known))
            case Number(), Number():
                ends = (*then.bounds, *otherwise.bounds)
                is_known = self._choice_known(test, then.known, otherwise.known)
                if test.true in (TRUE, FALSE):
                    chosen_number = then if test.true == TRUE else otherwise
                    return Number(chosen_number.terms, chosen_number.constant, is_known)
                if min(ends) == max(ends):
                    return Number((), ends[0], is_known)
                return selected(test.true, then, otherwise, is_known)
            case _:
                return None

    def _function(self, node: Call, arguments: Sequence[Number | Symbol]) -> Number | None:
        match node.function, [item for item in arguments if isinstance(item, Number)]:
            case "double", _:
                return None
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
        return selected(test, a, b, known)

    def _tabulated(self, node: Expression) -> Predicate[Text]:
        table = self._table(node)
        true = table.where(lambda value: value is True)
        if None not in table.results():
            return LOGIC.known(true)
        return Predicate(true, table.where(lambda value: value is False))

    def _uncomputed(self, node: Call) -> Number | None:
        return self._table(node).number() if node.function == "integer" else None

    def _table(self, node: Expression) -> Table:
        try:
            return tabulate(node, self.reader, self.place)
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
