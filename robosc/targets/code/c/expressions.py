"""RoboSC expressions in C: see `robosc.targets.code.expression_writer`.

Unknown values are -1 for a boolean and an enum, INT64_MIN for an integer, NaN for a double, NULL for a
text. Integers are computed in 64 bits, so that a result beyond 32 bits is detected before it overflows.
"""

from dataclasses import replace

from robosc.expressions import MINIMUM_INTEGER
from robosc.targets.code.c.text import string_literal
from robosc.targets.code.expression_writer import OPPOSITE, ExpressionWriter
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
    literal,
    operation,
)

# Operands stand in parentheses unless they are atoms; only conditions that guard an access are joined without.
_OTHER, _GUARD, ATOM = range(3)


def _infix(operator: str) -> Shape:
    return Shape(f"{{}} {operator} {{}}", _OTHER, (ATOM, ATOM))


_CASTS = ("void", "double", "int64_t", "int32_t", "uint8_t", "uint16_t", "uint32_t")
"""Types that a value is converted to."""

C = Language(
    {
        "true": Shape("true", ATOM),
        "false": Shape("false", ATOM),
        "and": Shape(" && ", _OTHER, (_GUARD,)),
        "or": Shape(" || ", _OTHER, (_GUARD,)),
        "not": Shape("!{}", _OTHER, (ATOM,)),
        "negate": Shape("-{}", _OTHER, (ATOM,)),
        "=": _infix("=="),
        **{operator: _infix(operator) for operator in ("+", "-", "*", "/", "!=", "<", "<=", ">", ">=")},
        "div": _infix("/"),
        "mod": _infix("%"),
        "below": Shape("{} < {}", _OTHER, (ATOM, _OTHER)),
        "is true": Shape("{} == 1", _OTHER, (ATOM,)),
        "is false": Shape("{} == 0", _OTHER, (ATOM,)),
        "if": Shape("{} ? {} : {}", _OTHER, (ATOM,) * 3),
        "if there": Shape("{} ? {} : {}", _OTHER, (ATOM, ATOM, _OTHER)),
        "has element": Shape("{} != NULL && {} > {}", _GUARD, (ATOM,) * 3),
        **{name: Shape(f"({name}){{}}", _OTHER, (ATOM,)) for name in _CASTS},
        "between": Shape("{1} >= {0} && {1} <= {2}", _GUARD, (_OTHER, ATOM, _OTHER)),
        "is given": Shape("{} != NULL", _GUARD, (ATOM,)),
        "is set": Shape("({} != 0)", ATOM, (ATOM,)),
        "not all": Shape("!({})", _GUARD, (_OTHER,)),
        "truth": Shape("({}) != 0", _OTHER, (_OTHER,)),
        "unknown boolean": Shape("{} < 0", _GUARD, (ATOM,)),
        "unknown enum": Shape("{} < 0", _GUARD, (ATOM,)),
        "unknown integer": Shape("{} == INT64_MIN", _GUARD, (ATOM,)),
        "unknown double": Shape("!isfinite({})", _GUARD, (_OTHER,)),
        "unknown text": Shape("{} == NULL", _GUARD, (ATOM,)),
        "item": Shape("{}[{}]", ATOM, (ATOM, _OTHER)),
        "increment": Shape("{}++", _OTHER, (ATOM,)),
    },
    sign=_OTHER,
    atom=ATOM,
)

code_text = C.text
"""The text of an expression."""

_TYPES = {
    Sort.BOOLEAN: ("int", "b", "KLEENE_UNKNOWN"),
    Sort.INTEGER: ("int64_t", "i", "INT64_MIN"),
    Sort.DOUBLE: ("double", "d", "(double)NAN"),
    Sort.ENUM: ("int", "e", "-1"),
    Sort.TEXT: ("const char *", "t", "NULL"),
}

_FUNCTIONS = {
    "not": "not",
    "and": "and",
    "or": "or",
    "=": "equal",
    "<": "less",
    "<=": "at_most",
    "+": "add",
    "-": "subtract",
    "*": "multiply",
    "/": "divide",
    "if": "choose",
}
"""Functions of the unit that are not called like the operator or function of RoboSC."""


def c_type(sort: Sort) -> str:
    """The C type that holds a value that may be unknown."""
    return _TYPES[sort][0]


def unknown_text(sort: Sort) -> str:
    """Text that stands for unknown."""
    return _TYPES[sort][2]


def unknown_as(sort: Sort) -> Unknown:
    """Way in which a value is unknown."""
    return Unknown.NAN if sort is Sort.DOUBLE else Unknown.VALUE


def number_code(number: int) -> Code:
    """A 32-bit number without the suffix of 64 bits."""
    is_least = number == MINIMUM_INTEGER
    return literal("(-2147483647 - 1)" if is_least else str(number), Sort.INTEGER, number, number < 0 and not is_least)


def _tested(code: Code) -> tuple[Code, str, bool] | None:
    """Return the place, the constant and whether they are equal, if a condition tests that."""
    match code:
        case Code(kind=Kind.PLACE):
            return code, "true", True
        case Code(kind=Kind.OPERATION, word="not", operands=(Code(kind=Kind.PLACE) as place_,)):
            return place_, "true", False
        case Code(kind=Kind.OPERATION, word="=" | "!=" as word, operands=(left, right)) if right.is_literal:
            return (left, right.word, word == "=") if right.sort in (Sort.INTEGER, Sort.ENUM) else None
    return None


