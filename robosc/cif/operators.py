"""Operators of CIF's expressions: type, static value and expression of a result, from those of the operands."""

import math
import re
from collections.abc import Callable, Mapping
from decimal import Decimal
from operator import add, mul, sub
from typing import Any

from robosc.cif import syntax
from robosc.cif.terms import (
    ERROR,
    Problem,
    Term,
    broken,
    conditional,
    enum_comparison,
    logic,
    made,
    negation,
    quotient,
    remainder,
    result_range,
    retyped,
    static,
    truth,
    tuple_parts,
    tuple_term,
)
from robosc.cif.types import (
    BOOL,
    REAL,
    STRING,
    UNKNOWN,
    CifType,
    integer,
    is_compatible,
    is_equal,
    merged,
)
from robosc.expressions import MAXIMUM_INTEGER, MINIMUM_INTEGER, Binary, Unary
from robosc.model.findings import Findings
from robosc.source import Location

MAXIMUM_ELEMENTS = 100_000
"""Elements of a list or dictionary, or characters of a text, beyond which a constant is refused."""

MAXIMUM_PARTS = 1000
"""Types that a type may be made of."""

_DECIDED = {("and", False), ("or", True), ("=>", False)}
"""Operators that the value of their first operand decides."""

_ARITHMETIC: Mapping[str, Callable[[int, int], int]] = {
    "+": add, "-": sub, "*": mul, "div": quotient, "mod": remainder,
}  # fmt: skip


