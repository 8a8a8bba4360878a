"""Conditions that allow a controllable event, also in words: the same for every language that is generated.

The conditions that the supervisor adds come on top; each generator writes decision diagrams in its own way.
"""

from typing import NamedTuple

from robosc.expressions import FALSE, TRUE, Expression, IntegerType, StateTest, Unary, conjunction
from robosc.expressions.text import expression_text
from robosc.model.structure import Behaviour, Deployment, EventKind, Model, Transition, is_tau
from robosc.supervisor import Supervisor
from robosc.targets.events import plant_step, split, taken_transition
from robosc.targets.model_text import requirement_text


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


def enabling_conditions(supervisor: Supervisor, event: str) -> list[tuple[str, Condition]]:
    """Return the conditions that a controllable event needs, each with words: plants, ranges, requirements."""
    model = supervisor.model
    name, kind = split(event)
    result: list[tuple[str, Condition]] = []
    if is_tau(event):
        result.append(_changes_something(model, event))
    if (step := plant_step(model, event)) is not None:
        plant, sources, _ = step
        result.append((f"{plant} is {' or '.join(sources)}", InOneOf(plant, sources)))
    result += accepting_conditions(model, event)
    if kind == EventKind.REQUEST:
        result += [(requirement_text(item), item.condition) for item in model.requirements_on(name)]
    elif kind == EventKind.CANCEL:
        result += _cancel_condition(supervisor, name)
    return result


def accepting_conditions(model: Model, event: str) -> list[tuple[str, Condition]]:
    """Return the conditions for behaviours to accept a controllable event and keep synthesis variables in range."""
    if is_tau(event):
        return [_tau_condition(model, event)]
    return [
        condition
        for component in model.components
        if component.behaviour
        for condition in _component_conditions(component.name, component.behaviour, event)
    ]


def _cancel_condition(supervisor: Supervisor, action: str) -> list[tuple[str, Condition]]:
    """Cancel only where at least one requirement does not hold; without requirements, and as a layer, anywhere."""
    requirements = supervisor.model.requirements_on(action)
    if not requirements or supervisor.deployment is Deployment.LAYER:
        return []
    all_hold = conjunction(*(requirement.condition for requirement in requirements))
    return [("at least one of the action's requirements does not hold", Unary("not", Unary("holds", all_hold)))]


def _tau(model: Model, event: str) -> tuple[str, Transition]:
    """The component and the transition of a tau."""
    component, _ = split(event)
    behaviour = model.component(component).behaviour
    assert behaviour is not None  # noqa: S101  # It has the tau.
    return component, next(item for item in behaviour.transitions if item.event == event)


def _tau_condition(model: Model, event: str) -> tuple[str, Condition]:
    component, transition = _tau(model, event)
    guard = transition.guard if transition.guard is not None else TRUE
    source = f"in {transition.source}: " if transition.source else ""
    condition = f" if {expression_text(guard)}" if transition.guard is not None else ""
    target = f" goto {transition.target}" if transition.target else ""
    place = TRUE if transition.source is None else StateTest(component, transition.source)
    return f"{component}: {source}transition{condition}{target}", conjunction(place, guard)


def _changes_something(model: Model, event: str) -> tuple[str, Condition]:
    """A tau that would change nothing is not taken."""
    component, transition = _tau(model, event)
    if transition.target is None or transition.target == transition.source:
        return "it would change nothing", FALSE
    if transition.source is not None:
        return "", TRUE
    return f"{component} is elsewhere", Unary("not", StateTest(component, transition.target))


def _component_conditions(component: str, behaviour: Behaviour, event: str) -> list[tuple[str, Condition]]:
    """Return the conditions for a component to accept a request and keep every synthesis variable in its range."""
    if not any(item.event == event for item in behaviour.transitions):
        return []
    taken = {state.name: taken_transition(behaviour, event, state.name) for state in behaviour.states}
    accepting = tuple(state for state, transition in taken.items() if transition is not None)
    result: list[tuple[str, Condition]] = []
    if len(accepting) < len(taken) and split(event)[1] == EventKind.REQUEST:
        result.append((f"{component} accepts it in {', '.join(accepting)}", InOneOf(component, accepting)))
    variables = {variable.name: variable for variable in behaviour.variables}
    for state, transition in taken.items():
        for update in transition.updates if transition is not None else ():
            variable = variables[update.variable]
            if variable.is_synthesis and isinstance(variable.type, IntegerType):
                words = f"{component}.{update.variable} := {expression_text(update.expression)} stays in its range"
                place = state if len(behaviour.states) > 1 else None
                result.append((words, StaysInRange(component, place, update.expression, variable.type)))
    return result
