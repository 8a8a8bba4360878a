"""Resolves and types expressions (language A.3 to A.5)."""

from dataclasses import dataclass
from itertools import chain

from robosc.expressions import (
    MAXIMUM_INTEGER,
    MINIMUM_INTEGER,
    ArrayType,
    Binary,
    BooleanType,
    Constant,
    DoubleType,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    NoneType,
    ObjectType,
    PathStep,
    Received,
    StateTest,
    StringType,
    Type,
    Unary,
    VariableRead,
    is_numeric,
    type_text,
)
from robosc.language import syntax
from robosc.model.findings import Findings
from robosc.model.scope import ComponentNames, Scope

_BOOLEAN = BooleanType()
_LOGIC = {"or": "or", "and": "and", "=>": "implies"}
_ORDER = frozenset({"<", "<=", ">", ">="})


@dataclass(frozen=True, slots=True)
class Typed:
    """A resolved expression, its type, and for a bounded integer the values it can have.

    Attributes:
        expression: The expression.
        type: Its type; an integer's bounds are those its value can have.
    """

    expression: Expression
    type: Type


class ExpressionChecker:
    """Resolves the expressions of one scope.

    Args:
        scope: What names mean.
        findings: Where faults are reported.
    """

    def __init__(self, scope: Scope, findings: Findings) -> None:
        self._scope = scope
        self._findings = findings

    def condition(self, tree: syntax.Expression) -> Expression | None:
        """A boolean expression, or None after reporting what is wrong."""
        return self.value(tree, _BOOLEAN)

    def value(self, tree: syntax.Expression, wanted: Type) -> Expression | None:
        """An expression that fits a type, or None after reporting what is wrong."""
        typed = self.fitting(tree, wanted)
        return None if typed is None else typed.expression

    def fitting(self, tree: syntax.Expression, wanted: Type) -> Typed | None:
        """As `value`, with the type."""
        typed = self.infer(tree, wanted)
        if typed is not None and not fits(typed.type, wanted):
            self._mismatch(tree, typed.type, f"{type_text(wanted)} is needed here")
            return None
        return typed

    def infer(self, tree: syntax.Expression, wanted: Type | None = None) -> Typed | None:
        """An expression and its type; `wanted` decides between enums that share a value."""
        match tree:
            case syntax.Literal(value=value):
                return Typed(Constant(value), _literal_type(value))
            case syntax.Access():
                return self._access(tree, wanted)
            case syntax.Unary():
                return self._unary(tree)
            case syntax.Binary():
                return self._binary(tree)

    def _mismatch(self, tree: syntax.Expression, found: Type, needed: str) -> None:
        self._findings.error(
            "type-mismatch",
            f"this is {_article(type_text(found))}, but {needed}",
            tree.location,
            "Write an expression of the needed type.",
        )

    # Operators

    def _unary(self, tree: syntax.Unary) -> Typed | None:
        operand = self.infer(tree.operand)
        if operand is None:
            return None
        if tree.operator == "!":
            if not isinstance(operand.type, BooleanType):
                self._mismatch(tree.operand, operand.type, "'!' takes a boolean")
                return None
            return Typed(Unary("not", operand.expression), _BOOLEAN)
        if not is_numeric(operand.type):
            self._mismatch(tree.operand, operand.type, "'-' takes a number")
            return None
        if isinstance(operand.type, IntegerType):
            low, high = _bounds(operand.type)
            return Typed(Unary("-", operand.expression), _integer(-high, -low))
        return Typed(Unary("-", operand.expression), operand.type)

    def _binary(self, tree: syntax.Binary) -> Typed | None:
        if tree.operator in ("=", "!="):
            return self._equality(tree)
        left, right = self.infer(tree.left), self.infer(tree.right)
        if left is None or right is None:
            return None
        logical = tree.operator in _LOGIC
        for side, typed in ((tree.left, left), (tree.right, right)):
            suits = isinstance(typed.type, BooleanType) if logical else is_numeric(typed.type)
            if not suits:
                self._mismatch(side, typed.type, f"'{tree.operator}' takes {'booleans' if logical else 'numbers'}")
                return None
        if logical:
            return Typed(Binary(_LOGIC[tree.operator], left.expression, right.expression), _BOOLEAN)  # type: ignore[arg-type]
        result = Binary(tree.operator, left.expression, right.expression)  # type: ignore[arg-type]
        if tree.operator in _ORDER:
            return Typed(result, _BOOLEAN)
        if tree.operator != "/" and isinstance(left.type, IntegerType) and isinstance(right.type, IntegerType):
            return Typed(result, _arithmetic(tree.operator, left.type, right.type))
        return Typed(result, DoubleType())

    def _equality(self, tree: syntax.Binary) -> Typed | None:
        """One type on both sides; the side with a type of its own decides what a bare enum value means."""
        if self._is_bare_value(tree.left):
            right = self.infer(tree.right)
            left = self.infer(tree.left, right.type if right else None)
        else:
            left = self.infer(tree.left)
            right = self.infer(tree.right, left.type if left else None)
        if left is None or right is None:
            return None
        both_numbers = is_numeric(left.type) and is_numeric(right.type)
        comparable = not isinstance(left.type, ObjectType | ArrayType | NoneType)
        if not comparable or not (both_numbers or _same_kind(left.type, right.type)):
            self._findings.error(
                "type-mismatch",
                f"'{tree.operator}' compares {_article(type_text(left.type))} with {_article(type_text(right.type))}",
                tree.location,
                "Compare values of one type.",
            )
            return None
        return Typed(Binary(tree.operator, left.expression, right.expression), _BOOLEAN)  # type: ignore[arg-type]

    def _is_bare_value(self, tree: syntax.Expression) -> bool:
        """Whether a tree is a single name that can only be an enum value."""
        if not isinstance(tree, syntax.Access) or tree.root is None or tree.steps:
            return False
        return not (self._scope.own and tree.root.text in self._scope.own.variables)

    # Accesses

    def _access(self, tree: syntax.Access, wanted: Type | None) -> Typed | None:
        if tree.root is None:
            return self._received(tree)
        name, own = tree.root.text, self._scope.own
        if tree.steps and name in self._scope.components:
            return self._component_part(tree, self._scope.components[name])
        if own and name in own.variables:
            return self._variable(tree, own, tree.root, tree.steps)
        if not tree.steps and self._scope.enums_with(name):
            return self._enum_value(tree, name, wanted)
        if tree.steps and name in self._scope.enums:
            return self._qualified_value(tree, self._scope.enums[name])
        if name in self._scope.components:
            self._findings.error(
                "type-mismatch",
                f"'{name}' is a component, not a value",
                tree.location,
                f"Name one of its states or variables: '{name}.something'.",
            )
        elif own and name in own.states:
            self._findings.error(
                "unknown-name",
                f"a state is named with its component: '{own.name}.{name}'",
                tree.root.location,
                f"Write '{own.name}.{name}'.",
            )
        elif name not in self._scope.absent:
            self._findings.unknown("name", name, tree.root.location, self._scope.known_names())
        return None

    def _component_part(self, tree: syntax.Access, component: ComponentNames) -> Typed | None:
        step = tree.steps[0]
        if not isinstance(step, syntax.Name):
            self._findings.error(
                "type-mismatch", f"'{component.name}' is no array", step.location, "Name a state or variable of it."
            )
            return None
        if step.text in component.variables:
            return self._variable(tree, component, step, tree.steps[1:])
        if step.text in component.states:
            if len(tree.steps) > 1:
                self._no_parts(tree.steps[1], "a state")
                return None
            return Typed(StateTest(component.name, step.text), _BOOLEAN)
        known = chain(component.variables, component.states)
        self._findings.unknown(f"state or variable of '{component.name}'", step.text, step.location, known)
        return None

    def _variable(
        self,
        tree: syntax.Access,
        component: ComponentNames,
        name: syntax.Name,
        rest: tuple[syntax.Name | syntax.Index, ...],
    ) -> Typed | None:
        found = component.variables[name.text]
        if rest:
            self._no_parts(rest[0], "a variable")
            return None
        return None if found is None else Typed(VariableRead(component.name, name.text), found)

    def _no_parts(self, step: syntax.Name | syntax.Index, what: str) -> None:
        self._findings.error("type-mismatch", f"{what} has no parts", step.location, "Remove what follows the name.")

    def _enum_value(self, tree: syntax.Access, name: str, wanted: Type | None) -> Typed | None:
        enums = self._scope.enums_with(name)
        if isinstance(wanted, EnumType) and wanted in enums:
            return Typed(EnumValue(wanted.name, name), wanted)
        if len(enums) == 1:
            return Typed(EnumValue(enums[0].name, name), enums[0])
        names = sorted(here for here, enum in self._scope.enums.items() if enum in enums)
        sayable = [f"'{here}.{name}'" for here in names if "." not in here]
        self._findings.error(
            "ambiguous-name",
            f"'{name}' is a value of {' and '.join(names)}",
            tree.location,
            f"Say which is meant: {' or '.join(sayable)}." if sayable else "Compare it with a variable of its type.",
        )
        return None

    def _qualified_value(self, tree: syntax.Access, enum: EnumType) -> Typed | None:
        step = tree.steps[0]
        if isinstance(step, syntax.Name) and step.text in enum.values and len(tree.steps) == 1:
            return Typed(EnumValue(enum.name, step.text), enum)
        if isinstance(step, syntax.Name) and step.text not in enum.values:
            self._findings.unknown(f"value of '{enum.name}'", step.text, step.location, enum.values)
        else:
            self._no_parts(tree.steps[-1], "an enum value")
        return None

    def _received(self, tree: syntax.Access) -> Typed | None:
        """`value` and its parts, typed through objects and arrays."""
        found = self._scope.received
        if found is None:
            self._findings.error(
                "no-value-here",
                "'value' means received data, and none is received here",
                tree.location,
                "Use it in enum rules and in updates on response and feedback only.",
            )
            return None
        path: list[PathStep] = []
        for step in tree.steps:
            inner = self._part(found, step)
            if inner is None:
                return None
            found = inner
            path.append(step.text if isinstance(step, syntax.Name) else step.value)
        if isinstance(found, NoneType):
            self._findings.error(
                "no-value-here", "there is no data: the type is none", tree.location, "Give the communication a type."
            )
            return None
        return Typed(Received(tuple(path)), found)

    def _part(self, whole: Type, step: syntax.Name | syntax.Index) -> Type | None:
        if isinstance(step, syntax.Index):
            if isinstance(whole, ArrayType):
                return whole.element
            self._findings.error("type-mismatch", f"{type_text(whole)} is no array", step.location, "Remove the index.")
            return None
        found = self._scope.types.property_type(whole, step.text)
        if found is None:
            known = self._scope.types.property_names(whole)
            if known:
                self._findings.unknown(f"property of '{type_text(whole)}'", step.text, step.location, known)
            elif not isinstance(whole, ObjectType):
                self._findings.error(
                    "type-mismatch",
                    f"{type_text(whole)} has no property '{step.text}'",
                    step.location,
                    "Remove the property: only objects have properties.",
                )
            else:
                self._findings.unknown(f"property of '{type_text(whole)}'", step.text, step.location, ())
        return found


