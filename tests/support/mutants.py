"""Supervisors that were tampered with: each mutant differs from a right one in one thing."""

from collections.abc import Iterator
from dataclasses import dataclass
from random import Random

import msgspec

from robosc.automata import Semantics, System
from robosc.automata.controlled import Added, controlled_graph
from robosc.automata.state import subject_domain, subjects
from robosc.expressions import TRUE, Binary, BooleanType, Constant, Expression, IntegerType, Unary
from robosc.model.structure import Behaviour, Component, Model, RequirementForm
from robosc.supervisor import (
    AddedCondition,
    Certificate,
    Choice,
    DecisionDiagram,
    DecisionNode,
    Strategy,
    Supervisor,
)
from robosc.verification import ExplicitSupervisor
from support.random_supervisors import random_diagram

change = msgspec.structs.replace

ALWAYS, NEVER = DecisionDiagram((), 1), DecisionDiagram((), 0)


@dataclass(frozen=True, slots=True)
class Mutant[T]:
    """A value that was tampered with.

    Attributes:
        name: Kind of change.
        value: The result.
    """

    name: str
    value: T


def negated(diagram: DecisionDiagram) -> DecisionDiagram:
    """The opposite."""

    def other(child: int) -> int:
        return 1 - child if child < 2 else child

    nodes = tuple(change(node, children=tuple(map(other, node.children))) for node in diagram.nodes)
    return DecisionDiagram(nodes, other(diagram.root))


def diagram_mutants(diagram: DecisionDiagram, system: System) -> Iterator[Mutant[DecisionDiagram]]:
    """Every single change of a diagram that leaves it one."""
    sizes = {(item.automaton, item.variable): len(subject_domain(system, item)) for item in subjects(system)}
    yield Mutant("always", ALWAYS)
    yield Mutant("never", NEVER)
    yield Mutant("negated", negated(diagram))
    for root in range(len(diagram.nodes) + 1):
        yield Mutant(f"root {root}", change(diagram, root=root))
    for place, node in enumerate(diagram.nodes):
        for name, changed in _node_mutants(node, place + 2, sizes[node.automaton, node.variable]):
            nodes = (*diagram.nodes[:place], changed, *diagram.nodes[place + 1 :])
            yield Mutant(f"node {place + 2}: {name}", change(diagram, nodes=nodes))


def _node_mutants(node: DecisionNode, number: int, size: int) -> Iterator[tuple[str, DecisionNode]]:
    rows = list(zip(node.starts, node.children, strict=True))
    for place in range(1, len(rows)):
        children = list(node.children)
        children[place - 1], children[place] = children[place], children[place - 1]
        yield f"children {place - 1} and {place} swapped", change(node, children=tuple(children))
        for start in (node.starts[place] - 1, node.starts[place] + 1):
            upper = node.starts[place + 1] if place + 1 < len(rows) else size
            if node.starts[place - 1] < start < upper:
                starts = (*node.starts[:place], start, *node.starts[place + 1 :])
                yield f"start {place} is {start}", change(node, starts=starts)
    for place in range(len(rows)):
        for child in {0, 1, number - 1} - {node.children[place], number}:
            children = list(node.children)
            children[place] = child
            yield f"child {place} is {child}", change(node, children=tuple(children))


def added_mutants(
    added: tuple[AddedCondition, ...], system: System, dice: Random
) -> Iterator[Mutant[tuple[AddedCondition, ...]]]:
    """Every single change of the added conditions, with random ones where a condition is made up."""
    names = [event.name for event in system.events if event.is_controllable]
    for place, item in enumerate(added):
        before, behind = added[:place], added[place + 1 :]
        yield Mutant(f"{item.event} dropped", (*before, *behind))
        for found in diagram_mutants(item.condition, system):
            yield Mutant(f"{item.event} {found.name}", (*before, change(item, condition=found.value), *behind))
        for name in names:
            if name not in {other.event for other in added}:
                yield Mutant(f"{item.event} moved to {name}", (*before, change(item, event=name), *behind))
        yield Mutant(
            f"{item.event} at random", (*before, change(item, condition=random_diagram(dice, system)), *behind)
        )
    for name in names:
        if name not in {other.event for other in added}:
            yield Mutant(f"{name} never", (*added, AddedCondition(name, NEVER)))
            yield Mutant(f"{name} always", (*added, AddedCondition(name, ALWAYS)))
            yield Mutant(f"{name} at random", (*added, AddedCondition(name, random_diagram(dice, system))))
    if len(added) > 1:
        first, second, *rest = added
        swapped = (change(first, condition=second.condition), change(second, condition=first.condition))
        yield Mutant(f"{first.event} and {second.event} swapped", (*swapped, *rest))


def is_right(system: System, added: Added, right: ExplicitSupervisor) -> bool:
    """Return True if conditions do what the right supervisor does, in every state that is reachable under them."""
    semantics = Semantics(system)
    graph = controlled_graph(semantics, added, limit=20_000)
    assert graph is not None
    return all(
        (name not in added or added[name](state)) == right.allows(state, name)
        for state in graph.states
        for name in (event.name for event in system.events if event.is_controllable)
        if semantics.enabled(state, name) and semantics.condition(state, name)
    )


