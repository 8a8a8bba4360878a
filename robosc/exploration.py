"""The graph of all states and transitions of the controlled system: as JSON values, as a table, as a drawing.

The graph has everything that is allowed, not only what an executor would choose. It is made from plants, requirements
and added conditions alone, independently of synthesis.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from robosc.automata.compile import State
from robosc.automata.controlled import TRANSITIONS_PER_STATE, Added, ControlledGraph, controlled_graph
from robosc.automata.executable import CALLED_KINDS
from robosc.automata.plants import communication_plant_name
from robosc.automata.semantics import Semantics
from robosc.automata.state import Subject, subjects
from robosc.automata.structure import Automaton, Edge, System
from robosc.errors import UnsupportedModelError
from robosc.expressions import ITSELF, Value
from robosc.expressions.text import automaton_text
from robosc.graphviz import can_draw, drawn
from robosc.model.structure import Communication, Model
from robosc.tables import html_table

DEFAULT_LIMIT = 100_000
"""States beyond which exploring is given up."""

MAXIMUM_DRAWN = 100
"""States beyond which a notebook shows a table and no picture."""


@dataclass(frozen=True, slots=True)
class GraphState:
    """One state of the controlled system; all of it in source order.

    Attributes:
        components: State of every component with a behaviour, by its name; of automata without a model, the location of
            each.
        variables: Value of every synthesis variable, by `Component.variable`.
        communications: Location of every service and action, by its name.
        enabled: Events that can happen here, sorted by name.
        is_marked: True if it counts as completed.
    """

    components: dict[str, str]
    variables: dict[str, Value]
    communications: dict[str, str]
    enabled: tuple[str, ...]
    is_marked: bool


@dataclass(frozen=True, slots=True, repr=False)
class Graph:
    """The controlled system.

    Attributes:
        name: Name of the robot, or of the automata.
        initial_states: Numbers of the initial states; a robot has one.
        columns: Names of the parts of a state in a table: its components, variables and communications.
        states: States, breadth-first from the initial one; a state's number is its place.
        transitions: State, event, state: sorted by the first, then by event and by the values of the second.
    """

    name: str
    initial_states: tuple[int, ...]
    columns: tuple[str, ...]
    states: tuple[GraphState, ...]
    transitions: tuple[tuple[int, str, int], ...]

    @property
    def initial(self) -> int:
        """Number of the initial state; of several, the first."""
        return self.initial_states[0]

    @property
    def dot(self) -> str:
        """The graph in Graphviz's language: marked states have a double border."""
        return graph_dot(self)

    def to_json(self) -> dict[str, object]:
        """The graph as JSON values, as `robosc explore --json` prints it."""
        return graph_json(self)

    def __repr__(self) -> str:
        return f"<graph of {self.name}: {len(self.states)} states, {len(self.transitions)} transitions>"

    def __str__(self) -> str:
        return graph_text(self)

    def _repr_html_(self) -> str:
        leaving = _leaving(self)
        rows = (
            (number, *_values(state), "\n".join(f"{event} -> {', '.join(map(str, to))}" for event, to in ways.items()))
            for number, (state, ways) in enumerate(zip(self.states, leaving, strict=True))
        )
        return html_table(("state", *self.columns, "events"), rows, caption=_head(self))

    def _repr_svg_(self) -> str | None:
        """The picture that Graphviz draws; None where it is not installed, or the graph is too large to look at."""
        if len(self.states) > MAXIMUM_DRAWN or len(self.transitions) > 10 * MAXIMUM_DRAWN or not can_draw():
            return None
        return drawn(self.dot, "svg").decode()


def explore(
    system: System,
    added: Added,
    model: Model | None,
    *,
    initial: Callable[[State], bool] = lambda state: True,
    limit: int = DEFAULT_LIMIT,
    should_stop: Callable[[], bool] = lambda: False,
) -> Graph:
    """The controlled system's graph, the same for the same input.

    Args:
        system: The automata of `model`, or others.
        added: The conditions that the supervisor adds to events, over states.
        model: The checked robot; None where the automata are of none.
        initial: The initial states in which the supervisor lets the system begin.
        limit: Number of states beyond which to give up.
        should_stop: Asked now and then; once true, the work ends.

    Raises:
        UnsupportedModelError: There are more than `limit` states.
        SynthesisCancelled: `should_stop` became true.
    """
    semantics = Semantics(system)
    graph = controlled_graph(semantics, added, limit=limit, initial=initial, should_stop=should_stop)
    name = system.name if model is None else model.name
    if graph is None:
        raise UnsupportedModelError(
            f"the controlled system of {name} has more than {limit} states, or "
            f"{TRANSITIONS_PER_STATE * limit} transitions: too many to list; raise the limit"
        )
    return Graph(
        name=name,
        initial_states=tuple(number for number, parent in enumerate(graph.parents) if parent is None),
        columns=graph_columns(system, model),
        states=_states(semantics, model, graph),
        transitions=tuple(
            (number, event, target)
            for number, steps in enumerate(graph.steps)
            for event, targets in steps
            for target in targets
        ),
    )


def graph_automaton(graph: Graph, system: System) -> System:
    """The controlled system as one plain automaton, whose states are `s0`, `s1`, ...

    Args:
        graph: The graph.
        system: Its automata, which say what is controllable.
    """
    known = frozenset[str]().union(*(item.alphabet for item in system.automata))
    names = tuple(f"s{number}" for number in range(len(graph.states)))
    automaton = Automaton(
        name="supervisor",
        locations=names,
        initial=tuple(names[number] for number in graph.initial_states),
        marked=frozenset(name for name, state in zip(names, graph.states, strict=True) if state.is_marked),
        alphabet=known,
        edges=tuple(Edge(names[source], event, names[target]) for source, event, target in graph.transitions),
    )
    return System(system.name, tuple(event for event in system.events if event.name in known), (automaton,))


