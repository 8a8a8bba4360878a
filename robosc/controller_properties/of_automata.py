"""Controller properties of automata under their supervisor, as CIF's controller properties checker defines them.

A program that runs them takes uncontrollable events until none is possible, then controllable ones until none is, and
so on; input variables change in between. Synthesis does not guarantee that this ends, that the order of controllable
events does not matter, or that a marked state is reached. All is decided on the reachable states, one by one.

Source: Reijnen, Erens, van de Mortel-Fronczak and Rooda, "Supervisory controller synthesis and implementation for
safety PLCs", Discrete Event Dynamic Systems 32, 2022, pp. 115-141; bounded response and nonblocking under control as
in the manual of the Eclipse ESCET toolkit. Two orders of controllable events agree if both can go on to the same state,
which for orders that end means that they end in it; CIF proves this for pairs of events and may not find a proof.
"""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from robosc.automata.compile import State
from robosc.automata.controlled import Added, ControlledGraph, controlled_graph
from robosc.automata.semantics import Semantics
from robosc.automata.structure import System
from robosc.controller_properties.graphs import components

type Steps = Sequence[Sequence[tuple[str, int]]]
"""Steps from each state: the event, and the number of the state that it leads to."""


@dataclass(frozen=True, slots=True)
class Response:
    """Events of one kind that can follow each other, without others.

    Attributes:
        bound: Greatest number of them, from any reachable state; None if there is no bound.
        trace: Events that lead to a state from which so many follow, or that lead into a cycle.
        events: Those that follow, or the cycle.
    """

    bound: int | None
    trace: tuple[str, ...]
    events: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Disagreement:
    """Two orders of controllable events that never meet again.

    Attributes:
        trace: Events that lead to the state in which both begin.
        orders: The two orders.
    """

    trace: tuple[str, ...]
    orders: tuple[tuple[str, ...], tuple[str, ...]]


@dataclass(frozen=True, slots=True)
class AutomataProperties:
    """Controller properties of automata.

    Attributes:
        uncontrollable: Uncontrollable events in a row; changes of input variables do not count.
        controllable: Controllable events in a row.
        disagreement: Reason why there is no confluence, or None.
        blocking: Events that lead to a state from which no marked state is reached in which no controllable event is
            possible, where uncontrollable events wait for controllable ones; None if there is no such state.
    """

    uncontrollable: Response
    controllable: Response
    disagreement: Disagreement | None
    blocking: tuple[str, ...] | None

    @property
    def checks(self) -> Mapping[str, bool]:
        """The outcome of each property, by its name."""
        return {
            "bounded_response": None not in (self.uncontrollable.bound, self.controllable.bound),
            "finite_response": self.controllable.bound is not None,
            "confluence": self.disagreement is None,
            "nonblocking_under_control": self.blocking is None,
        }