class Operators:
    """Operators, which report operands that do not fit.

    Args:
        findings: Findings so far.

    Attributes:
        is_evaluating: True in what is evaluated beforehand, where whatever is known may be compared, and all must be.
    """

    def __init__(self, findings: Findings) -> None:
        self._findings = findings
        self.is_evaluating = False

    def error(self, code: str, message: str, location: Location, fix: str) -> None:
        """Report an error."""
        self._findings.error(code, message, location, fix)

    def mismatch(self, message: str, at: Location, fix: str = "") -> Term:
        """Report that types do not fit; the term of an error."""
        self.error("cif-type", message, at, fix or "Use an expression of a type that fits.")
        return ERROR

    def failed(self, type_: CifType, message: str, at: Location) -> Term:
        """The term of a value that is known beforehand not to be there, which matters where it is needed."""
        return broken(type_, problem=Problem(message, at))

    def sized(self, type_: CifType, at: Location) -> CifType:
        """Return a type unless it is too large to work with, which is reported."""
        if type_.size <= MAXIMUM_PARTS:
            return type_
        self.error("cif-too-large", f"this type has more than {MAXIMUM_PARTS} parts", at, "Use a smaller type.")
        return UNKNOWN

    def unary(self, node: syntax.Unary, term: Term) -> Term:
        """The term of an operator on one operand."""
        if term.type.kind == "unknown":
            return ERROR
        if node.operator == "not":
            if term.type.kind != "bool":
                return self.mismatch(f"'not' needs a boolean; this is {of_type(term.type)}", node.at)
            return negation(term)
        if node.operator == "sample":
            if term.type.kind != "dist":
                return self.mismatch(f"'sample' needs a distribution; this is {of_type(term.type)}", node.at)
            type_ = CifType("tuple", parts=(term.type.parts[0], term.type))
            return broken(type_, term, problem=Problem("a distribution is sampled", node.at))
        if not term.type.is_number:
            return self.mismatch(f"'{node.operator}' needs a number; this is {of_type(term.type)}", node.at)
        if node.operator == "+":
            return term
        if term.type.kind == "real":
            if term.is_static:
                return static(REAL, -term.value)
            return broken(REAL, term, problem=Problem("this computes with real numbers", node.at))
        low, high = term.type.range
        if low == MINIMUM_INTEGER:
            if term.type.low is not None:
                return self.mismatch("the result may leave 32 bits", node.at)
            low += 1
        type_ = integer(-high, -low)
        if term.is_static:
            return self.integer(type_ if term.type.low is not None else CifType("int"), -term.value, node.at)
        type_ = type_ if term.type.low is not None else CifType("int")
        return made(type_, Unary("-", term.core), term) if term.is_usable else broken(type_, term)

    def binary(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        """The term of an operator between two operands."""
        operator = node.operator
        if "unknown" in (left.type.kind, right.type.kind):
            return ERROR
        if operator in ("and", "or", "=>", "<=>"):
            if left.type.kind == right.type.kind == "bool":
                # The rest is not evaluated then, and may have no value.
                if self.is_evaluating and left.is_static and (operator, left.value) in _DECIDED:
                    return truth(operator != "and")
                return logic(operator, left, right)
            if operator in ("and", "or") and left.type.kind == right.type.kind == "set":
                return self._sets(node, left, right)
            return self._unfit(node.operator, node.at, left, right)
        if operator in ("=", "!="):
            return self.equality(operator, node.at, left, right)
        if operator in ("in", "sub"):
            return self._membership(node, left, right)
        if left.type.is_number and right.type.is_number:
            if operator in ("<", "<=", ">", ">="):
                return self._order(node, left, right)
            return self._arithmetic(node, left, right)
        if operator in ("+", "-") and not (left.type.is_number or right.type.is_number):
            return self._collections(node, left, right)
        return self._unfit(node.operator, node.at, left, right)

    def _unfit(self, operator: str, at: Location, left: Term, right: Term) -> Term:
        return self.mismatch(f"'{operator}' does not take {left.type} and {right.type}", at)

    def equality(self, operator: str, at: Location, left: Term, right: Term) -> Term:
        """The term of `=` or `!=` between two operands."""
        if not (is_compatible(left.type, right.type) and left.type.has_equality and right.type.has_equality):
            return self._unfit(operator, at, left, right)
        if left.is_static and right.is_static and (self.is_evaluating or left.type.kind in ("bool", "int", "enum")):
            return truth((left.value == right.value) is (operator == "="))
        if left.type.kind == "bool":
            return logic(operator, left, right)
        if left.parts or right.parts:
            return self._tuples(operator, at, left, right)
        if left.type.kind not in ("int", "enum"):
            return broken(BOOL, left, right, problem=Problem(f"values of type {left.type} are compared", at))
        if not (left.is_usable and right.is_usable):
            return broken(BOOL, left, right)
        if left.type.kind == "enum":
            return made(BOOL, enum_comparison(operator, left.core, right.core), left, right)
        return made(BOOL, Binary("=" if operator == "=" else "!=", left.core, right.core), left, right)

    def _tuples(self, operator: str, at: Location, left: Term, right: Term) -> Term:
        """Compare tuples that are not both known, field by field."""
        found = truth(True)
        for one, other in zip(tuple_parts(left), tuple_parts(right), strict=True):
            found = logic("and", found, self.equality("=", at, one, other))
        return found if operator == "=" else negation(found)

    def _order(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        is_real = "real" in (left.type.kind, right.type.kind)
        if is_real and not (self.is_evaluating and left.is_static and right.is_static):
            return broken(BOOL, left, right, problem=Problem("real numbers are compared", node.at))
        if left.is_static and right.is_static:
            a, b = left.value, right.value
            return truth({"<": a < b, "<=": a <= b, ">": a > b, ">=": a >= b}[node.operator])
        if not (left.is_usable and right.is_usable):
            return broken(BOOL, left, right)
        return made(BOOL, Binary(node.operator, left.core, right.core), left, right)  # type: ignore[arg-type]

    def _arithmetic(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        operator = node.operator
        if operator == "/" or (operator in ("+", "-", "*") and "real" in (left.type.kind, right.type.kind)):
            return self._real(node, left, right)
        if "real" in (left.type.kind, right.type.kind):
            return self._unfit(node.operator, node.at, left, right)
        if operator in ("div", "mod") and (right.type.low, right.type.high) == (0, 0):
            return self.mismatch("this divides by zero", node.at)
        low, high = result_range(operator, left.type.range, right.type.range)
        is_ranged = left.type.low is not None and right.type.low is not None
        if low < MINIMUM_INTEGER or high > MAXIMUM_INTEGER:
            if is_ranged:
                return self.mismatch("the result may leave 32 bits", node.at)
            low, high = max(low, MINIMUM_INTEGER), min(high, MAXIMUM_INTEGER)
        type_ = integer(low, high) if is_ranged else CifType("int")
        if left.is_static and right.is_static:
            if operator in ("div", "mod") and right.value == 0:
                return self.failed(type_, "this divides by zero", node.at)
            return self.integer(type_, _ARITHMETIC[operator](left.value, right.value), node.at)
        if not (left.is_usable and right.is_usable):
            return broken(type_, left, right)
        if operator in ("div", "mod") and not (right.is_static and right.value > 0):
            problem = Problem(f"'{operator}' has a divisor that is not a constant above zero", node.at)
            return broken(type_, left, right, problem=problem)
        return made(type_, Binary(operator, left.core, right.core), left, right)  # type: ignore[arg-type]

    def _real(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        if not (left.is_static and right.is_static):
            return broken(REAL, left, right, problem=Problem("this computes with real numbers", node.at))
        a, b = float(left.value), float(right.value)
        if node.operator == "/" and b == 0:
            return self.failed(REAL, "this divides by zero", node.at)
        value = {"+": lambda: a + b, "-": lambda: a - b, "*": lambda: a * b, "/": lambda: a / b}[node.operator]()
        return self.real(value, node.at)

    def integer(self, type_: CifType, value: int, at: Location) -> Term:
        """The term of a result that is an integer, if it is one of 32 bits."""
        if not MINIMUM_INTEGER <= value <= MAXIMUM_INTEGER:
            return self.failed(type_, "the result leaves 32 bits", at)
        return static(type_, value)

    def real(self, value: float, at: Location) -> Term:
        """The term of a result that is a real number, if it is one."""
        if not math.isfinite(value):
            return self.failed(REAL, "the result is larger than real numbers can be", at)
        # A sum with zero makes the negative zero the one that there is.
        return static(REAL, value + 0.0)

    def _sets(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        if not is_compatible(left.type, right.type):
            return self._unfit(node.operator, node.at, left, right)
        type_ = merged(left.type, right.type)
        if not (left.is_static and right.is_static):
            return broken(type_, left, right, problem=Problem("this computes with sets", node.at))
        return static(type_, left.value & right.value if node.operator == "and" else left.value | right.value)

    def _collections(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        """Join or subtract strings, lists, sets or dictionaries."""
        kind = left.type.kind
        if node.operator == "-" and kind == "dict":
            return self._without_keys(node, left, right)
        is_known = kind in ("string", "list", "dict") if node.operator == "+" else kind == "set"
        if not is_known or not is_compatible(left.type, right.type):
            return self._unfit(node.operator, node.at, left, right)
        type_ = merged(left.type, right.type)
        if kind == "list" and type_.low is not None:
            lengths = [one + other for one, other in zip(left.type.range, right.type.range, strict=True)]
            type_ = CifType("list", lengths[0], min(lengths[1], MAXIMUM_INTEGER), type_.parts)
        if not (left.is_static and right.is_static):
            return broken(type_, left, right, problem=Problem(f"this computes with values of type {type_}", node.at))
        if node.operator == "-":
            return static(type_, left.value - right.value)
        if len(left.value) + len(right.value) > MAXIMUM_ELEMENTS:
            message = f"this has more than {MAXIMUM_ELEMENTS} elements"
            self.error("cif-too-large", message, node.at, "Use fewer elements.")
            return ERROR
        if kind == "dict":
            return static(type_, frozenset((dict(left.value) | dict(right.value)).items()))
        return static(type_, left.value + right.value)

    def _without_keys(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        """Remove the keys of a dictionary, or of a list or set of keys, from a dictionary."""
        is_fit = is_compatible(left.type, right.type) if right.type.kind == "dict" else (
            right.type.kind in ("list", "set") and is_compatible(left.type.parts[0], right.type.parts[0])
        )  # fmt: skip
        if not is_fit:
            return self._unfit(node.operator, node.at, left, right)
        type_ = merged(left.type, right.type) if right.type.kind == "dict" else left.type
        if not (left.is_static and right.is_static):
            return broken(type_, left, right, problem=Problem("this computes with dictionaries", node.at))
        keys = set(dict(right.value) if right.type.kind == "dict" else right.value)
        return static(type_, frozenset(item for item in left.value if item[0] not in keys))

    def _membership(self, node: syntax.Binary, left: Term, right: Term) -> Term:
        if node.operator == "sub":
            is_fit = left.type.kind == right.type.kind == "set" and is_compatible(left.type, right.type)
        else:
            is_fit = right.type.kind in ("list", "set", "dict") and left.type.has_equality
            is_fit = is_fit and is_compatible(left.type, right.type.parts[0])
        if not is_fit:
            return self._unfit(node.operator, node.at, left, right)
        if not (left.is_static and right.is_static):
            return broken(BOOL, left, right, problem=Problem(f"'{node.operator}' has a value of a state", node.at))
        if node.operator == "sub":
            return truth(left.value <= right.value)
        return truth(left.value in (dict(right.value) if right.type.kind == "dict" else right.value))

    def choice(self, condition: Term, then: Term, otherwise: Term, type_: CifType) -> Term:
        """`if condition: then else otherwise end`, of one type."""
        if "unknown" in (condition.type.kind, then.type.kind, otherwise.type.kind):
            return ERROR
        return conditional(condition, retyped(then, type_), retyped(otherwise, type_), type_)

    def common(self, terms: list[Term], at: Location, what: str) -> CifType | None:
        """The type of values that must all fit the first; None after reporting that they do not."""
        found = terms[0].type
        for term in terms[1:]:
            if not is_compatible(terms[0].type, term.type):
                self.mismatch(f"{what} have types that do not fit each other: {terms[0].type} and {term.type}", at)
                return None
            found = merged(found, term.type)
        if found.kind == "automaton":
            self.mismatch(f"an automaton is no value, and {what} must be values", at)
            return None
        return found

    def group(self, node: syntax.Group, items: list[Term], hint: CifType | None) -> Term:
        """The term of a tuple, list, set or dictionary of elements."""
        if any(item.type.kind == "unknown" for item in items):
            return ERROR
        if node.kind == "tuple":
            if any(item.type.kind == "automaton" for item in items):
                return self.mismatch("an automaton is no value, and those of a tuple must be values", node.at)
            whole = self.sized(CifType("tuple", parts=tuple(item.type for item in items)), node.at)
            return ERROR if whole.kind == "unknown" else tuple_term(whole, tuple(items))
        if not items:
            if hint is None or hint.kind not in (("list",) if node.kind == "list" else ("set", "dict")):
                return self.mismatch("nothing says what type this has", node.at,
                                     "Write its type before it, as in '<list int>[]'.")  # fmt: skip
            length = 0 if node.kind == "list" else None
            return static(CifType(hint.kind, length, length, hint.parts), () if node.kind == "list" else frozenset())
        groups = [items[::2], items[1::2]] if node.kind == "dict" else [items]
        parts = []
        for group in groups:
            part = self.common(group, node.at, "the elements")
            if part is None:
                return ERROR
            parts.append(part)
        if node.kind != "list" and not parts[0].has_equality:
            return self.mismatch(f"values {of_type(parts[0])} cannot be told apart", node.at)
        length = len(items) if node.kind == "list" else None
        type_ = self.sized(CifType(node.kind, length, length, tuple(parts)), node.at)
        if not all(item.is_static for item in items):
            return broken(type_, *items, problem=Problem(f"this makes a {node.kind} of values of a state", node.at))
        values = [item.value for item in items]
        if node.kind == "dict":
            if len(set(values[::2])) < len(items) // 2:
                return self.failed(type_, "two keys of this dictionary are the same", node.at)
            return static(type_, frozenset(zip(values[::2], values[1::2], strict=True)))
        return static(type_, tuple(values) if node.kind == "list" else frozenset(values))

    def cast(self, node: syntax.Cast, type_: CifType, term: Term) -> Term:
        """The term of a value that is cast to a type."""
        if "unknown" in (term.type.kind, type_.kind):
            return ERROR
        if is_equal(term.type, type_) and term.type.kind != "automaton":
            return retyped(term, type_)
        pairs = {("int", "real"), ("bool", "string"), ("int", "string"), ("real", "string"), ("automaton", "string"),
                 ("string", "bool"), ("string", "int"), ("string", "real")}  # fmt: skip
        if (term.type.kind, type_.kind) not in pairs or (type_.kind == "int" and type_.low is not None):
            return self.mismatch(f"{term.type} cannot be cast to {type_}", node.at)
        if not term.is_static:
            return broken(type_, term, problem=Problem(f"a value of a state is cast to {type_}", node.at))
        try:
            return _cast_value(term, type_)
        except ValueError:
            return self.failed(type_, f"{term.value!r} is not {type_}", node.at)


def of_type(type_: CifType) -> str:
    """Return the words for a value's type in a message."""
    return f"of type {type_}"


def real_text(value: float) -> str:
    """A real number as CIF writes it: with a point always, and in powers of ten from 1e7 on and below 1e-3."""
    if value == 0 or 1e-3 <= abs(value) < 1e7:
        return format(Decimal(repr(value)), "f") if value else "0.0"
    sign, figures, place = Decimal(repr(value)).as_tuple()
    text = "".join(map(str, figures)).rstrip("0")
    power = len(figures) - 1 + int(place)
    return f"{'-' if sign else ''}{text[0]}.{text[1:] or '0'}e{power}"


def value_text(value: Any, type_: CifType) -> str:
    """A static value as CIF writes it; a text without its quotes."""
    return str(value) if type_.kind == "string" else _literal_text(value, type_)


def _literal_text(value: Any, type_: CifType) -> str:
    match type_.kind:
        case "bool":
            return str(value).lower()
        case "real":
            return real_text(value)
        case "string":
            escaped = value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\t", "\\t")
            return f'"{escaped}"'
        case "tuple":
            return f"({', '.join(map(_literal_text, value, type_.parts))})"
        case "list" | "set":
            items = [_literal_text(item, type_.parts[0]) for item in value]
            return f"[{', '.join(items)}]" if type_.kind == "list" else f"{{{', '.join(sorted(items))}}}"
        case "dict":
            pairs = sorted(": ".join(map(_literal_text, item, type_.parts)) for item in value)
            return f"{{{', '.join(pairs)}}}"
    return str(value)


def _cast_value(term: Term, type_: CifType) -> Term:
    value = term.value
    match type_.kind:
        case "real":
            if isinstance(value, str) and not re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", value, re.ASCII):
                raise ValueError(value)
            if not math.isfinite(float(value)):
                raise ValueError(value)
            return static(REAL, float(value))
        case "string":
            return static(STRING, value_text(value, term.type))
        case "bool":
            if value not in ("true", "false"):
                raise ValueError(value)
            return truth(value == "true")
    if not re.fullmatch(r"[+-]?[0-9]{1,20}", value):
        raise ValueError(value)
    found = int(value)
    if not MINIMUM_INTEGER <= found <= MAXIMUM_INTEGER:
        raise ValueError(value)
    return static(type_, found)