def fits(found: Type, wanted: Type) -> bool:
    """Whether a value of one type can stand where another is wanted (ranges are judged elsewhere)."""
    return _same_kind(found, wanted) or (isinstance(found, IntegerType) and isinstance(wanted, DoubleType))


def may_leave(found: Type, wanted: Type) -> bool:
    """Whether an integer can lie outside the range that is wanted."""
    if not isinstance(found, IntegerType) or not isinstance(wanted, IntegerType) or not wanted.is_bounded:
        return False
    (low, high), (least, most) = _bounds(found), _bounds(wanted)
    return low < least or high > most


def _same_kind(first: Type, second: Type) -> bool:
    if isinstance(first, IntegerType) and isinstance(second, IntegerType):
        return True
    return first == second


def _literal_type(value: bool | int | float | str) -> Type:
    match value:
        case bool():
            return _BOOLEAN
        case int():
            return IntegerType(value, value)
        case float():
            return DoubleType()
        case _:
            return StringType()


def _bounds(type_: IntegerType) -> tuple[int, int]:
    low = MINIMUM_INTEGER if type_.low is None else type_.low
    high = MAXIMUM_INTEGER if type_.high is None else type_.high
    return low, high


def _integer(low: int, high: int) -> IntegerType:
    """An integer of these bounds; results beyond 32 bits are unknown, so they need no place."""
    return IntegerType(max(low, MINIMUM_INTEGER), min(high, MAXIMUM_INTEGER))


def _arithmetic(operator: str, left: IntegerType, right: IntegerType) -> IntegerType:
    """Bounds of a sum, difference or product (interval arithmetic)."""
    (a, b), (c, d) = _bounds(left), _bounds(right)
    match operator:
        case "+":
            return _integer(a + c, b + d)
        case "-":
            return _integer(a - d, b - c)
        case _:
            corners = (a * c, a * d, b * c, b * d)
            return _integer(min(corners), max(corners))


def _article(text: str) -> str:
    return text if text in ("none",) else f"{'an' if text[0] in 'aeiou' else 'a'} {text}"
