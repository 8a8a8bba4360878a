"""Subjects that a user asks about, by the model's names: an event, a state, a run."""

import re

from robosc.automata.plants import communication_plant_name
from robosc.automata.state import Subject, subject_domain, subject_type, subjects
from robosc.automata.structure import System
from robosc.errors import RoboscError
from robosc.explanation.notation import value_text
from robosc.expressions import (
    Binary,
    BinaryOperator,
    BooleanType,
    Constant,
    EnumType,
    EnumValue,
    Expression,
    IntegerType,
    StateTest,
    Unary,
    Value,
    VariableRead,
    conjunction,
)
from robosc.model.findings import did_you_mean
from robosc.model.structure import Model
from robosc.source import visible

MAXIMUM_NAMES = 8
"""Names that an error lists."""

MAXIMUM_SHOWN = 100
"""Characters of what was asked that an error repeats."""

_ATOM = re.compile(
    r"(?P<not>!\s*|not\s+)?(?:(?P<kind>service|action)\s+)?(?P<owner>\w+)\.(?P<name>\w+)(?:\s*(?P<operator>!=|<=|>=|=|<|>)\s*(?P<value>-?\w+))?"
)

_OPERATORS: dict[str, BinaryOperator] = {"=": "=", "!=": "!=", "<": "<", "<=": "<=", ">": ">", ">=": ">="}


class RequestError(RoboscError, LookupError):
    """Error for a request about something that is not there."""


def asked_event(system: System, model: Model, text: str) -> str:
    """The event that a name stands for: an event, or a communication's request (or what comes from it).

    Raises:
        RequestError: There is none.
    """
    name = text.strip().replace("^", "")
    events = [event.name for event in system.events]
    if name in events:
        return name
    communications = {item.name: item.events[0] for item in model.communications}
    if name in communications:
        return communications[name]
    raise _unknown("event", name, [*communications, *events])


def asked_run(system: System, model: Model, text: str) -> tuple[str, ...]:
    """The events of a run, separated by commas.

    Raises:
        RequestError: One of them is not there.
    """
    return tuple(asked_event(system, model, part) for part in text.split(",") if part.strip())


def asked_state(system: System, model: Model, text: str) -> Expression:
    """The condition that `Door.open, Lift.n = 2, !Lamp.on, calibrate.waiting` stands for.

    Of a service or action that is called like a component, `service calibrate.waiting` is the location.

    Raises:
        RequestError: It is none, or names something that is not there.
    """
    parts = [part for item in text.split(",") for part in re.split(r"\s+and\s+", item) if part.strip()]
    if not parts:
        raise RequestError('no state is asked for: write for instance "Door.closed, Lift.n = 2"')
    return conjunction(*(_atom(system, model, part.strip()) for part in parts))


def _atom(system: System, model: Model, text: str) -> Expression:
    found = _ATOM.fullmatch(text.replace("^", ""))
    if found is None:
        raise RequestError(f"{_shown(text)} is no condition such as Door.closed, Lift.n = 2 or !Lamp.on")
    owner, name = found["owner"], found["name"]
    plants = {item.name: communication_plant_name(item) for item in model.communications}
    if found["kind"]:
        # The word tells a service or action from a component of the same name.
        automaton = f"{found['kind']} {owner}"
        plants = {name: plant for name, plant in plants.items() if plant.startswith(f"{found['kind']} ")}
        if automaton not in plants.values():
            raise _unknown(found["kind"], owner, list(plants))
    else:
        components = [item.name for item in model.components]
        automaton = owner if owner in components else plants.get(owner, owner)
    known = subjects(system)
    if Subject(automaton) not in known:
        raise _unknown("component or communication", owner, [*(item.automaton for item in known), *plants])
    if Subject(automaton, name) in known:
        result = _test(system, Subject(automaton, name), found["operator"], found["value"])
    else:
        locations = [str(item) for item in subject_domain(system, Subject(automaton))]
        if name not in locations:
            variables = [item.variable for item in known if item.automaton == automaton and item.variable]
            raise _unknown(f"state or synthesis variable of {owner}", name, [*locations, *variables])
        if found["operator"]:
            raise RequestError(f"{owner}.{name} is a state: it has no value to compare")
        result = StateTest(automaton, name)
    return Unary("not", result) if found["not"] else result


def _test(system: System, subject: Subject, operator: str | None, value: str | None) -> Expression:
    type_ = subject_type(system, subject)
    read = VariableRead(subject.automaton, str(subject.variable))
    if operator is None or value is None:
        if not isinstance(type_, BooleanType):
            raise RequestError(f"{subject} needs a value: {subject} = {value_text(subject_domain(system, subject)[0])}")
        return read
    if operator not in ("=", "!=") and not isinstance(type_, IntegerType):
        raise RequestError(f"{subject} has no order: it is only compared with = and !=")
    return Binary(_OPERATORS[operator], read, _value(system, subject, value))


def _value(system: System, subject: Subject, text: str) -> Expression:
    type_ = subject_type(system, subject)
    values: dict[str, Value] = {}
    if isinstance(type_, IntegerType):
        if re.fullmatch(r"-?[0-9]{1,18}", text):
            return Constant(int(text))
    else:
        values = {value_text(value): value for value in subject_domain(system, subject)}
        if text in values:
            return EnumValue(type_.name, text) if isinstance(type_, EnumType) else Constant(values[text])
    raise RequestError(f"{_shown(text)} is no value of {subject}{_hint(text, list(values) or ['a whole number'])}")


def _unknown(what: str, name: str, known: list[str]) -> RequestError:
    return RequestError(f"unknown {what} {_shown(name)}{_hint(name, known)}")


def _hint(name: str, known: list[str]) -> str:
    """Return a hint at what may have been meant."""
    near = did_you_mean(name, known)
    if near is not None:
        return f"; did you mean '{near}'?"
    shown = ", ".join(known[:MAXIMUM_NAMES]) + (", ..." if len(known) > MAXIMUM_NAMES else "")
    return f"; there is {shown}" if known else ""


def _shown(text: str) -> str:
    return f"'{visible(text[:MAXIMUM_SHOWN])}'"
