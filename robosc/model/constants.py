"""Constants: names for values that are known when a model is checked."""

from collections.abc import Iterator, Mapping

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
from robosc.model.expression_checker import ExpressionChecker
from robosc.model.findings import Findings
from robosc.model.scope import Scope, enums_of
from robosc.model.typed import Typed, constant_value, may_leave
from robosc.model.types import Types
from robosc.model.units import Libraries, Unit

_MAXIMUM_CHAIN = 50
"""Constants that are worked out because an earlier one needs them, one inside the other."""


class Constants:
    """Resolver of the constants of every file, each once, in whichever order they need each other.

    Args:
        types: All types.
        libraries: Libraries that files import from.
        findings: Findings to which faults are reported.
    """

    def __init__(self, types: Types, libraries: Libraries, findings: Findings) -> None:
        self._types = types
        self._libraries = libraries
        self._findings = findings
        self._found: dict[tuple[Unit, str], Typed | None] = {}
        self._checkers: dict[Unit, ExpressionChecker] = {}
        self._open: list[tuple[Unit, str]] = []
        self._has_reported_depth = False

    def visible_in(self, unit: Unit) -> "VisibleConstants":
        """The constants that a file can name; reports what is wrong with those of the file and of its libraries."""
        visible = self._names(unit)
        for home in dict.fromkeys((unit, *self._libraries.all_of(unit))):
            for name in dict.fromkeys(item.name.text for item in home.tree.items if isinstance(item, syntax.Constant)):
                self.resolve(home, name)
        return visible

    def _names(self, unit: Unit) -> "VisibleConstants":
        """The nearest definition of each name: the file's own, then its libraries', then those they import from.

        A name that several equally near libraries define means nothing.
        """
        homes: dict[str, Unit] = {}
        ambiguous: dict[str, tuple[str, ...]] = {}
        for units in ((unit,), *self._libraries.tiers_of(unit)):
            near: dict[str, list[Unit]] = {}
            for home in units:
                for name in home.constants:
                    near.setdefault(name, []).append(home)
            for name, found in near.items():
                if name in homes or name in ambiguous:
                    continue
                if len(found) == 1:
                    homes[name] = found[0]
                else:
                    ambiguous[name] = tuple(sorted(home.tree.name.text for home in found))
        return VisibleConstants(self, homes, ambiguous)

    def resolve(self, unit: Unit, name: str) -> Typed | None:
        """The value of a constant, or None where it has none, which has been reported."""
        key = (unit, name)
        tree = unit.constants[name]
        if key in self._open:
            names = [item for _, item in self._open[self._open.index(key) :]]
            chain = " needs ".join(f"'{item}'" for item in [*names, name])
            message = f"the constant depends on itself: {chain}"
            self._findings.error("constant-cycle", message, tree.name.location, "Write one of them as a value.")
            self._found[key] = None
        elif len(self._open) >= _MAXIMUM_CHAIN and key not in self._found:
            if not self._has_reported_depth:
                message = f"constants need each other in a chain of more than {_MAXIMUM_CHAIN}"
                fix = "Define them before they are used."
                self._findings.error("nesting-too-deep", message, tree.name.location, fix)
            self._has_reported_depth = True
            self._found[key] = None
        if key not in self._found:
            self._open.append(key)
            found = self._resolve(unit, tree, self._checker(unit))
            self._open.pop()
            self._found.setdefault(key, found)
        return self._found[key]

    def _checker(self, unit: Unit) -> ExpressionChecker:
        if unit not in self._checkers:
            visible = self._names(unit)
            enums = enums_of(unit, self._types, self._libraries)
            scope = Scope(self._types, {}, enums, constants=visible, constant_places=visible.places)
            self._checkers[unit] = ExpressionChecker(scope, self._findings)
        return self._checkers[unit]

    def _resolve(self, unit: Unit, tree: syntax.Constant, checker: ExpressionChecker) -> Typed | None:
        type_ = self._types.resolve(tree.type, unit)
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
            else checker.fitting(
                tree.value,
                type_,
                RelatedPlace(f"'{tree.name.text}' is declared as {type_text(type_)} here", tree.type.location),
            )
        )
        if found is None or type_ is None:
            return None
        value = constant_value(found.expression)
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


class VisibleConstants(Mapping[str, Typed | None]):
    """The constants that a file can name; each is worked out on first use.

    Attributes:
        ambiguous: Names that several libraries define, with the libraries' names.
        places: Place where each is defined.
    """

    def __init__(
        self,
        constants: Constants,
        homes: Mapping[str, Unit],
        ambiguous: Mapping[str, tuple[str, ...]],
    ) -> None:
        self._constants = constants
        self._homes = homes
        self.ambiguous = ambiguous
        self.places = {name: home.constants[name].name.location for name, home in homes.items()}

    def __getitem__(self, name: str) -> Typed | None:
        return self._constants.resolve(self._homes[name], name)

    def __contains__(self, name: object) -> bool:
        return name in self._homes  # Asking whether there is one must not resolve it.

    def __iter__(self) -> Iterator[str]:
        return iter(self._homes)

    def __len__(self) -> int:
        return len(self._homes)
