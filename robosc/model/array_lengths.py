"""Indices of received arrays against the lengths that a middleware type fixes or bounds."""

from collections.abc import Iterator

from robosc.expressions import ArrayType, EnumType, ObjectType, Type
from robosc.interfaces import Field, Part
from robosc.interfaces.catalogue import Catalogue
from robosc.language import syntax
from robosc.model.findings import Findings
from robosc.model.interfaces import parts_by_event
from robosc.model.message_fields import basic_field
from robosc.model.structure import Communication, EventKind
from robosc.model.types import Types
from robosc.source import Location


class ArrayLengths:
    """Checker of constant indices into received data.

    Args:
        types: Types of the model.
        findings: Findings to which faults are reported.
    """

    def __init__(self, types: Types, findings: Findings) -> None:
        self._types = types
        self._findings = findings
        self._reported: set[tuple[Location, str]] = set()
        # The message is kept, so that its identity stays its own.
        self._checked: dict[tuple[str, int], Part] = {}

    def check_communication(self, item: Communication, tree: syntax.Communication, catalogue: Catalogue) -> None:
        """Check the enums that are made from the data of a communication, and the condition in its list.

        Args:
            item: A communication that fits its interface.
            tree: Its declaration.
            catalogue: The interfaces.
        """
        parts = parts_by_event(item, catalogue)
        for type_, part in parts.values():
            self._check_type(type_, part, catalogue)
        for option in tree.options:
            if option.key == "when" and not isinstance(option.value, syntax.Name) and EventKind.REQUEST in parts:
                self._check(option.value, *parts[EventKind.REQUEST], catalogue)  # type: ignore[arg-type]  # as parsed

    def check_transition(
        self, transition: syntax.CommunicationTransition, item: Communication, catalogue: Catalogue
    ) -> None:
        """Check the updates of a transition on an event of a communication that fits its interface."""
        parts = parts_by_event(item, catalogue)
        if transition.kind in parts:
            for update in transition.updates:
                self._check(update.value, *parts[EventKind(transition.kind)], catalogue)

    def _check_type(self, type_: Type, part: Part, catalogue: Catalogue) -> None:
        """Check the rules of the enums that are made from received data of a type."""
        if not isinstance(type_, EnumType | ObjectType) or (type_.name, id(part)) in self._checked:
            return
        self._checked[type_.name, id(part)] = part
        source: Type = type_
        if isinstance(type_, EnumType):
            source = self._types.sources[type_.name]
            _, _, tree = self._types.enums[type_.name]
            for rule in tree.rules:
                if rule.condition is not None:
                    self._check(rule.condition, source, part, catalogue)
        if isinstance(source, ObjectType):
            for item in self._types.objects[source.name].properties:
                field = part.fields.get(item.name)
                nested = None if field is None else catalogue.message(field.type)
                inner = item.type.element if isinstance(item.type, ArrayType) else item.type
                if nested is not None:
                    self._check_type(inner, nested, catalogue)

    def _check(self, tree: syntax.Expression, type_: Type, part: Part, catalogue: Catalogue) -> None:
        """Check an expression over `value`, which is of a type and comes as a message."""
        for access in _received(tree):
            self._check_access(access, type_, part, catalogue)

    def _check_access(self, access: syntax.Access, type_: Type, part: Part, catalogue: Catalogue) -> None:
        here: Part | None = part
        field: Field | None = None if isinstance(type_, ObjectType) else basic_field(part)
        for step in access.steps:
            if isinstance(step, syntax.Name):
                if field is not None:
                    here = catalogue.message(field.type)
                field = None if here is None else here.fields.get(step.text)
                if field is None:
                    return
            else:
                index = step.value if isinstance(step, syntax.Index) else step.low
                self._check_index(index, step.location, field)
                if isinstance(step, syntax.Slice):
                    self._check_index(step.high, step.location, field)

    def _check_index(self, index: syntax.Expression, place: Location, field: Field | None) -> None:
        array = None if field is None else field.array
        if field is None or array is None or array.length is None or not isinstance(index, syntax.Literal):
            return
        if type(index.value) is int and index.value >= array.length and (place, field.name) not in self._reported:
            self._reported.add((place, field.name))
            at_most = "at most " if array.is_bounded else ""
            self._findings.warning(
                "index-outside-array",
                f"'{field.name}' has {at_most}{array.length} elements, so [{index.value}] is never there",
                place,
                f"Write an index from 0 to {array.length - 1}.",
            )


def _received(tree: syntax.Expression) -> Iterator[syntax.Access]:
    """Yield the accesses of received data, in any order."""
    stack = [tree]
    while stack:
        match stack.pop():
            case syntax.Access() as access:
                if access.root is None:
                    yield access
            case syntax.Unary(operand=operand):
                stack.append(operand)
            case syntax.Binary(left=left, right=right):
                stack += (left, right)
            case syntax.Conditional(condition=condition, then=then, otherwise=otherwise):
                stack += (condition, then, otherwise)
            case syntax.Call(arguments=arguments):
                stack += arguments
            case syntax.Quantifier(array=array, condition=condition):
                stack += (array, condition)


__all__ = ["ArrayLengths"]
