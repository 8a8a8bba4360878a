"""Resolves and types expressions."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import reduce
from itertools import chain

from robosc.errors import RelatedPlace
from robosc.expressions import (
    ARGUMENTS,
    MAXIMUM_INTEGER,
    ArrayPart,
    ArrayType,
    Binary,
    BooleanType,
    Conditional,
    Constant,
    DoubleType,
    Element,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    NoneType,
    ObjectType,
    PathStep,
    Quantifier,
    Received,
    Reduction,
    StateTest,
    Type,
    Unary,
    VariableRead,
    is_numeric,
    type_text,
)
from robosc.language import syntax
from robosc.language.words import spelled
from robosc.model.findings import MAXIMUM_CHOICES, Findings
from robosc.model.outcomes import DATA_ELSEWHERE
from robosc.model.ranges import Range, Ranges, narrowed
from robosc.model.scope import ComponentNames, Scope
from robosc.model.typed import (
    Typed,
    applied,
    arithmetic,
    as_type,
    bounded_integer,
    bounds_of,
    common_type,
    constant_value,
    fits,
    literal_type,
    same_kind,
)
from robosc.source import Location

_BOOLEAN = BooleanType()
_OPPOSITES = {"=": "!=", "!=": "=", "<": ">=", ">=": "<", ">": "<=", "<=": ">"}
_LOGIC = {"or": "or", "and": "and", "=>": "implies"}
_ORDER = frozenset({"<", "<=", ">", ">="})
_WORDS = ("true", "false", "value", "default")
_FUNCTIONS = (*ARGUMENTS, "length", "any", "all")
_USES = {
    "abs": "'abs(x)'",
    "min": "'min(x, y)' or 'min(array[i..j])'",
    "max": "'max(x, y)' or 'max(array[i..j])'",
    "clamp": "'clamp(x, least, greatest)'",
    "integer": "'integer(x)'",
    "double": "'double(x)'",
    "length": "'length(array)'",
}
_Step = syntax.Name | syntax.Index | syntax.Slice


class ExpressionChecker:
    """Resolver of the expressions of one scope.

    Args:
        scope: Meanings of names.
        findings: Findings to which faults are reported.
    """

    def __init__(self, scope: Scope, findings: Findings) -> None:
        self._scope = scope
        self._findings = findings
        self._elements: list[tuple[syntax.Name, Type]] = []
        self._bind = findings.bindings.bind
        self._ranges: dict[Expression, Range] = {}

    @contextmanager
    def where(self, condition: Expression) -> Iterator[None]:
        """Give what is resolved meanwhile the bounds that it has where a condition, resolved here, is true."""
        with self._within(narrowed(condition, self._ranges) or {}):
            yield

    @contextmanager
    def _within(self, ranges: Ranges) -> Iterator[None]:
        before = {read: self._ranges[read] for read in ranges}
        self._ranges.update(ranges)
        yield
        self._ranges.update(before)

    def condition(self, tree: syntax.Expression) -> Expression | None:
        """A boolean expression, or None after reporting what is wrong."""
        return self.value(tree, _BOOLEAN)

    def value(self, tree: syntax.Expression, wanted: Type) -> Expression | None:
        """An expression that fits a type, or None after reporting what is wrong."""
        typed = self.fitting(tree, wanted)
        return None if typed is None else typed.expression

    def fitting(self, tree: syntax.Expression, wanted: Type, because: RelatedPlace | None = None) -> Typed | None:
        """Return the expression of `value` with its type; `because` is where the wanted type is declared."""
        typed = self.infer(tree, wanted)
        if typed is not None and not fits(typed.type, wanted):
            if self._quoted(tree, wanted):
                return None
            self._mismatch(tree, typed.type, f"{type_text(wanted)} is needed here", because)
            return None
        return typed

    def infer(self, tree: syntax.Expression, wanted: Type | None = None) -> Typed | None:
        """An expression and its type; `wanted` decides between enums that share a value."""
        match tree:
            case syntax.Literal(value=value):
                return Typed(Constant(value), literal_type(value))
            case syntax.Access():
                return self._access(tree, wanted)
            case syntax.Unary():
                return self._unary(tree)
            case syntax.Binary():
                return self._binary(tree)
            case syntax.Conditional():
                return self._conditional(tree, wanted)
            case syntax.Call():
                return self._call(tree)
            case syntax.Quantifier():
                return self._quantifier(tree)

    def _declaration(self, tree: syntax.Expression) -> tuple[RelatedPlace, ...]:
        """Return the place where the variable that a tree names is declared, if it names one."""
        if not isinstance(tree, syntax.Access) or tree.root is None or len(tree.steps) > 1:
            return ()
        component, name = self._scope.own, tree.root.text
        if tree.steps and isinstance(tree.steps[0], syntax.Name):
            component, name = self._scope.components.get(name), tree.steps[0].text
        if component is None or name not in component.declared:
            return ()
        return (RelatedPlace(f"'{name}' is declared here", component.declared[name]),)

    def _mismatch(
        self,
        tree: syntax.Expression,
        found: Type,
        needed: str,
        because: RelatedPlace | None = None,
        fix: str = "Write an expression of the needed type.",
    ) -> None:
        self._findings.error(
            "type-mismatch",
            f"this is {_article(_plain_text(found))}, but {needed}",
            tree.location,
            fix,
            *self._declaration(tree),
            *((because,) if because else ()),
        )

    def _quoted(self, tree: syntax.Expression, wanted: Type) -> bool:
        """Return True after reporting a value of an enum that is written as a text."""
        match tree, wanted:
            case syntax.Literal(value=str() as text), EnumType(name=name, values=values) if text in values:
                fix = f"Write '{spelled(text)}'."
                self._findings.error("type-mismatch", f"a value of {name} has no quotes", tree.location, fix)
                return True
        return False

    # Operators

    def _unary(self, tree: syntax.Unary) -> Typed | None:
        if tree.operator == "-" and isinstance(tree.operand, syntax.Literal) and type(tree.operand.value) is int:
            return Typed(Constant(-tree.operand.value), IntegerType(-tree.operand.value, -tree.operand.value))
        operand = self.infer(tree.operand)
        if operand is None:
            return None
        if tree.operator == "!":
            if not isinstance(operand.type, BooleanType):
                fix = "Put what is negated in parentheses, as in '!(a = b)', or negate a boolean."
                self._mismatch(tree.operand, operand.type, "'!' (or 'not') takes a boolean", fix=fix)
                return None
            return Typed(Unary("not", operand.expression), _BOOLEAN)
        if not is_numeric(operand.type):
            self._mismatch(tree.operand, operand.type, "'-' takes a number")
            return None
        if isinstance(operand.type, IntegerType):
            low, high = bounds_of(operand.type)
            return Typed(Unary("-", operand.expression), bounded_integer(-high, -low))
        return Typed(Unary("-", operand.expression), operand.type)

    def _binary(self, tree: syntax.Binary) -> Typed | None:
        if self._negates_operand(tree):
            return None
        if tree.operator in ("=", "!="):
            return self._equality(tree)
        left, right = self.infer(tree.left), self.infer(tree.right)
        if left is None or right is None:
            return None
        logical = tree.operator in _LOGIC
        if tree.operator == "=>" and is_numeric(left.type) and is_numeric(right.type):
            message, fix = "'=>' takes booleans; did you mean '>='?", "Write '>=' instead of '=>'."
            self._findings.error("type-mismatch", message, tree.location, fix)
            return None
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
            return Typed(result, arithmetic(tree.operator, left.type, right.type))
        return Typed(result, DoubleType())

    def _negates_operand(self, tree: syntax.Binary) -> bool:
        """Return True after reporting `!a = b` or `not a < b` of what is no boolean: `!` takes `a` alone."""
        opposite = _OPPOSITES.get(tree.operator)
        match tree.left:
            case syntax.Unary(operator="!", operand=syntax.Access(root=syntax.Name() as root, steps=steps) as operand):
                names = [root, *(step for step in steps if isinstance(step, syntax.Name))]
            case _:
                return False
        begin, end = tree.left.location, tree.location
        if opposite is None or len(names) <= len(steps) or begin.line != end.line:
            return False
        typed = self.infer(operand)
        if typed is None or isinstance(typed.type, BooleanType):
            return typed is None
        written = ".".join(spelled(name.text) for name in names)
        self._findings.error(
            "type-mismatch",
            f"'!' and 'not' take '{written}' alone, which is {_article(_plain_text(typed.type))} and no boolean",
            Location(begin.file, begin.line, begin.column, end.column + end.length - begin.column),
            f"Write '{written} {opposite}', or put what is negated in parentheses.",
        )
        return True

    def _equality(self, tree: syntax.Binary) -> Typed | None:
        """One type on both sides; the side with a type of its own decides what a bare enum value means."""
        if self._is_open(tree.left):
            right = self.infer(tree.right)
            left = self.infer(tree.left, right.type if right else None)
        else:
            left = self.infer(tree.left)
            right = self.infer(tree.right, left.type if left else None)
        if left is None or right is None:
            return None
        both_numbers = is_numeric(left.type) and is_numeric(right.type)
        comparable = not isinstance(left.type, ObjectType | ArrayType | NoneType)
        if not comparable or not (both_numbers or same_kind(left.type, right.type)):
            if self._quoted(tree.left, right.type) or self._quoted(tree.right, left.type):
                return None
            self._findings.error(
                "type-mismatch",
                f"'{tree.operator}' compares {_article(type_text(left.type))} with {_article(type_text(right.type))}",
                tree.location,
                "Compare values of one type.",
                *self._declaration(tree.left),
                *self._declaration(tree.right),
            )
            return None
        return Typed(Binary(tree.operator, left.expression, right.expression), _BOOLEAN)  # type: ignore[arg-type]

    def _is_open(self, tree: syntax.Expression) -> bool:
        """Return True if the type that is wanted decides what a tree means.

        Such a tree is a bare enum value, or a choice between such.
        """
        if isinstance(tree, syntax.Conditional):
            return self._is_open(tree.then) and self._is_open(tree.otherwise)
        if not isinstance(tree, syntax.Access) or tree.root is None or tree.steps:
            return False
        name = tree.root.text
        if any(variable.text == name for variable, _ in self._elements):
            return False
        if name in self._scope.constants and not self._scope.enums_with(name):
            return False
        return not (self._scope.own and name in self._scope.own.variables)

    def _conditional(self, tree: syntax.Conditional, wanted: Type | None) -> Typed | None:
        condition = self.condition(tree.condition)
        if_true = {} if condition is None else narrowed(condition, self._ranges)
        if_false = {} if condition is None else narrowed(Unary("not", condition), self._ranges)
        if self._is_open(tree.then):
            with self._within(if_false or {}):
                otherwise = self.infer(tree.otherwise, wanted)
            with self._within(if_true or {}):
                then = self.infer(tree.then, wanted or (otherwise.type if otherwise else None))
        else:
            with self._within(if_true or {}):
                then = self.infer(tree.then, wanted)
            with self._within(if_false or {}):
                otherwise = self.infer(tree.otherwise, wanted or (then.type if then else None))
        if condition is None or then is None or otherwise is None:
            return None
        common = common_type(then.type, otherwise.type)
        if common is None:
            self._mismatch(tree.otherwise, otherwise.type, f"'then' has {_article(type_text(then.type))}")
            return None
        result = Conditional(condition, as_type(then, common), as_type(otherwise, common))
        if isinstance(common, IntegerType) and (if_true is None) is not (if_false is None):
            # One side is never taken: the other one has all the values.
            return Typed(result, otherwise.type if if_true is None else then.type)
        return Typed(result, common)

    # Functions and arrays

    def _call(self, tree: syntax.Call) -> Typed | None:
        name = tree.function.text
        count = len(tree.arguments)
        if name in ("length", "min", "max") and count == 1:
            return self._reduction(tree)
        if name in ("any", "all"):
            self._findings.error(
                "type-mismatch",
                f"'{name}' needs a variable, an array and a condition",
                tree.location,
                f"Write '{name}(x in array: condition)'.",
            )
            return None
        if name == "length" or name not in ARGUMENTS:
            if name in ARGUMENTS or name == "length":
                self._wrong_count(tree, 1)
            else:
                self._findings.unknown("function", name, tree.location, _FUNCTIONS)
            return None
        if count < ARGUMENTS[name] or (count > ARGUMENTS[name] and name not in ("min", "max")):
            self._wrong_count(tree, ARGUMENTS[name])
            return None
        found = [self._numeric_argument(name, argument) for argument in tree.arguments]
        arguments = [item for item in found if item is not None]
        if len(arguments) < count:
            return None
        if name in ("min", "max"):
            return reduce(lambda left, right: applied(name, (left, right)), arguments)
        return applied(name, tuple(arguments))

    def _wrong_count(self, tree: syntax.Call, wanted: int) -> None:
        name = tree.function.text
        self._findings.error(
            "type-mismatch",
            f"'{name}' takes {wanted} argument{'s' if wanted > 1 else ''}, not {len(tree.arguments)}",
            tree.location,
            f"Write {_USES[name]}.",
        )

    def _numeric_argument(self, name: str, tree: syntax.Expression) -> Typed | None:
        found = self.infer(tree)
        if found is not None and not is_numeric(found.type):
            self._mismatch(tree, found.type, f"'{name}' takes numbers")
            return None
        return found

    def _reduction(self, tree: syntax.Call) -> Typed | None:
        name, argument = tree.function.text, tree.arguments[0]
        found = self._array(argument, name)
        if found is None:
            return None
        part, element = found
        if name == "length":
            if part.low is not None:
                self._findings.error(
                    "type-mismatch", "'length' takes a whole array", argument.location, "Remove the slice."
                )
                return None
            return Typed(Reduction("length", part), IntegerType(0, MAXIMUM_INTEGER))
        if not is_numeric(element):
            needed = f"'{name}' takes an array of numbers"
            self._mismatch(argument, ArrayType(element), needed)
            return None
        return Typed(Reduction(name, part), element)  # type: ignore[arg-type]  # 'min' or 'max'

    def _array(self, tree: syntax.Expression, what: str) -> tuple[ArrayPart, Type] | None:
        """A whole array or a slice of one, and the type of its elements."""
        part: syntax.Slice | None = None
        if isinstance(tree, syntax.Access) and tree.steps and isinstance(tree.steps[-1], syntax.Slice):
            part = tree.steps[-1]
            tree = syntax.Access(tree.root, tree.steps[:-1], tree.location)
        found = self.infer(tree)
        if found is None:
            return None
        if not isinstance(found.type, ArrayType) or not isinstance(found.expression, Received | Element):
            self._mismatch(tree, found.type, f"'{what}' looks at an array")
            return None
        if part is None:
            return ArrayPart(found.expression), found.type.element
        low, high = self._index(part.low), self._index(part.high)
        if low is None or high is None:
            return None
        return ArrayPart(found.expression, low, high), found.type.element

    def _quantifier(self, tree: syntax.Quantifier) -> Typed | None:
        found = self._array(tree.array, tree.word.text)
        if found is None:
            return None
        part, element = found
        self._elements.append((tree.variable, element))
        condition = self.condition(tree.condition)
        self._elements.pop()
        if condition is None:
            return None
        return Typed(Quantifier(tree.word.text, part, condition), _BOOLEAN)  # type: ignore[arg-type]  # as parsed

    def _index(self, tree: syntax.Expression) -> int | None:
        """The value of a constant index."""
        if isinstance(tree, syntax.Literal) and type(tree.value) is int:
            return tree.value
        found = self.infer(tree)
        if found is None:
            return None
        value = constant_value(found.expression)
        if isinstance(found.type, IntegerType) and type(value) is int and value >= 0:
            return value
        self._findings.error(
            "type-mismatch",
            "an index is a whole number that is known in advance and not negative",
            tree.location,
            "Write a number or a constant.",
        )
        return None

    # Accesses

    def _access(self, tree: syntax.Access, wanted: Type | None) -> Typed | None:
        if tree.root is None:
            return self._received(tree)
        name, own = tree.root.text, self._scope.own
        for level, (variable, element) in enumerate(reversed(self._elements)):
            if variable.text == name:
                self._bind(tree.root, variable.location)
                walked = self._walk(element, tree.steps)
                return None if walked is None else Typed(Element(level, walked[0]), walked[1])
        if tree.steps and name in self._scope.components:
            self._bind(tree.root, self._scope.component_places.get(name))
            return self._component_part(tree, self._scope.components[name], wanted)
        if own and name in own.variables:
            return self._variable(tree, own, tree.root, tree.steps)
        if not tree.steps and name in self._scope.constants:
            is_wanted_value = isinstance(wanted, EnumType) and wanted in self._scope.enums_with(name)
            if not is_wanted_value:
                self._bind(tree.root, self._scope.constant_places.get(name))
                return self._scope.constants[name]  # None for a broken one, which has been reported.
        if not tree.steps and self._scope.enums_with(name):
            return self._enum_value(tree, tree.root, wanted)
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
        elif name in self._scope.ambiguous:
            libraries = " and ".join(f"'{library}'" for library in self._scope.ambiguous[name])
            self._findings.error(
                "ambiguous-name",
                f"'{name}' is defined by the libraries {libraries}",
                tree.root.location,
                "Define it in this file, or rename one of the two.",
            )
        elif name not in self._scope.absent:
            if isinstance(wanted, EnumType) and not tree.steps and len(wanted.values) <= MAXIMUM_CHOICES:
                self._findings.unknown(f"value of '{wanted.name}'", name, tree.root.location, wanted.values)
                return None
            if self._is_message(tree, name, tree.steps, wanted):
                return None
            known = self._scope.known_names()
            fix = ""
            if name in self._findings.bindings.communications:
                fix = f"'{name}' is a communication: let a component go to a state with it, and name that state."
            self._findings.unknown("name", name, tree.root.location, known, fix=fix, words=_WORDS)
        return None

    def _is_message(self, tree: syntax.Access, name: str, steps: Sequence[_Step], wanted: Type | None) -> bool:
        """Report that a communication, or a word for its data, stands where a value is due; False: it is neither."""
        words = tuple(step.text for step in steps if isinstance(step, syntax.Name))
        if self._scope.received is not None and name in {*DATA_ELSEWHERE, self._scope.sender}:
            properties = self._scope.types.property_names(self._scope.received)
            meant = ".".join(("value", *words)) if words and words[0] in properties else "value"
            message = f"what was received is called 'value', not '{name}'"
            self._findings.error("unknown-name", message, tree.location, f"Write '{meant}'.")
            return True
        outcome = self._scope.outcomes.get(name)
        if outcome is None:
            return False
        meant = outcome.value(words, wanted)
        if meant:
            message = f"'{name}' is a communication, not a value: '{meant}' says what became of it"
            self._findings.error("unknown-name", message, tree.location, f"Write '{meant}'.")
        elif outcome.is_requested or not outcome.has_data:
            return False
        else:
            kept = outcome.free or f"last_{name}"
            message = f"'{name}' is a message, not a value: a variable keeps what comes with it"
            line = f"on response from {spelled(name)} do {kept} := value"
            fix = (
                f"Let the behaviour of '{outcome.component}' keep it: '{line}', and write '{outcome.component}.{kept}'."
            )
            self._findings.error("unknown-name", message, tree.location, fix)
        return True

    def _component_part(
        self, tree: syntax.Access, component: ComponentNames, wanted: Type | None = None
    ) -> Typed | None:
        step = tree.steps[0]
        if not isinstance(step, syntax.Name):
            self._findings.error(
                "type-mismatch", f"'{component.name}' is not an array", step.location, "Name a state or variable of it."
            )
            return None
        if step.text in component.variables:
            return self._variable(tree, component, step, tree.steps[1:])
        if step.text in component.states:
            self._bind(step, component.places.get(step.text))
            if len(tree.steps) > 1:
                self._no_parts(tree.steps[1], "a state")
                return None
            return Typed(StateTest(component.name, step.text), _BOOLEAN)
        if self._is_message(tree, step.text, tree.steps[1:], wanted):
            return None
        known = chain(component.variables, component.states)
        self._findings.unknown(f"state or variable of '{component.name}'", step.text, step.location, known)
        return None

    def _variable(
        self,
        tree: syntax.Access,
        component: ComponentNames,
        name: syntax.Name,
        rest: Sequence[_Step],
    ) -> Typed | None:
        found = component.variables[name.text]
        self._bind(name, component.places.get(name.text))
        if rest:
            self._no_parts(rest[0], "a variable")
            return None
        return None if found is None else self._read(VariableRead(component.name, name.text), found)

    def _no_parts(self, step: _Step, what: str) -> None:
        self._findings.error("type-mismatch", f"{what} has no parts", step.location, "Remove what follows the name.")

    def _enum_value(self, tree: syntax.Access, named: syntax.Name, wanted: Type | None) -> Typed | None:
        name = named.text
        enums = self._scope.enums_with(name)
        meant = wanted if isinstance(wanted, EnumType) and wanted in enums else enums[0] if len(enums) == 1 else None
        if meant is not None:
            self._bind(named, self._scope.types.value_places.get((meant.name, name)))
            return Typed(EnumValue(meant.name, name), meant)
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
        types = self._scope.types
        if tree.root is not None and enum.name in types.enums:
            self._bind(tree.root, types.enums[enum.name][2].name.location)
        if isinstance(step, syntax.Name) and step.text in enum.values and len(tree.steps) == 1:
            self._bind(step, types.value_places.get((enum.name, step.text)))
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
                "'value' is the received data, and nothing is received here",
                tree.location,
                "Use it in enum rules and in updates on response and feedback only.",
            )
            return None
        walked = self._walk(found, tree.steps)
        if walked is None:
            return None
        path, found = walked
        if isinstance(found, NoneType):
            self._findings.error(
                "no-value-here", "there is no data: the type is none", tree.location, "Give the communication a type."
            )
            return None
        return self._read(Received(path), found)

    def _read(self, read: Expression, type_: Type) -> Typed:
        """Return what is read, with the bounds that it has here."""
        if isinstance(type_, IntegerType):
            declared = bounds_of(type_)
            here = self._ranges.setdefault(read, declared)
            type_ = type_ if here == declared else IntegerType(*here)
        return Typed(read, type_)

    def _walk(self, whole: Type, steps: Sequence[_Step]) -> tuple[tuple[PathStep, ...], Type] | None:
        """Property by property, element by element: the path and the type at its end."""
        path: list[PathStep] = []
        for step in steps:
            if isinstance(step, syntax.Slice):
                self._findings.error(
                    "type-mismatch",
                    "a slice can only be looked at with 'min', 'max', 'any' or 'all'",
                    step.location,
                    "Write one index, or one of these around it.",
                )
                return None
            inner = self._part(whole, step)
            key = self._index(step.value) if isinstance(step, syntax.Index) else step.text
            if inner is None or key is None:
                return None
            whole = inner
            path.append(key)
        return tuple(path), whole

    def _part(self, whole: Type, step: syntax.Name | syntax.Index) -> Type | None:
        if isinstance(step, syntax.Index):
            if isinstance(whole, ArrayType):
                return whole.element
            self._findings.error(
                "type-mismatch", f"{type_text(whole)} is not an array", step.location, "Remove the index."
            )
            return None
        found = self._scope.types.property_type(whole, step.text)
        if found is not None and isinstance(whole, ObjectType):
            self._bind(step, self._scope.types.property_places.get((whole.name, step.text)))
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


def _plain_text(type_: Type) -> str:
    """A type in words; of a single number it is enough that it is an integer."""
    if isinstance(type_, IntegerType) and type_.low == type_.high:
        return "integer"
    return type_text(type_)


def _article(text: str) -> str:
    return text if text in ("none",) else f"{'an' if text[0] in 'aeiou' else 'a'} {text}"
