"""Added conditions as predicates over the explicit states of a system."""

from collections.abc import Callable, Iterable

from robosc.automata import System
from robosc.automata.state import subject_domain, subjects
from robosc.expressions import Value
from robosc.supervisor.diagram import evaluate
from robosc.supervisor.structure import AddedCondition, DecisionDiagram

State = tuple[Value, ...]


def state_predicates(system: System, added: Iterable[AddedCondition]) -> dict[str, Callable[[State], bool]]:
    """For each event with an added condition, its predicate over state tuples in the order of `subjects`."""
    places = _places(system)
    return {item.event: _predicate(places, item.condition) for item in added}


def state_predicate(system: System, diagram: DecisionDiagram) -> Callable[[State], bool]:
    """A diagram as a predicate over state tuples in the order of `subjects`."""
    return _predicate(_places(system), diagram)


_Places = dict[tuple[str, str | None], tuple[int, dict[Value, int]]]
"""Where each subject stands in a state tuple, with the index of each of its values."""


def _places(system: System) -> _Places:
    return {
        (subject.automaton, subject.variable): (
            place,
            {value: index for index, value in enumerate(subject_domain(system, subject))},
        )
        for place, subject in enumerate(subjects(system))
    }


def _predicate(places: _Places, diagram: DecisionDiagram) -> Callable[[State], bool]:
    def holds(state: State) -> bool:
        def read(automaton: str, variable: str | None) -> int:
            place, indices = places[automaton, variable]
            return indices[state[place]]

        return evaluate(diagram, read)

    return holds
