"""Variables that take part in synthesis, and the rules about them."""

from collections.abc import Iterable, Iterator, Mapping

import msgspec

from robosc.expressions import (
    DoubleType,
    Expression,
    IntegerType,
    Received,
    Type,
    VariableRead,
    is_finite,
    leaves,
    type_text,
)
from robosc.language import syntax
from robosc.model.behaviour import BehaviourTree
from robosc.model.findings import Findings
from robosc.model.structure import (
    Assumption,
    Behaviour,
    Communication,
    EventKind,
    Goal,
    Invariant,
    Mission,
    Provide,
    Requirement,
    is_tau,
)
from robosc.model.types import Types

Key = tuple[str, str]


def mark_synthesis_variables(
    behaviours: Mapping[str, Behaviour],
    requirements: Iterable[Requirement],
    provides: Iterable[Provide],
    invariants: Iterable[Invariant],
    aims: Iterable[Goal | Assumption | Mission],
) -> dict[str, Behaviour]:
    """The behaviours with every variable classified: part of synthesis, or code-only."""
    found = set[Key]()
    conditions = [item.expression for item in requirements]
    conditions += [item.expression for item in invariants]
    conditions += [expression for item in aims for expression in item.expressions]
    conditions += [item.condition for item in provides if item.condition is not None]
    conditions += [item.guard for behaviour in behaviours.values() for item in behaviour.transitions if item.guard]
    frontier = [key for condition in conditions for key in _read(condition)]
    feeding: dict[Key, list[Key]] = {}
    for name, behaviour in behaviours.items():
        for transition in behaviour.transitions:
            for update in transition.updates:
                feeding.setdefault((name, update.variable), []).extend(_read(update.expression))
    while frontier:
        key = frontier.pop()
        if key not in found:
            found.add(key)
            frontier.extend(feeding.get(key, ()))
    return {
        name: msgspec.structs.replace(
            behaviour,
            variables=tuple(
                msgspec.structs.replace(variable, is_synthesis=(name, variable.name) in found)
                for variable in behaviour.variables
            ),
        )
        for name, behaviour in behaviours.items()
    }


def _read(expression: Expression) -> Iterator[Key]:
    for leaf in leaves(expression):
        if isinstance(leaf, VariableRead):
            yield leaf.component, leaf.variable


def check_synthesis_variables(
    tree: BehaviourTree,
    behaviour: Behaviour,
    communications: Mapping[str, Communication],
    types: Types,
    findings: Findings,
) -> None:
    """Synthesis variables are finite, and so is what they are fed with."""
    places = {variable.name.text: variable.type.location for variable in tree.variables}
    finite = set[str]()
    for variable in behaviour.variables:
        if not variable.is_synthesis:
            continue
        if is_finite(variable.type):
            finite.add(variable.name)
            continue
        match variable.type:
            case IntegerType():
                code, fix = "integer-range-required", "Give it a range: 'integer(0..10)'."
            case DoubleType():
                code, fix = "double-in-synthesis", "Use an integer with a range, or an enum made from the double."
            case _:
                code, fix = "string-in-synthesis", "Use an enum made from the string."
        findings.error(
            code,
            f"'{variable.name}' decides about requests, so it cannot be of type {type_text(variable.type)}",
            places[variable.name],
            fix,
        )
    _check_sources(tree, behaviour, finite, communications, types, findings)


def _check_sources(
    tree: BehaviourTree,
    behaviour: Behaviour,
    finite: set[str],
    communications: Mapping[str, Communication],
    types: Types,
    findings: Findings,
) -> None:
    """Received data that feeds a synthesis variable is finite."""
    written = {
        (transition.kind, transition.communication.text, _target(update), state.name.text if state else None): update
        for state, transition in tree.transitions
        if isinstance(transition, syntax.CommunicationTransition)
        for update in transition.updates
    }
    for transition in behaviour.transitions:
        if is_tau(transition.event):
            continue
        name, _, kind = transition.event.partition(".")
        received = communications[name].received_type(EventKind(kind))
        for update in transition.updates:
            if update.variable not in finite or received is None:
                continue
            infinite = [
                type_
                for leaf in leaves(update.expression)
                if isinstance(leaf, Received) and (type_ := _type_of(received, leaf, types)) and not is_finite(type_)
            ]
            place = written.get((kind, name, update.variable, transition.source))
            if infinite and place is not None:
                findings.error(
                    "infinite-source",
                    f"'{update.variable}' takes part in synthesis, but {type_text(infinite[0])} has too many values",
                    place.value.location,
                    "Make the received data an enum, and assign that.",
                )


def _target(update: syntax.Update) -> str:
    last = update.target.steps[-1] if update.target.steps else update.target.root
    return last.text if isinstance(last, syntax.Name) else ""


def _type_of(received: Type, leaf: Received, types: Types) -> Type | None:
    found: Type | None = received
    for step in leaf.path:
        if found is None:
            return None
        found = getattr(found, "element", None) if isinstance(step, int) else types.property_type(found, step)
    return found
