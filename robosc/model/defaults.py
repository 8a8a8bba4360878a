"""Enums over sensors whose default, which data without numbers leads to, lets more through than their other values."""

import math
from collections.abc import Iterable, Mapping, Sequence

from robosc.errors import RelatedPlace
from robosc.expressions import (
    ArrayType,
    Binary,
    Conditional,
    Constant,
    DoubleType,
    EnumType,
    EnumValue,
    Expression,
    Received,
    Type,
    Unary,
    Value,
    VariableRead,
    values,
)
from robosc.expressions.evaluate import evaluate
from robosc.model.findings import Findings
from robosc.model.places import Places
from robosc.model.received import path_type, received_paths
from robosc.model.structure import (
    Behaviour,
    Communication,
    CommunicationKind,
    EnumDefinition,
    EventKind,
    Model,
    Requirement,
)
from robosc.source import Location

_ELEMENTS = 1024
"""Elements of an array without numbers: more than any index of a scan that is written."""


def permissive_defaults(model: Model, places: Places, defaults: Mapping[str, Location], findings: Findings) -> None:
    """Warn about each enum of an outgoing message whose default permits more than its other values.

    Args:
        model: The model.
        places: Places of its parts.
        defaults: Place of the default rule of each enum.
        findings: Findings to which the warnings are added.
    """
    reported: set[str] = set()
    sensors = {item.event(EventKind.RESPONSE): item for item in model.communications if _is_sensor(item)}
    for component, behaviour in ((item.name, item.behaviour) for item in model.components):
        for name, enum in _sensed(model, sensors, behaviour):
            if enum.name in reported or enum.name not in defaults or not _falls_to_default(model, enum):
                continue
            let_through = [
                (requirement, place)
                for requirement, place in zip(model.requirements, places.requirements, strict=True)
                if requirement.communications and _permits(requirement, component, name, enum.default)
            ]
            forbidding = _forbidding(let_through, component, name, enum)
            if forbidding and not _forbids_elsewhere(model, component, name, enum):
                reported.add(enum.name)
                _report(enum, defaults[enum.name], forbidding, findings)


def _sensed(
    model: Model, sensors: Mapping[str, Communication], behaviour: Behaviour | None
) -> Iterable[tuple[str, EnumDefinition]]:
    """The variables of a behaviour that hold an enum of an outgoing message, with the enum; messages by event."""
    found: dict[str, EnumDefinition] = {}
    for transition in behaviour.transitions if behaviour else ():
        sensor = sensors.get(transition.event)
        for update in transition.updates if sensor is not None else ():
            if sensor is not None and sensor.response is not None and isinstance(update.expression, Received):
                type_ = path_type(model, sensor.response, update.expression.path)
                if isinstance(type_, EnumType):
                    found.setdefault(update.variable, model.enum(type_.name))
    return found.items()


def _is_sensor(item: Communication) -> bool:
    return item.kind is CommunicationKind.OUTGOING_MESSAGE


def _falls_to_default(model: Model, enum: EnumDefinition) -> bool:
    """Return True if data without any number, empty or all NaN, leads to the default past a rule that is unknown."""
    return any(_outcome(model, enum, elements) for elements in (0, _ELEMENTS))


def _outcome(model: Model, enum: EnumDefinition, elements: int) -> bool:
    """Return True if arrays of so many elements, none of them a number, do."""
    is_unknown = False
    for rule in enum.rules:
        types = {path: path_type(model, enum.source, path) for path in received_paths(rule.condition)}
        if not all(map(_is_of_numbers, types.values())):
            return False
        read = {
            path: math.nan if isinstance(type_, DoubleType) else [math.nan] * elements for path, type_ in types.items()
        }
        holds = evaluate(rule.condition, _no_state, _no_state, read.__getitem__)
        if holds is True:
            return False
        is_unknown = is_unknown or holds is None
    return is_unknown


def _is_of_numbers(type_: Type) -> bool:
    """Return True if data of a type may have no number in it: other data is known."""
    match type_:
        case ArrayType(element=element):
            return isinstance(element, DoubleType)
        case _:
            return isinstance(type_, DoubleType)


def _no_state(*names: str) -> str:
    raise KeyError(names)


def _permits(requirement: Requirement, component: str, variable: str, value: str) -> bool:
    """Return True if a requirement may let its requests through while a variable has a value."""
    return _partial(requirement.condition, component, variable, value) is not False


def _partial(expression: Expression, component: str, variable: str, value: str) -> Value | None:
    """Value of a condition where one variable is known and all else is not; None: it depends on that."""
    match expression:
        case Constant(value=constant):
            return constant
        case EnumValue(value=name):
            return name
        case VariableRead(component=owner, variable=name) if (owner, name) == (component, variable):
            return value
        case Unary(operator="not" | "holds" as operator, operand=operand):
            found = _partial(operand, component, variable, value)
            return found if operator == "holds" else values.not_(found)
        case Binary(operator="and" | "or" | "implies" | "=" | "!=" as operator, left=left, right=right):
            sides = [_partial(side, component, variable, value) for side in (left, right)]
            functions = {
                "and": values.and_,
                "or": values.or_,
                "implies": values.implies,
                "=": values.equal,
                "!=": values.unequal,
            }
            return functions[operator](*sides)  # type: ignore[no-any-return]
        case Conditional(condition=condition, then=then, otherwise=otherwise):
            parts = (_partial(part, component, variable, value) for part in (condition, then, otherwise))
            return values.conditional(*parts)  # type: ignore[no-any-return]
    return None


def _forbidding(
    let_through: Sequence[tuple[Requirement, Location]], component: str, name: str, enum: EnumDefinition
) -> list[tuple[Requirement, Location, list[str]]]:
    """Return requirements that the default lets something through with, and the other values that forbid it."""
    others = [value for value in enum.values if value != enum.default]
    found = []
    for requirement, place in let_through:
        forbidden = [value for value in others if not _permits(requirement, component, name, value)]
        if forbidden:
            found.append((requirement, place, forbidden))
    return found


def _forbids_elsewhere(model: Model, component: str, name: str, enum: EnumDefinition) -> bool:
    """Return True if another value permits what the default forbids."""
    return any(
        not _permits(item, component, name, enum.default)
        and any(_permits(item, component, name, value) for value in enum.values)
        for item in model.requirements
        if item.communications
    )


def _report(
    enum: EnumDefinition,
    place: Location,
    forbidding: Sequence[tuple[Requirement, Location, list[str]]],
    findings: Findings,
) -> None:
    requirement, _, forbidden = forbidding[0]
    shown = enum.name.rpartition("::")[2]
    named = " and ".join(f"'{name}'" for name in requirement.communications[:3])
    values_named = " and ".join(f"'{value}'" for value in forbidden[:3])
    findings.warning(
        "permissive-default",
        f"data that is empty or has no number in it is '{enum.default}', the default of '{shown}', and lets {named} "
        f"through, which {values_named} {'forbids' if len(forbidden) == 1 else 'forbid'}",
        place,
        f"Give '{enum.default}' a rule of its own, and make a value the default that permits least, such as "
        f"'{forbidden[0]}'.",
        *(RelatedPlace("this requirement lets it through then", where) for _, where, _ in forbidding[:5]),
    )