def _is_decided(operator: str, operands: tuple[Code, ...]) -> bool:
    """Return True if tests joined by an operator say nothing, as compilers warn: never all true, or always one."""
    tests = [test for test in map(_tested, operands) if test is not None]
    # Equalities of a place exclude each other in a conjunction, and so do inequalities in a disjunction.
    pairs = {(subject, constant) for subject, constant, is_equal in tests if is_equal is (operator == "and")}
    others = {(subject, constant) for subject, constant, is_equal in tests if is_equal is not (operator == "and")}
    return len({subject for subject, _ in pairs}) < len(pairs) or bool(pairs & others)


class CWriter(ExpressionWriter):
    """Writer of expressions in C; what they read is left open."""

    def _constant_code(self, constant: bool | int | float | str) -> Code:
        match constant:
            case bool():
                return TRUE_CODE if constant else FALSE_CODE
            case int() if constant < 0:
                text = str(constant) if constant > MINIMUM_INTEGER else "-2147483647 - 1"
                return literal(text, Sort.INTEGER, constant, is_signed=True)
            case int():
                return literal(f"INT64_C({constant})", Sort.INTEGER, constant)
            case float():
                return double(constant)
            case str():
                return literal(string_literal(constant), Sort.TEXT)

    def variable_code(self, component: str, variable: str) -> Code:
        """The code that reads a variable."""
        found = self.variable_place(component, variable)
        if found.sort is not Sort.INTEGER:
            return found
        # Small members would be added as `int`, which may have 16 bits.
        return replace(found, kind=Kind.OPERATION, word="int64_t", operands=(found,))

    def _kleene_call(self, function: str, *arguments: Code, sort: Sort = Sort.BOOLEAN) -> Code:
        name = f"{_FUNCTIONS.get(function, function)}_{_TYPES[arguments[-1].sort][1]}"
        return call(name, *arguments, sort=sort, unknown=unknown_as(sort))

    def _function_code(self, function: str, arguments: list[Code]) -> Code:
        first = arguments[0]
        if function == "double":
            return self.as_double(first)
        if function == "integer":
            if first.sort is Sort.INTEGER:
                return first
            unknown = Unknown.NEVER if first.is_known else Unknown.VALUE
            return call("integer_of", first, sort=Sort.INTEGER, unknown=unknown)
        is_integer = all(item.sort is Sort.INTEGER for item in arguments)
        sort = Sort.INTEGER if is_integer else Sort.DOUBLE
        codes = arguments if is_integer else [self.as_double(item) for item in arguments]
        return self._bounded_call(function, arguments, self._kleene_call(function, *codes, sort=sort))

    def as_double(self, code: Code) -> Code:
        """A number as a double."""
        if code.sort is Sort.DOUBLE:
            return code
        if not code.is_known:
            return call("double_of", code, sort=Sort.DOUBLE, unknown=Unknown.NAN)
        return operation("double", code, sort=Sort.DOUBLE)

    def _in_one_type(self, left: Code, right: Code) -> tuple[Code, Code]:
        if left.sort is right.sort or Sort.DOUBLE not in (left.sort, right.sort):
            return left, right
        return self.as_double(left), self.as_double(right)

    def _joined_unknown(self, left: Code, right: Code) -> Unknown:
        return left.unknown if right.is_known else right.unknown

    def _join(self, operator: str, operands: tuple[Code, ...]) -> Code:
        if _is_decided(operator, operands):
            return FALSE_CODE if operator == "and" else TRUE_CODE
        return operation(operator, *operands)

    def _negate_condition(self, code: Code) -> Code:
        if _tested(code) is None or code.kind is Kind.PLACE:
            return operation("not", code)
        return code.operands[0] if code.word == "not" else operation(OPPOSITE[code.word], *code.operands)

    def _compare(self, operator: str, left: Code, right: Code) -> Code:
        if left == right:  # Compilers warn about a comparison of something with itself.
            return TRUE_CODE if operator in ("=", "<=", ">=") else FALSE_CODE
        if left.sort is Sort.INTEGER and (decided := _by_bounds(operator, left, right)) is not None:
            return decided
        if left.sort is Sort.TEXT:
            return operation(operator, call("strcmp", left, right), literal("0", Sort.TEXT))
        return operation(operator, left, right)

    def _stays_in_range(self, code: Code, low: int, high: int) -> Code:
        return call("stays_in_range", code, number_code(low), number_code(high))

    def _nan_comparison(self, operator: str, left: Code, right: Code) -> Code | None:
        is_native = left.sort is Sort.DOUBLE and operator != "!=" and left != right  # `!=` is true for NaN.
        return operation(operator, left, right) if is_native else None

    def _kleene_comparison(self, operator: str, left: Code, right: Code) -> Code:
        if operator == "!=":
            return self._kleene_not(self._kleene_call("=", left, right))
        if operator in (">", ">="):
            return self._kleene_call({">": "<", ">=": "<="}[operator], right, left)
        return self._kleene_call(operator, left, right)

    def _kleene_implication(self, left: Code, right: Code) -> Code:
        return self._kleene_call("or", self._kleene_not(left), right)


def _by_bounds(operator: str, left: Code, right: Code) -> Code | None:
    """A comparison of integers that their bounds decide, if they do."""
    match operator:
        case "=" | "!=":
            is_decided = left.high < right.low or right.high < left.low
            return (TRUE_CODE if operator == "!=" else FALSE_CODE) if is_decided else None
        case ">" | ">=":
            return _by_bounds({">": "<", ">=": "<="}[operator], right, left)
        case "<":
            return TRUE_CODE if left.high < right.low else FALSE_CODE if left.low >= right.high else None
        case _:
            return TRUE_CODE if left.high <= right.low else FALSE_CODE if left.low > right.high else None