def _states(semantics: Semantics, model: Model | None, graph: ControlledGraph) -> tuple[GraphState, ...]:
    places = {subject: place for place, subject in enumerate(subjects(semantics.system))}
    components = _named_automata(semantics.system, model)
    variables = [subject for subject in places if subject.variable is not None]
    communications = [(item.name, places[Subject(communication_plant_name(item))]) for item in _called(model)]

    def graph_state(state: State, enabled: tuple[str, ...]) -> GraphState:
        return GraphState(
            components={name: str(state[places[Subject(name)]]) for name in components},
            variables={str(subject): state[places[subject]] for subject in variables},
            communications={name: str(state[place]) for name, place in communications},
            enabled=enabled,
            is_marked=semantics.is_marked(state),
        )

    return tuple(
        graph_state(state, tuple(event for event, _ in steps))
        for state, steps in zip(graph.states, graph.steps, strict=True)
    )


def graph_columns(system: System, model: Model | None) -> tuple[str, ...]:
    """Return the names of the parts of a state in a table; without a model, those of automata and variables."""
    components = () if model is None else tuple(item.name for item in model.components)
    return (
        *_named_automata(system, model),
        *(str(subject) for subject in subjects(system) if subject.variable is not None),
        *(automaton_text(communication_plant_name(item), components) for item in _called(model)),
    )


def marks(system: System, model: Model) -> Callable[[Mapping[str, str], Mapping[str, str]], bool]:
    """Return a function that decides from component states and communication locations whether a state is marked."""
    components = {name: system.automaton(name).marked for name in _named_automata(system, model)}
    called = {item.name: system.automaton(communication_plant_name(item)).marked for item in _called(model)}
    return lambda at, location: (
        all(at.get(name) in marked for name, marked in components.items())
        and all(location.get(name) in marked for name, marked in called.items())
    )


def _named_automata(system: System, model: Model | None) -> list[str]:
    """The automata whose locations are shown: the components; without a model all but those of input variables."""
    if model is None:
        return [item.name for item in system.automata if ITSELF not in {variable.name for variable in item.variables}]
    return [item.name for item in model.components if item.behaviour]


def _called(model: Model | None) -> list[Communication]:
    """The services and actions of a model."""
    return [] if model is None else [item for item in model.communications if item.kind in CALLED_KINDS]


def graph_json(graph: Graph) -> dict[str, object]:
    """The graph as JSON values: `initial`, `states`, `transitions`; of several initial states `initial_states`, too."""
    return {
        "initial": graph.initial,
        **({"initial_states": list(graph.initial_states)} if len(graph.initial_states) > 1 else {}),
        "states": [
            {
                "components": state.components,
                "variables": state.variables,
                "communications": state.communications,
                "enabled": list(state.enabled),
            }
            for state in graph.states
        ],
        "transitions": [list(transition) for transition in graph.transitions],
    }


def graph_text(graph: Graph) -> str:
    """The graph as a table: a line for each state, below it a line for each event with where it leads."""
    header = ["", *graph.columns]
    rows = [[str(number), *_values(state)] for number, state in enumerate(graph.states)]
    widths = [max(len(row[column]) for row in (header, *rows)) for column in range(len(header))]
    leaving = _leaving(graph)

    def line(cells: list[str]) -> str:
        return "  ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)).rstrip()

    lines = [_head(graph), "", line(header)]
    for number, row in enumerate(rows):
        lines.append(line(row))
        for event, targets in leaving[number].items():
            lines.append(f"{'':{widths[0]}}  {event} -> {', '.join(map(str, targets))}")
    return "\n".join(lines) + "\n"


def _head(graph: Graph) -> str:
    counts = f"{graph.name}: {len(graph.states)} states, {len(graph.transitions)} transitions"
    return f"{counts}; it starts in state {' or '.join(map(str, graph.initial_states))}"


def graph_dot(graph: Graph) -> str:
    """The graph in Graphviz's language: a box for each state, double if marked; events of one arrow on its label."""
    lines = [f"digraph {_quoted(graph.name)} {{", "  node [shape=box];", '  start [shape=point, label=""];']
    lines += [f"  start -> {number};" for number in graph.initial_states]
    for number, state in enumerate(graph.states):
        label = "\n".join(
            [str(number), *(f"{name} = {text}" for name, text in zip(graph.columns, _values(state), strict=True))]
        )
        lines.append(f"  {number} [label={_quoted(label)}{', peripheries=2' if state.is_marked else ''}];")
    arrows: dict[tuple[int, int], list[str]] = {}
    for source, event, target in graph.transitions:
        arrows.setdefault((source, target), []).append(event)
    for (source, target), events in arrows.items():
        label = "\n".join(events)
        lines.append(f"  {source} -> {target} [label={_quoted(label)}];")
    return "\n".join([*lines, "}"]) + "\n"


def _values(state: GraphState) -> list[str]:
    """Return what a reader wants to see of a state: the value of each column."""
    values = (*state.components.values(), *state.variables.values(), *state.communications.values())
    return [str(value).lower() if isinstance(value, bool) else str(value) for value in values]


def _leaving(graph: Graph) -> list[dict[str, list[int]]]:
    result: list[dict[str, list[int]]] = [{} for _ in graph.states]
    for source, event, target in graph.transitions:
        result[source].setdefault(event, []).append(target)
    return result


def _quoted(text: str) -> str:
    """A Graphviz string."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'
