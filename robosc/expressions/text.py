"""Expressions in the language's own words and syntax, with as few parentheses as A.3 allows."""

import re
from collections.abc import Collection

from robosc.expressions.tree import (
    ITSELF,
    ArrayPart,
    Binary,
    Call,
    Conditional,
    Constant,
    Element,
    EnumValue,
    Expression,
    PathStep,
    Quantifier,
    Received,
    Reduction,
    StateTest,
    Unary,
    VariableRead,
)
from robosc.expressions.types import BooleanType, EnumType, IntegerType, Type, type_text

_LEVELS = {
    "or": 1,
    "and": 2,
    "=": 3,
    "!=": 4,
    ">": 5,
    ">=": 5,
    "<": 5,
    "<=": 5,
    "+": 6,
    "-": 6,
    "*": 7,
    "/": 7,
    "div": 7,
    "mod": 7,
}
_NOT, _NEGATIVE, _OPERAND = 8, 9, 10
_COMPARISONS = frozenset({"=", "!=", ">", ">=", "<", "<="})
_IMPLIES = 0
_CONDITIONAL = -1

_SENTENCE = re.compile("(.*) (is|was) ")
"""Beginning of a sentence, up to its verb: the last, as a name in it may be one, too.

It is a variable whose name has blanks; no name of the language has any.
"""


def automaton_text(name: str, components: Collection[str]) -> str:
    """Return the name of an automaton in a text.

    The language of properties reads this name with a dot and `location` behind it.

    A component has its name, and so has a service or action (whose automaton is called `service calibrate`), unless a
    component has that name: then the bare name would mean the component.

    Args:
        name: The automaton's name.
        components: Names of all components.
    """
    bare = name.rpartition(" ")[2]
    return name if bare in components else bare


def variable_text(component: str, variable: str) -> str:
    """Return the name of a variable in a text: with its component before it, unless it is a sentence or `ITSELF`."""
    if variable == ITSELF:
        return component
    return variable if _SENTENCE.search(variable) else f"{component}.{variable}"


def cif_text(expression: Expression) -> str:
    """Return an expression about automata in CIF's notation.

    It has `not`, an `if` with a colon and an `end`, comparisons of one rank and literals of enums by absolute names.
    Names of automata are whole.
    """
    return _Printer((), is_cif=True).print(expression, 0)[0]


def cif_type_text(type_: Type) -> str:
    """Return the type of a variable of automata in CIF's notation."""
    match type_:
        case IntegerType(low=int(low), high=int(high)):
            return f"int[{low}..{high}]"
        case BooleanType():
            return "bool"
        case _:
            return type_text(type_)


def cif_literal(enum: str, value: str) -> str:
    """Return the absolute name of a literal, which stands in the component that declares its enum."""
    scope, dot, _ = enum.rpartition(".")
    return f"{scope}{dot}{value}"


def literal_named(type_: EnumType, text: str) -> str:
    """Return the literal of an enum that goes by a name, its own or the absolute one; other texts as they are."""
    return next((value for value in type_.values if text == cif_literal(type_.name, value)), text)


def expression_text(expression: Expression, components: Collection[str] = ()) -> str:
    """The expression as a user would write it.

    The operator `holds` has no syntax, since an author never needs it; it is printed as `holds(...)`.
    A communication's location is printed as `automaton_text` says. The elements that quantifiers look at are called
    `x1` (of the outermost), `x2` and so on. A variable whose name has blanks is a sentence, such as `goal 1 is owed`,
    of which no text of the language speaks either.

    Args:
        expression: The expression.
        components: Names of all components; needed only where it may read locations of services and actions, which no
            text of the language names.
    """
    return _Printer(components).print(expression, 0)[0]


