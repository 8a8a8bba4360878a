"""Added conditions as predicates over the explicit states of a system."""

from collections.abc import Callable, Iterable

from robosc.automata import System
from robosc.automata.decision import Decision, Test, index_in
from robosc.automata.state import Subject, subject_domain, subjects
from robosc.supervisor.structure import AddedCondition, DecisionDiagram


def state_predicates(system: System, added: Iterable[AddedCondition]) -> dict[str, Decision]:
    """For each event with an added condition, its predicate over state tuples in the order of `subjects`."""
    decide = _decider(system)
    return {item.event: decide(item.condition) for item in added}


def state_predicate(system: System, diagram: DecisionDiagram) -> Decision:
    """A diagram as a predicate over state tuples in the order of `subjects`."""
    return _decider(system)(diagram)


def _decider(system: System) -> Callable[[DecisionDiagram], Decision]:
    order = subjects(system)
    places = {subject: place for place, subject in enumerate(order)}
    indices = tuple(index_in(subject_domain(system, subject)) for subject in order)

    def decision(diagram: DecisionDiagram) -> Decision:
        nodes = tuple(
            Test(places[Subject(node.automaton, node.variable)], node.starts, node.children) for node in diagram.nodes
        )
        return Decision(nodes, diagram.root, indices)

    return decision
