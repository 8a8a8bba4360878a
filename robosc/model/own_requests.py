"""Effect of the request of an action on its own requirements."""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from itertools import islice

from robosc.expressions import Expression, StateTest, Unary, Value, children, leaves
from robosc.expressions.evaluate import evaluate
from robosc.model.structure import Behaviour, EventKind, Transition

_MAXIMUM_JUDGEMENTS = 20_000


class _UnknownLocation:
    """A location of which nothing is known: whether it is a given one is unknown."""

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> None:  # type: ignore[override]  # neither true nor false
        return None


_UNKNOWN_LOCATION = _UnknownLocation()


class OwnRequests:
    """The transitions of a robot that requests take.

    Args:
        behaviours: Behaviours by component.
    """

    def __init__(self, behaviours: Mapping[str, Behaviour]) -> None:
        self._judgements = 0
        self._taken: defaultdict[str, list[tuple[str, Behaviour, Transition]]] = defaultdict(list)
        for component, behaviour in behaviours.items():
            for transition in behaviour.transitions:
                self._taken[transition.event].append((component, behaviour, transition))

    def breaking(self, action: str, requirement: Expression) -> str | None:
        """A component in which the request of an action makes a requirement false, whatever the others do.

        Only the component's own states and variables are read: a requirement counts as false only if no other
        component could make it true. The number of these checks is limited, because it grows with the square of the
        model and the finding is only a note.
        """
        if self._judgements > _MAXIMUM_JUDGEMENTS or _tests_knowledge(requirement):
            return None
        for component, behaviour, transition in self._taken.get(f"{action}.{EventKind.REQUEST}", ()):
            for state in _distinct_states(requirement, component, behaviour, transition):
                self._judgements += 1
                if _breaks(requirement, component, transition, state):
                    return component
        return None


def _distinct_states(
    requirement: Expression, component: str, behaviour: Behaviour, transition: Transition
) -> Iterator[str]:
    """The states in which a transition can be taken; only the first of those that a requirement treats alike."""
    if transition.source is not None:
        yield transition.source
        return
    named = {leaf.state for leaf in leaves(requirement) if isinstance(leaf, StateTest) and leaf.component == component}
    yield from (state.name for state in behaviour.states if state.name in named)
    yield from islice((state.name for state in behaviour.states if state.name not in named), 1)


def _breaks(requirement: Expression, component: str, transition: Transition, state: str) -> bool:
    """Return True if a requirement that may be true in a state is false after a transition from it."""
    before = _known_value(requirement, component, state, {})
    assigned = {update.variable: _known_value(update.expression, component, state, {}) for update in transition.updates}
    after = _known_value(requirement, component, transition.target or state, assigned)
    return before is not False and after is False


def _known_value(
    expression: Expression, component: str, state: str, variables: Mapping[str, Value | None]
) -> Value | None:
    """The value of an expression, if one component's state and variables determine it; else None."""
    return evaluate(  # type: ignore[no-any-return]
        expression,
        lambda owner, variable: variables.get(variable) if owner == component else None,  # type: ignore[arg-type, return-value]
        lambda owner: state if owner == component else _UNKNOWN_LOCATION,  # type: ignore[arg-type, return-value]  # compared only
    )


def _tests_knowledge(expression: Expression) -> bool:
    """Return True if an expression tests whether data are known: here, unknown data mean something else."""
    stack = [expression]
    while stack:
        node = stack.pop()
        if isinstance(node, Unary) and node.operator == "holds":
            return True
        stack += children(node)
    return False