class _Printer:
    """Prints the expressions of one robot."""

    def __init__(self, components: Collection[str], *, is_cif: bool = False) -> None:
        self._components = components
        self._is_cif = is_cif

    def print(self, expression: Expression, depth: int) -> tuple[str, int]:
        """The text and how tightly its outermost operator binds, inside `depth` quantifiers."""
        match expression:
            case Constant(value=bool(value)):
                return ("true" if value else "false"), _OPERAND
            case Constant(value=str(value)):
                return _quoted(value), _OPERAND
            case Constant(value=int(value) | float(value)):
                text = _number(value)
                return text, (_NEGATIVE if text.startswith("-") else _OPERAND)
            case EnumValue(enum=enum, value=value):
                return (cif_literal(enum, value) if self._is_cif else value), _OPERAND
            case VariableRead(component=component, variable=variable):
                return variable_text(component, variable), _OPERAND
            case StateTest(component=component, state=state):
                name = component if self._is_cif else automaton_text(component, self._components)
                return f"{name}.{state}", _OPERAND
            case Received(path=path):
                return f"value{_steps(path)}", _OPERAND
            case Element(level=level, path=path):
                return f"x{depth - level}{_steps(path)}", _OPERAND
            case Call(function=function, arguments=arguments):
                return f"{function}({', '.join([self.print(item, depth)[0] for item in arguments])})", _OPERAND
            case Reduction(function=function, part=part):
                return f"{function}({self._part(part, depth)})", _OPERAND
            case Quantifier(word=word, part=part, condition=condition):
                inside = self.print(condition, depth + 1)[0]
                return f"{word}(x{depth + 1} in {self._part(part, depth)}: {inside})", _OPERAND
            case Conditional(condition=condition, then=then, otherwise=otherwise):
                # No generator here: each of those that are open within each other takes a part of C's stack.
                parts = [self.print(item, depth)[0] for item in (condition, then, otherwise)]
                if self._is_cif:
                    return "if {}: {} else {} end".format(*parts), _OPERAND
                return "if {} then {} else {}".format(*parts), _CONDITIONAL
            case Unary(operator="holds", operand=operand) if self._is_cif:
                # Every condition of automata is true or false.
                return self.print(operand, depth)
            case Unary(operator="holds", operand=operand):
                return f"holds({self.print(operand, depth)[0]})", _OPERAND
            case Unary(operator="not", operand=VariableRead(variable=variable)) if _SENTENCE.search(variable):
                return _SENTENCE.sub(r"\1 \2 not ", variable, count=1), _OPERAND
            case Unary(operator="not", operand=operand):
                return f"{'not ' if self._is_cif else '!'}{self._within(operand, _NOT, depth)}", _NOT
            case Unary(operand=operand):
                return f"-{self._within(operand, _NEGATIVE, depth)}", _NEGATIVE
            case Binary(operator="implies", left=left, right=right):
                # Its operands are literals, negations or parentheses, and it stands alone.
                return f"{self._within(left, _NOT, depth)} => {self._within(right, _NOT, depth)}", _IMPLIES
            case Binary(operator=operator, left=left, right=right):
                level = first = _LEVELS[operator]
                if self._is_cif and operator in _COMPARISONS:
                    # All have one rank; each in another is in parentheses, on the left as well.
                    level, first = _LEVELS["="], _LEVELS["+"]
                second = max(first, level + 1)
                return f"{self._within(left, first, depth)} {operator} {self._within(right, second, depth)}", level
        raise TypeError(f"no expression: {expression!r}")

    def _part(self, part: ArrayPart, depth: int) -> str:
        """An array or a slice of it."""
        text = self.print(part.array, depth)[0]
        return text if part.low is None else f"{text}[{part.low}..{part.high}]"

    def _within(self, expression: Expression, level: int, depth: int) -> str:
        """An operand, in parentheses where it binds less tightly than its place requires."""
        text, binds = self.print(expression, depth)
        return text if binds >= level else f"({text})"


def _steps(path: tuple[PathStep, ...]) -> str:
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)


def _number(value: float) -> str:
    """A number in the language's digits: no exponent."""
    if isinstance(value, int):
        return str(value)
    text = repr(value)
    return (
        text
        if "e" not in text
        else format(value, "f")
        if value == float(format(value, "f"))
        else f"{value:.340f}".rstrip("0")
    )


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\t", "\\t")
    return f'"{escaped}"'
