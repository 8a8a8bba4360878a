"""Subjects of a user's question, by the names of a model or of automata: an event, a state, a run."""

import re
from abc import ABC, abstractmethod

from robosc.automata.plants import communication_plant_name
from robosc.automata.state import Subject, subject_domain, subject_type, subjects
from robosc.automata.structure import System
from robosc.errors import RoboscError
from robosc.explanation.notation import value_text
from robosc.expressions import (
    ITSELF,
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
from robosc.expressions.text import literal_named
from robosc.model.findings import did_you_mean
from robosc.model.structure import Model
from robosc.source import visible

MAXIMUM_NAMES = 8
"""Names that an error lists."""

MAXIMUM_SHOWN = 100
"""Maximum number of characters of a question that an error repeats."""

_ATOM = re.compile(
    r"(?P<not>!\s*|not\s+)?(?:(?P<kind>service|action)\s+)?(?P<owner>\w+)\.(?P<name>\w+)(?:\s*(?P<operator>!=|<=|>=|=|<|>)\s*(?P<value>-?\w+))?"
)

_NEGATION = re.compile(r"(?:!|not\b)\s*")

_COMPARISON = re.compile(r"!=|<=|>=|=|<|>")

_OPERATORS: dict[str, BinaryOperator] = {"=": "=", "!=": "!=", "<": "<", "<=": "<=", ">": ">", ">=": ">="}


class RequestError(RoboscError, LookupError):
    """Error about a question that names something that does not exist."""


class Requests(ABC):
    """Reader of questions about one system.

    Args:
        system: The automata.
    """

    def __init__(self, system: System) -> None:
        self._system = system
        self._known = subjects(system)

    @abstractmethod
    def event(self, text: str) -> str:
        """The event that a name stands for.

        Raises:
            RequestError: There is none.
        """

    def run(self, text: str) -> tuple[str, ...]:
        """The events of a run, separated by commas.

        Raises:
            RequestError: One of them is not there.
        """
        return tuple(self.event(part) for part in text.split(",") if part.strip())

    def state(self, text: str) -> Expression:
        """The condition that `Door.open, Lift.n = 2, !Lamp.on` stands for.

        Raises:
            RequestError: It is none, or names something that is not there.
        """
        parts = [part for item in text.split(",") for part in re.split(r"\s+and\s+", item) if part.strip()]
        if not parts:
            raise RequestError('no state is asked for: write for instance "Door.closed, Lift.n = 2"')
        return conjunction(*(self._atom(part.strip()) for part in parts))

    @abstractmethod
    def _atom(self, text: str) -> Expression:
        """The condition on one place of a state."""

    def _test(self, subject: Subject, operator: str | None, value: str | None) -> Expression:
        type_ = subject_type(self._system, subject)
        read = VariableRead(subject.automaton, str(subject.variable))
        if operator is None or value is None:
            if not isinstance(type_, BooleanType):
                example = value_text(subject_domain(self._system, subject)[0])
                raise RequestError(f"{subject} needs a value: {subject} = {example}")
            return read
        if operator not in ("=", "!=") and not isinstance(type_, IntegerType):
            raise RequestError(f"{subject} has no order: it is only compared with = and !=")
        return Binary(_OPERATORS[operator], read, self._value(subject, value))

    def _value(self, subject: Subject, text: str) -> Expression:
        type_ = subject_type(self._system, subject)
        values: dict[str, Value] = {}
        if isinstance(type_, IntegerType):
            if re.fullmatch(r"-?[0-9]{1,18}", text):
                return Constant(int(text))
        else:
            values = {value_text(value): value for value in subject_domain(self._system, subject)}
            if isinstance(type_, EnumType):
                text = literal_named(type_, text)
            if text in values:
                return EnumValue(type_.name, text) if isinstance(type_, EnumType) else Constant(values[text])
        raise RequestError(
            f"{_quoted(text)} is not a value of {subject}{_hint(text, list(values) or ['a whole number'])}"
        )


class ModelQuestionReader(Requests):
    """Reader of questions about a model's automata.

    Args:
        system: The automata.
        model: The model.
    """

    def __init__(self, system: System, model: Model) -> None:
        super().__init__(system)
        self._model = model

    def event(self, text: str) -> str:
        """The event of a name: an event itself, or the request (or else the response) of a communication.

        Raises:
            RequestError: There is none.
        """
        name = text.strip().replace("^", "")
        events = [event.name for event in self._system.events]
        if name in events:
            return name
        communications = {item.name: item.events[0] for item in self._model.communications}
        if name in communications:
            return communications[name]
        raise _unknown("event", name, [*communications, *events])

    def _atom(self, text: str) -> Expression:
        """The condition on one place of a state.

        If a component has the name of a service or action, `service calibrate.waiting` is the service's location.
        """
        found = _ATOM.fullmatch(text.replace("^", ""))
        if found is None:
            raise RequestError(f"{_quoted(text)} is not a condition such as Door.closed, Lift.n = 2 or !Lamp.on")
        owner, name = found["owner"], found["name"]
        plants = {item.name: communication_plant_name(item) for item in self._model.communications}
        if found["kind"]:
            # The word distinguishes a service or action from a component of the same name.
            automaton = f"{found['kind']} {owner}"
            plants = {name: plant for name, plant in plants.items() if plant.startswith(f"{found['kind']} ")}
            if automaton not in plants.values():
                raise _unknown(found["kind"], owner, list(plants))
        else:
            components = [item.name for item in self._model.components]
            automaton = owner if owner in components else plants.get(owner, owner)
        if Subject(automaton) not in self._known:
            raise _unknown("component or communication", owner, [*(item.automaton for item in self._known), *plants])
        if Subject(automaton, name) in self._known:
            result = self._test(Subject(automaton, name), found["operator"], found["value"])
        else:
            locations = [str(item) for item in subject_domain(self._system, Subject(automaton))]
            if name not in locations:
                variables = [item.variable for item in self._known if item.automaton == automaton and item.variable]
                raise _unknown(f"state or synthesis variable of {owner}", name, [*locations, *variables])
            if found["operator"]:
                raise RequestError(f"{owner}.{name} is a state: it has no value to compare")
            result = StateTest(automaton, name)
        return Unary("not", result) if found["not"] else result


class SystemQuestionReader(Requests):
    """Reader of questions about automata, whose names may be any text."""

    def event(self, text: str) -> str:
        """The event of a name.

        Raises:
            RequestError: There is none.
        """
        events = [event.name for event in self._system.events]
        if text.strip() in events:
            return text.strip()
        raise _unknown("event", text.strip(), events)

    def _atom(self, text: str) -> Expression:
        negated = _NEGATION.match(text)
        rest = text[negated.end() :] if negated else text
        result = self._comparison(rest)
        if result is None:
            # An input variable is no automaton to a user.
            inputs = {item.automaton for item in self._known if item.variable == ITSELF}
            locations = [
                f"{item.automaton}.{name}"
                for item in self._known
                if item.variable is None and item.automaton not in inputs
                for name in subject_domain(self._system, item)
            ]
            variables = [str(item) for item in self._known if item.variable is not None]
            name = _COMPARISON.split(rest)[0].strip()
            raise _unknown("location or variable", name, [*locations, *variables])
        return Unary("not", result) if negated else result

    def _comparison(self, text: str) -> Expression | None:
        """The condition on a location or a variable; None if its name is not there."""
        variables = {str(item): item for item in self._known if item.variable is not None}
        if text in variables:
            return self._test(variables[text], None, None)
        for item in self._known:
            if item.variable is None and text.startswith(f"{item.automaton}."):
                location = text[len(item.automaton) + 1 :]
                if location in subject_domain(self._system, item):
                    return StateTest(item.automaton, location)
        # A name may hold what looks like an operator, so each place where one could be is tried.
        for found in _COMPARISON.finditer(text):
            name, value = text[: found.start()].strip(), text[found.end() :].strip()
            if name in variables:
                return self._test(variables[name], found[0], value)
            if Subject(name) in self._known and found[0] in ("=", "!="):
                locations = [str(item) for item in subject_domain(self._system, Subject(name))]
                if value not in locations:
                    raise _unknown(f"location of {name}", value, locations)
                test = StateTest(name, value)
                return test if found[0] == "=" else Unary("not", test)
        return None


def _unknown(what: str, name: str, known: list[str]) -> RequestError:
    return RequestError(f"unknown {what} {_quoted(name)}{_hint(name, known)}")


def _hint(name: str, known: list[str]) -> str:
    """Return a hint at the name that may have been meant."""
    near = did_you_mean(name, known)
    if near is not None:
        return f"; did you mean '{near}'?"
    shown = ", ".join(known[:MAXIMUM_NAMES]) + (", ..." if len(known) > MAXIMUM_NAMES else "")
    return f"; there is {shown}" if known else ""


def _quoted(text: str) -> str:
    return f"'{visible(text[:MAXIMUM_SHOWN])}'"
