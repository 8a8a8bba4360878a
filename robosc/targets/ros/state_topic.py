"""Tables for the topic `/state`: the structure of the model, and the transitions that an event takes."""

from dataclasses import dataclass

from robosc.model.structure import Behaviour, Communication, CommunicationKind, Component, Model, Transition, is_tau

Table = dict[str, tuple[tuple[str, dict[str, int]], ...]]
"""For each event the components that take part, each with the transition's number by the state it is taken in."""


@dataclass(frozen=True, slots=True)
class StateTopic:
    """Data that the generated node needs to publish its state.

    Attributes:
        definition: The key `definition` of each state.
        transitions: Transition that an event takes.
    """

    definition: dict[str, object]
    transitions: Table


def state_topic(model: Model) -> StateTopic:
    """The tables of a model.

    A transition of the behaviour stands in every state; it is drawn once in each, with a number of its own.
    """
    numbers: dict[tuple[str, str, int], int] = {}
    components = []
    table: dict[str, dict[str, dict[str, int]]] = {}
    for component in model.components:
        components.append(_component(model, component, numbers))
        if component.behaviour is not None:
            _add_transitions(table, component.name, component.behaviour, numbers)
    transitions = {event: tuple(by_component.items()) for event, by_component in table.items()}
    return StateTopic({"name": model.name, "components": components}, transitions)


def _component(model: Model, component: Component, numbers: dict[tuple[str, str, int], int]) -> dict[str, object]:
    own = [item for item in model.communications if item.component == component.name]
    messages = (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.OUTGOING_MESSAGE)
    result: dict[str, object] = {
        "name": component.name,
        "messages": [item.name for item in own if item.kind in messages],
        "services": [item.name for item in own if item.kind is CommunicationKind.SERVICE],
        "actions": [item.name for item in own if item.kind is CommunicationKind.ACTION],
    }
    behaviour = component.behaviour
    if behaviour is not None:
        result["behaviour"] = {
            "variables": [variable.name for variable in behaviour.variables],
            "states": [
                {
                    "name": state.name,
                    "initial": state.is_initial,
                    "transitions": [
                        _transition(component.name, state.name, index, transition, numbers)
                        for index, transition in _transitions_of(behaviour, state.name)
                    ],
                }
                for state in behaviour.states
            ],
        }
    return result


def _transitions_of(behaviour: Behaviour, state: str) -> list[tuple[int, Transition]]:
    """The transitions of a state, its own before the behaviour's."""
    fitting = [(i, item) for i, item in enumerate(behaviour.transitions) if item.source in (state, None)]
    return sorted(fitting, key=lambda pair: pair[1].source is None)


def _transition(
    component: str, state: str, index: int, transition: Transition, numbers: dict[tuple[str, str, int], int]
) -> dict[str, object]:
    number = numbers.setdefault((component, state, index), len(numbers) + 1)
    name, _, kind = transition.event.rpartition(".")
    tau = is_tau(transition.event)
    return {
        "next": transition.target if transition.target is not None else state,
        "id": number,
        "type": "tau" if tau else kind,
        "communication": "" if tau else name,
    }


def _add_transitions(
    table: dict[str, dict[str, dict[str, int]]],
    component: str,
    behaviour: Behaviour,
    numbers: dict[tuple[str, str, int], int],
) -> None:
    for state in behaviour.states:
        for index, transition in _transitions_of(behaviour, state.name):
            by_state = table.setdefault(transition.event, {}).setdefault(component, {})
            by_state.setdefault(state.name, numbers[component, state.name, index])


__all__ = ["Communication", "StateTopic", "state_topic"]
