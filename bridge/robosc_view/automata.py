"""Automata without a model of RoboSC, for the page: their drawings, and the edges that an event takes."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from robosc.automata import Automaton, Edge, System
from robosc.automata.compile import NO_DATA, Function, compile_expression
from robosc.automata.state import subjects, whole_names
from robosc.certification.supervisor_file import StateInWords
from robosc.explanation.notation import value_text
from robosc.expressions import TRUE
from robosc.expressions.text import expression_text
from robosc.pipeline.received_data import data_field
from robosc.pipeline.steps import Step
from robosc.pipeline.systems import SystemSupervisor
from robosc.source import visible
from robosc_view.definition import (
    DrawnAutomaton,
    Robot,
    Shape,
    ShapeBehaviour,
    ShapeComponent,
    ShapeState,
    ShapeTransition,
)
from robosc_view.graphs import Arrow, Node
from robosc_view.reports import SourceKind

MAXIMUM_EVENTS = 500
MAXIMUM_AUTOMATA = 500
"""Sizes beyond which there is no page: it would be useless."""

MAXIMUM_DRAWN = 3_000
"""Edges of all automata that are laid out, which takes its time; automata after those are listed."""


def too_large(system: System) -> str:
    """Return the reason why a system is too large for a page; empty if it is not."""
    for what, count, most in (
        ("events", len(system.events), MAXIMUM_EVENTS),
        ("automata", len(system.automata), MAXIMUM_AUTOMATA),
    ):
        if count > most:
            return f"{system.name} has {count} {what}, and a page shows at most {most}: lead it by 'robosc simulate'"
    return ""


def robot_of_automata(supervisor: SystemSupervisor, play: Mapping[str, Any]) -> Robot:
    """Return what a page shows of automata under their supervisor.

    Args:
        supervisor: Supervisor of the automata.
        play: Further parts of what a page can play, besides the events.
    """
    system = supervisor.system
    components, drawn = [], {}
    left = MAXIMUM_DRAWN
    for item, numbers in zip(system.automata, _numbers(system), strict=True):
        left -= len(item.edges)
        transitions: dict[str, list[ShapeTransition]] = {name: [] for name in item.locations}
        for number, edge in zip(numbers, item.edges, strict=True):
            transitions[edge.source].append(ShapeTransition(edge.target, number, "", ""))
        states = tuple(ShapeState(name, name in item.initial, tuple(found)) for name, found in transitions.items())
        variables = tuple(variable.name for variable in item.variables)
        components.append(ShapeComponent(item.name, (), (), (), ShapeBehaviour(variables, states)))
        drawn[item.name] = _drawn(system, item, numbers, is_listed=left < 0)
    return Robot(
        source=SourceKind.MODEL,
        version="",
        is_layer=False,
        shape=Shape(system.name, tuple(components)),
        communications=(),
        table={},
        supervisor=None,
        can_command=False,
        play={"events": _events(system), **play},
        automata=drawn,
    )


def _events(system: System) -> list[dict[str, Any]]:
    fields: dict[str, list[dict[str, Any]]] = {}
    for item in system.inputs:
        field = data_field(tuple(map(str, item.path)), item.type, is_read=True, is_required=False)
        fields.setdefault(item.event, []).append(field.as_json())
    return [
        {"event": event.name, "controllable": event.is_controllable, "fields": fields.get(event.name, [])}
        for event in system.events
    ]


def _numbers(system: System) -> Iterator[range]:
    """Yield the numbers of each automaton's edges."""
    first = 0
    for item in system.automata:
        yield range(first, first + len(item.edges))
        first += len(item.edges)


def _drawn(system: System, automaton: Automaton, numbers: range, *, is_listed: bool) -> DrawnAutomaton:
    is_input = automaton.name in _input_names(system)
    role = "input variable" if is_input else system.role_of(automaton)
    if is_listed:
        return DrawnAutomaton(role, (), ())
    controllable = {event.name for event in system.events if event.is_controllable}
    names = whole_names(system)
    nodes = tuple(Node(name, name in automaton.initial, name in automaton.marked) for name in automaton.locations)
    arrows = tuple(
        Arrow(
            number,
            edge.source,
            edge.target,
            _label(edge, names),
            "controllable" if edge.event in controllable else "uncontrollable",
        )
        for number, edge in zip(numbers, automaton.edges, strict=True)
    )
    return DrawnAutomaton(role, nodes, arrows)


def _input_names(system: System) -> frozenset[str]:
    """The automata that stand for input variables: each is named like the event that changes it."""
    return frozenset(item.event for item in system.inputs)


def _label(edge: Edge, names: frozenset[str]) -> str:
    guard = "" if edge.guard == TRUE else f" [{expression_text(edge.guard, names)}]"
    updates = ", ".join(f"{item.variable} := {expression_text(item.expression, names)}" for item in edge.updates)
    return visible(f"{edge.event}{guard}{f' / {updates}' if updates else ''}")


class EdgesTaken:
    """Edges that events of a run take, by their numbers.

    Args:
        system: The automata.
    """

    def __init__(self, system: System) -> None:
        self._subjects = tuple(map(str, subjects(system)))
        places = {subject: place for place, subject in enumerate(subjects(system))}
        # By event the automata that take part, with their edges.
        self._edges: dict[str, dict[str, list[tuple[int, tuple[str, str], Function]]]] = {}
        for item, numbers in zip(system.automata, _numbers(system), strict=True):
            for number, edge in zip(numbers, item.edges, strict=True):
                way, guard = (edge.source, edge.target), compile_expression(edge.guard, places)
                self._edges.setdefault(edge.event, {}).setdefault(item.name, []).append((number, way, guard))

    def of(self, before: StateInWords, step: Step) -> list[int]:
        """Return the edges that a step took from a state; none for an automaton with several possible edges."""
        parts = before.parts
        state = tuple(parts[name] for name in self._subjects)
        found = []
        for name, edges in self._edges.get(step.event, {}).items():
            # An input variable has one location, which states leave out.
            only = edges[0][1][0]
            taken = before.components.get(name, only), step.state.components.get(name, only)
            fitting = [number for number, way, guard in edges if way == taken and guard(state, NO_DATA) is True]
            if len(fitting) == 1:
                found += fitting
        return found


def distinct_initial_states(system: System, states: Sequence[StateInWords]) -> tuple[StateInWords, ...]:
    """Return the initial states that differ in more than input variables, which events change at any time."""
    inputs = _input_names(system)
    found: dict[tuple[Any, ...], StateInWords] = {}
    for state in states:
        own = tuple(value for name, value in state.parts.items() if name not in inputs)
        found.setdefault(own, state)
    return tuple(found.values())


def distinguishing_parts(states: Sequence[StateInWords]) -> tuple[str, ...]:
    """Return the values by which each state differs from the others, in the form that `robosc simulate` accepts."""
    parts = [state.parts for state in states]
    varying = [name for name in parts[0] if len({item[name] for item in parts}) > 1] if parts else []
    return tuple(", ".join(f"{name} = {value_text(item[name])}" for name in varying) for item in parts)
