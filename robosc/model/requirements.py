"""Builds and checks requirements and provided data."""

from collections.abc import Iterator, Mapping

from robosc.errors import RelatedPlace
from robosc.expressions import TRUE, EnumType, NoneType, ObjectType, Type, type_text
from robosc.language import syntax
from robosc.model.expression_checker import ExpressionChecker
from robosc.model.findings import Findings
from robosc.model.structure import (
    Communication,
    Invariant,
    ObjectValue,
    Provide,
    ProvidedValue,
    Requirement,
    RequirementForm,
)
from robosc.model.typed import may_leave
from robosc.model.types import Types
from robosc.model.units import unique
from robosc.source import Location


def build_requirement(
    tree: syntax.Requirement,
    checker: ExpressionChecker,
    communications: Mapping[str, Communication],
    findings: Findings,
) -> Requirement | None:
    """A requirement of the model, or None where it is broken."""
    if not tree.communications:
        findings.warning(
            "empty-requirement",
            "this requirement restricts nothing: no communication stands in its braces",
            tree.location,
            "Name the communications that it is about, or remove it.",
        )
    names = list(_restricted(tree, communications, findings))
    expression = checker.condition(tree.expression)
    if expression is None or len(names) < len(tree.communications):
        return None
    form = RequirementForm.DISABLES if tree.disables else RequirementForm.NEEDS
    return Requirement(tuple(dict.fromkeys(names)), form, expression)


def build_invariant(tree: syntax.Invariant, checker: ExpressionChecker) -> Invariant | None:
    """A state invariant of the model, or None where it is broken."""
    expression = checker.condition(tree.expression)
    return None if expression is None else Invariant(tree.is_never, expression)


def _restricted(
    tree: syntax.Requirement, communications: Mapping[str, Communication], findings: Findings
) -> Iterator[str]:
    for name in tree.communications:
        request = findings.request_of(
            name,
            communications,
            "requirement-on-outgoing",
            "a component sends it, and no requirement can forbid it",
            "Restrict an incoming message, a service or an action.",
        )
        if request is not None:
            yield name.text


class ProvideBuilder:
    """Builder of provide statements.

    Args:
        checker: Checker that resolves expressions of the robot.
        types: All types.
        findings: Findings to which faults are reported.
        places: Place where each communication is declared.
    """

    def __init__(
        self, checker: ExpressionChecker, types: Types, findings: Findings, places: Mapping[str, Location]
    ) -> None:
        self._checker = checker
        self._places = places
        self._because: RelatedPlace | None = None
        self._types = types
        self._findings = findings

    def build(self, tree: syntax.Provide, communications: Mapping[str, Communication]) -> Provide | None:
        """A provide statement of the model, or None where it is broken."""
        name = tree.communication
        condition = None if tree.condition is None else self._checker.condition(tree.condition)
        request = self._findings.request_of(
            name,
            communications,
            "provide-to-outgoing",
            "its data come from the component",
            "Provide data for an incoming message, a service or an action.",
        )
        if request is None:
            return None
        self._because = RelatedPlace(f"'{name.text}' is declared here", self._places[name.text])
        with self._checker.where(TRUE if condition is None else condition):
            value = self._value(tree.value, request, name)
        if value is None or (tree.condition is not None and condition is None):
            return None
        return Provide(name.text, value, condition)

    def _value(
        self, tree: syntax.ObjectValue | syntax.Expression, wanted: Type, name: syntax.Name
    ) -> ProvidedValue | None:
        if isinstance(wanted, EnumType):
            # An enum only reads data; what would be sent is a value of the type it is made from.
            wanted = self._types.sources[wanted.name]
        if isinstance(tree, syntax.ObjectValue):
            return self._object(tree, wanted)
        if isinstance(wanted, NoneType | ObjectType):
            needed = "no data" if isinstance(wanted, NoneType) else f"an object '{wanted.name}'"
            self._findings.error(
                "type-mismatch",
                f"'{name.text}' takes {needed}",
                tree.location,
                "Remove the statement." if isinstance(wanted, NoneType) else "Write '{ property: value }'.",
            )
            return None
        typed = self._checker.fitting(tree, wanted, self._because)
        if typed is None:
            return None
        if may_leave(typed.type, wanted):
            self._findings.warning(
                "may-leave-range",
                f"the value can leave the range of '{name.text}', {type_text(wanted)}",
                tree.location,
                "Widen the range of the type, or narrow what is provided.",
            )
        return typed.expression

    def _object(self, tree: syntax.ObjectValue, wanted: Type) -> ObjectValue | None:
        if not isinstance(wanted, ObjectType):
            self._findings.error(
                "type-mismatch",
                f"an object value cannot stand for {type_text(wanted)}",
                tree.location,
                "Write a plain expression.",
            )
            return None
        unique([name for name, _ in tree.properties], "duplicate-property", "property", self._findings)
        properties: list[tuple[str, ProvidedValue]] = []
        for name, part in tree.properties:
            type_ = self._types.property_type(wanted, name.text)
            if type_ is None:
                known = self._types.property_names(wanted)
                self._findings.unknown(f"property of '{wanted.name}'", name.text, name.location, known)
                continue
            self._findings.bindings.bind(name, self._types.property_places.get((wanted.name, name.text)))
            value = self._value(part, type_, name)
            if value is not None:
                properties.append((name.text, value))
        return ObjectValue(tuple(properties)) if len(properties) == len(tree.properties) else None
