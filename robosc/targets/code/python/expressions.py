"""RoboSC expressions in Python: see `robosc.targets.code.expression_writer`, and `values` for the functions.

Unknown is None, except that an unknown *number* read from received data is NaN: every function of `values` takes NaN as
unknown, too.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import IntEnum

from robosc.expressions import ArrayPart, Quantifier, Reduction, Type
from robosc.model.received import Path, path_type
from robosc.model.structure import Model
from robosc.targets.code.expression_writer import ExpressionWriter, read_nothing
from robosc.targets.code.expressions import (
    FALSE_CODE,
    TRUE_CODE,
    Code,
    Kind,
    Language,
    Shape,
    Sort,
    Unknown,
    call,
    double,
    integer,
    literal,
    operation,
    place,
    variable,
)


class Precedence(IntEnum):
    """Binding strength of a piece of Python; a larger number binds tighter."""

    LAMBDA = 0
    OR = 1
    AND = 2
    NOT = 3
    COMPARISON = 4
    SUM = 5
    PRODUCT = 6
    SIGN = 7
    ATOM = 8


def _comparison(operator: str) -> Shape:
    # Comparisons would chain without parentheses.
    return Shape(f"{{}} {operator} {{}}", Precedence.COMPARISON, (Precedence.SUM, Precedence.SUM))


def _arithmetic(operator: str, level: Precedence) -> Shape:
    # The right operand of - and / keeps its parentheses; so do + and *, to leave the order as written.
    return Shape(f"{{}} {operator} {{}}", level, (level, Precedence(level + 1)))


PYTHON = Language(
    {
        "true": Shape("True", Precedence.ATOM),
        "false": Shape("False", Precedence.ATOM),
        "and": Shape(" and ", Precedence.AND, (Precedence.AND,)),
        "or": Shape(" or ", Precedence.OR, (Precedence.OR,)),
        "not": Shape("not {}", Precedence.NOT, (Precedence.NOT,)),
        "negate": Shape("-{}", Precedence.SIGN, (Precedence.SIGN,)),
        "+": _arithmetic("+", Precedence.SUM),
        "-": _arithmetic("-", Precedence.SUM),
        "*": _arithmetic("*", Precedence.PRODUCT),
        "/": _arithmetic("/", Precedence.PRODUCT),
        "div": _arithmetic("//", Precedence.PRODUCT),
        "mod": _arithmetic("%", Precedence.PRODUCT),
        "=": _comparison("=="),
        **{
            operator: _comparison(operator) for operator in ("!=", "<", "<=", ">", ">=", "in", "not in", "is", "is not")
        },
        "between": Shape("{} <= {} <= {}", Precedence.COMPARISON, (Precedence.SUM,) * 3),
        "is None": Shape("{} is None", Precedence.COMPARISON, (Precedence.SUM,)),
        "is true": Shape("{} is True", Precedence.COMPARISON, (Precedence.SUM,)),
        "is false": Shape("{} is False", Precedence.COMPARISON, (Precedence.SUM,)),
        "is not None": Shape("{} is not None", Precedence.COMPARISON, (Precedence.SUM,)),
        "is not true": Shape("{} is not True", Precedence.COMPARISON, (Precedence.SUM,)),
        "is not false": Shape("{} is not False", Precedence.COMPARISON, (Precedence.SUM,)),
        "if": Shape("({1} if {0} else {2})", Precedence.ATOM, (Precedence.LAMBDA,) * 3),
        "if not NaN": Shape("{0} if {0} == {0} else {1}", Precedence.LAMBDA, (Precedence.SUM, Precedence.OR)),
        "lambda": Shape("lambda {}: {}", Precedence.LAMBDA, (Precedence.LAMBDA,) * 2),
        "list": Shape(", ", Precedence.LAMBDA, (Precedence.LAMBDA,)),
        "tuple": Shape("({},)", Precedence.ATOM, (Precedence.LAMBDA,)),
        "pair": Shape("({}, {})", Precedence.ATOM, (Precedence.LAMBDA,) * 2),
        "array": Shape("[{}]", Precedence.ATOM, (Precedence.LAMBDA,)),
        "object": Shape("{{{}}}", Precedence.ATOM, (Precedence.LAMBDA,)),
        "entry": Shape("{}: {}", Precedence.LAMBDA, (Precedence.LAMBDA,) * 2),
    },
    sign=Precedence.SIGN,
    atom=Precedence.ATOM,
)

code_text = PYTHON.text
"""The text of an expression."""


def constant(value: object) -> Code:
    """The code of a constant as `ascii` shows it; a number has none of what `integer` and `double` know about it."""
    return literal(ascii(value), Sort.ENUM)


_FUNCTIONS = {
    "not": "not_",
    "or": "or_",
    "and": "and_",
    "=": "equal",
    "!=": "unequal",
    "<": "less",
    "<=": "less_or_equal",
    ">": "greater",
    ">=": "greater_or_equal",
    "+": "add",
    "-": "subtract",
    "*": "multiply",
    "/": "divide",
    "if": "conditional",
    "abs": "absolute",
    "min": "minimum",
    "max": "maximum",
    "integer": "to_integer",
    "double": "to_double",
}
"""Functions of `values` that are not called like the operator or function of RoboSC."""

_OPPOSITE = {
    word: opposite
    for pair in (
        ("in", "not in"),
        ("is", "is not"),
        ("is None", "is not None"),
        ("is true", "is not true"),
        ("is false", "is not false"),
    )
    for word, opposite in (pair, pair[::-1])
}
"""Operators with `in` and `is`, before which a linter takes no `not`."""

_REDUCTIONS = {"length": "array_length", "min": "least", "max": "greatest"}


@dataclass(frozen=True, slots=True)
class Scope(ExpressionWriter):
    """Writer of expressions in Python, with the meanings of names in the generated code.

    Attributes:
        used: Function called with the name of each function of `values` that the code needs.
        model: The model, for the types of parts.
        variable: Text and type of a variable, given component and variable.
        location: Text of an automaton's current location.
        received: The code that reads received data of a path.
        root: Type of the received data, or None where there is none.
        elements: Local name and type of what the quantifiers around look at, the innermost first.
    """

    used: Callable[[str], None]
    model: Model
    variable: Callable[[str, str], tuple[str, Type]] = read_nothing
    location: Callable[[str], str] = read_nothing
    received: Callable[[Path], Code] = read_nothing
    root: Type | None = None
    elements: tuple[tuple[str, Type], ...] = ()

    def _constant_code(self, constant: bool | int | float | str) -> Code:
        match constant:
            case bool():
                return TRUE_CODE if constant else FALSE_CODE
            case int():
                return integer(constant)
            case float():
                return double(constant)
            case str():
                return literal(ascii(constant), Sort.TEXT)

    def _enum_code(self, enum: str, value: str) -> Code:
        return constant(value)

    def variable_place(self, component: str, variable: str) -> Code:
        """The place of a variable."""
        return place(*self.variable(component, variable))

    def location_place(self, automaton: str) -> Code:
        """The place of an automaton's location."""
        return variable(self.location(automaton), Sort.ENUM)

    def location_code(self, automaton: str, location: str) -> Code:
        """The code of a location."""
        return constant(location)

    def in_one_of(self, automaton: str, locations: tuple[str, ...], is_in: bool = True) -> Code:
        """Return the code that tests whether an automaton is in one of some locations, or is in none."""
        if len(locations) == 1:
            return self.state_code(automaton, locations[0], is_in)
        return operation("in" if is_in else "not in", self.location_place(automaton), constant(locations))

    def _negate_condition(self, code: Code) -> Code:
        if code.kind is Kind.OPERATION and code.word in _OPPOSITE:
            return operation(_OPPOSITE[code.word], *code.operands)
        return operation("not", code)

    def _stays_in_range(self, code: Code, low: int, high: int) -> Code:
        if code.is_known:
            return operation("between", integer(low), code, integer(high))
        return self._helper("stays_in_range", code, integer(low), integer(high))

    def _element_code(self, level: int, path: Path) -> Code:
        name, type_ = self.elements[level]
        code = place(name, type_, Unknown.VALUE)
        for step in path:
            function = "read_element" if isinstance(step, int) else "read_property"
            code = self._helper(function, code, constant(step))
        return code.typed(path_type(self.model, type_, path), Unknown.VALUE)

    def _elements(self, part: ArrayPart) -> tuple[Code, Type]:
        """The elements that are looked at, and their type."""
        code, type_ = self._array(part)
        if part.low is not None and part.high is not None:
            code = self._helper("array_part", code, integer(part.low), integer(part.high))
        return code, type_.element

    def _reduction_code(self, expression: Reduction) -> Code:
        array, element = self._elements(expression.part)
        code = self._helper(_REDUCTIONS[expression.function], array)
        if expression.function == "length":
            return replace(code, sort=Sort.INTEGER, unknown=Unknown.VALUE, low=0)
        return code.typed(element, Unknown.VALUE)

    def _quantifier_code(self, expression: Quantifier) -> Code:
        array, element = self._elements(expression.part)
        name = f"x{len(self.elements) + 1}"
        inner = replace(self, elements=((name, element), *self.elements))
        condition = operation("lambda", place(name, element), inner.value(expression.condition))
        return replace(self._helper(f"{expression.word}_of", array, condition), unknown=Unknown.VALUE)

    def _kleene_call(self, function: str, *arguments: Code, sort: Sort = Sort.BOOLEAN) -> Code:
        return replace(self._helper(_FUNCTIONS.get(function, function), *arguments), sort=sort, unknown=Unknown.VALUE)

    def _helper(self, function: str, *arguments: Code) -> Code:
        self.used(function)
        return call(function, *arguments)

    def _function_code(self, function: str, arguments: list[Code]) -> Code:
        first = arguments[0]
        if function not in ("integer", "double"):
            return self._bounded_call(function, arguments, self._kleene_call(function, *arguments, sort=first.sort))
        sort = Sort.INTEGER if function == "integer" else Sort.DOUBLE
        code = self._kleene_call(function, first, sort=sort)
        if first.sort is Sort.INTEGER is sort:
            code = replace(code, low=first.low, high=first.high)
        return replace(code, unknown=Unknown.NEVER) if first.is_known else code

    def _divided(self, operator: str, left: Code, right: Code) -> Code:
        # Python's own operators go towards minus infinity.
        return operation(operator, left, right) if left.low >= 0 else self._helper(operator, left, right)

    def _nan_comparison(self, operator: str, left: Code, right: Code) -> Code | None:
        if left.sort not in (Sort.INTEGER, Sort.DOUBLE):
            return None
        if operator == "!=":  # `!=` is true for NaN.
            return self.either(self._compare("<", left, right), self._compare(">", left, right))
        return self._compare(operator, left, right)
