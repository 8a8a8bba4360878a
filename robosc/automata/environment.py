"""Input variables: the environment sets them at any time to any value, and automata may read them."""

import msgspec

from robosc.automata.structure import Assignment, Automaton, DiscreteVariable, Edge, Event, InputVariable
from robosc.expressions import ITSELF, Expression, Received, Type, VariableRead, domain

_LOCATION = "here"


class EnvironmentVariable(msgspec.Struct, frozen=True):
    """An input variable, as parts of a system: one uncontrollable event gives it any value, at any time.

    Attributes:
        automaton: Automaton that holds the value, is marked whatever the value is, and may begin with any.
        event: Event by which the environment changes the value.
        received: The new value.
        read: Expression that reads the value in guards, updates and conditions.
    """

    automaton: Automaton
    event: Event
    received: InputVariable
    read: Expression


def environment_variable(name: str, type_: Type) -> EnvironmentVariable:
    """An input variable.

    Args:
        name: Name of its automaton, and with `.changes` of its event.
        type_: A finite type.
    """
    event = Event(f"{name}.changes", is_controllable=False)
    edge = Edge(_LOCATION, event.name, _LOCATION, updates=(Assignment(ITSELF, Received()),))
    automaton = Automaton(
        name=name,
        locations=(_LOCATION,),
        initial=(_LOCATION,),
        marked=frozenset({_LOCATION}),
        alphabet=frozenset({event.name}),
        edges=(edge,),
        variables=(DiscreteVariable(ITSELF, type_, tuple(domain(type_))),),
    )
    return EnvironmentVariable(automaton, event, InputVariable(event.name, (), type_), VariableRead(name, ITSELF))
