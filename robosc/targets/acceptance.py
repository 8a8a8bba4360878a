"""Conditions that allow a controllable event, also in words, for all generated languages.

The conditions that the supervisor adds are not included; each generator writes decision diagrams in its own way.
"""

from typing import NamedTuple

from robosc.automata.executable import ExecutableEvent, Participant
from robosc.expressions import FALSE, TRUE, Expression, IntegerType, StateTest, Unary, conjunction
from robosc.expressions.text import expression_text
from robosc.model.structure import EventKind, Transition
from robosc.targets.text import requirement_text


class InOneOf(NamedTuple):
    """An automaton is in one of some locations."""

    automaton: str
    locations: tuple[str, ...]


class StaysInRange(NamedTuple):
    """The value of an update is in the variable's range, or unknown, or the component is not in the update's state.

    Attributes:
        component: The component.
        state: The state in which it would update; None if that is its only one.
        expression: The value.
        type: The variable's type.
    """

    component: str
    state: str | None
    expression: Expression
    type: IntegerType


Condition = Expression | InOneOf | StaysInRange
"""An expression holds only when it is true."""


def enabling_conditions(event: ExecutableEvent) -> list[tuple[str, Condition]]:
    """Return the conditions that an issued event needs, each with words: plants, ranges, requirements."""
    result: list[tuple[str, Condition]] = []
    if event.communication is None:
        result.append(_changes_something(event))
    if event.moves is not None:
        plant, sources = event.moves.plant, event.moves.sources
        result.append((f"{plant} is {' or '.join(sources)}", InOneOf(plant, sources)))
    result += accepting_conditions(event)
    words = [requirement_text(item) for item in event.requirements]
    if event.kind is EventKind.CANCEL and words:
        words = ["at least one of the action's requirements does not hold"]
    result += zip(words, event.needs, strict=True)
    return result


def accepting_conditions(event: ExecutableEvent) -> list[tuple[str, Condition]]:
    """Return the conditions for behaviours to accept an issued event and keep synthesis variables in range."""
    if event.communication is None:
        return [_tau_condition(event)]
    return [condition for participant in event.participants for condition in _component_conditions(participant)]


def _tau(event: ExecutableEvent) -> tuple[str, Transition]:
    """The component and the transition of a tau."""
    (participant,) = event.participants
    return participant.component, next(iter(participant.taken.values()))


def _tau_condition(event: ExecutableEvent) -> tuple[str, Condition]:
    component, transition = _tau(event)
    guard = transition.guard if transition.guard is not None else TRUE
    source = f"in {transition.source}: " if transition.source else ""
    condition = f" if {expression_text(guard)}" if transition.guard is not None else ""
    target = f" goto {transition.target}" if transition.target else ""
    place = TRUE if transition.source is None else StateTest(component, transition.source)
    return f"{component}: {source}transition{condition}{target}", conjunction(place, guard)


def _changes_something(event: ExecutableEvent) -> tuple[str, Condition]:
    """A tau that would change nothing is not taken."""
    component, transition = _tau(event)
    if transition.target is None or transition.target == transition.source:
        return "it would change nothing", FALSE
    if transition.source is not None:
        return "", TRUE
    return f"{component} is elsewhere", Unary("not", StateTest(component, transition.target))


def _component_conditions(participant: Participant) -> list[tuple[str, Condition]]:
    """Return the conditions for a component to accept an event and keep every synthesis variable in its range."""
    component, behaviour, taken = participant.component, participant.behaviour, participant.taken
    result: list[tuple[str, Condition]] = []
    if participant.may_block and len(taken) < len(behaviour.states):
        result.append((f"{component} accepts it in {', '.join(taken)}", InOneOf(component, tuple(taken))))
    variables = {variable.name: variable for variable in behaviour.variables}
    for state, transition in taken.items():
        for update in transition.updates:
            variable = variables[update.variable]
            if variable.is_synthesis and isinstance(variable.type, IntegerType):
                words = f"{component}.{update.variable} := {expression_text(update.expression)} stays in its range"
                place = state if len(behaviour.states) > 1 else None
                result.append((words, StaysInRange(component, place, update.expression, variable.type)))
    return result
