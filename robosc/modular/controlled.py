"""Modules under their supervisors, as automata for composition: each possible step of a part has one label."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from itertools import product

from robosc.automata.compile import State
from robosc.automata.controlled import ControlledGraph, controlled_graph
from robosc.automata.semantics import Semantics
from robosc.automata.state import subjects
from robosc.automata.structure import System
from robosc.modular.graphs import SILENT, Edges, Graph, Label
from robosc.modular.partition import Module, Partition
from robosc.supervisor import AddedCondition, DecisionDiagram
from robosc.supervisor.predicates import state_predicate, state_predicates


@dataclass(frozen=True, slots=True)
class ControlledModule:
    """A module under its supervisor, state by state.

    Attributes:
        module: The module.
        graph: Its states and steps.
        marked: Numbers of the marked states.
        places: For each of its parts the places of a state that belong to it.
        events: Its events.
    """

    module: Module
    graph: ControlledGraph
    marked: frozenset[int]
    places: dict[int, tuple[int, ...]]
    events: frozenset[str]

    def values(self, part: int, number: int) -> tuple[object, ...]:
        """The values of a part in a state."""
        state = self.graph.states[number]
        return tuple(state[place] for place in self.places[part])


def controlled_module(
    partition: Partition,
    module: Module,
    system: System,
    added: Sequence[AddedCondition],
    initial: DecisionDiagram | None,
    *,
    limit: int,
    should_stop: Callable[[], bool],
) -> ControlledModule | None:
    """Return a module under its supervisor; None if it has more than `limit` states."""
    semantics = Semantics(system)
    predicates = state_predicates(system, added)
    may_begin = _always_true if initial is None else state_predicate(system, initial)
    graph = controlled_graph(semantics, predicates, limit=limit, initial=may_begin, should_stop=should_stop)
    if graph is None:
        return None
    order = subjects(system)
    return ControlledModule(
        module,
        graph,
        frozenset(number for number, state in enumerate(graph.states) if semantics.is_marked(state)),
        {
            part: tuple(place for place, item in enumerate(order) if item.automaton in partition.parts[part])
            for part in module.parts
        },
        frozenset(event.name for event in system.events),
    )


def _always_true(state: State) -> bool:
    return True


def graphs_of(modules: Sequence[ControlledModule], parts_of: Mapping[str, Set[int]]) -> list[Graph]:
    """The automata of modules, to be composed.

    A part that several modules share is in the same state in each of them. If an event, or the beginning, can lead such
    a part to several states, each outcome has a label of its own.

    Args:
        modules: The modules.
        parts_of: The parts that have each event.
    """
    count = Counter(part for item in modules for part in item.module.parts)
    shared = {part for part in count if count[part] > 1}
    labels = _Labels(modules, shared, parts_of)
    begins = {
        part: {
            ("begin", part, item.values(part, number))
            for item in modules
            if part in item.module.parts
            for number in _initial(item)
        }
        for part in sorted(shared)
    }
    # Each module may leave one beginning, and another module another one.
    begins = {part: found for part, found in begins.items() if len(found) > 1}
    return [_graph(item, labels, begins) for item in modules]


def _initial(item: ControlledModule) -> list[int]:
    return [number for number, parent in enumerate(item.graph.parents) if parent is None]


class _Labels:
    """Labels of the steps of modules.

    An event is open if it can lead a part that several modules share to several states.
    """

    def __init__(self, modules: Sequence[ControlledModule], shared: Set[int], parts_of: Mapping[str, Set[int]]) -> None:
        # For each open event its open parts, and for each of these the states that it leads to.
        self._outcomes: dict[str, dict[int, dict[tuple[object, ...], None]]] = {}
        for item in modules:
            for event, part in _open_events(item, shared, parts_of):
                self._outcomes.setdefault(event, {}).setdefault(part, {})
        for item in modules:
            for steps in item.graph.steps:
                for event, targets in steps:
                    for part, found in self._outcomes.get(event, {}).items():
                        if part in item.module.parts:
                            found.update(dict.fromkeys(item.values(part, target) for target in targets))

    def of(self, item: ControlledModule, event: str, target: int | None = None) -> list[Label]:
        """The labels of a step of a module, one if it has all open parts; without a target all labels of an event."""
        outcomes = self._outcomes.get(event)
        if outcomes is None:
            return [event]
        choices = (
            (item.values(part, target),) if target is not None and part in item.module.parts else tuple(found)
            for part, found in sorted(outcomes.items())
        )
        return [(event, *choice) for choice in product(*choices)]


def _open_events(
    item: ControlledModule, shared: Set[int], parts_of: Mapping[str, Set[int]]
) -> Iterable[tuple[str, int]]:
    """The events that can lead a shared part of a module to several states, with the part."""
    for steps in item.graph.steps:
        for event, targets in steps:
            if len(targets) > 1:
                for part in parts_of.get(event, frozenset()) & shared & item.module.parts:
                    if len({item.values(part, target) for target in targets}) > 1:
                        yield event, part


def _graph(
    item: ControlledModule,
    labels: _Labels,
    begins: dict[int, set[tuple[str, int, tuple[object, ...]]]],
) -> Graph:
    edges: Edges = [
        [(label, target) for event, targets in steps for target in targets for label in labels.of(item, event, target)]
        for steps in item.graph.steps
    ]
    alphabet: set[Label] = {label for event in item.events for label in labels.of(item, event)}
    mine = [part for part in begins if part in item.module.parts]
    alphabet.update(label for part in mine for label in begins[part])
    if not mine:
        return Graph(frozenset(alphabet), _initial(item), edges, set(item.marked))
    # A tree of choices, one for each open part, in an order that all modules have in common.
    root = len(edges)
    edges.append([])
    reached: dict[tuple[object, ...], int] = {(): root}
    for number in _initial(item):
        path: tuple[object, ...] = ()
        for part in mine:
            values = item.values(part, number)
            longer = (*path, values)
            if longer not in reached:
                reached[longer] = len(edges)
                edges.append([])
                edges[reached[path]].append((("begin", part, values), reached[longer]))
            path = longer
        edges[reached[path]].append((SILENT, number))
    return Graph(frozenset(alphabet), [root], edges, set(item.marked))
