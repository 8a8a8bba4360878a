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
    places = {
        (subject.automaton, subject.variable): (
            place,
            {value: index for index, value in enumerate(subject_domain(system, subject))},
        )
        for place, subject in enumerate(subjects(system))
    }

    def predicate(diagram: DecisionDiagram) -> Callable[[State], bool]:
        def holds(state: State) -> bool:
            def read(automaton: str, variable: str | None) -> int:
                place, indices = places[automaton, variable]
                return indices[state[place]]

            return evaluate(diagram, read)

        return holds

    return {item.event: predicate(item.condition) for item in added}