def false_certificates(certificate: Certificate) -> Iterator[Mutant[Certificate]]:
    """The same certificate with another figure."""
    for states in (int(certificate.states) + 1, int(certificate.states) - 1 or 7, 10**30):
        yield Mutant(f"{states} states", change(certificate, states=str(states)))
    for transitions in (int(certificate.transitions or 0) + 1, 0, 10**30):
        if str(transitions) != certificate.transitions:
            yield Mutant(f"{transitions} transitions", change(certificate, transitions=str(transitions)))


def model_mutants(model: Model) -> Iterator[Mutant[Model]]:
    """Every single change of a model: guards, updates, requirements, marking, initial states, ranges, order."""
    yield Mutant("name", change(model, name=model.name + "_"))
    for place, component in enumerate(model.components):
        if component.behaviour is not None:
            for found in _behaviour_mutants(component.behaviour):
                changed: Component = change(component, behaviour=found.value)
                components = (*model.components[:place], changed, *model.components[place + 1 :])
                yield Mutant(f"{component.name}: {found.name}", change(model, components=components))
    for place, requirement in enumerate(model.requirements):
        before, behind = model.requirements[:place], model.requirements[place + 1 :]
        yield Mutant(f"requirement {place} dropped", change(model, requirements=(*before, *behind)))
        forms = [form for form in RequirementForm if form is not requirement.form]
        for other in (
            *(change(requirement, form=form) for form in forms),
            change(requirement, expression=Unary("not", requirement.expression)),
            change(requirement, expression=TRUE),
        ):
            if other != requirement:
                yield Mutant(f"requirement {place} changed", change(model, requirements=(*before, other, *behind)))
    if len(model.requirements) > 1 and model.requirements[0] != model.requirements[-1]:
        yield Mutant("requirements in another order", change(model, requirements=model.requirements[::-1]))


def _behaviour_mutants(behaviour: Behaviour) -> Iterator[Mutant[Behaviour]]:
    for place, state in enumerate(behaviour.states):
        states = list(behaviour.states)
        states[place] = change(state, is_marked=not state.is_marked)
        yield Mutant(f"{state.name} marked or not", change(behaviour, states=tuple(states)))
        if not state.is_initial:
            states = [change(item, is_initial=item is state) for item in behaviour.states]
            yield Mutant(f"{state.name} initial", change(behaviour, states=tuple(states)))
    for place, variable in enumerate(behaviour.variables):
        others = []
        match variable.type:
            case IntegerType(low=int(low), high=int(high)):
                others.append(change(variable, type=IntegerType(low, high + 1)))
                others.append(change(variable, initial=low if variable.initial != low else high))
            case BooleanType():
                others.append(change(variable, initial=not variable.initial))
        for other in others:
            variables = (*behaviour.variables[:place], other, *behaviour.variables[place + 1 :])
            yield Mutant(f"{variable.name} changed", change(behaviour, variables=variables))
    for place, transition in enumerate(behaviour.transitions):
        before, behind = behaviour.transitions[:place], behaviour.transitions[place + 1 :]
        yield Mutant(f"transition {place} dropped", change(behaviour, transitions=(*before, *behind)))
        if transition.guard is not None:
            guard: Expression = Unary("not", transition.guard)
            weaker = Binary("or", transition.guard, Constant(True))
            for altered in (change(transition, guard=guard), change(transition, guard=weaker)):
                yield Mutant(f"guard {place} changed", change(behaviour, transitions=(*before, altered, *behind)))
        for state in behaviour.states:
            if state.name != transition.target:
                altered = change(transition, target=state.name)
                yield Mutant(f"target {place} changed", change(behaviour, transitions=(*before, altered, *behind)))
                break


def with_added(supervisor: Supervisor, added: tuple[AddedCondition, ...]) -> Supervisor:
    """A supervisor with other conditions."""
    return change(supervisor, added=added)


def strategy_mutants(supervisor: Supervisor) -> Iterator[Mutant[Strategy]]:
    """Every single change of a strategy: of what it chooses, in which order, and where."""
    assert supervisor.strategy is not None
    modes, executable = supervisor.strategy.modes, supervisor.executable

    def changed(number: int, mode: tuple[Choice, ...]) -> Strategy:
        return Strategy((*modes[:number], mode, *modes[number + 1 :]))

    for number, mode in enumerate(modes):
        subject = f"goal {number + 1}"
        if number:
            swapped = (*modes[: number - 1], mode, modes[number - 1], *modes[number + 1 :])
            yield Mutant(f"{subject} exchanged with the one before", Strategy(swapped))
        yield Mutant(f"{subject}: nothing", changed(number, ()))
        for place, choice in enumerate(mode):
            before, after, name = mode[:place], mode[place + 1 :], f"{subject}, {choice.event}"
            yield Mutant(f"{name}: removed", changed(number, (*before, *after)))
            if place:
                yield Mutant(f"{name}: earlier", changed(number, (*mode[: place - 1], choice, before[-1], *after)))
            for event in executable.requests:
                if event not in {item.event for item in mode}:
                    other = change(choice, event=event)
                    yield Mutant(f"{name}: {event} instead", changed(number, (*before, other, *after)))
            for mutant in diagram_mutants(choice.condition, executable.remembering_automata):
                other = change(choice, condition=mutant.value)
                yield Mutant(f"{name}: {mutant.name}", changed(number, (*before, other, *after)))
