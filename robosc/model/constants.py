"""Constants: names for values that are known when a model is checked (language B.3)."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

from robosc.errors import RelatedPlace
from robosc.expressions import (
    ArrayType,
    Constant,
    DoubleType,
    EnumType,
    EnumValue,
    IntegerType,
    NoneType,
    ObjectType,
    Type,
    Value,
    type_text,
)
from robosc.language import syntax
from robosc.model.expressions import ExpressionChecker, Typed, constant_value, may_leave
from robosc.model.findings import Findings
from robosc.model.scope import Scope, Scopes
from robosc.model.types import Types
from robosc.model.units import Unit

_MAXIMUM_CHAIN = 50
"""Constants that are worked out because an earlier one needs them, one inside the other."""

_MAXIMUM_CHAIN = 50
"""Constants that are worked out because an earlier one needs them, one inside the other."""


class Constants:
    """Resolves the constants of every file, each once, in whichever order they need each other.

    Args:
        types: All types.
        findings: Where faults are reported.
    """

    def __init__(self, types: Types, findings: Findings) -> None:
        self._types = types
        self._findings = findings
        self._resolved: dict[Unit, dict[str, Typed | None]] = {}

    def visible_in(self, unit: Unit, scopes: Scopes) -> Mapping[str, Typed | None]:
        """The constants that a file can name: its own, then those of the libraries that it imports from.

        A name that several of these libraries define means nothing unless the file defines it itself.
        """
        imported: dict[str, list[Typed | None]] = {}
        for other in scopes.units_of(unit):
            for name, found in self._of(other, scopes).items():
                imported.setdefault(name, []).append(found)
        unique = {name: found[0] for name, found in imported.items() if len(found) == 1}
        return unique | self._of(unit, scopes)

    def _of(self, unit: Unit, scopes: Scopes) -> dict[str, Typed | None]:
        if unit not in self._resolved:
            self._resolved[unit] = _Resolution(unit, scopes.of_constants(unit), self._types, self._findings).all()
        return self._resolved[unit]


class _Resolution(Mapping[str, Typed | None]):
    """The constants of one file as a mapping that resolves what it is asked for."""

    def __init__(self, unit: Unit, scope: Scope, types: Types, findings: Findings) -> None:
        self._unit = unit
        self._types = types
        self._findings = findings
        self._found: dict[str, Typed | None] = {}
        self._open: list[str] = []
        self._has_told_depth = False
        self._checker = ExpressionChecker(replace(scope, constants=self), findings)

    def __getitem__(self, name: str) -> Typed | None:
        tree = self._unit.constants[name]
        if name in self._open:
            chain = " needs ".join(f"'{item}'" for item in [*self._open[self._open.index(name) :], name])
            message = f"the constant depends on itself: {chain}"
            self._findings.error("constant-cycle", message, tree.name.location, "Write one of them as a value.")
            self._found[name] = None
        elif len(self._open) >= _MAXIMUM_CHAIN and name not in self._found:
            if not self._has_told_depth:
                message = f"constants need each other in a chain of more than {_MAXIMUM_CHAIN}"
                mend = "Define them before they are used."
                self._findings.error("nesting-too-deep", message, tree.name.location, mend)
            self._has_told_depth = True
            self._found[name] = None
        if name not in self._found:
            self._open.append(name)
            found = self._resolve(tree)
            self._open.pop()
            self._found.setdefault(name, found)
        return self._found[name]

    def __contains__(self, name: object) -> bool:
        return name in self._unit.constants  # Asking whether there is one must not resolve it.

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys(i.name.text for i in self._unit.tree.items if isinstance(i, syntax.Constant)))

    def __len__(self) -> int:
        return len(self._unit.constants)

    def all(self) -> dict[str, Typed | None]:
        """Every constant of the file."""
        return {name: self[name] for name in self}

    def _resolve(self, tree: syntax.Constant) -> Typed | None:
        type_ = self._types.resolve(tree.type, self._unit)
        if isinstance(type_, ObjectType | ArrayType | NoneType):
            self._findings.error(
                "object-variable",
                f"a constant cannot be of type {type_text(type_)}",
                tree.type.location,
                "Make it a number, a boolean, a text or a value of an enum.",
            )
            return None
        found = (
            None
            if type_ is None
            else self._checker.fitting(
                tree.value,
                type_,
                RelatedPlace(f"'{tree.name.text}' is declared as {type_text(type_)} here", tree.type.location),
            )
        )
        if found is None or type_ is None:
            return None
        value = constant_value(found)
        if value is None:
            self._findings.error(
                "not-constant",
                f"the value of '{tree.name.text}' is not known in advance",
                tree.value.location,
                "Compute it from numbers and other constants, without dividing by zero or leaving 32 bits.",
            )
            return None
        return self._typed(value, type_, tree)

    def _typed(self, value: Value, type_: Type, tree: syntax.Constant) -> Typed | None:
        match type_:
            case EnumType(name=name):
                return Typed(EnumValue(name, str(value)), type_)
            case DoubleType():
                return Typed(Constant(float(value)), type_)
            case IntegerType() if isinstance(value, int):
                exact = IntegerType(value, value)
                if may_leave(exact, type_):
                    self._findings.error(
                        "type-mismatch",
                        f"the value {value} lies outside {type_text(type_)}",
                        tree.value.location,
                        "Write a value of the range, or widen the range.",
                    )
                    return None
                return Typed(Constant(value), exact)
            case _:
                return Typed(Constant(value), type_)
