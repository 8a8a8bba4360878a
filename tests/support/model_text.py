"""The text of a model: what an author would write for a checked model that tests made without one."""

import re
from collections.abc import Iterable, Iterator, Sequence

import msgspec

from robosc.errors import LanguageError
from robosc.expressions import (
    ArrayType,
    Constant,
    EnumType,
    Expression,
    IntegerType,
    NoneType,
    ObjectType,
    StringType,
    Type,
)
from robosc.expressions.text import expression_text
from robosc.formatting import format_text
from robosc.language.words import RESERVED_WORDS, spelled
from robosc.model.structure import (
    Assumption,
    Behaviour,
    Bound,
    Communication,
    CommunicationKind,
    Component,
    EnumDefinition,
    Goal,
    Mission,
    Model,
    ObjectValue,
    ProvidedValue,
    Requirement,
    RequirementForm,
    Transition,
    Update,
    Variable,
    is_tau,
)

_PLACEHOLDER = "some_type"
"""The interface of what the language wants linked, and the model has not."""

_KINDS = {
    "request": "request to",
    "response": "response from",
    "feedback": "feedback from",
    "error": "error from",
    "cancel": "cancel from",
}


def model_text(model: Model) -> str:
    """A text that means the model, as far as a text can: what the language has no words for is left out."""
    text = _Writer(model).text()
    try:
        return format_text(text)
    except LanguageError:
        return text


