"""Names and types of a parsed CIF specification, as strict as CIF's own tools; expressions become functions.

What is refused: double and hidden names, unknown references, wrong types, integer ranges beyond 32 bits, assignments
whose range has nothing in common with the variable's, and what data-based synthesis refuses (negative ranges, equal
literals). Inputs may be read in updates only, of events that their own automaton declares.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from support.cif_parser import Apply, Automaton, CifError, Name, Node, Specification, Type

Place = tuple[str, str]
"""An automaton, and one of its variables or inputs; "" for its location."""

Values = Mapping[Place, Any]
"""Value of every place."""

Function = Callable[[Values], Any]

BOOL = Type("bool")
_LARGEST = 2**31 - 1


@dataclass(frozen=True)
class Typed:
    """An expression: its type, its meaning, and the inputs that it reads."""

    type: Type
    value: Function
    inputs: frozenset[Place] = frozenset()


@dataclass(frozen=True)
class _Symbol:
    kind: str
    owner: str
    name: str
    type: Type = BOOL


class Scope:
    """Every name of a specification.

    Raises:
        CifError: Two things have one name, or a name of an automaton hides one of the specification.
    """

    def __init__(self, specification: Specification) -> None:
        self.specification = specification
        self._top: dict[str, _Symbol] = {}
        self._locals: dict[str, dict[str, _Symbol]] = {}
        self.enums = dict(specification.enums)
        for enum, literals in specification.enums:
            _declare(self._top, _Symbol("enum", "", enum))
            for literal in literals:
                _declare(self._top, _Symbol("literal", "", literal, Type(enum)))
        for automaton in specification.automata:
            _declare(self._top, _Symbol("automaton", "", automaton.name))
        for name, _ in specification.algebraics:
            _declare(self._top, _Symbol("algebraic", "", name))
        for automaton in specification.automata:
            self._locals[automaton.name] = self._local(automaton)
        self._algebraics: dict[str, Typed] = {}
        for name, node in specification.algebraics:
            # The nodes of our files use earlier ones only, so there is no circle.
            self._algebraics[name] = self._boolean(node, None)
            _require(not self._algebraics[name].inputs, f"{name} reads an input")

    def _local(self, automaton: Automaton) -> dict[str, _Symbol]:
        found: dict[str, _Symbol] = {}
        for name, _ in automaton.events:
            _declare(found, _Symbol("event", automaton.name, name))
        for kind, items in (("input", automaton.inputs), ("variable", automaton.variables)):
            for item in items:
                self._require_type(item[1])
                _declare(found, _Symbol(kind, automaton.name, item[0], item[1]))
        for location in automaton.locations:
            if location.name:
                _declare(found, _Symbol("location", automaton.name, location.name))
        hidden = found.keys() & self._top.keys()
        _require(not hidden, f"{automaton.name} hides {hidden}")
        return found

    def _require_type(self, type_: Type) -> None:
        match type_.name:
            case "bool":
                return
            case "int":
                _require(0 <= type_.low <= type_.high <= _LARGEST, f"{type_} is no range for synthesis")
            case name:
                _require(name in self.enums, f"there is no enum {name}")

    def _symbol(self, name: Name, here: str | None) -> _Symbol:
        first, *rest = name.parts
        symbol = self._locals.get(here or "", {}).get(first) or self._top.get(first)
        for part in rest:
            is_automaton = symbol is not None and symbol.kind == "automaton"
            symbol = self._locals[symbol.name].get(part) if symbol is not None and is_automaton else None
        if symbol is None:
            raise CifError(f"unknown name {'.'.join(name.parts)}")
        return symbol

    def event(self, name: Name, here: str | None) -> str:
        """An event as `automaton.event`."""
        symbol = self._symbol(name, here)
        _require(symbol.kind == "event", f"{name} is no event")
        return f"{symbol.owner}.{symbol.name}"

    def predicate(self, node: Node, here: str | None) -> Function:
        """A condition that reads no input."""
        typed = self._boolean(node, here)
        _require(not typed.inputs, "an input is read outside an update")
        return typed.value

    def initial(self, node: Node, type_: Type, here: str) -> Any:
        """An initial value, which must be in range whatever happens."""
        typed = self.typed(node, here)
        _require(type_.name == typed.type.name, "an initial value has another type")
        _require(type_.low <= typed.type.low and typed.type.high <= type_.high, "an initial value is out of range")
        return typed.value({})

    def update(self, node: Node, type_: Type, here: str) -> Typed:
        """The new value of a variable."""
        typed = self.typed(node, here)
        _require(type_.name == typed.type.name, f"{typed.type} is assigned to {type_}")
        overlaps = typed.type.low <= type_.high and type_.low <= typed.type.high
        _require(overlaps, f"{typed.type} is assigned to {type_}")
        return typed

    def _boolean(self, node: Node, here: str | None) -> Typed:
        typed = self.typed(node, here)
        _require(typed.type == BOOL, "a condition is not a condition")
        return typed

    def typed(self, node: Node, here: str | None) -> Typed:
        """An expression."""
        match node:
            case bool():
                return Typed(BOOL, lambda values: node)
            case int():
                _require(node <= _LARGEST, f"{node} is beyond 32 bits")
                return Typed(Type("int", node, node), lambda values: node)
            case Name():
                return self._read(self._symbol(node, here))
            case Apply(operator="if", operands=operands):
                return self._choice([self.typed(item, here) for item in operands])
            case Apply(operator=operator, operands=operands):
                return _applied(operator, [self.typed(item, here) for item in operands])

    def _read(self, symbol: _Symbol) -> Typed:
        place = (symbol.owner, symbol.name)
        match symbol.kind:
            case "location":
                return Typed(BOOL, lambda values: values[symbol.owner, ""] == symbol.name)
            case "variable":
                return Typed(symbol.type, lambda values: values[place])
            case "input":
                return Typed(symbol.type, lambda values: values[place], frozenset({place}))
            case "literal":
                return Typed(symbol.type, lambda values: symbol.name)
            case "algebraic":
                if symbol.name not in self._algebraics:
                    raise CifError(f"{symbol.name} is used before it is declared")
                return self._algebraics[symbol.name]
        raise CifError(f"{symbol.kind} {symbol.name} is no value")

    def _choice(self, operands: list[Typed]) -> Typed:
        conditions, results = operands[:-1:2], [*operands[1::2], operands[-1]]
        _require(all(item.type == BOOL for item in conditions), "a condition of `if` is not a condition")
        _require(len({item.type.name for item in results}) == 1, "the results of `if` have different types")
        low, high = min(item.type.low for item in results), max(item.type.high for item in results)

        def value(values: Values) -> Any:
            for condition, result in zip(conditions, results, strict=False):
                if condition.value(values):
                    return result.value(values)
            return results[-1].value(values)

        return Typed(Type(results[0].type.name, low, high), value, _inputs(operands))


def _inputs(operands: list[Typed]) -> frozenset[Place]:
    return frozenset[Place]().union(*(item.inputs for item in operands))


def _applied(operator: str, operands: list[Typed]) -> Typed:
    names = {item.type.name for item in operands}
    functions = [item.value for item in operands]
    inputs = _inputs(operands)
    match operator:
        case "and" | "or" | "not" | "=>" | "<=>":
            _require(names == {"bool"}, f"'{operator}' takes conditions")
            return Typed(BOOL, _LOGIC[operator](functions), inputs)
        case "=" | "!=":
            _require(len(names) == 1, f"'{operator}' compares different types")
        case _:
            _require(names == {"int"}, f"'{operator}' takes integers")
    if operator in _COMPARISONS:
        compare = _COMPARISONS[operator]
        left, right = functions
        return Typed(BOOL, lambda values: compare(left(values), right(values)), inputs)
    if operator == "negative":
        (only,) = functions
        return Typed(_range(-operands[0].type.high, -operands[0].type.low), lambda values: -only(values), inputs)
    calculate = _ARITHMETIC[operator]
    left, right = functions
    ends = [
        calculate(a, b)
        for a in (operands[0].type.low, operands[0].type.high)
        for b in (operands[1].type.low, operands[1].type.high)
    ]
    return Typed(_range(min(ends), max(ends)), lambda values: calculate(left(values), right(values)), inputs)


def _range(low: int, high: int) -> Type:
    _require(low >= -(2**31) and high <= _LARGEST, f"{low}..{high} is beyond 32 bits")
    return Type("int", low, high)


_LOGIC: dict[str, Callable[[list[Function]], Function]] = {
    "and": lambda parts: lambda values: all(part(values) for part in parts),
    "or": lambda parts: lambda values: any(part(values) for part in parts),
    "not": lambda parts: lambda values: not parts[0](values),
    "=>": lambda parts: lambda values: not parts[0](values) or parts[1](values),
    "<=>": lambda parts: lambda values: parts[0](values) == parts[1](values),
}
_COMPARISONS: dict[str, Callable[[Any, Any], bool]] = {
    "=": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
}
_ARITHMETIC: dict[str, Callable[[int, int], int]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
}


def _declare(scope: dict[str, _Symbol], symbol: _Symbol) -> None:
    _require(symbol.name not in scope, f"{symbol.name} is declared twice")
    scope[symbol.name] = symbol


def _require(is_right: bool, message: str) -> None:
    if not is_right:
        raise CifError(message)
