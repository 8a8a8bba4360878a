"""A short way to write checked models without a text.

Transitions are written `state: event -> target`; `*` stands for every state, and without `-> target` the
state stays.
"""

import re
from collections.abc import Iterable

from robosc.expressions import BooleanType, Expression, NoneType, Type, Value
from robosc.model.structure import (
    Behaviour,
    Communication,
    CommunicationKind,
    Component,
    Invariant,
    Model,
    ObjectDefinition,
    Requirement,
    RequirementForm,
    State,
    Transition,
    Update,
    Variable,
)

NONE = NoneType()


def incoming(name: str, component: str = "C") -> Communication:
    """An incoming message without data."""
    return Communication(name, component, CommunicationKind.INCOMING_MESSAGE, name, request=NONE)


def outgoing(name: str, response: Type = NONE, component: str = "C") -> Communication:
    """An outgoing message."""
    return Communication(name, component, CommunicationKind.OUTGOING_MESSAGE, name, response=response)


def service(name: str, response: Type = NONE, component: str = "C") -> Communication:
    """A service."""
    return Communication(name, component, CommunicationKind.SERVICE, name, request=NONE, response=response)


def action(name: str, response: Type = NONE, feedback: Type = NONE, component: str = "C") -> Communication:
    """An action."""
    return Communication(
        name, component, CommunicationKind.ACTION, name, request=NONE, response=response, feedback=feedback
    )


def transition(text: str, guard: Expression | None = None, /, **updates: Expression) -> Transition:
    """A transition such as `idle: move.request -> driving`."""
    found = re.fullmatch(r"(\w+|\*): ([\w.]+)(?: -> (\w+))?", text)
    assert found, text
    source, event, target = found.groups()
    assignments = tuple(Update(name, value) for name, value in updates.items())
    return Transition(None if source == "*" else source, event, guard, assignments, target)


def variable(name: str, type_: Type = BooleanType(), initial: Value = False, is_synthesis: bool = True) -> Variable:  # noqa: B008  # a frozen value
    """A synthesis variable, unless given otherwise."""
    return Variable(name, type_, initial, is_synthesis)


def component(
    name: str,
    states: str,
    transitions: Iterable[Transition | str] = (),
    variables: Iterable[Variable] = (),
) -> Component:
    """A component with a behaviour; the first state is initial, those with a star are marked: `idle* busy`."""
    names = states.split()
    return Component(
        name,
        Behaviour(
            variables=tuple(variables),
            states=tuple(
                State(item.rstrip("*"), is_initial=place == 0, is_marked=item.endswith("*"))
                for place, item in enumerate(names)
            ),
            transitions=tuple(transition(item) if isinstance(item, str) else item for item in transitions),
        ),
    )


def needs(communications: str, condition: Expression) -> Requirement:
    """`requirement {a, b} needs E`."""
    return Requirement(tuple(communications.split()), RequirementForm.NEEDS, condition)


def disables(condition: Expression, communications: str) -> Requirement:
    """`requirement E disables {a, b}`."""
    return Requirement(tuple(communications.split()), RequirementForm.DISABLES, condition)


def model(
    *parts: Component | Communication | Requirement | ObjectDefinition,
    name: str = "Robot",
) -> Model:
    """A robot; communications without a component of theirs belong to a component C without a behaviour."""
    communications = tuple(part for part in parts if isinstance(part, Communication))
    components = tuple(part for part in parts if isinstance(part, Component))
    known = {part.name for part in components}
    owners = dict.fromkeys(part.component for part in communications)
    silent = tuple(Component(owner) for owner in owners if owner not in known)
    return Model(
        name=name,
        components=(*silent, *components),
        communications=communications,
        enums=(),
        objects=tuple(part for part in parts if isinstance(part, ObjectDefinition)),
        requirements=tuple(part for part in parts if isinstance(part, Requirement)),
        provides=(),
        invariants=tuple(part for part in parts if isinstance(part, Invariant)),
    )