class _Writer:
    """Writes one model.

    Args:
        model: The model.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self._components = [item.name for item in model.components]
        linked = (item.interface for item in model.communications if item.interface is not None)
        self._interfaces = {item: f"interface_{number}" for number, item in enumerate(dict.fromkeys(linked))}

    def text(self) -> str:
        """The whole."""
        return f"robot {spelled(self._model.name)} {{\n" + "\n".join(self._parts()) + "\n}\n"

    def _parts(self) -> Iterator[str]:
        model = self._model
        yield f"interface {_PLACEHOLDER} use SomeType from some_package"
        for item, name in self._interfaces.items():
            yield f"interface {name} use {spelled(item.type)} from {spelled(item.package)}"
        for definition in model.objects:
            properties = " ".join(f"{spelled(item.name)}: {_type(item.type)}" for item in definition.properties)
            yield f"datatype object {_own(definition.name)} {{ {properties} }}"
        yield from map(self._enum, model.enums)
        yield from map(self._component, model.components)
        yield from map(self._requirement, model.requirements)
        for invariant in model.invariants:
            word = "never" if invariant.is_never else "always"
            yield f"requirement {word} {self._expression(invariant.expression)}"
        yield from (f"goal {self._aim(goal)}" for goal in model.goals)
        for assumption in model.assumptions:
            yield f"assume {'allow ' if assumption.is_allowed else ''}{self._aim(assumption)}"
        yield from map(self._mission, model.missions)
        for preference in model.preferences:
            sides = (", ".join(map(spelled, side)) for side in (preference.preferred, preference.others))
            yield "prefer {{ {} }} over {{ {} }}".format(*sides)
        for item_ in model.provides:
            condition = "" if item_.condition is None else f" if {self._expression(item_.condition)}"
            yield f"provide {spelled(item_.communication)} with {self._provided(item_.value)}{condition}"
        for limit in model.limits:
            condition = "" if limit.condition is None else f" if {self._expression(limit.condition)}"
            yield f"limit {spelled(limit.communication)} to {self._range(limit.bounds)}{condition}"

    def _enum(self, item: EnumDefinition) -> str:
        rules = "\n".join(f"{self._expression(rule.condition)} -> {spelled(rule.value)}" for rule in item.rules)
        head = f"datatype enum {_own(item.name)} from {_type(item.source)} to"
        return f"{head} {{\n{rules}\ndefault -> {spelled(item.default)}\n}}"

    def _component(self, item: Component) -> str:
        parts = [self._communication(one) for one in self._model.communications if one.component == item.name]
        if item.behaviour is not None:
            parts.append(self._behaviour(item.behaviour))
        return f"component {spelled(item.name)} {{\n" + "\n".join(parts) + "\n}"

    def _communication(self, item: Communication) -> str:
        given = [f"identifier: {self._expression(Constant(item.identifier))}"]
        types = {"request": item.request, "response": item.response, "feedback": item.feedback}
        is_message = item.kind in (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.OUTGOING_MESSAGE)
        given += [
            f"{'type' if is_message else word}: {_type(type_)}" for word, type_ in types.items() if type_ is not None
        ]
        options = {"qos": item.quality, "depth": item.depth, "max_age": item.max_age}
        given += [f"{word}: {value}" for word, value in options.items() if value is not None]
        if item.frame is not None:
            given.append(f"stamped: {self._expression(Constant(item.frame))}")
        if item.has_condition:
            given.append("when: default" if item.when is None else f"when: {self._expression(item.when)}")
        links = ""
        if item.interface is not None:
            links = f" links {self._interfaces[item.interface]}"
        elif not is_message or any(isinstance(self._source(type_), ObjectType) for type_ in types.values() if type_):
            links = f" links {_PLACEHOLDER}"
        return f"{item.kind} {spelled(item.name)} with {', '.join(given)}{links}"

    def _source(self, type_: Type) -> Type:
        """Return the type as which a type crosses the middleware."""
        return self._source(self._model.enum(type_.name).source) if isinstance(type_, EnumType) else type_

    def _behaviour(self, item: Behaviour) -> str:
        parts = [f"variable {spelled(one.name)}: {_type(one.type)} = {self._initial(one)}" for one in item.variables]
        parts += [self._transition(one) for one in item.transitions if one.source is None]
        for state in item.states:
            words = f"{'initial ' if state.is_initial else ''}{'marked ' if state.is_marked else ''}state"
            inside = "\n".join(self._transition(one) for one in item.transitions if one.source == state.name)
            parts.append(f"{words} {spelled(state.name)} {{\n{inside}\n}}")
        return "behaviour {\n" + "\n".join(parts) + "\n}"

    def _initial(self, item: Variable) -> str:
        return (
            spelled(str(item.initial)) if isinstance(item.type, EnumType) else self._expression(Constant(item.initial))
        )

    def _transition(self, item: Transition) -> str:
        goto = "" if item.target is None else f" goto {spelled(item.target)}"
        if is_tau(item.event):
            condition = "" if item.guard is None else f" if {self._expression(item.guard)}"
            return f"transition{condition}{goto}"
        communication, _, kind = item.event.partition(".")
        updates = ", ".join(map(self._update, item.updates))
        return f"on {_KINDS.get(kind, kind)} {spelled(communication)}{' do ' if updates else ''}{updates}{goto}"

    def _update(self, item: Update) -> str:
        return f"{spelled(item.variable)} := {self._expression(item.expression)}"

    def _requirement(self, item: Requirement) -> str:
        requests = f"{{ {', '.join(map(spelled, item.communications))} }}"
        # The parentheses keep the condition apart from the words around it.
        condition = f"({self._expression(item.expression)})"
        if item.form is RequirementForm.NEEDS:
            return f"requirement {requests} needs {condition}"
        return f"requirement {condition} disables {requests}"

    def _aim(self, item: Goal | Assumption) -> str:
        # The parentheses keep words of a condition from being taken for those of the form.
        conditions = [f"({self._expression(expression)})" for expression in item.expressions]
        return f" {item.form} ".join(conditions) if len(conditions) > 1 else f"{item.form} {conditions[0]}"

    def _mission(self, item: Mission) -> str:
        condition = "" if item.condition is None else f" while {self._expression(item.condition)}"
        parts = [self._visits(item.visits)]
        for detour in item.detours:
            parts.append(f"on {self._expression(detour.trigger)} from anywhere {self._visits(detour.visits)}")
        return f"mission {spelled(item.name)}{condition} {{\n" + "\n".join(parts) + "\n}"

    def _visits(self, visits: Iterable[Expression]) -> str:
        return "visit " + " then ".join(f"({self._expression(visit)})" for visit in visits)

    def _range(self, bounds: Sequence[Bound], depth: int = 0) -> str:
        if len(bounds[0].path) == depth:
            return f"{bounds[0].low}..{bounds[0].high}"
        parts: dict[str, list[Bound]] = {}
        for bound in bounds:
            parts.setdefault(bound.path[depth], []).append(bound)
        return (
            "{ " + ", ".join(f"{spelled(name)}: {self._range(part, depth + 1)}" for name, part in parts.items()) + " }"
        )

    def _provided(self, value: ProvidedValue) -> str:
        if not isinstance(value, ObjectValue):
            return self._expression(value)
        inside = ", ".join(f"{spelled(name)}: {self._provided(part)}" for name, part in value.properties)
        return f"{{ {inside} }}"

    def _expression(self, expression: Expression) -> str:
        text = expression_text(_marked(expression), self._components)
        return re.sub(rf"\b(\w+){_MARK}\b", r"^\1", text)


_MARK = "__reserved"


def _marked(expression: Expression) -> Expression:
    """The expression, its names that are reserved words marked at their ends: afterwards nobody could know them."""

    def renamed(value: object, field: str = "") -> object:
        if isinstance(value, str):
            return f"{value}{_MARK}" if value in RESERVED_WORDS and field in _NAMES else value
        if isinstance(value, tuple):
            return tuple(renamed(item, field) for item in value)
        if not isinstance(value, msgspec.Struct):
            return value
        fields = value.__struct_fields__
        if isinstance(value, Constant):
            return value
        inner = "enum value" if type(value).__name__ == "EnumValue" else ""
        changed = {name: renamed(getattr(value, name), inner if inner and name == "value" else name) for name in fields}
        return msgspec.structs.replace(value, **changed)

    return renamed(expression)  # type: ignore[return-value]  # renamed part by part


_NAMES = frozenset({"component", "variable", "state", "path", "enum value"})


def _own(name: str) -> str:
    """The name of a type, of a library too, as one of the robot."""
    return spelled(name.replace(".", "_"))


def _type(type_: Type) -> str:
    match type_:
        case IntegerType(low=int(low), high=int(high)):
            return f"integer({low}..{high})"
        case ArrayType(element=element):
            return f"array({_type(element)})"
        case ObjectType(name=name) | EnumType(name=name):
            return _own(name)
        case StringType() | NoneType():
            return "string" if isinstance(type_, StringType) else "none"
        case _:
            return type(type_).__name__.removesuffix("Type").lower()