def check_automata(
    system: System,
    added: Added,
    *,
    limit: int,
    initial: Callable[[State], bool] = lambda state: True,
    should_stop: Callable[[], bool] = lambda: False,
) -> AutomataProperties | None:
    """Check the controller properties of automata under their supervisor; None if they have too many states.

    Args:
        system: The automata, as they run.
        added: The conditions that the supervisor adds to events.
        limit: Number of states beyond which to give up.
        initial: The initial states in which the supervisor lets the system begin.
        should_stop: Function called now and then; once it returns true, the work ends.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    semantics = Semantics(system)
    graph = controlled_graph(semantics, added, limit=limit, initial=initial, should_stop=should_stop)
    if graph is None:
        return None
    inputs = {item.event for item in system.inputs} & {item.name for item in system.automata}
    own = {event.name for event in system.events if event.is_controllable}
    controllable = _steps(graph, lambda event: event in own)
    return AutomataProperties(
        uncontrollable=_response(graph, _steps(graph, lambda event: event not in own | inputs)),
        controllable=_response(graph, controllable),
        disagreement=_disagreement(graph, controllable),
        blocking=_blocking(graph, controllable, [semantics.is_marked(state) for state in graph.states]),
    )


def _steps(graph: ControlledGraph, is_wanted: Callable[[str], bool]) -> Steps:
    return [
        [(event, target) for event, targets in steps if is_wanted(event) for target in targets] for steps in graph.steps
    ]


def _components(steps: Steps) -> dict[int, int]:
    """The strongly connected component of each state; a state comes after those of other components that it reaches."""
    return components({number: [target for _, target in found] for number, found in enumerate(steps)})


def _response(graph: ControlledGraph, steps: Steps) -> Response:
    """The longest run of some steps, or a cycle of them."""
    part = _components(steps)
    for number, found in enumerate(steps):
        for event, target in found:
            if part[target] == part[number]:
                back = _path(steps, target, lambda state, number=number: state == number)  # type: ignore[misc]
                return Response(None, graph.trace(number), (event, *back))
    # Without a cycle each state is a component, and comes after all that it leads to.
    longest = [0] * len(steps)
    for number in part:
        longest[number] = max((longest[target] + 1 for _, target in steps[number]), default=0)
    number = first = max(range(len(steps)), key=longest.__getitem__, default=0)
    events: list[str] = []
    while steps and longest[number]:
        event, number = max(steps[number], key=lambda step: longest[step[1]])
        events.append(event)
    return Response(len(events), graph.trace(first) if events else (), tuple(events))


def _path(steps: Steps, start: int, is_end: Callable[[int], bool]) -> tuple[str, ...]:
    """The events of a shortest run of some steps from a state to another, of which there is one."""
    before: dict[int, tuple[int, str] | None] = {start: None}
    waiting = deque([start])
    while not is_end(waiting[0]):
        number = waiting.popleft()
        for event, target in steps[number]:
            if target not in before:
                before[target] = number, event
                waiting.append(target)
    events: list[str] = []
    step = before[waiting[0]]
    while step is not None:
        events.append(step[1])
        step = before[step[0]]
    return tuple(reversed(events))


def _disagreement(graph: ControlledGraph, steps: Steps) -> Disagreement | None:
    """The nearest state from which controllable events lead to states that have no state ahead in common."""
    part = _components(steps)
    # Components that no controllable event leaves: every order ends in one, or goes round in it for ever.
    leaving = {
        part[number] for number, found in enumerate(steps) for _, target in found if part[target] != part[number]
    }
    ends: dict[int, set[int]] = {}
    for number in part:
        reached = ends.setdefault(part[number], set() if part[number] in leaving else {part[number]})
        for _, target in steps[number]:
            if part[target] != part[number] and len(reached) < 2:
                reached |= ends[part[target]]
    for number in range(len(steps)):
        if len(ends[part[number]]) > 1:
            first, second, *_ = sorted(ends[part[number]])
            orders = tuple(
                _path(steps, number, lambda state, end=end: part[state] == end)  # type: ignore[misc]
                for end in (first, second)
            )
            return Disagreement(graph.trace(number), (orders[0], orders[1]))
    return None


def _blocking(graph: ControlledGraph, controllable: Steps, marked: Sequence[bool]) -> tuple[str, ...] | None:
    """The nearest state without a controllable-complete way to a marked state."""
    before: list[list[int]] = [[] for _ in graph.states]
    for number, steps in enumerate(graph.steps):
        # Uncontrollable events wait until no controllable one is possible.
        found = [target for _, target in controllable[number]]
        for target in found or [target for _, targets in steps for target in targets]:
            before[target].append(number)
    waiting = [number for number, is_marked in enumerate(marked) if is_marked and not controllable[number]]
    complete = set(waiting)
    while waiting:
        for number in before[waiting.pop()]:
            if number not in complete:
                complete.add(number)
                waiting.append(number)
    # States are numbered by the length of the runs that lead to them.
    lost = next((number for number in range(len(graph.states)) if number not in complete), None)
    return None if lost is None else graph.trace(lost)
